"""Figure: calibrated stiffness over all sampled joint poses, one panel per free coordinate."""

from dataclasses import dataclass
from math import log10
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullFormatter

from spinepipe.cohort import Cohort
from spinepipe.report.layout import grid, label_rows, row_height
from spinepipe.report.published import paper_of
from spinepipe.report.rows import EVERY_JOINT, Rows, rows_of
from spinepipe.report.spread import (
    KEY,
    Array,
    Quartiles,
    draw_bar,
    draw_density,
    draw_iqr,
    finite,
    quartiles,
)
from spinepipe.report.style import BLUE, GREY, VERMILLION, note, saying
from spinepipe.report.words import AXIS, count, number, percent, stiffness_unit
from spinepipe.statics.status import Status
from spinepipe.studies import JointPoseSensitivity
from spinepipe.units import COORDINATES, STIFFNESS_COLUMNS

AT_BOUND = 1e-4
"""Relative distance below which a stiffness stands at its bound."""

FARTHEST = 30.0
"""A start or bound is on the axis if it is within this factor of what was found."""


@dataclass(frozen=True)
class _Panel:
    """What one panel shows: a coordinate, its start and bounds, and the paper's quartiles."""

    coordinate: str
    column: str
    start: float
    low: float
    high: float
    paper: Quartiles | None

    def at_bound(self, values: Array) -> int:
        """How many of the values stand at a bound."""
        near = np.isclose(values, self.low, rtol=AT_BOUND) | np.isclose(
            values, self.high, rtol=AT_BOUND
        )
        return int(near.sum())


def stiffness_figure(
    study: JointPoseSensitivity, cohort: Cohort, calibrations: pd.DataFrame
) -> Figure:
    """Distribution of every fitted stiffness, with start, bounds and the paper's values."""
    usable = [status.value for status in Status if status.usable]
    solved = calibrations[calibrations["status"].isin(usable)]
    poses = len(calibrations[["specimen", "pose"]].drop_duplicates())
    if solved.empty:
        return saying(f"No stiffness was found for any of {count(poses, 'joint pose')}.")
    per_joint = study.calibration.grouping == "per_joint"
    joints = cohort.joint_names if per_joint else (EVERY_JOINT,)
    rows = rows_of(solved, cohort.specimen_names, joints)
    panels = [_panel(study, cohort, name) for name in COORDINATES if name in study.calibration.free]
    axes, figure = grid(len(panels), rows, row_height(rows, 20.0))
    for panel, axis in zip(panels, axes, strict=True):
        _draw(panel, axis, rows, solved)
    found = len(solved[["specimen", "pose"]].drop_duplicates())
    figure.supxlabel(_key(study, cohort, found, poses, rows), fontsize=6.5, color=GREY)
    return figure


def _key(study: JointPoseSensitivity, cohort: Cohort, found: int, poses: int, rows: Rows) -> str:
    solved = f"{count(found, 'joint pose')} of {poses:,} with a stiffness".replace(",", "\u2009")
    parts = [solved, rows.note, KEY]
    bounds = f"bounds: start ×/÷ {number(study.calibration.bound_factor)}"
    second = [f"dashed: start of the fit; {bounds}"]
    paper = paper_of(cohort.name)
    if paper:
        second.append(f"red: median and IQR of {paper[0]}")
    return "; ".join(part for part in parts if part) + "\n" + "; ".join(second)


def _panel(study: JointPoseSensitivity, cohort: Cohort, coordinate: str) -> _Panel:
    index = COORDINATES.index(coordinate)
    start = study.stiffness.in_order()[index]
    factor = study.calibration.bound_factor
    column = STIFFNESS_COLUMNS[index]
    paper = _paper(cohort, column)
    return _Panel(coordinate, column, start, start / factor, start * factor, paper)


def _paper(cohort: Cohort, column: str) -> Quartiles | None:
    found = paper_of(cohort.name)
    if found is None:
        return None
    reduced = found[1]["reduced_stiffness"]
    if column not in reduced["median"]:
        return None
    low, high = reduced["quartile_25"][column], reduced["quartile_75"][column]
    return Quartiles(low, reduced["median"][column], high, 0)


