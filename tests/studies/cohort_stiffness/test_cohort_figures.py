"""Figures of cohort studies: drawn for any cohort, and true to the tables they are drawn from.

Seen here: words off the page or on each other, a value at the wrong place, a row that is not drawn
and not told.
"""

from itertools import pairwise

import numpy as np
import pandas as pd
import pytest
from cohort_analysis_cases import Row, seen
from cohort_study_cases import PUBLISHED, Size, cohort_of, frame, study_of, tables_of
from drawn import caption, drawings
from matplotlib.axis import Axis
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
from matplotlib.text import Text

from spinepipe.report.style import WIDTH_MM, style
from spinepipe.report.words import short
from spinepipe.studies.cohort_stiffness.figures.error_map import error_map_figure, stages
from spinepipe.studies.cohort_stiffness.figures.held_out_error import motion_errors
from spinepipe.studies.cohort_stiffness.figures.load_case_stiffness import ratios
from spinepipe.studies.cohort_stiffness.figures.range_of_motion import comparison_panels
from spinepipe.studies.cohort_stiffness.kind import KIND, OF_JOBS
from spinepipe.tables import StudyTables

DRAW = drawings("cohort_stiffness")
LONG = tuple(f"vertebra_number_{n}" for n in range(6))
SPINE = ("S1", "L5", "L4", "L3", "L2", "L1", *(f"T{n}" for n in range(12, 0, -1)))
SIZES = {
    "one of all": Size(("a",), ("L5", "L4"), ("flexion",), ("per_joint",)),
    "two load cases, none pooled": Size(
        tests=("flexion", "left_lateral_bending"), representations=("per_specimen", "level_ratio")
    ),
    "long names": Size(tuple(f"specimen_with_a_long_name_{n}" for n in range(5)), LONG),
    "many": Size(tuple(f"s{n:02d}" for n in range(20)), SPINE, ("flexion",), ("per_joint",)),
    "nothing solved": Size(solved=False),
}


def draw(name: str, size: Size, **changed: pd.DataFrame) -> Figure:
    """A figure of made-up tables, laid out."""
    with style():
        figure = DRAW[name](study_of(size), cohort_of(size), tables_of(size, **changed))
        figure.draw_without_rendering()
    return figure


def words(figure: Figure) -> str:
    """All words of a figure."""
    found = [text.get_text() for text in figure.findobj(lambda a: hasattr(a, "get_text"))]
    return " ".join(" ".join(str(text).split()) for text in found)


def ticks(axis: Axis) -> list[Text]:
    """Names of the ticks that are inside the axis."""
    low, high = sorted(axis.get_view_interval())
    return [t.label1 for t in axis.get_major_ticks() if low <= t.get_loc() <= high]


def test_every_figure_has_a_caption_and_tables_that_studies_have() -> None:
    analysed = {table for job in KIND.analyses for table in job.writes}
    for figure in KIND.figures:
        told = caption("cohort_stiffness", figure.name).read_text(encoding="utf-8")
        assert len(told) > 200, figure.name
        assert set(figure.reads) <= {*OF_JOBS, *analysed}, figure.name


def crowded(figure: Figure) -> list[str]:
    """What stands off the page or on something else."""
    page, found = figure.bbox, list[str]()
    for axis in (axis for axis in figure.axes if axis.get_visible()):
        for labels in (ticks(axis.xaxis), ticks(axis.yaxis), [axis.xaxis.label]):
            shown = [t for t in labels if t.get_visible() and t.get_text().strip()]
            boxes = {t: t.get_window_extent() for t in shown}
            upright = [t for t in shown if t.get_rotation() == 0.0]
            for one, other in pairwise(upright):
                if boxes[one].shrunk(0.98, 0.9).overlaps(boxes[other].shrunk(0.98, 0.9)):
                    found.append(f"{one.get_text()} on {other.get_text()}")
            found += [
                f"{text.get_text()} off the page"
                for text, box in boxes.items()
                if box.x0 <= page.x0 - 1.0 or box.x1 >= page.x1 + 1.0
            ]
    for legend in figure.legends:
        inside = legend.get_window_extent()
        if not page.x0 - 1.0 < inside.x0 < inside.x1 < page.x1 + 1.0:
            found.append("the key is off the page")
    return found


