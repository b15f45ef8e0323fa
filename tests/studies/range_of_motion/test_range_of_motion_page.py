"""The page of range of motion, from made-up tables: verdicts, numbers, figures.

Would catch a verdict without its condition, a number that no table has, a figure that does not fit.
"""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from grid_cases import JOINTS, STUDY, project
from page_rules import (
    all_verdicts,
    faults_of_chart,
    faults_of_page,
    faults_of_sentences,
    faults_of_told,
    verdicts,
)

from spinepipe.cohort import Cohort
from spinepipe.report.conclusions import sentences_of
from spinepipe.report.page.study_page import Page, ResultTables
from spinepipe.studies.range_of_motion import charts
from spinepipe.studies.range_of_motion.page import page
from spinepipe.studies.range_of_motion.settings import RangeOfMotion
from spinepipe.studies.read import check
from spinepipe.tables import StudyTables

PACKAGE = "spinepipe.studies.range_of_motion"
VIRTUAL = "virtual_tests: {moment_nm: 7.5, tests: [flexion, left_rotation], steps: 1}\n"
TESTS = {"flexion": ("extension", -1.0), "left_rotation": ("left_rotation", 1.0)}


def summary(medians: Sequence[float], middle: float, lost: int = 0, n: int = 60) -> pd.DataFrame:
    """Motion of the joints of two tests; in the second a third of the first."""
    rows = []
    for number, (test, (coordinate, sign)) in enumerate(TESTS.items()):
        for joint, median in zip(JOINTS, medians, strict=True):
            size, half = median / (1 + 2 * number), middle / (1 + 2 * number) / 2.0
            ends = sorted(sign * x for x in (size - half, size + half))
            wide = sorted(sign * x for x in (size - 3 * half, size + 3 * half))
            there = {"median": sign * size, "low_quartile": ends[0], "high_quartile": ends[1]}
            there |= {"percentile_5": wide[0], "percentile_95": wide[1]}
            for specimen in ("*", "a", "b"):
                rows.append(
                    {
                        **{"specimen": specimen, "test": test, "joint": joint},
                        **{"coordinate": coordinate, "role": "loaded", "unit": "deg"},
                        **{"n": n, "n_without": lost, **(there if n else {})},
                        **{"status": "done" if n else "too_few", "message": ""},
                    }
                )
                # runs are counted in the rows of one coordinate
                rows.append({**rows[-1], "coordinate": "anterior", "role": "coupled", "unit": "mm"})
    return pd.DataFrame(rows)


def variance(shares: Sequence[float], sets: int = 12, poses: int = 20) -> pd.DataFrame:
    """Of the stiffness, a share for each test; the rest is halved between specimens and poses."""
    rows = []
    for (test, (coordinate, _)), share in zip(TESTS.items(), shares, strict=True):
        parts = {"stiffness": share, "specimen": (1 - share) / 2, "pose": (1 - share) / 2}
        ends = {
            f"{name}_{end}": min(max(part + off, 0.0), 1.0)
            for name, part in {**parts, "rest": 0.0}.items()
            for end, off in (("share", 0.0), ("low", -0.04), ("high", 0.04))
        }
        for joint in JOINTS:
            rows.append(
                {
                    **{"specimen": "*", "test": test, "joint": joint, "coordinate": coordinate},
                    **{"n_specimens": 2, "n_poses": poses, "n_stiffness": sets, "sd": 1.0},
                    **ends,
                    **{"status": "done", "message": ""},
                }
            )
    return pd.DataFrame(rows)


def swapped() -> pd.DataFrame:
    """Stiffness makes most in one test, joint frames in the other."""
    rows = variance((0.9, 0.9))
    other, pairs = rows["test"] == "left_rotation", {}
    for end in ("share", "low", "high"):
        pairs |= {f"stiffness_{end}": f"pose_{end}", f"pose_{end}": f"stiffness_{end}"}
    return pd.concat([rows[~other], rows[other].rename(columns=pairs)])


def untold() -> pd.DataFrame:
    """Shares that were not computed."""
    few = variance((0.9, 0.9)).assign(status="too_few", message="at least 3 x 3 are needed")
    return few.astype({name: object for name in few if name.endswith(("share", "low", "high"))})


def made(root: Path, settings: str, header: str, **tables: pd.DataFrame) -> tuple[Any, ...]:
    """Study, cohort, results and page; its rules held."""
    sound = project(root, settings, specimens=("a", "b"), header=header)
    study, cohort = check(sound, STUDY)
    assert isinstance(study, RangeOfMotion)
    results = ResultTables(StudyTables(tables))
    found = page(study, cohort, results)
    assert list(faults_of_told(found.told)) == []
    assert list(faults_of_page(found.html(study, cohort, results))) == []
    return study, cohort, results, found


