"""Figures and findings of range of motion, from tables of any size and outcome."""

import json
import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from grid_cases import JOINTS, STUDY, made_up, table_of
from matplotlib.figure import Figure
from spinepipe.studies.range_of_motion.figures.motion import levels_figure, variance_figure

from spinepipe.cohort import Cohort
from spinepipe.report.page.document import ResultTables
from spinepipe.report.style import picture, style
from spinepipe.studies.range_of_motion import draw
from spinepipe.studies.range_of_motion.grid import read_grid
from spinepipe.studies.range_of_motion.page import document, findings
from spinepipe.studies.range_of_motion.settings import RangeOfMotion
from spinepipe.studies.range_of_motion.summary import summary_rows
from spinepipe.studies.range_of_motion.variance import variance_rows
from spinepipe.studies.read import check
from spinepipe.tables import StudyTables, read_frame

Size = tuple[int, int, int]
Lost = tuple[tuple[int, int, int], ...]


def results(root: Path, size: Size, lost: Lost = ()) -> tuple[RangeOfMotion, Cohort, ResultTables]:
    """Tables of a study of made-up numbers."""
    project = made_up(root, size)
    path, _ = table_of(root, size, lost)
    study, cohort = check(project, STUDY)
    assert isinstance(study, RangeOfMotion)
    grid = read_grid(str(path), study, cohort)
    tables = {
        "rom_summary": pd.DataFrame(summary_rows(grid)),
        "rom_variance": pd.DataFrame(variance_rows(grid)),
    }
    return study, cohort, ResultTables(StudyTables(tables), {}, {})


def page_of(study: RangeOfMotion, cohort: Cohort, found: ResultTables) -> str:
    """The whole report."""
    return document(study, cohort, found).html(study, cohort)


def words(figure: Figure) -> str:
    """All text of a figure."""
    texts = [text.get_text() for text in figure.texts]
    texts += [legend.get_title().get_text() for legend in figure.legends]
    texts += [text.get_text() for legend in figure.legends for text in legend.get_texts()]
    return " ".join(" ".join(texts).split())


def figures(root: Path, size: Size, lost: Lost = ()) -> tuple[Figure, Figure]:
    study, cohort, found = results(root, size, lost)
    with style():
        drawn = (
            levels_figure(study, cohort, found.tables),
            variance_figure(study, cohort, found.tables),
        )
        assert all(picture(figure, "svg") for figure in drawn)
    return drawn


def test_a_panel_for_each_test_a_row_for_each_joint(tmp_path: Path) -> None:
    for figure in figures(tmp_path, (3, 5, 4), lost=((0, 1, 1),)):
        assert [axis.get_title("left")[4:] for axis in figure.axes] == ["Flexion", "Left rotation"]
        first = figure.axes[0]
        assert [label.get_text() for label in first.get_yticklabels()] == list(JOINTS)
        assert all("(" in axis.get_xlabel() for axis in figure.axes)  # units


def test_what_the_bars_and_symbols_stand_for_is_told(tmp_path: Path) -> None:
    levels, variance = figures(tmp_path, (3, 5, 4), lost=((0, 1, 1),))
    assert "120 runs of 2 tests, 2 without an equilibrium" in words(levels)
    assert "medians of the specimens" in words(levels)
    assert "3 specimens, 3 drawn poses each, 3 drawn stiffness sets" in words(variance)
    assert "specimen joint frames stiffness rest" in words(variance)


def test_one_specimen_has_no_share_of_specimens(tmp_path: Path) -> None:
    levels, variance = figures(tmp_path, (1, 5, 4))
    assert "medians of the specimens" not in words(levels)
    assert "1 specimen, 4 drawn poses of a" in words(variance)
    assert words(variance).endswith("joint frames stiffness rest")


def test_nothing_to_show_is_said(tmp_path: Path) -> None:
    levels, variance = figures(tmp_path, (1, 1, 1), lost=((0, 0, 0),))
    assert "no run has an equilibrium" in words(levels)
    assert "at least 3 x 3 are needed" in words(variance)


@pytest.mark.parametrize("size", [(3, 5, 4), (1, 1, 1)])
def test_findings_have_the_numbers_of_the_tables(tmp_path: Path, size: Size) -> None:
    study, cohort, found = results(tmp_path, size)
    page = page_of(study, cohort, found)
    assert f"{size[0] * size[1] * size[2] * 2} runs of 2 tests: none without" in page
    assert "pure moments without weight" in page
    rows = found.table("rom_summary")
    chosen = rows[rows["specimen"] == ("*" if size[0] > 1 else "a")]
    flexion = chosen.query("test == 'flexion' and role == 'loaded'")
    largest = flexion["median"].abs().max()
    assert f" to {largest:.1f}° (" in page
    assert ("of the variance is due to" in page) == (size[1] > 1)