@pytest.mark.parametrize("size", SIZES.values(), ids=SIZES.keys())
def test_no_words_leave_the_page_or_stand_on_each_other(size: Size) -> None:
    trouble = dict[str, list[str]]()
    for name in DRAW:
        figure = draw(name, size)
        assert figure.get_figwidth() * 25.4 == pytest.approx(WIDTH_MM)
        assert words(figure).strip()
        assert len(figure.legends) < 2
        trouble[name] = crowded(figure)
    assert not any(trouble.values()), trouble


def test_tables_without_rows_are_told_not_drawn() -> None:
    names = ("stiffness", "errors", "sign_checks", "load_displacement")
    empty = {table: frame(table, []) for table in names}
    told = {
        "stiffness_by_level": "No stiffness was found for any specimen.",
        "error_map": "none of 0 rows has one",
        "held_out_error": "no fit has a result",
        "load_case_stiffness": "One load case",
        "range_of_motion": "No range of motion was both measured and simulated.",
    }
    assert set(told) == set(DRAW)
    for name, why in told.items():
        figure = draw(name, Size(), **empty)
        assert why in words(figure)
        assert not figure.axes


def test_why_nothing_was_fitted_is_said() -> None:
    assert "it tips <over>" in words(draw("stiffness_by_level", Size(solved=False)))


def test_stiffness_stands_at_its_level_with_its_interval() -> None:
    size = Size(("a",), representations=("per_joint",))
    tables = tables_of(size)
    rows = tables["stiffness"]
    chosen = (rows["source"] == "own") & (rows["fitted_to"] == "all")
    chosen &= (rows["coordinate"] == "extension") & (rows["joint"] == "L3L4")
    rows.loc[chosen, ["stiffness", "low", "high"]] = [44.0, 40.0, 48.4]
    (panel, *_) = draw("stiffness_by_level", size, stiffness=rows).axes
    lines = [(line.get_xdata(), line.get_ydata()) for line in panel.lines]
    drawn = [(list(np.atleast_1d(x)), list(np.atleast_1d(y))) for x, y in lines]
    assert ([0.0], [44.0]) in drawn, "L3L4 is the first level: cranial on the left"
    assert ([0.0, 0.0], [40.0, 48.4]) in drawn
    assert any(y == [PUBLISHED["extension"]] * 2 for _, y in drawn), "published value"
    assert [label.get_text() for label in panel.get_xticklabels()] == ["L3L4", "L4L5"]


def test_what_the_data_do_not_hold_is_hollow_and_what_is_missing_crossed() -> None:
    size = Size(("a", "b"), representations=("per_joint",))
    rows = tables_of(size)["stiffness"]
    own = rows.index[(rows["source"] == "own") & (rows["fitted_to"] == "all")]
    plain = words(draw("stiffness_by_level", size))
    assert "not identifiable" not in plain
    assert "no stiffness" not in plain
    rows.loc[own[0], "identifiable"] = False
    rows.loc[own[1], "at_bound"] = "upper"
    rows.loc[own[2], ["stiffness", "low", "high"]] = np.nan
    figure = draw("stiffness_by_level", size, stiffness=rows)
    marks = [line for axis in figure.axes for line in axis.lines if line.get_marker() in "ox"]
    assert (
        sum(str(m.get_markerfacecolor()) == "#FFFFFF" and m.get_marker() == "o" for m in marks) == 2
    )
    assert sum(m.get_marker() == "x" for m in marks) == 1
    assert "not identifiable or at a bound" in words(figure)
    assert "no stiffness" in words(figure)


def map_of(size: Size, tables: StudyTables) -> Figure:
    """The map of errors."""
    with style():
        return error_map_figure(study_of(size), cohort_of(size), tables)


