"""Figures of trunk loads: drawn for any persons and tasks, and true to the tables.

Seen here: a figure that breaks or runs off the page where tasks, persons, samples or the volunteer
are missing, a mark that is not where the table has it, what is not sound drawn as if it were.
"""

from collections.abc import Callable
from dataclasses import replace
from functools import cache
from importlib import import_module
from typing import Any

import numpy as np
import pandas as pd
import pytest
from drawn import caption, faults_of_layout
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from trunk_table_cases import BEYOND, ERRORS, MEASURED, Size, cohort_of, study_of, tables_of

from spinepipe.report.style import style
from spinepipe.studies.trunk_loads.figures.cost_of_simplifications import costs
from spinepipe.studies.trunk_loads.figures.line_styles import look_of
from spinepipe.studies.trunk_loads.selection import (
    courses_of,
    extensor_forces,
    forward_bends,
    of_person,
    relaxed_standing,
    shown_person,
    some_tasks,
)

NAMES = (
    *("pressure_against_measured", "muscle_force_bars", "load_by_level", "load_over_flexion"),
    *("drivers", "cost_of_simplifications", "upright"),
)
NEEDS = {
    "pressure_against_measured": ("pressures", "agreement"),
    "muscle_force_bars": ("tasks", "muscles"),
    "load_by_level": ("tasks", "levels"),
    "load_over_flexion": ("tasks", "muscles"),
    "drivers": ("intervals", "drivers"),
    "cost_of_simplifications": ("simplified",),
    "upright": ("upright",),
}
ALL_LOST = tuple((task, "out_of_reach", "no") for task in ("standing", "load_away", "flexion_50"))
_OF_TASKS = ("muscle_force_bars", "load_by_level", "load_over_flexion")
SIZES = {
    "five persons": (Size(), NAMES),
    "one person": (Size(1), ("load_by_level", "load_over_flexion", "upright")),
    "one task": (Size(2, ("standing",)), NAMES),
    "nothing settled": (Size(1, tuple(t for t, *_ in ALL_LOST), ALL_LOST), NAMES),
    "beyond strength": (Size(1, ("standing", "exertion_extension"), (BEYOND,)), _OF_TASKS),
    "no samples": (Size(1, samples=False), ("pressure_against_measured",)),
    "no drawn task": (Size(3, drawn=()), _OF_TASKS),
}
"""Studies, and the figures that look otherwise in them than in those before."""


def function(name: str) -> Callable[..., Figure]:
    """What draws a figure."""
    module = import_module(f"spinepipe.studies.trunk_loads.figures.{name}")
    found: Callable[..., Figure] = getattr(module, f"{name}_figure")
    return found


def draw(name: str, size: Size, **changed: pd.DataFrame) -> Figure:
    """A figure of made-up tables, laid out; drawn once unless tables are changed."""
    return _drawn(name, size) if not changed else _drawn.__wrapped__(name, size, **changed)


@cache
def _drawn(name: str, size: Size, **changed: pd.DataFrame) -> Figure:
    with style():
        figure = function(name)(study_of(size), cohort_of(size), tables_of(size, **changed))
        figure.draw_without_rendering()
    return figure


def words(figure: Figure) -> str:
    """All words of a figure."""
    found: list[Any] = figure.findobj(lambda artist: hasattr(artist, "get_text"))
    return " ".join(" ".join(str(text.get_text()).split()) for text in found)


def panel(figure: Figure, title: str) -> Axes:
    """The panel of a heading, after its letter."""
    return next(axis for axis in figure.axes if axis.get_title("left")[1:].strip() == title)


def rows_of(axis: Axes) -> list[str]:
    """Names of the rows of a panel, from the bottom up."""
    return [label.get_text() for label in axis.get_yticklabels()]


def points(axis: Axes, marker: str) -> set[tuple[float, float]]:
    """Single marks of a panel, to three decimals."""
    lines = [line for line in axis.lines if line.get_marker() == marker]
    return {
        (round(float(x), 3), round(float(y), 3))
        for line in lines
        for x, y in zip(line.get_xdata(), line.get_ydata(), strict=True)
    }


def test_every_figure_has_a_caption() -> None:
    short = [n for n in NAMES if len(caption("trunk_loads", n).read_text(encoding="utf-8")) <= 200]
    assert not short


@pytest.mark.parametrize("which", SIZES)
def test_no_words_leave_the_page_or_stand_on_each_other(which: str) -> None:
    size, names = SIZES[which]
    there = [name for name in names if set(NEEDS[name]) <= set(tables_of(size))]
    assert there
    faults = [f"{name}: {fault}" for name in there for fault in faults_of_layout(draw(name, size))]
    assert not faults


