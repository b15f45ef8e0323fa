"""Cohorts that are sound cell by cell and wrong: told at their place, and good ones never."""

import shutil
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import yaml
from cohort_cases import Change, joints, swap, text
from cohort_cases import write as write_small
from mistaken_cases import MISTAKES, XYZ

from spinepipe import cohort as cohorts
from spinepipe.anatomy.levels import spacing_mm
from spinepipe.cli.program import main
from spinepipe.problems import InputError, Problem
from spinepipe.studies.cohort_stiffness.settings import CohortStiffness
from spinepipe.studies.doubts import doubts, refusals, suspicions
from spinepipe.studies.free import unmeasured
from spinepipe.studies.registry import every_form
from tests.generators.hidden import Recipe, make

ROOT = Path(__file__).resolve().parents[2]
REAL = ROOT.parent / "shared" / "data"
"""Geometry of real spines, where it is there; no part of this repository."""

SHIPPED = {
    "t12s1_phantom": ("s01", "s02"),
    "linear_spines": ("s01", "s02"),
    "cross_coupled_spines": ("s03",),
    "palanca_l1l4": ("s01",),
    "l4l5_disc": ("heuer_2007", "jaramillo"),
    "tracking_phantom": ("s01",),
}
"""Cohorts that come along, and the specimens of them that are taken."""

REAL_SPINES = ("thoracolumbar_male", "visible_human_l1s1", "vid_t1l5")

UNTOLD = {("palanca_l1l4", "turned"), ("palanca_l1l4", "constant")}
"""One loaded step, a force within a centimetre of the joints: nobody knows which way they turn, and
two joints may well turn alike."""


def good(name: str, into: Path) -> Path:
    """A good cohort by its name, cut down to a few specimens."""
    if name.startswith("small"):
        return write_small(
            into / "small", *((text("joints.csv", joints()),) if name.endswith("joints") else ())
        )
    source = REAL / name if name in REAL_SPINES else ROOT / "config" / "cohorts" / name
    if not source.is_dir():
        pytest.skip("real spine geometry is not beside this repository")
    shutil.copytree(source, into / name)
    every = pd.read_csv(source / "specimens.csv")["specimen"]
    keep = [*SHIPPED.get(name, every[:3]), "*"]
    for file in (into / name).glob("*.csv"):
        table = pd.read_csv(file)
        if "specimen" in table:
            table[table["specimen"].isin(keep)].to_csv(file, index=False)
    return into / name


def told(folder: Path) -> tuple[Problem, ...]:
    """Everything that `check` says of a cohort."""
    try:
        return tuple(one.problem for one in suspicions(cohorts.read(folder, every_form())))
    except InputError as error:
        return error.problems


@pytest.mark.parametrize("name", ["small", "small_joints", *SHIPPED, *REAL_SPINES])
def test_every_mistake_is_told_at_its_place(name: str, tmp_path: Path) -> None:
    """344 mistakes in eleven cohorts, 53 of them in real spines: 342 are told."""
    folder = good(name, tmp_path / "good")
    assert told(folder) == (), "a good cohort is not doubted"
    tried, missed = 0, set()
    for mistake in MISTAKES:
        spoilt = tmp_path / mistake.name / folder.name
        shutil.copytree(folder, spoilt)
        if not mistake.apply(spoilt):
            continue
        tried += 1
        found = {problem.file.split("/")[-1] for problem in told(spoilt)}
        if not found & set(mistake.places):
            missed.add((name, mistake.name))
    assert tried >= 4
    assert missed == {one for one in UNTOLD if one[0] == name}


@pytest.mark.parametrize("seed", [41, 42])
def test_necks_are_not_doubted(seed: int, tmp_path: Path) -> None:
    make(Recipe(seed=seed, region="cervical", joints=4), tmp_path / "necks")
    assert told(tmp_path / "necks") == ()


def test_a_free_coordinate_that_nobody_measured(tmp_path: Path) -> None:
    """Rotations alone were read; the file frees a translation by name, or nothing."""
    folder = good("linear_spines", tmp_path / "config" / "cohorts")
    cohort = cohorts.read(folder, every_form())
    (tmp_path / "config" / "studies").mkdir()
    head = {"study": "fit", "kind": "cohort_stiffness", "cohort": "linear_spines"}
    for free, lines in ((["extension", "anterior"], [4]), (["extension"], []), (None, [])):
        keys = {**head, **({} if free is None else {"free": free})}
        file = tmp_path / "config" / "studies" / "fit.yaml"
        file.write_text(yaml.safe_dump(keys, sort_keys=False, default_flow_style=None))
        found = unmeasured(tmp_path, CohortStiffness.model_validate(keys), cohort)
        assert [one.row for one in found] == lines
        assert all("anterior, which nobody measured" in one.found for one in found)


@pytest.mark.parametrize("name", REAL_SPINES)
def test_real_spines_are_not_doubted(name: str) -> None:
    """All of them, scoliotic ones too: 83 in CT."""
    if not (REAL / name).is_dir():
        pytest.skip("real spine geometry is not beside this repository")
    assert told(REAL / name) == ()


