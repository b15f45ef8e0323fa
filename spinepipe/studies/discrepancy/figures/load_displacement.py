"""Figures of single joints along the load of a test, measured and modelled.

Load over displacement has a panel for the coordinate that a test drives: that in which its load
does the most work. The curve is the field's own: displacement along, load up, loading and unloading
apart. Measured less modelled motion over load steps has one for each place where they disagree
most, driven or not.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from spinepipe.cohort import Cohort
from spinepipe.report.glyphs import Array
from spinepipe.report.panels import explain_marks, head, sections
from spinepipe.report.style import BLACK, GREY, INK, OURS, SMALL_PT, THEIRS, WHITE, saying
from spinepipe.report.words import AXIS, case, count, fixed, number, short, unit
from spinepipe.studies.discrepancy.settings import Discrepancy
from spinepipe.studies.discrepancy.words import load_axis, motion_of
from spinepipe.tables import StudyTables
from spinepipe.units import COORDINATES, DISPLAY_PER_SI

MOST_PANELS, FEWEST_PANELS = 12, 6
CLEARLY = 1.5
"""Beyond the fewest, curves and places are shown where the base is off by so many noise SD."""

MOST_PLACES, FEWEST_PLACES = 6, 3

BAND_SD = 2.0
"""SDs of the measured mean to each side of a point."""

PLACE = ["specimen", "test", "joint", "coordinate"]

_LINES: dict[str, dict[str, Any]] = {
    "base": {"color": THEIRS, "ls": (0, (4, 1.5)), "lw": 1.0},
    "with_effects": {"color": OURS, "ls": "-", "lw": 1.2},
    "with_table": {"color": BLACK, "ls": (0, (1, 1.2)), "lw": 1.3},
}
_STEP_LINES: dict[str, dict[str, Any]] = {
    "base": {"color": THEIRS, "ls": "--", "lw": 1.0, "marker": "s", "ms": 3.0, "mew": 0.0},
    "with_effects": {"color": OURS, "ls": "-", "lw": 1.2, "marker": "o", "ms": 2.6, "mew": 0.0},
    "with_table": {"color": BLACK, "ls": ":", "lw": 1.2, "marker": "d", "ms": 2.6, "mew": 0.0},
}
"""How each model is drawn over displacement, and over load steps."""

LABELS = {
    "base": "base model",
    "with_effects": "model with the effects",
    "with_table": "model with a table of what has no name",
}
_DOT: dict[str, Any] = {"marker": "o", "ms": 3.4, "lw": 0, "mec": BLACK, "mew": 0.6}
_PANEL_MM, _KEY_MM = 51.0, 18.0
_STEPS_PANEL_MM, _STEPS_KEY_MM = 50.0, 17.0
_JUMP = 2.0
"""Times the usual change of load from which a change of side is a jump."""

_ROUNDING = 1e-3
"""Share of the motion by which both branches of a line may differ."""

_BACK = 0.02
"""Share of the largest load by which a load must fall for its step to be one of unloading."""

Steps = NDArray[np.int64]


def load_displacement_figure(study: Discrepancy, cohort: Cohort, tables: StudyTables) -> Figure:
    """The curves where the base is farthest off, each in the specimen where it is worst."""
    gap = tables["gap"]
    curves = worst_curves(gap)
    if not curves:
        return saying(
            "No curve can be shown: the base model has no pose, or no test loads a joint."
        )
    lines = models_shown(gap)
    (panels,), figure = sections([(len(curves), _PANEL_MM)], _KEY_MM)
    unloaded = False
    for index, (axis, curve) in enumerate(zip(panels, curves, strict=True)):
        unloaded |= _draw(axis, curve, lines)
        _label(axis, index, curve, len(cohort.specimen_names))
    explain_marks(figure, _handles(lines, unloaded), _words(gap, curves, cohort), 5)
    return figure


@dataclass(frozen=True)
class JointTestCurve:
    """One specimen's joint in one test: ``rows`` of the table gap in the order of load steps.

    ``off`` : root mean square of measured less base, noise SD.
    """

    specimen: str
    test: str
    joint: str
    coordinate: str
    rows: pd.DataFrame
    off: float


def worst_curves(gap: pd.DataFrame) -> list[JointTestCurve]:
    """Of each joint in each test the driven coordinate, the base's farthest first.

    Of many each in the specimen where it is worst.
    """
    rows = gap[gap["base"].notna() & (gap["noise_sd"] > 0.0)].sort_values("step", kind="stable")
    chosen = driven_coordinates(rows)
    found = [
        JointTestCurve(str(specimen), str(test), str(joint), str(coordinate), part, _off(part))
        for (specimen, test, joint, coordinate), part in rows.groupby(PLACE, sort=False)
        if (test, joint, coordinate) in chosen
    ]
    ordered = sorted(found, key=lambda curve: -curve.off)
    if len(ordered) <= MOST_PANELS:
        return ordered
    of_place: dict[tuple[str, str], JointTestCurve] = {}
    for curve in ordered:
        of_place.setdefault((curve.test, curve.joint), curve)
    shown = list(of_place.values())[:MOST_PANELS]
    return [curve for n, curve in enumerate(shown) if n < FEWEST_PANELS or curve.off > CLEARLY]


def driven_coordinates(gap: pd.DataFrame) -> set[tuple[str, str, str]]:
    """Test, joint and the coordinate in which the load does the most work there, over specimens."""
    factors = dict(zip(COORDINATES, DISPLAY_PER_SI, strict=True))
    per_si = gap["coordinate"].map(factors).astype(float)
    motion = gap["held_at"].fillna(gap["measured"])  # on a rig that moves it, a load is measured
    work = (gap["load"] * motion / per_si).abs()
    keys = ["test", "joint", "coordinate"]
    total = work.groupby([gap[key] for key in keys], sort=False).sum().rename("work").reset_index()
    best = total[total["work"] > 0.0].sort_values("work", ascending=False, kind="stable")
    chosen = best.drop_duplicates(["test", "joint"])
    return set(chosen[keys].itertuples(index=False, name=None))


def _off(rows: pd.DataFrame) -> float:
    residual = (rows["measured"] - rows["base"]) / rows["noise_sd"]
    return float(np.sqrt(np.mean(residual**2)))


def unloading(load: Array) -> NDArray[np.bool_]:
    """(T,) steps that were come to from a larger load to the same side, the way back to zero.

    On a rig that moves a joint, the motion stands for the load.
    """
    before = np.concatenate([load[:1], load[:-1]])
    least = _BACK * float(np.abs(load).max(initial=0.0))
    same_side = load * before >= 0.0
    return same_side & (np.abs(before) - np.abs(load) > least)


def models_shown(gap: pd.DataFrame) -> tuple[str, ...]:
    """The models that differ: the base, that with effects, that with tables besides."""
    added = not gap["base"].fillna(0.0).equals(gap["with_effects"].fillna(0.0))
    tabulated = "with_table" in gap and gap["with_table"].notna().any()
    return ("base", *["with_effects"] * added, *["with_table"] * bool(tabulated))


def _draw(axis: Axes, curve: JointTestCurve, lines: Sequence[str]) -> bool:
    """Points, their noise and the models' curves; whether there were unloading steps."""
    rows = curve.rows
    load, measured = rows["load"].to_numpy(float), rows["measured"].to_numpy(float)
    along = rows["held_at"].to_numpy(float)
    on_a_rig = bool(np.isfinite(along).all())  # that moves the joint: a load was measured

    def placed(seen: Array, steps: Steps | NDArray[np.bool_]) -> tuple[Array, Array]:
        return (along[steps], seen[steps]) if on_a_rig else (seen[steps], load[steps])

    drive = along if on_a_rig else load
    back, noise = unloading(drive), BAND_SD * rows["noise_sd"].to_numpy(float)
    fill_between = axis.fill_between if on_a_rig else axis.fill_betweenx
    for way in ways(drive):
        for steps in _branches(way, back):
            low, high = measured[steps] - noise[steps], measured[steps] + noise[steps]
            fill_between(drive[steps], low, high, color=GREY, alpha=0.3, lw=0, zorder=1)
        for name in lines:
            modelled = rows[name].to_numpy(float)
            line = placed(modelled, line_order(drive, modelled, way))
            axis.plot(*line, zorder=3, **_LINES[name])
    for chosen, fill in ((~back, BLACK), (back, WHITE)):
        axis.plot(*placed(measured, chosen), mfc=fill, zorder=5, **_DOT)
    axis.axhline(0.0, color=GREY, lw=0.4, zorder=0)
    axis.axvline(0.0, color=GREY, lw=0.4, zorder=0)
    return bool(back.any())