def test_the_map_shows_each_error_at_its_specimen_and_level() -> None:
    size = Size(("a", "b"), ("L5", "L4", "L3"), ("flexion",), ("per_joint",))
    tables = tables_of(size)
    errors = tables["errors"]
    place = (errors["specimen"] == "b") & (errors["joint"] == "L3L4") & errors["loaded"]
    errors.loc[place & (errors["stage"] == "literature"), "peak_error"] = -3.21
    errors.loc[place & (errors["stage"] == "fitted"), "peak_error"] = np.nan
    figure = map_of(size, tables)
    published, fitted, _ = (np.ma.asarray(axis.images[0].get_array()) for axis in figure.axes[:3])
    assert published[1, 0] == -3.21, "second specimen, cranial level on the left"
    assert np.ma.getmaskarray(fitted)[1, 0]
    assert np.ma.count(fitted) == 3
    assert "−3.2" in words(figure)
    ends = {axis.images[0].norm.vmin + axis.images[0].norm.vmax for axis in figure.axes[:3]}  # type: ignore[operator]
    assert ends == {0.0}, "symmetric around zero"


def test_flipped_signs_are_framed_and_explained() -> None:
    size = Size(("a", "b"), ("L5", "L4", "L3"), ("flexion",), ("per_joint",))
    tables = tables_of(size)
    assert "sign flipped" not in words(map_of(size, tables))
    signs = tables["sign_checks"]
    signs.loc[(signs["specimen"] == "b") & (signs["joint"] == "L4L5"), "verdict"] = "flipped"
    figure = map_of(size, tables)
    frames = [p for p in figure.axes[0].patches if isinstance(p, Rectangle) and p.get_lw() > 1.0]
    assert [p.get_xy() for p in frames] == [(0.5, 0.5)]
    assert "sign flipped?" in words(figure)


def test_lines_of_the_map_hang_on_what_was_fitted() -> None:
    def titles(size: Size) -> list[str]:
        errors = tables_of(size)["errors"]
        found = stages(errors[errors["loaded"]], len(size.specimens))
        return [stage.title for stage in found]

    assert titles(Size()) == [
        "Published, one value",
        "One value per specimen, fitted to this specimen",
        "Each joint its own, fitted to this specimen",
        "Each joint its own, from the other specimens",
        "Partially pooled, from the other specimens",
    ]
    assert titles(Size(representations=("level_ratio",))) == [
        "Published, one value",
        "Published ratio of levels, fitted to this specimen",
        "Published ratio of levels, from the other specimens",
    ]
    assert len(titles(Size(("a",)))) == 3, "nobody else to predict from"


def test_error_of_a_specimen_by_hand() -> None:
    def row(specimen: str, coordinate: str, readings: int, error: float | None) -> Row:
        of = {"coordinate": coordinate, "readings": readings, "loaded": False}
        return seen(specimen, "L4L5", error, "per_joint", fitted_to="all", **of)

    rows = [
        row("a", "extension", 10, 0.3),
        row("a", "right_bending", 30, 0.1),
        row("a", "anterior", 10, 99.0),
        row("b", "extension", 10, 0.2),
        row("b", "right_bending", 10, None),
    ]
    found = motion_errors(pd.DataFrame(rows))
    # (10 * 0.09 + 30 * 0.01) / 40 = 0.03; translations do not count; b is not complete
    assert found["specimen"].tolist() == ["a"]
    assert found["error"].iloc[0] == pytest.approx(0.03**0.5)


def test_left_out_load_cases_are_predicted_by_the_fit_that_left_them_out() -> None:
    size = Size(("a",), representations=("per_joint",))
    errors = tables_of(size)["errors"]
    of_case = errors["stage"] == "left_out_case"
    right = errors["fitted_to"] == "all_but_" + errors["test"]
    errors.loc[of_case, "rmse"] = np.where(right[of_case], 0.7, 50.0)
    found = motion_errors(errors).set_index("stage")["error"]
    assert found["left_out_case"] == pytest.approx(0.7)
    two = Size(("a",), tests=("flexion", "left_lateral_bending"), representations=("per_joint",))
    rows = tables_of(two)["errors"]
    rows.loc[rows["stage"] == "left_out_case", "rmse"] = 0.4
    assert motion_errors(rows).set_index("stage")["error"]["left_out_case"] == pytest.approx(0.4)