def _draw(panel: _Panel, axis: Axes, rows: Rows, solved: pd.DataFrame) -> None:
    axis.set_xscale("log")
    axis.set_title(f"{AXIS[panel.coordinate]} stiffness ({stiffness_unit(panel.coordinate)})")
    values = finite(solved[panel.column])
    _limit(axis, panel, values)
    if _shown(axis, panel.start):
        axis.axvline(panel.start, color=GREY, lw=0.7, ls=(0, (4, 2)), zorder=1)
    for bound in (panel.low, panel.high):
        if _shown(axis, bound):
            axis.axvline(bound, color=GREY, lw=0.9, ls=":", zorder=1)
    for y, frame in enumerate(rows.frames):
        _draw_row(panel, axis, y, finite(frame[panel.column]), frame, rows.with_numbers)
    if panel.paper is not None:
        draw_iqr(axis, panel.paper, -0.28, VERMILLION)
    label_rows(axis, rows, below=0.45, above=0.85)
    axis.text(1.0, 0.995, _shares(panel, solved), transform=axis.transAxes, fontsize=6.0,
              ha="right", va="top", color=GREY) if not rows.with_numbers else None  # fmt: skip


def _draw_row(
    panel: _Panel, axis: Axes, y: float, values: Array, frame: pd.DataFrame, with_numbers: bool
) -> None:
    inside = values[(values > panel.low * (1 + AT_BOUND)) & (values < panel.high * (1 - AT_BOUND))]
    draw_density(axis, inside, y + 0.1, 0.45, BLUE, logarithmic=True)
    found = draw_bar(axis, values, y, BLUE)
    if with_numbers:
        middle = f"median {number(found.median)} (IQR {number(found.low)}–{number(found.high)})"
        note(axis, 0.02, y + 0.72, middle, BLUE)
        note(axis, 0.02, y + 0.60, _shares(panel, frame), GREY)


def _shares(panel: _Panel, frame: pd.DataFrame) -> str:
    """Shares at a bound and not identifiable, of the solved fits."""
    values = finite(frame[panel.column])
    flags = frame[f"{panel.coordinate}_identifiable"]
    lost = int((flags == False).sum())  # noqa: E712  (None: held fixed)
    at = percent(panel.at_bound(values), len(values))
    return f"at a bound {at}, not identifiable {percent(lost, len(values))}, n = {len(values)}"


def _limit(axis: Axes, panel: _Panel, values: Array) -> None:
    """Limits around the middle 98 % of what was found, start and paper as far as they are near."""
    low, high = np.percentile(values, [1.0, 99.0])
    middle = quartiles(values)
    reach = FARTHEST * max(1.0, middle.high / middle.low)
    low, high = max(low, middle.low / reach), min(high, middle.high * reach)
    near: list[Any] = [panel.start]
    if panel.paper is not None:
        near += [panel.paper.low, panel.paper.high]
    near = [x for x in near if low / FARTHEST < x < high * FARTHEST]
    low, high = min([low, *near]), max([high, *near])
    margin = 10 ** max(0.06, 0.07 * log10(high / low))
    axis.set_xlim(low / margin, high * margin)
    axis.xaxis.set_major_locator(LogLocator(subs=_ticks(low / margin, high * margin)))
    axis.xaxis.set_minor_locator(LogLocator(subs=range(1, 10)))
    axis.xaxis.set_major_formatter(lambda x, _: number(x))
    axis.xaxis.set_minor_formatter(NullFormatter())


def _ticks(low: float, high: float) -> tuple[float, ...]:
    decades = log10(high / low)
    if decades < 0.7:
        return tuple(float(x) for x in range(1, 10)) if decades > 0.3 else _FINE
    return (1.0, 2.0, 5.0) if decades < 1.7 else (1.0,)


_FINE = tuple(1.0 + 0.2 * step for step in range(45))


def _shown(axis: Axes, x: float) -> bool:
    low, high = axis.get_xlim()
    return bool(low < x < high)
