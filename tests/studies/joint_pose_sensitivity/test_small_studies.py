"""Small cohorts: nothing overlaps, and captions promise nothing that is not there."""

from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pandas as pd
from identification_cases import identification
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from spinepipe.report.page.document import Picture, ResultTables
from spinepipe.report.page.scene import scenes
from study_cases import STUDY, Size, project, results
from sweeps import sweep

from spinepipe.cohort import Cohort
from spinepipe.report.panels import across_of, log_ticks
from spinepipe.report.specimen import view_of
from spinepipe.report.style import TALLEST_MM, style
from spinepipe.studies.joint_pose_sensitivity.figures import agreement
from spinepipe.studies.joint_pose_sensitivity.figures.agreement import agreement_figure
from spinepipe.studies.joint_pose_sensitivity.figures.bootstrap import bootstrap_figure
from spinepipe.studies.joint_pose_sensitivity.figures.errors import errors_figure
from spinepipe.studies.joint_pose_sensitivity.figures.landmark_precision import (
    landmark_precision_figure,
)
from spinepipe.studies.joint_pose_sensitivity.figures.pose_against_stiffness import (
    pose_against_stiffness_figure,
)
from spinepipe.studies.joint_pose_sensitivity.figures.success import success_figure
from spinepipe.studies.joint_pose_sensitivity.inputs import study_and_cohort
from spinepipe.studies.joint_pose_sensitivity.page import caption
from spinepipe.studies.joint_pose_sensitivity.settings import JointPoseSensitivity
from spinepipe.tables import StudyTables

FOUR = ("anterior", "superior", "extension", "right_bending")
CAPTIONS = Path(agreement.__file__).parent
Study = tuple[JointPoseSensitivity, Cohort, StudyTables]


def made(root: Path, size: Size) -> Study:
    """A study, its cohort and all its tables, made up."""
    folder = results(project(root, size), size)
    identification(folder, size)
    study, cohort = study_and_cohort(str(root), STUDY)
    return study, cohort, StudyTables.read(list(folder.glob("*.parquet")))


def panels(figure: Figure) -> list[Axes]:
    """The panels that are shown."""
    return [axis for axis in figure.axes if axis.get_visible()]


def words(figure: Figure) -> str:
    """All words in the panels and below them, in one line."""
    told = [text.get_text() for axis in figure.axes for text in axis.texts]
    told += [text.get_text() for text in figure.texts]
    for legend in figure.legends:
        told += [legend.get_title().get_text(), *(text.get_text() for text in legend.get_texts())]
    return " ".join(" ".join(told).split())


def settling(study: JointPoseSensitivity) -> JointPoseSensitivity:
    """The same study, with motion 0.3 s after loading."""
    return study.model_copy(update={"loading": "settle", "settle_time_s": 0.3})


def overlaps(figure: Figure, along: str) -> bool:
    """Whether labels of ticks lie on each other, along x or y."""
    figure.canvas.draw()
    low, high = f"{along}0", f"{along}1"
    for axis in panels(figure):
        axes = axis.xaxis if along == "x" else axis.yaxis
        ends = axes.get_view_interval()
        boxes = sorted(
            (
                tick.label1.get_window_extent()
                for tick in axes.get_major_ticks()
                if tick.label1.get_visible()
                and tick.label1.get_text()
                and min(ends) <= tick.get_loc() <= max(ends)
            ),
            key=lambda box: float(getattr(box, low)),
        )
        if any(getattr(b, low) < getattr(a, high) for a, b in pairwise(boxes)):
            return True
    return False


@sweep("size", [Size(("a", "b"), 2, 4, FOUR), Size(("a",), 3, 4)])
def test_rows_and_ticks_of_the_bootstrap_can_be_read(tmp_path: Path, size: Size) -> None:
    study, cohort, tables = made(tmp_path, size)
    with style():
        figure = bootstrap_figure(study, cohort, tables)
        assert not overlaps(figure, "x")
        assert not overlaps(figure, "y")
    assert figure.get_size_inches()[1] * 25.4 <= TALLEST_MM + 1e-9


def test_numbers_of_the_bootstrap_stand_only_where_there_is_room(tmp_path: Path) -> None:
    small, large = (made(tmp_path / str(n), Size(("a", "b")[:n], 2, 4, FOUR[1:])) for n in (1, 2))
    with style():
        assert "n = 5" in words(bootstrap_figure(*small))
        assert "n = 5" not in words(bootstrap_figure(*large))