SD = "measurement_sd: {rotation_deg: 3.0, translation_mm: 1.2}\n"
BOTH = VIRTUAL + "poses: 5\nstiffness_sets: 4\n"
ALIKE, APART = summary((9.0, 9.1, 9.2), 4.0), summary((6.0, 9.0, 14.0), 4.0)
CASES: dict[str, tuple[str, dict[str, pd.DataFrame], set[tuple[str, str]]]] = {
    "stiffness makes most": (
        BOTH,
        {"rom_summary": ALIKE, "rom_variance": variance((0.9, 0.8))},
        {("motion", "most"), ("widest", "by_test"), ("factor", "by_test"), ("draws", "both")}
        | {("levels", "within"), ("dominant", "all"), ("origins", "no_trace"), ("runs", "ok")}
        | {("sample", "ok"), ("methods", "virtual"), ("methods_shares", "anova")},
    ),
    "most in one test alone": (
        VIRTUAL + "poses: 1\nstiffness_sets: 4\n",
        {
            "rom_summary": summary((6.0, 9.0, 14.0), 4.0, lost=3),
            "rom_variance": variance((0.9, 0.5), sets=4),
        },
        {("dominant", "some"), ("levels", "beyond"), ("runs", "check"), ("sample", "check")}
        | {("draws", "stiffness")},
    ),
    "nothing makes most": (
        VIRTUAL + "poses: 5\nstiffness_sets: 1\n",
        {
            "rom_summary": summary((6.0, 9.0, 14.0), 4.0, lost=30),
            "rom_variance": variance((0.52, 0.5)),
        },
        {("motion", "mixed"), ("dominant", "none"), ("runs", "stop"), ("draws", "frames")},
    ),
    "tests differ in what makes most": (
        BOTH,
        {"rom_summary": APART, "rom_variance": swapped()},
        {("dominant", "differ")},
    ),
    "no shares": (
        VIRTUAL + "poses: 1\nstiffness_sets: 1\n",
        {"rom_summary": APART, "rom_variance": untold()},
        {("motion", "alone"), ("sample", "check_none"), ("draws", "neither")},
    ),
    "no run stands": (
        BOTH,
        {"rom_summary": summary((1.0, 1.0, 1.0), 1.0, lost=60, n=0), "rom_variance": untold()},
        {("motion", "none"), ("runs", "stop")},
    ),
}


@pytest.mark.parametrize("name", list(CASES))
def test_a_made_up_study_comes_to_its_verdicts(name: str, tmp_path: Path) -> None:
    settings, tables, expected = CASES[name]
    assert expected <= verdicts(made(tmp_path, settings, SD, **tables)[3].conclusions)


def test_every_sentence_is_reached_and_keeps_the_rules(tmp_path: Path) -> None:
    reached = set().union(*(expected for _, _, expected in CASES.values()))
    study, cohort, results, _ = made(tmp_path, BOTH, SD, rom_summary=ALIKE)
    own = study.model_copy(update={"virtual_tests": None})
    reached |= {("methods", "cohort")} & verdicts(page(own, cohort, results).conclusions)
    assert reached == all_verdicts(sentences_of(PACKAGE))
    assert list(faults_of_sentences(PACKAGE)) == []


def test_motion_across_zero_keeps_its_interval(tmp_path: Path) -> None:
    """A median of -2 with 5th and 95th percentiles of -3 and 1 is a size of 2, from -1 to 3."""
    wide = summary((2.0, 1.9, 1.8), 1.0)
    flexion = (wide["test"] == "flexion") & (wide["role"] == "loaded")
    wide.loc[flexion, ["percentile_5", "percentile_95"]] = -3.0, 1.0
    found: Page = made(tmp_path, BOTH, SD, rom_summary=wide)[3]
    (widest,) = (one.values["value"] for one in found.at("key"))
    assert (widest.number, widest.low, widest.high) == (2.0, -1.0, 3.0)


@pytest.mark.parametrize("few", [{"n": 3}, {"joint": "L3L4"}])
def test_joints_are_not_compared_without_two_of_them_or_quartiles(
    few: dict[str, Any], tmp_path: Path
) -> None:
    found: Page = made(tmp_path, BOTH, SD, rom_summary=APART.assign(**few))[3]
    assert not [one for one in found.conclusions if one.rule == "levels"]


def test_weight_or_a_follower_load_takes_back_that_origins_leave_no_trace(tmp_path: Path) -> None:
    tables = {"rom_summary": ALIKE}
    followed = BOTH.replace("steps: 1", "steps: 1, follower_n: 100")
    found: Page = made(tmp_path, followed, SD, **tables)[3]
    assert ("origins", "no_trace") not in verdicts(found.conclusions)


def test_the_answer_has_the_sizes_of_the_table(tmp_path: Path) -> None:
    found: Page = made(tmp_path, BOTH, SD, rom_summary=APART)[3]
    values = found.at("answer")[0].values
    assert (values["least"].number, values["most"].number) == (6.0, 14.0)
    (widest,) = (one.values["value"] for one in found.at("key"))
    assert (widest.low, widest.high) == (8.0, 20.0), "the middle 90 %, flexion as a size"


def drawn(cohort: Cohort, study: RangeOfMotion, tables: dict[str, pd.DataFrame]) -> list[Any]:
    return [draw(study, cohort, tables) for draw in (charts.motion, charts.shares)]


def test_figures_hold_their_words(tmp_path: Path) -> None:
    tables = {"rom_summary": APART, "rom_variance": variance((0.9, 0.3))}
    study, cohort, _, _ = made(tmp_path, BOTH, SD, **tables)
    motion, shares = drawn(cohort, study, tables)
    assert list(faults_of_chart(motion)) == list(faults_of_chart(shares)) == []
    frame = shares.panels[0].frame
    total = frame.groupby("row")["value"].sum()
    np.testing.assert_allclose(total, 100.0)
    assert motion.panels[0].names[0] == "L1–L2", "cranial first"


def test_a_figure_without_results_says_why(tmp_path: Path) -> None:
    tables = {"rom_summary": ALIKE.assign(n=0), "rom_variance": untold()}
    study, cohort, _, _ = made(tmp_path, BOTH, SD, **tables)
    motion, shares = drawn(cohort, study, tables)
    assert "No run has an equilibrium" in motion.caption
    assert "at least 3 x 3 are needed" in shares.caption