def ways(load: Array) -> list[Steps]:
    """Steps that a line may join: a jump to the other side starts anew, from where all began."""
    # a change of side is usual where a test sweeps through zero: there the change is small
    change = np.abs(np.diff(load))
    sides = load[1:] * load[:-1] < 0.0
    usual = float(np.median(change)) if len(change) else 0.0
    jumps = np.flatnonzero(sides & (change > _JUMP * usual)) + 1
    found: list[Steps] = np.split(np.arange(len(load)), jumps)
    unloaded = abs(load[0]) <= _BACK * float(np.abs(load).max(initial=0.0))
    return [np.r_[0, way] if unloaded and way[0] else way for way in found]


def line_order(drive: Array, seen: Array, way: Steps) -> Steps:
    """The steps in the order of what drives them, if that is one line: no dash is drawn twice."""
    order: Steps = way[np.argsort(drive[way], kind="stable")]
    rise = np.diff(seen[order])
    least = _ROUNDING * float(np.ptp(seen[way]))
    return way if (rise > least).any() and (rise < -least).any() else order


def _branches(way: Steps, back: NDArray[np.bool_]) -> list[Steps]:
    """Runs of steps that load or unload, each with the step that it starts from."""
    turns = [0, *(np.flatnonzero(np.diff(back[way])) + 1).tolist(), len(way)]
    return [way[max(0, a - 1) : b] for a, b in pairwise(turns)]