def test_ticks_of_logarithmic_axes_are_few() -> None:
    axis = Figure().subplots()
    axis.set_xscale("log")
    for low, high in ((1.4e4, 9e5), (9.0, 250.0), (30.0, 40.0), (1.0, 1e12)):
        axis.set_xlim(low, high)
        log_ticks(axis.xaxis, low, high, 3)
        shown = [x for x in axis.get_xticks() if low <= x <= high]
        assert 1 <= len(shown) <= 4, (low, high, shown)


def test_four_panels_are_two_and_two() -> None:
    assert [across_of(n) for n in (1, 2, 3, 4, 5, 6, 7)] == [1, 2, 3, 2, 3, 3, 3]
    assert across_of(4, most=4) == 4


def test_letters_run_on_and_titles_stay_in_the_figure(tmp_path: Path) -> None:
    study, cohort, tables = made(tmp_path, Size(("a", "b"), 2, 4))
    for name in ("variance_shares", "importance"):
        more = [
            tables[name].assign(coordinate=coordinate)
            for coordinate in ("anterior", "right_bending")
        ]
        tables[name] = pd.concat([tables[name], *more])
    with style():
        figure = pose_against_stiffness_figure(study, cohort, tables)
        figure.canvas.draw()
    titles = [axis.get_title(loc="left") for axis in panels(figure)]
    assert [title[0] for title in titles] == list("abcdefghijkl")
    for axis in panels(figure):
        (text,) = [t for t in (axis._left_title,) if t.get_text()]  # type: ignore[attr-defined]
        assert text.get_window_extent().x1 <= figure.bbox.x1
        for told in axis.texts:
            box = told.get_window_extent()
            assert axis.bbox.x0 <= box.x0 < box.x1 <= axis.bbox.x1 + 1.0, told.get_text()


def test_trees_of_too_few_rows_keep_their_panels(tmp_path: Path) -> None:
    study, cohort, tables = made(tmp_path, Size(("a",), 2, 4))
    why = "18 rows in 6 groups; at least 20 in 2 are needed"
    none = {"status": "too_few", "message": why, "importance": np.nan, "leaves": np.nan}
    tables["importance"] = tables["importance"].assign(**none, r2=np.nan)
    with style():
        figure = pose_against_stiffness_figure(study, cohort, tables)
    assert [a.get_title(loc="left").split(": ")[1] for a in panels(figure)] == [
        "error",
        "error",
        "|error|",
        "|error|",
        "tree of |error|",
        "tree of |error|",
    ]
    assert words(figure).count(why) == 5, "in two rows of two panels, and below them"
    assert f"no tree for 4 of 4 errors: {why}" in words(figure)


def test_trees_are_drawn_whatever_else_is_missing(tmp_path: Path) -> None:
    study, cohort, tables = made(tmp_path, Size(("a",), 2, 4))
    with style():
        figure = pose_against_stiffness_figure(study, cohort, tables)
    bars = [len(axis.patches) for axis in panels(figure)]
    assert bars == [0, 0, 0, 0, 4, 4], "two factors, two joints"


def test_zeros_of_step_0_are_no_readings(tmp_path: Path) -> None:
    study, cohort, tables = made(tmp_path, Size(("a",), 2, 4))
    runs = tables["simulations"]
    filled = [name for name in runs if name.startswith("error_") and runs[name].notna().any()]
    assert len(filled) == 2
    runs.loc[(runs["step"] == 0), filled] = 0.0
    with style():
        assert "n = 8 per row" in words(errors_figure(study, cohort, tables)), (
            "4 poses, steps 0 and 1"
        )
        zeroed = replace(cohort, zeroed_at_step_0=True)
        assert "n = 4 per row" in words(errors_figure(study, zeroed, tables))


def test_exact_fits_are_exact_not_1e_16(tmp_path: Path) -> None:
    study, cohort, tables = made(tmp_path, Size(("a",), 2, 4))
    runs = tables["simulations"]
    columns = [name.removeprefix("error_") for name in runs if name.startswith("error_")]
    own = runs["stiffness"] == "calibrated"
    for name in columns:
        exact = runs[f"measured_{name}"] + 1e-15
        runs.loc[own, f"predicted_{name}"] = exact
        runs.loc[own & exact.notna(), f"error_{name}"] = 1e-15
    with style():
        figures = [agreement_figure(study, cohort, tables), errors_figure(study, cohort, tables)]
        for figure in figures:
            figure.canvas.draw()
            offsets = [
                a.get_offset_text().get_text() for p in panels(figure) for a in (p.xaxis, p.yaxis)
            ]
            assert not any(offsets)
    assert words(figures[0]).count("exact to rounding, n = 12") == 4
    assert "bias" not in words(figures[0])
    assert words(figures[1]).count("exact to rounding") == 4