def test_tables_without_rows_are_told_not_drawn() -> None:
    empty = {table: rows.iloc[:0] for table, rows in tables_of(Size()).items()}
    for name in NAMES:
        with style():
            figure = function(name)(study_of(Size()), cohort_of(Size()), empty)
        assert not figure.axes, name
        assert len(words(figure)) > 30, name


@pytest.mark.parametrize(("tier", "marker"), [("untuned", "o"), ("tuned", "s"), ("left_out", "^")])
def test_points_stand_at_measured_and_computed_pressure(tier: str, marker: str) -> None:
    figure = draw("pressure_against_measured", Size(1))
    found = points(panel(figure, tier.replace("_", " ")), marker)
    turned = [(-1) ** k for k in range(len(MEASURED))]
    asked = {
        (measured, round(measured + ERRORS[tier] * sign, 3))
        for (measured, status), sign in zip(MEASURED.values(), turned, strict=True)
        if tier != "left_out" or status == "confirmed"
    }
    assert found == asked


def test_agreement_is_told_as_the_table_has_it() -> None:
    rows = tables_of(Size(1))["agreement"]
    rows.loc[rows["tier"] == "tuned", ["r", "r_low", "r_high", "rmse_mpa"]] = [0.5, -0.4, 0.9, 0.77]
    told = words(draw("pressure_against_measured", Size(1), agreement=rows))
    assert "6 tasks counted r 0.50 (−0.40 to 0.90) off by 0.77 MPa" in told
    rows.loc[:, ["r", "r_low", "r_high", "rmse_mpa"]] = np.nan
    assert "no task counted" in words(draw("pressure_against_measured", Size(1), agreement=rows))


def test_tasks_that_do_not_count_are_hollow_and_unsettled_ones_crossed() -> None:
    rows = tables_of(Size(1))["pressures"]
    rows.loc[rows["task"] == "load_close", "status"] = "cycling"
    figure = draw("pressure_against_measured", Size(1), pressures=rows)
    square = panel(figure, "untuned")
    hollow = {
        round(float(np.asarray(line.get_xdata())[0]), 3)
        for line in square.lines
        if line.get_marker() == "o" and line.get_markerfacecolor() == "#FFFFFF"
    }
    assert hollow == {1.6, 1.0, 0.55}
    assert points(square, "X") == {(1.05, 0.75)}
    assert "Cross: forces did not settle" in words(figure)
    assert "Cross:" not in words(draw("pressure_against_measured", Size(1)))


def test_intervals_are_drawn_where_tasks_were_sampled_and_there_alone() -> None:
    with_them = panel(draw("pressure_against_measured", Size(1)), "untuned")
    upright = [
        line
        for line in with_them.lines
        if len(set(np.asarray(line.get_xdata()))) == 1 and len(np.asarray(line.get_xdata())) == 2
    ]
    assert len(upright) == 3
    told = words(draw("pressure_against_measured", Size(1, samples=False)))
    assert "Line:" not in told


def test_sides_have_bars_of_their_own_only_where_they_differ() -> None:
    figure = draw("muscle_force_bars", Size(1))
    n = len(set(tables_of(Size(1))["muscles"]["group"]))
    assert len(panel(figure, "one handed").patches) == 4 * n
    assert len(panel(figure, "load away").patches) == 2 * n
    assert "active, right" in words(figure)
    alike = draw("muscle_force_bars", Size(1, ("standing", "load_away")))
    assert "active, right" not in words(alike)


def test_bars_add_up_to_the_forces_of_the_table() -> None:
    """Sides alike, so that one of them is drawn: active bars, and passive ones on their ends."""
    rows = tables_of(Size(1))["muscles"]
    own = rows[(rows["task"] == "flexion_50") & (rows["side"] == "right")]
    figure = draw("muscle_force_bars", Size(1, drawn=("flexion_50",)))
    bars = panel(figure, "flexion 50").patches
    passive = sum(bar.get_width() for bar in bars if bar.get_hatch())
    assert sum(bar.get_width() for bar in bars) == pytest.approx(own["force_n"].sum())
    assert passive > 0.0
    assert passive == pytest.approx(own["passive_n"].sum())


def test_what_is_beyond_strength_is_drawn_hollow_and_said() -> None:
    size = Size(1, ("standing", "exertion_extension"), (BEYOND,))
    figure = draw("load_by_level", size)
    assert "Hollow: forces did not settle" not in words(figure), "only sound tasks are chosen"
    drawn = Size(1, ("standing", "exertion_extension"), (BEYOND,), drawn=("exertion_extension",))
    figure = draw("load_by_level", drawn)
    assert "Hollow: forces did not settle" in words(figure)
    courses = [line for line in figure.axes[0].lines if len(np.asarray(line.get_xdata())) == 7]
    assert "#FFFFFF" in {line.get_markerfacecolor() for line in courses}


