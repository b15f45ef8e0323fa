"""Figures of tracked motions: drawn for any persons and motions, and true to the tables.

Seen here: a figure that breaks or runs off the page where persons, trials, truth or calibrations
are missing, a mean, course or mark that is not the table's, an approach that changes its colour.
"""

from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
import pandas as pd
import pytest
from drawn import drawings, faults_of_layout
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from tracking_table_cases import BEND_DEG, ERROR, Size, cohort_of, study_of, tables_of

from spinepipe.motion.skeleton import BODIES
from spinepipe.report.style import style
from spinepipe.studies.tracking.figures.kinematics import courses_of, ends_of
from spinepipe.studies.tracking.figures.line_styles import choose_approaches, styles_of_approaches
from spinepipe.studies.tracking.figures.stiffness import closed_elements
from spinepipe.studies.tracking.in_space import farthest, motions_of, still_figure

NAMES = (
    *("kinematics", "motion_sharing", "error_by_level", "stiffness_profiles"),
    *("stiffness_by_level", "trade_off"),
)
SIZES = {
    "three persons": (Size(), NAMES),
    "nothing found": (Size(1, failing=tuple(ERROR)), NAMES),
    "one person": (Size(1), ("kinematics", "motion_sharing", "error_by_level", "trade_off")),
    "no truth": (Size(2, truth=False), ("kinematics", "error_by_level")),
    "one person, no truth": (Size(1, truth=False), ("trade_off",)),
    "stance alone": (Size(2, ("stance",)), ("kinematics", "motion_sharing", "error_by_level")),
    "one approach": (Size(2, approaches=("optk_generic",)), NAMES[:3]),
    "turned too little": (Size(2, moves=False), ("kinematics", "motion_sharing")),
    "profiles lost": (Size(1, verdict="lost"), ("stiffness_profiles", "stiffness_by_level")),
    "profiles told": (Size(1, verdict="told"), ("stiffness_profiles", "stiffness_by_level")),
}
"""Studies, and the figures that look otherwise in them than in those before."""
REAL = drawings("tracking")


def draw(name: str, size: Size, **changed: pd.DataFrame) -> Figure:
    """A figure of made-up tables, laid out; drawn once unless tables are changed."""
    return _drawn(name, size) if not changed else _drawn.__wrapped__(name, size, **changed)


@cache
def _drawn(name: str, size: Size, **changed: pd.DataFrame) -> Figure:
    function: Callable[..., Figure] = REAL[name]
    with style():
        figure = function(study_of(size), cohort_of(size), tables_of(size, **changed))
        figure.draw_without_rendering()
    return figure


def words(figure: Figure) -> str:
    """All words of a figure."""
    found: list[Any] = figure.findobj(lambda artist: hasattr(artist, "get_text"))
    return " ".join(" ".join(str(text.get_text()).split()) for text in found)


def panel(figure: Figure, title: str) -> Axes:
    """The first panel of a heading, after its letter."""
    return next(axis for axis in figure.axes if axis.get_title("left")[1:].strip() == title)


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("which", SIZES)
def test_no_words_leave_the_page_or_stand_on_each_other(which: str) -> None:
    size, names = SIZES[which]
    faults = [f"{name}: {fault}" for name in names for fault in faults_of_layout(draw(name, size))]
    assert not faults


def test_what_is_not_there_is_said() -> None:
    nothing = Size(1, failing=tuple(ERROR))
    assert "no approach found a motion" in words(draw("kinematics", nothing))
    assert "no approach found a motion" in words(draw("kinematics", Size(1, ("stance",))))
    assert "is not known of any motion" in words(draw("error_by_level", Size(1, truth=False)))
    assert "no trial turns" in words(draw("motion_sharing", Size(1, ("stance",))))
    assert "turns too little" in words(draw("motion_sharing", Size(2, moves=False)))
    assert "no calibration loaded" in words(draw("stiffness_by_level", nothing))
    assert "not known: no fit settled" in words(draw("stiffness_profiles", Size(1, verdict="lost")))
    untold = words(draw("trade_off", Size(1, truth=False)))
    assert untold.count("no truth is known") == 2
    empty = {name: rows.iloc[:0] for name, rows in tables_of(Size(1)).items()}
    for name in NAMES:
        assert "Nothing can be shown" in words(draw(name, Size(1), **empty)), name


