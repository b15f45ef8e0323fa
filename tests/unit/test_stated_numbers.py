"""Numbers and pictures of README and pages are those of the files that come along.

Counts are taken from settings, schemas and tables of the repository. What only a run of
studies can tell is compared where their results are there.

Catches numbers of README or of pages that are no longer true.
"""

import json
import re
from pathlib import Path

import pandas as pd
import pytest
import yaml

from spinepipe.anatomy import published
from spinepipe.cli.docs import FOLDER, PICTURES, copy_pictures
from spinepipe.studies.discrepancy.verdict import share_of_gap

ROOT = Path(__file__).resolve().parents[2]


def text(name: str) -> str:
    """A page in one line, as it is read."""
    return " ".join((ROOT / name).read_text().split())


README, TUTORIAL, LIMITS = text("README.md"), text("docs/tutorial.md"), text("docs/limits.md")
POSES = text("docs/studies/joint_pose_sensitivity.md")
CITING = {"README.md": README, "docs/tutorial.md": TUTORIAL, "docs/limits.md": LIMITS}
CITING["docs/studies/joint_pose_sensitivity.md"] = POSES


def numbers(pattern: str, page: str) -> set[float]:
    """All numbers that a page states in such a place."""
    found = {float(number) for number in re.findall(pattern, page)}
    assert found, f"no page states {pattern}"
    return found


def test_counts_are_those_of_the_study_that_comes_along() -> None:
    study = yaml.safe_load((ROOT / "config/studies/l1l4_joint_pose.yaml").read_text())
    poses = {float(study["poses"])}
    for page in (POSES, TUTORIAL):
        assert numbers(r"(\d+) plausible", page) == poses
    assert numbers(r"stiffness over (\d+) joint poses", POSES) == poses
    assert numbers(r"All (\d+) fits end", POSES) == poses
    paper = published("gould_2024a")["counts"]
    kept = paper["pose_samples_successful"]
    assert numbers(r"the paper kept (\d+) of \d+", POSES) == {float(kept)}


def test_the_phantoms_of_the_coverage_are_counted() -> None:
    rows = pd.read_csv(ROOT / "tests/validation/results/coverage.csv")
    (every,) = rows[(rows["design"] == "all") & (rows["region"] == "profile")].to_dict("records")
    assert numbers(r"Over (\d+) phantoms", README) == {float(every["phantoms"])}
    assert numbers(r"hold \[(\d+) % of the true values", README) == {round(every["holds_percent"])}
    assert numbers(r"hold \[(\d+) %\]", LIMITS) == {round(every["holds_percent"])}


def test_spoilt_projects_and_kills_are_counted() -> None:
    folder = ROOT / "tests/validation/results"
    spoilt = pd.read_csv(folder / "wrong_inputs.csv")
    (every,) = spoilt[spoilt["what is spoilt"] == "all"].to_dict("records")
    assert numbers(r"Of ([\d,]+\d) projects spoilt", README.replace(",", "")) == {every["cases"]}
    assert numbers(r"took (\d+) as their doc", README.replace(",", "")) == {every["right"]}
    assert every["hangs"] == 0
    told = pd.read_csv(folder / "plausibility.csv").groupby("kinds")[["told", "mistakes"]].sum()
    assert told.loc["last", "told"] / told.loc["last", "mistakes"] == pytest.approx(2 / 3, abs=0.05)
    assert "[two of three](../tests/validation/results/plausibility.md)" in LIMITS
    kills = pd.read_csv(folder / "soak_kills.csv")
    assert set(kills["kills"]) == numbers(r"runs: (\d+) kills in each", README)
    assert len(kills) == 8
    assert "each of eight kinds" in README
    assert not kills["finished_files_made_twice_or_lost"].any()


def test_mutants_are_counted() -> None:
    row = re.search(r"\| all \| (\d+) \| (\d+) \|", (ROOT / "docs/mutants.md").read_text())
    assert row is not None
    assert numbers(r"\d+ of (\d+)\]\(mutants", LIMITS) == {float(row[1])}
    assert numbers(r"\[(\d+) of \d+\]\(mutants", LIMITS) == {float(row[2])}


def test_no_other_time_is_told() -> None:
    """Minutes and hours of a run are told with what measured them, or not at all."""
    told = r"[^.]*\b(?:minutes|quarter of an hour|hours)\b[^.]*\."
    for name, page in CITING.items():
        runs = [one for one in re.findall(told, page) if "a minute or two" not in one]
        assert [one for one in runs if "core" in one or "take" in one] == [], name


@pytest.mark.parametrize("picture", PICTURES)
def test_a_picture_is_a_copy_of_the_result_that_its_caption_names(picture: str) -> None:
    """And each picture of the folder is shown, by one page at least."""
    assert {path.name for path in (ROOT / FOLDER).iterdir()} == set(PICTURES)
    shown = [page for page in CITING.values() if f"figures/{picture}" in page]
    assert shown
    for page in shown:
        caption = page.partition(f"figures/{picture}")[2][:1500]
        assert f"`{PICTURES[picture]}`" in caption


def test_pictures_are_copied_from_results(tmp_path: Path) -> None:
    (tmp_path / FOLDER).mkdir(parents=True)
    name, source = next(iter(PICTURES.items()))
    (tmp_path / source).parent.mkdir(parents=True)
    (tmp_path / source).write_bytes(b"drawn")
    assert copy_pictures(tmp_path) == {other: other == name for other in PICTURES}
    assert (tmp_path / FOLDER / name).read_bytes() == b"drawn"


def test_gaps_of_the_search_that_comes_along() -> None:
    file = ROOT / "results/stiffening_spines/discrepancy/verdict.json"
    if not file.is_file():
        pytest.skip("the study stiffening_spines was not run here")
    verdict = json.loads(file.read_text())
    gap = verdict["gap"]
    told = re.search(
        r"falls from ([\d.]+) noise SD to ([\d.]+), .*? left out of the fits it falls by (\d+) %",
        README,
    )
    assert told is not None
    stated = [float(number) for number in told.groups()]
    closed = 100.0 * share_of_gap(gap["held_out_closed"])
    assert stated == [round(gap["base"], 1), round(gap["with_effects"], 1), round(closed)]