def test_held_out_figure_tells_the_mean_of_each_row() -> None:
    size = Size(("a", "b"), representations=("per_joint",))
    errors = tables_of(size)["errors"]
    fitted = errors["stage"] == "fitted"
    errors.loc[fitted, "rmse"] = np.where(errors["specimen"][fitted] == "a", 0.2, 0.3)
    assert "0.250°" in words(draw("held_out_error", size, errors=errors))


def test_ratio_to_the_fit_of_all_load_cases() -> None:
    size = Size(("a",), ("L5", "L4"), representations=("per_joint",))
    tables = tables_of(size)
    rows = tables["stiffness"]
    own = (rows["source"] == "own") & (rows["coordinate"] == "extension")
    rows.loc[own & (rows["fitted_to"] == "all"), "stiffness"] = 50.0
    single = own & (rows["fitted_to"] == "flexion")
    rows.loc[single, ["stiffness", "low", "high"]] = [60.0, 50.0, 75.0]
    found = ratios(rows, tables["errors"])
    one = found[(found["coordinate"] == "extension") & (found["fitted_to"] == "flexion")]
    assert one[["ratio", "low", "high"]].to_numpy(float).tolist() == [[1.2, 1.0, 1.5]]
    assert one["loaded"].tolist() == [True]
    others = found[(found["coordinate"] == "extension") & (found["fitted_to"] != "flexion")]
    assert others["loaded"].tolist() == [False, False]
    assert not found["fitted_to"].str.startswith("all").any()


def test_joints_that_share_an_unknown_count_once() -> None:
    size = Size(("a", "b"), representations=("per_specimen", "per_joint"))
    tables = tables_of(size)
    found = ratios(tables["stiffness"], tables["errors"])
    counts = found.groupby("representation").size()
    assert counts["per_specimen"] == 2 * 3 * 3, "specimens x coordinates x load cases"
    assert counts["per_joint"] == 2 * 2 * 3 * 3


def test_nested_test_is_told_where_there_is_one() -> None:
    size = Size(("a", "b"))
    row = {
        "family": "load_case_specific/per_joint",
        "test": "nested models F",
        "joint": "*",
        "response": "stiffness",
        "factor": "load case",
        "stratum": "",
        "n": 100,
        "statistic_name": "F",
        "effect_name": "",
        "family_size": 2,
        "status": "done",
        "message": "",
    }
    rows = [{**row, "specimen": s, "p_holm": p} for s, p in (("a", 0.01), ("b", 0.2))]
    told = words(draw("load_case_stiffness", size, statistics=frame("statistics", rows)))
    assert "Each joint its own: separate stiffness is significantly better in 1 of 2 spec" in told
    assert "One value per specimen: separate" not in told


def test_long_names_keep_both_ends() -> None:
    assert short("specimen_with_a_long_name_7", 12) == "speci…name_7"
    assert short("s01", 12) == "s01"


def test_curves_stand_beside_the_model_where_they_were_read() -> None:
    size = Size(("a", "b"), tests=("flexion", "left_lateral_bending"))
    rows = tables_of(size)["load_displacement"]
    titles = [panel.title for panel in comparison_panels(rows)]
    assert titles == ["Flexion", "Left lateral bending", "Neutral zone", "Work lost in a cycle"]
    ranges, _, zones, work = comparison_panels(rows)
    here = ranges.points
    np.testing.assert_allclose(here["measured_way"], 0.3)
    np.testing.assert_allclose((here["simulated"] - here["measured"]).abs() % 1.0, 0.5)
    assert set(zones.points["simulated"]) == {0.0}, "a straight curve of the model has none"
    np.testing.assert_allclose(work.points["measured"], 200.0)
    figure = draw("range_of_motion", size)
    drawn = [axis for axis in figure.axes if axis.get_visible()]
    assert [axis.get_title(loc="left")[4:] for axis in drawn] == titles
    assert comparison_panels(rows[rows["source"] == "measured"]) == []