def variance_of(stiffness: Sequence[float]) -> pd.DataFrame:
    """Shares of a cohort's joints in one test; pose takes a third of what stiffness leaves."""
    shares = np.array(stiffness)
    return pd.DataFrame(
        {
            "specimen": "*",
            "test": "left_bending",
            "status": "done",
            "joint": JOINTS[: len(shares)],
            "specimen_share": (1.0 - shares) / 3.0,
            "pose_share": (1.0 - shares) / 3.0,
            "stiffness_share": shares,
            "rest_share": (1.0 - shares) / 3.0,
        }
    )


@pytest.mark.parametrize(
    ("stiffness", "says"),
    [
        (
            (0.61, 0.72, 0.55),
            "most of the variance is due to the stiffness (median 61 %, 55 % to "
            "72 % over the joints).",
        ),
        (
            (0.45, 0.40, 0.48),
            "the largest share of the variance is due to the stiffness (median "
            "45 %, 40 % to 48 % over the joints).",
        ),
        (
            (0.61, 0.72, 0.45),
            "the largest share of the variance is due to the stiffness (median "
            "61 %, 45 % to 72 % over the joints).",
        ),
        ((0.40,), "the largest share of the variance is due to the stiffness (40 %)."),
        ((0.60, 0.60), "most of the variance is due to the stiffness (60 % at every joint)."),
    ],
)
def test_most_is_more_than_half_at_every_joint(
    stiffness: Sequence[float], says: str, tmp_path: Path
) -> None:
    study, cohort, found = results(tmp_path, (3, 5, 4))
    tables = {**found.tables, "rom_variance": variance_of(stiffness)}
    told = findings(study, cohort, replace(found, tables=StudyTables(tables)))
    assert f"Left bending: {says}" in [line.replace("\u00a0", " ") for line in told]


LOADS = """\
specimen,test,step,vertebra,fx_n,fy_n,fz_n,mx_nm,my_nm,mz_nm,px_mm,py_mm,pz_mm
*,flexion,0,L1,0,0,0,0,0,0,0,90,0
*,flexion,1,L1,0,0,0,0,0,-4,0,90,0
"""


@pytest.mark.parametrize("virtual", [True, False])
def test_the_segment_is_shown_with_the_loads_that_were_applied(
    virtual: bool, tmp_path: Path
) -> None:
    """Not with those of loads.csv, where the tests are virtual; no landmarks, so no vertebrae."""
    study, cohort, found = results(tmp_path, (2, 3, 4))
    (tmp_path / "config/cohorts/stack/loads.csv").write_text(LOADS)
    parts = []
    for specimen in cohort.specimen_names:
        draw.sample_frames(str(tmp_path), STUDY, specimen, str(tmp_path / "frames.parquet"))
        parts.append(read_frame(tmp_path / "frames.parquet"))
    tables = {**found.tables, "frames": pd.concat(parts, ignore_index=True)}
    study = study if virtual else study.model_copy(update={"virtual_tests": None})
    cohort = check(tmp_path, STUDY)[1]
    page = page_of(study, cohort, replace(found, tables=StudyTables(tables)))
    text = page.split('<script type="application/json"')[0]
    assert re.findall(r'data-group="(\w+)"', text) == ["own", "sampled", *["loads"] * (not virtual)]
    assert ("Arrows end where" in text) != virtual
    assert "drums" not in text
    (scenes,) = re.findall(r'id="scenes">(.*?)</script>', page)
    shown = json.loads(scenes)
    assert list(shown) == ["a", "b"]
    sampled = [t for t in shown["a"]["data"] if t["name"] == "superior axis, sampled"]
    assert [len(t["x"]) // 3 for t in sampled] == [2 * len(JOINTS)], "pose 0 is no draw"
    assert any(t["meta"] == "loads" for t in shown["a"]["data"]) != virtual


def test_what_the_settings_leave_out_is_told(tmp_path: Path) -> None:
    study, cohort, found = results(tmp_path, (1, 1, 1))
    page = page_of(study, cohort, found)
    assert "drawn joint frames (poses: 1); drawn stiffness sets (stiffness_sets: 1)" in page
    assert "left out" not in page_of(*results(tmp_path / "more", (1, 5, 4)))