def _label(axis: Axes, index: int, curve: JointTestCurve, specimens: int) -> None:
    _head_place(axis, index, curve.specimen, curve.test, curve.joint, specimens)
    axis.set_xlabel(f"{motion_of(curve.coordinate)} ({unit(curve.coordinate)})")
    axis.set_ylabel(load_axis(curve.coordinate))
    axis.xaxis.set_major_locator(MaxNLocator(5))
    axis.yaxis.set_major_locator(MaxNLocator(5))
    axis.tick_params(axis="y", length=2.5)
    axis.margins(x=0.06, y=0.08)
    axis.text(
        0.98,
        0.03,
        f"base off by {fixed(curve.off, 1)} SD",
        transform=axis.transAxes,
        ha="right",
        va="bottom",
        fontsize=SMALL_PT,
        color=INK[GREY],
        bbox={"facecolor": WHITE, "edgecolor": "none", "alpha": 0.8, "pad": 0.6},
        in_layout=False,
    )


def _head_place(
    axis: Axes, index: int, specimen: str, test: str, joint: str, specimens: int
) -> None:
    whose = f", {short(specimen, 14)}" if specimens > 1 else ""
    head(axis, index, f"{joint}{whose}\n{short(case(test), 34)}")


def _handles(lines: Sequence[str], unloaded: bool) -> list[Line2D | Patch]:
    word = "measured, loading" if unloaded else "measured"
    handles: list[Line2D | Patch] = [Line2D([], [], mfc=BLACK, label=word, **_DOT)]
    if unloaded:
        handles.append(Line2D([], [], mfc=WHITE, label="measured, unloading", **_DOT))
    handles.append(Patch(facecolor=GREY, alpha=0.3, lw=0, label="noise of the mean, 2 SD"))
    return handles + [Line2D([], [], label=LABELS[name], **_LINES[name]) for name in lines]


def _words(gap: pd.DataFrame, curves: Sequence[JointTestCurve], cohort: Cohort) -> str:
    places = len(driven_coordinates(gap))
    each = len(curves) == len({(curve.test, curve.joint) for curve in curves})
    whose = ", each in the specimen where it is worst" if len(cohort.specimen_names) > 1 else ""
    some = f"{len(curves)} of {count(places, 'curve')} (joint and test)"
    shown = some if each and places > len(curves) else "All curves"
    return (
        f"{shown} in the direction that the test drives, the base's farthest first"
        f"{whose if each else ''}; the load at the joint is that of the neutral pose.{_aside(gap)}"
    )