@pytest.mark.parametrize(
    ("factor", "words"),
    [(0.1, "cm and not mm (0.1)"), (1 / 25.4, "inches"), (10.0, "multiplied by 10")],
)
def test_a_spine_of_another_unit_is_refused_with_its_factor(
    factor: float, words: str, tmp_path: Path
) -> None:
    folder = good("linear_spines", tmp_path)
    scale(folder / "joints.csv", list(XYZ), factor)
    cohort = cohorts.read(folder, every_form())
    (refused,) = refusals(cohort)
    assert words in refused.remedy
    assert (refused.file, refused.row) == ("linear_spines/joints.csv", 2)
    assert "i_mean_it: [lengths]" in refused.remedy


def test_what_is_meant_is_a_warning(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder = good("linear_spines", tmp_path / "config" / "cohorts")
    scale(folder / "joints.csv", list(XYZ), 10.0)
    assert main(["--root", str(tmp_path), "check", "linear_spines"]) == 1
    assert "FAIL" in capsys.readouterr().out
    header = yaml.safe_load((folder / "cohort.yaml").read_text())
    (folder / "cohort.yaml").write_text(yaml.safe_dump({**header, "i_mean_it": ["lengths"]}))
    assert main(["--root", str(tmp_path), "check", "linear_spines"]) == 0
    assert "multiplied by 10" in capsys.readouterr().out
    (folder / "cohort.yaml").write_text(yaml.safe_dump({**header, "i_mean_it": ["masses"]}))
    assert main(["--root", str(tmp_path), "check", "linear_spines"]) == 1, "another group"


def test_an_unknown_group_is_refused(tmp_path: Path) -> None:
    change = swap("cohort.yaml", "gravity: true", "gravity: true\ni_mean_it: [length]")
    with pytest.raises(InputError) as caught:
        cohorts.read(write_small(tmp_path / "small", change))
    (problem,) = caught.value.problems
    assert problem.file == "small/cohort.yaml"
    assert "lengths" in problem.remedy + problem.allowed


@pytest.mark.parametrize(
    ("sd", "refused"), [("1.0e-300", True), ("1.0e-7", True), ("1.0e-5", False), ("40.0", False)]
)
def test_errors_that_no_instrument_has(sd: str, refused: bool, tmp_path: Path) -> None:
    change: Change = swap("cohort.yaml", "rotation_deg: 0.1", f"rotation_deg: {sd}")
    cohort = cohorts.read(write_small(tmp_path / "small", change))
    found = refusals(cohort) if refused else doubts(cohort)
    assert any(one.column == "measurement_sd.rotation_deg" for one in found)
    assert bool(refusals(cohort)) == refused


@pytest.mark.parametrize(
    ("name", "column"), [("t12s1_phantom", "step"), ("l4l5_disc", "step"), ("linear_spines", "x")]
)
def test_step_0_against_the_flag(name: str, column: str, tmp_path: Path) -> None:
    """Readings that are all 0 were zeroed; where they are not, they were not."""
    folder = good(name, tmp_path)
    header = yaml.safe_load((folder / "cohort.yaml").read_text())
    turned = {**header, "zeroed_at_step_0": not header["zeroed_at_step_0"]}
    (folder / "cohort.yaml").write_text(yaml.safe_dump(turned))
    found = [one for one in suspicions(cohorts.read(folder)) if one.group == "zeroing"]
    assert [one.certain for one in found] == [column != "step"]
    assert found[0].problem.file == f"{name}/motion.csv"


def test_lengths_of_levels_are_those_of_the_sources() -> None:
    """Panjabi 1991, 1992: L3 23.8 mm, T6 17.4 mm; discs L2L3, L3L4 9.64, 10.71 (Shukri 2013)."""
    assert spacing_mm("L3") == pytest.approx(23.8 + (9.64 + 10.71) / 2.0, abs=0.05)
    assert spacing_mm("T6") == pytest.approx(17.4 + 5.0)
    assert spacing_mm("V3") is None


def test_vertebrae_of_other_names_are_not_judged(tmp_path: Path) -> None:
    """No level, no source: a toy may have any size and posture."""
    files = [swap("cohort.yaml", "[L4, L3, L2]", "[V4, V3, V2]")]
    folder = write_small(tmp_path / "small", *files)
    for file in folder.glob("*.csv"):
        renamed = file.read_text().replace("L", "V")
        file.write_text(renamed)
    scale(folder / "landmarks.csv", list(XYZ), 3.0)
    assert not [one for one in suspicions(cohorts.read(folder)) if one.group == "postures"]
    assert not [one for one in suspicions(cohorts.read(folder)) if one.certain]


def scale(file: Path, columns: list[str], factor: float) -> None:
    table = pd.read_csv(file)
    table[columns] = np.asarray(table[columns], dtype=float) * factor
    table.to_csv(file, index=False)