def test_levels_stand_as_in_a_spine() -> None:
    axis = draw("load_by_level", Size(1)).axes[0]
    labels = rows_of(axis)
    assert labels[0] == "L5S1"
    assert labels[-1] == "T11T12"
    assert axis.get_ylim()[0] < axis.get_ylim()[1]
    rows = tables_of(Size(1))["levels"]
    own = rows[(rows["task"] == "standing") & (rows["level"] == "L5S1")]["compression_n"]
    line = next(one for one in axis.lines if one.get_color() == look_of(0).color)
    assert float(np.asarray(line.get_xdata())[0]) == pytest.approx(float(own.iloc[0]))


def test_bends_are_free_handed_unpushed_and_settled() -> None:
    size = Size(1)
    tasks = tables_of(size)["tasks"]
    found = forward_bends(tasks, cohort_of(size))
    angles = [0.0, *range(10, 101, 10), 107.3]
    assert found["flexion_deg"].tolist() == pytest.approx(angles)
    assert not {"exertion_torsion", "standing_stable", "load_away"} & set(found["task"])
    lost = tasks["task"] == "full_flexion"
    tasks.loc[lost, "status"] = "two_answers"
    assert forward_bends(tasks, cohort_of(size))["flexion_deg"].max() == 100.0
    few = tasks[tasks["task"].isin(["standing", "flexion_50"])]
    assert forward_bends(few, cohort_of(size)).empty


def test_relaxed_standing_is_found_by_number_or_by_what_it_is() -> None:
    size = Size(1)
    tasks = tables_of(size)["tasks"]
    assert relaxed_standing(tasks, cohort_of(size)) == "standing"
    unnumbered = tasks.assign(number=None)
    assert relaxed_standing(unnumbered, cohort_of(size)) == "standing"
    gone = unnumbered[unnumbered["task"] != "standing"]
    assert relaxed_standing(gone, cohort_of(size)) is None, (
        "torsion is pushed, the other one is tense"
    )


def test_persons_and_tasks_are_chosen_by_rule() -> None:
    tables = tables_of(Size(3))
    tasks = tables["tasks"]
    assert shown_person(study_of(Size(3)), tasks) == "volunteer"
    nobody = Size(3, volunteer=False)
    others = tasks[tasks["specimen"] != "volunteer"]
    assert shown_person(study_of(nobody), others) == "ng_2002"
    own = of_person(tasks, "volunteer")
    chosen = some_tasks(study_of(Size(3)), own)
    assert {"standing", "load_away", "one_handed"} < set(chosen)
    assert len(chosen) == 6
    assert not {"exertion_extension", "exertion_flexion"} & set(chosen)


def test_the_course_of_the_extensors_is_that_of_the_table() -> None:
    size = Size(1)
    tables = tables_of(size)
    course = courses_of(tables["tasks"], cohort_of(size))["volunteer"]
    rows = extensor_forces(tables["muscles"], course)
    forces = rows.groupby(["group", "flexion_deg"]).sum()
    long = forces.loc["longissimus_thoracis"]
    assert long["active"].idxmax() == pytest.approx(60.0)
    assert long["passive"].is_monotonic_increasing


def test_costs_are_shares_of_the_whole_model() -> None:
    found = costs(tables_of(Size(2))["simplified"])
    percent = found.groupby("simplification")["percent"].unique().map(np.round)
    assert {name: set(values) for name, values in percent.items()} == {
        "no_feedback": {-5.0}, "rigid_translations": {10.0},
        "only_l5s1": {-15.0}, "no_wrapping": {20.0},
    }  # fmt: skip
    assert not found[found["task"] == "exertion_extension"]["sound"].any()
    assert "exertion_flexion" not in set(found["task"])


def test_factors_stand_in_the_order_of_their_indices() -> None:
    labels = rows_of(draw("drivers", Size(1)).axes[3])
    assert labels[-1] == "how far ahead the hands are"
    assert labels[0] == "stiffness of joints"
    rows = tables_of(Size(1))["drivers"]
    rows.loc[rows["factor"] == "passive_rotation", "total"] = 0.9
    assert rows_of(draw("drivers", Size(1), drivers=rows).axes[3])[-1] == "stiffness of joints"


def test_the_paper_stands_beside_its_own_volunteers_alone() -> None:
    size = Size(1)
    assert "Ghezelbash 2016 Table 2" in words(draw("upright", size))
    other = replace(cohort_of(size), name="mine")
    with style():
        figure = function("upright")(study_of(size), other, tables_of(size))
    assert "Ghezelbash" not in words(figure)