def test_motion_that_was_not_at_rest_is_told_below_the_figures(tmp_path: Path) -> None:
    study, cohort, tables = made(tmp_path, Size(("a",), 2, 4))
    late = "simulated 0.3 s after loading"
    with style():
        assert late in words(errors_figure(settling(study), cohort, tables))
        assert late in words(agreement_figure(settling(study), cohort, tables))
        assert late not in words(agreement_figure(study, cohort, tables))
        assert late not in words(errors_figure(study, cohort, tables))


def test_medians_of_specimens_are_thick_in_all_panels(tmp_path: Path) -> None:
    study, cohort, tables = made(tmp_path, Size(("a", "b"), 2, 4))
    with style():
        figure = landmark_precision_figure(study, cohort, tables)
    for axis in panels(figure):
        assert sum(line.get_linewidth() == 1.8 for line in axis.lines) == 2, "two stiffnesses"
        assert not axis.collections, "no bands"
    assert "band" not in words(figure)


def test_a_method_that_was_refused_has_no_row(tmp_path: Path) -> None:
    study, cohort, tables = made(tmp_path, Size(("a",), 2, 4))
    fits = tables["method_fits"]
    gone = fits["method"] == "exact"
    fits.loc[gone, ["status", "message"]] = ["refused", "not this one"]
    with style():
        figure = success_figure(study, cohort, tables)
    assert len(panels(figure)[0].get_yticks()) == 2
    assert "exact not compared: not this one." in words(figure)


def told(name: str, study: Study, **tables: pd.DataFrame) -> str:
    """A figure's caption on the page."""
    text = (CAPTIONS / f"{name}.rst").read_text(encoding="utf-8")
    picture = Picture(name, name, "", " ".join(text.split()))
    return caption(picture, *study[:2], ResultTables(StudyTables({**study[2], **tables}), {}, {}))


def test_captions_speak_of_the_paper_only_beside_its_cohort(tmp_path: Path) -> None:
    study, cohort, tables = made(tmp_path, Size(("a",), 2, 4))
    rebuilt = replace(cohort, name="palanca_l1l4")
    for path in CAPTIONS.glob("*.rst"):
        own = told(path.stem, (study, cohort, tables))
        assert "Gould" not in own, path.name
        assert len(own) > 200, path.name
        theirs = told(path.stem, (study, rebuilt, tables))
        assert ("Gould" in theirs) == ("Gould" in path.read_text(encoding="utf-8")), path.name
    assert told("bootstrap", (study, cohort, tables)).endswith("relative to its own median.")


def test_captions_tell_how_this_study_was_drawn(tmp_path: Path) -> None:
    one, two = (
        made(tmp_path / str(n), Size(("a", "b")[:n], joints, 4)) for n, joints in ((1, 2), (2, 4))
    )
    assert "a dot is a reading" in told("agreement", one)
    assert "a row without the readings" not in told("agreement", one)
    assert "a dot is a reading" not in told("agreement", two)
    assert "a row without the readings" in told("agreement", two)
    assert "Wilson" in told("landmark_precision", one)
    assert "thick" not in told("landmark_precision", one)
    assert "thick" in told("landmark_precision", two)
    assert "Wilson" not in told("landmark_precision", two)
    late = "Motion was simulated 0.3 s after loading"
    for name in ("errors", "agreement", "bootstrap"):
        assert (late in told(name, (settling(one[0]), *one[1:]))) == (name != "bootstrap")
        assert late not in told(name, one)


def test_legend_of_the_scene_names_each_load_once(tmp_path: Path) -> None:
    study, cohort, tables = made(tmp_path, Size(("a",), 2, 4))
    assert cohort.loads is not None
    twice = pd.concat([cohort.loads.assign(cycle=cycle) for cycle in (1, 2)], ignore_index=True)
    again = replace(cohort, loads=twice)
    drawn = scenes([view_of(again, "a", study.tests)], again, tables["poses"])["a"]["data"]
    loads = [trace for trace in drawn if trace["meta"] == "loads"]
    assert len(loads) == 8, "line and head of a force and of a moment, in two cycles"
    named = sorted(t["name"] for t in loads if t["showlegend"])
    assert named == ["flexion: 1 N m", "flexion: 20 N"]