def _aside(gap: pd.DataFrame) -> str:
    """That the base is farther off in a coordinate that no load drives there, if it is."""
    rows = gap[gap["base"].notna() & (gap["noise_sd"] > 0.0)]
    drives = driven_coordinates(rows)
    off = {place: _off(part) for place, part in rows.groupby(PLACE[1:], sort=False)}
    most = max(off, key=lambda place: off[place])
    if most in drives or off[most] <= CLEARLY:
        return ""
    test, joint, coordinate = map(str, most)
    return (
        f" The base is farther off aside of the load: {joint}, {motion_of(coordinate)}, in "
        f"{case(test).lower()} (the gap along the load has it)."
    )


def gap_by_step_figure(study: Discrepancy, cohort: Cohort, tables: StudyTables) -> Figure:
    """A panel for each of the places where the base model is farthest off."""
    gap = tables["gap"]
    places = worst_places(gap)
    if not places:
        return saying("No motion can be shown: the base model has no pose.")
    lines = models_shown(gap)
    (panels,), figure = sections([(len(places), _STEPS_PANEL_MM)], _STEPS_KEY_MM)
    rows_of = [gap[(gap[PLACE] == list(place)).all(axis=1)] for place in places]
    for index, (axis, place) in enumerate(zip(panels, places, strict=True)):
        specimen, test, joint, coordinate = map(str, place)
        rows = rows_of[index].sort_values("step")
        _draw_steps(axis, rows, lines)
        _head_place(axis, index, specimen, test, joint, len(cohort.specimen_names))
        axis.set_ylabel(f"{AXIS[coordinate].lower()} ({unit(coordinate)})")
        axis.set_xlabel("load step")
        axis.xaxis.set_major_locator(MaxNLocator(6, integer=True))
        axis.tick_params(axis="y", length=2.5)
        # how far the joint moved: the size of the motion that the difference is a part of
        measured, of = rows["measured"].to_numpy(float), unit(coordinate)
        ends = (number(float(end), 2) for end in (measured.min(), measured.max()))
        reach = f"moved {' to '.join(ends)}{of if of == '°' else f' {of}'}"
        style: dict[str, Any] = {"va": "top", "fontsize": SMALL_PT, "color": INK[GREY]}
        axis.text(0.02, 1.0, reach, transform=axis.transAxes, in_layout=False, **style)
        axis.margins(y=0.18)
    words = "noise of the mean of the cycles, 95 %"
    handles: list[Line2D | Patch] = [Patch(facecolor=GREY, alpha=0.25, lw=0, label=words)]
    handles += [
        Line2D([], [], label=f"measured less {LABELS[name]}", **_STEP_LINES[name]) for name in lines
    ]
    worst = (rows_of[0]["measured"] - rows_of[0]["base"]) / rows_of[0]["noise_sd"]
    off = float(np.sqrt(np.nanmean(worst.to_numpy(float) ** 2)))
    words = (
        "The places where the base model is farthest off, each in the specimen where it is worst; "
        f"in a the base is off by {number(off, 2)} noise SD (root mean square)."
    )
    explain_marks(figure, handles, words, 4)
    return figure


def worst_places(gap: pd.DataFrame) -> list[tuple[Any, ...]]:
    """Places of the largest residual of the base in noise SD, of like places the worst specimen."""
    rows = gap[gap["base"].notna() & (gap["noise_sd"] > 0.0)]
    squares = ((rows["measured"] - rows["base"]) / rows["noise_sd"]) ** 2
    size = squares.groupby([rows[key] for key in PLACE], sort=False).mean().rename("size")
    ordered = size.sort_values(ascending=False, kind="stable").reset_index()
    like = ordered.drop_duplicates(PLACE[1:]).head(MOST_PLACES).reset_index()
    like = like[(like.index < FEWEST_PLACES) | (like["size"] > CLEARLY**2)]
    return [tuple(row) for row in like[PLACE].itertuples(index=False)]


def _draw_steps(axis: Axes, rows: pd.DataFrame, lines: Sequence[str]) -> None:
    x, measured = rows["step"].to_numpy(float), rows["measured"].to_numpy(float)
    band = 1.96 * rows["noise_sd"].to_numpy(float)
    axis.fill_between(x, -band, band, color=GREY, alpha=0.25, lw=0, zorder=1)
    axis.axhline(0.0, color=BLACK, lw=0.5, zorder=2)
    for name in lines:
        axis.plot(x, measured - rows[name].to_numpy(float), zorder=3, **_STEP_LINES[name])
    axis.set_xlim(float(x.min()) - 0.3, float(x.max()) + 0.3)