def test_courses_are_those_of_the_table() -> None:
    courses = courses_of(cohort_of(Size()), tables_of(Size())["tracked"])
    assert list(courses) == ["flexion_extension", "lateral_bending"]
    one = courses["flexion_extension"]
    # at half time a sixth of the bend, a tenth more from person to person
    np.testing.assert_allclose(
        one.found["optk_generic"][:, 50, 2], BEND_DEG / 6.0 * np.array([1.0, 1.1, 1.2])
    )
    assert one.true.shape == (3, 101, 6)
    assert np.ptp(one.true) > 2.0, "the phantom moves"
    assert courses_of(cohort_of(Size(1, truth=False)), tables_of(Size(1))["tracked"])[
        "flexion_extension"
    ].true.shape == (0, 101, 6)


def test_what_vibrates_leaves_the_axis_and_has_no_band() -> None:
    rows = tables_of(Size())["tracked"]
    wild = rows["approach"] == "ik"
    rows.loc[wild, "extension_deg"] *= 30.0
    one = courses_of(cohort_of(Size()), rows)["flexion_extension"]
    assert "ik" not in one.calm
    low, high = ends_of(one)
    assert -60.0 < low < high < 60.0
    told = words(draw("kinematics", Size(), tracked=rows))
    assert "Inverse kinematics: without a band where it leaves the axis." in told
    assert "without a band" not in words(draw("kinematics", Size()))


def test_errors_are_means_over_persons() -> None:
    figure = draw("error_by_level", Size())
    axis = panel(figure, "Flexion–extension: vertebral centres")
    assert [label.get_text() for label in axis.get_yticklabels()] == list(BODIES[1:])
    names = choose_approaches(study_of(Size()), ERROR, 4)
    assert names == ["ik", "optk_zero", "optk_generic", "optk_from_both"]
    look = styles_of_approaches(names)["optk_generic"]
    line = next(one for one in axis.lines if one.get_color() == look.color)
    assert np.mean(np.asarray(line.get_xdata(), dtype=float)) == pytest.approx(
        1.1 * ERROR["optk_generic"]
    )


def test_an_approach_looks_the_same_in_all_figures() -> None:
    one, other = (
        styles_of_approaches(["ik", "optk_generic"]),
        styles_of_approaches(["optk_generic"]),
    )
    assert one["optk_generic"] == other["optk_generic"]
    many = styles_of_approaches(["ik_springs", "ik_smooth", "ik"])
    assert len({look.color for look in many.values()}) == 3


def test_profiles_show_open_ends_and_what_is_told() -> None:
    for verdict, said in (
        ("told", "markers tell it least cost at 1"),
        ("one_sided", "markers tell one end least cost at 0.5"),
        ("falls", "markers do not tell it least cost at 0.2, an end"),
        ("not_told", "markers do not tell it least cost at 1"),
    ):
        figure = draw("stiffness_profiles", Size(1, verdict=verdict))
        assert said in words(figure), verdict
        marks = {str(line.get_marker()) for line in figure.axes[0].lines}
        assert ("<" in marks) == (verdict != "told")
        assert (">" in marks) == (verdict in ("not_told", "falls"))


def test_stiffness_is_filled_only_where_it_is_told() -> None:
    def filled(verdict: str) -> set[bool]:
        axis = draw("stiffness_by_level", Size(1, verdict=verdict)).axes[0]
        marks = [line for line in axis.lines if str(line.get_marker()) in "os"]
        return {line.get_markerfacecolor() == line.get_markeredgecolor() for line in marks}

    assert filled("told") == {True}
    assert filled("one_sided") == {False}
    assert filled("not_told") == {False}
    assert closed_elements(tables_of(Size(1, verdict="one_sided"))["profiles"]) == set()
    without = tables_of(Size(1))["profiles"].iloc[:0]
    assert closed_elements(without) == set()


def test_weights_that_did_not_settle_are_hollow() -> None:
    assert "not settled" not in words(draw("trade_off", Size(1)))
    rows = tables_of(Size(1))["weights"]
    rows.loc[0, "status"] = "not_converged"
    assert "not settled" in words(draw("trade_off", Size(1), weights=rows))


def test_the_drawing_for_paper_has_the_farthest_frame() -> None:
    shown = next(iter(motions_of(tables_of(Size(1), drawn=moving())["drawn"])))
    assert farthest(shown) is shown.frames[2]
    with style():
        assert "joints at 2.00 s" in words(still_figure(shown))


def moving() -> pd.DataFrame:
    """What is drawn of the first moving trial alone."""
    rows = tables_of(Size(1))["drawn"]
    return rows[rows["trial"] == "flexion_extension"]
