"""Figure: calibrated stiffness over all sampled joint poses, one panel per free coordinate."""

from collections.abc import Mapping
from dataclasses import dataclass
from math import log10
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from spinepipe.cohort import Cohort
from spinepipe.report.glyphs import (
    KEY,
    Array,
    Quartiles,
    draw_bar,
    draw_density,
    draw_iqr,
    finite,
    quartiles,
)
from spinepipe.report.panels import (
    EVERY_JOINT,
    PanelRows,
    explain,
    grid,
    head,
    label_rows,
    log_ticks,
    mark_start,
    row_height,
    rows_of,
)
from spinepipe.report.style import GREY, OURS, THEIRS, note, saying
from spinepipe.report.words import AXIS, count, number, percent, stiffness_unit
from spinepipe.status import USABLE
from spinepipe.studies.joint_pose_sensitivity.findings_of_stiffness import MOSTLY
from spinepipe.studies.joint_pose_sensitivity.gould_2024a import GOULD_2024A, stiffness_quartiles
from spinepipe.studies.joint_pose_sensitivity.settings import JointPoseSensitivity
from spinepipe.studies.joint_pose_sensitivity.tables import region_columns
from spinepipe.units import COORDINATES, STIFFNESS_COLUMNS

AT_BOUND = 1e-4
"""Relative distance below which a stiffness stands at its bound."""

FARTHEST = 10.0
"""A start or bound is on the axis if it is within this factor of what was found."""

_PAPER_Y = -0.26


def stiffness_figure(
    study: JointPoseSensitivity, cohort: Cohort, tables: Mapping[str, pd.DataFrame]
) -> Figure:
    """Distribution of every fitted stiffness, with start, bounds and the paper's values."""
    calibrations = tables["calibrations"]
    solved = calibrations[calibrations["status"].isin(USABLE)]
    poses = len(calibrations[["specimen", "pose"]].drop_duplicates())
    if solved.empty:
        return saying(f"No stiffness was found for any of {count(poses, 'joint pose')}.")
    per_joint = study.calibration.grouping == "per_joint"
    joints = cohort.joint_names if per_joint else (EVERY_JOINT,)
    rows = rows_of(solved, cohort.specimen_names, joints)
    panels = []
    for name, column, start in zip(
        COORDINATES, STIFFNESS_COLUMNS, study.stiffness.in_order(), strict=True
    ):
        published, factor = stiffness_quartiles(cohort.name, column), study.calibration.bound_factor
        quartiles_of_paper = published and Quartiles(*published, 0)
        if name in study.calibration.free:
            ends = start / factor, start * factor
            panels.append(_StiffnessPanel(name, column, start, *ends, quartiles_of_paper))
    axes, figure = grid(len(panels), rows, row_height(rows, 22.0))
    for index, (panel, axis) in enumerate(zip(panels, axes, strict=True)):
        head(axis, index, AXIS[panel.coordinate])
        _draw(panel, axis, rows, solved)
    found = len(solved[["specimen", "pose"]].drop_duplicates())
    bars = {OURS: "calibrated, over all sampled joint poses"}
    paper = GOULD_2024A.beside(cohort.name)
    if paper:
        bars[THEIRS] = f"{paper[0]}, {paper[1]['counts']['pose_samples_reduced']} poses"
    words = _words(study.calibration.bound_factor, found, poses, rows)
    explain(figure, bars, words, dashed="start of the fit")
    return figure


@dataclass(frozen=True)
class _StiffnessPanel:
    """What one panel shows: a coordinate, its start and bounds, and the paper's quartiles."""

    coordinate: str
    column: str
    start: float
    low: float
    high: float
    paper: Quartiles | None

    def inside(self, values: Array) -> Array:
        """The values that do not stand at a bound."""
        above, below = self.low * (1.0 + AT_BOUND), self.high * (1.0 - AT_BOUND)
        return values[(values > above) & (values < below)]


def _draw(panel: _StiffnessPanel, axis: Axes, rows: PanelRows, solved: pd.DataFrame) -> None:
    axis.set_xscale("log")
    axis.set_xlabel(f"stiffness ({stiffness_unit(panel.coordinate)})")
    values = finite(solved[panel.column])
    _limit(axis, panel, values)
    mark_start(axis, panel.start)
    for bound in (panel.low, panel.high):
        axis.axvline(bound, color=GREY, lw=0.9, ls=":", zorder=1)
    for y, frame in enumerate(rows.frames):
        _draw_row(panel, axis, y, frame, rows.with_numbers)
    if panel.paper is not None:
        draw_iqr(axis, panel.paper, _PAPER_Y, THEIRS)
        note(axis, 0.02, _PAPER_Y - 0.15, _median_and_iqr(panel.paper), THEIRS)
    label_rows(
        axis, rows, below=0.55 if panel.paper else 0.35, above=0.9 if rows.with_numbers else 1.7
    )
    if not rows.with_numbers:
        note(axis, 0.02, len(rows) + 0.25, _shares(panel, solved), GREY)


def _limit(axis: Axes, panel: _StiffnessPanel, values: Array) -> None:
    """Limits around the middle 98 % of what was found, start and paper as far as they are near."""
    inside = panel.inside(values)
    low, high = np.percentile(inside if len(inside) else values, [1.0, 99.0])
    middle = quartiles(values)
    reach = FARTHEST * middle.high / middle.low
    near_low, near_high = max(low, middle.low / reach), min(high, middle.high * reach)
    if near_low < near_high:  # else the few inside the bounds lie far from the quartiles
        low, high = near_low, near_high
    near: list[Any] = [panel.start]
    if panel.paper is not None:
        near += [panel.paper.low, panel.paper.high]
    near = [x for x in near if low / FARTHEST < x < high * FARTHEST]
    low, high = min([low, *near]), max([high, *near])
    margin = 10 ** max(0.06, 0.07 * log10(high / low))
    axis.set_xlim(low / margin, high * margin)
    log_ticks(axis.xaxis, low / margin, high * margin)


def _draw_row(
    panel: _StiffnessPanel, axis: Axes, y: int, frame: pd.DataFrame, with_numbers: bool
) -> None:
    """Hill and bar of the fits; grey and without a median where the data do not hold most."""
    values = finite(frame[panel.column])
    held = _lost(panel, frame) <= MOSTLY * len(values)
    color = OURS if held else GREY
    draw_density(axis, panel.inside(values), y + 0.1, 0.42, color, logarithmic=True)
    found = draw_bar(axis, values, y, color)
    if not with_numbers:
        return
    if held:
        told = _median_and_iqr(found)
    else:  # how low the stiffness may be is all that is known of it
        lower = finite(frame[region_columns(panel.coordinate)[1]])
        told = "not held by the data"
        if len(lower):
            of_ends = quartiles(lower)
            told = f"not held; above {number(of_ends.low)}–{number(of_ends.high)} (IQR)"
    note(axis, 0.02, y + 0.78, told, color)
    note(axis, 0.02, y + 0.65, _shares(panel, frame), GREY)
    # where fits ended at a bound beyond the axis, say at its edge how many and where it is
    ends = axis.get_xlim()
    for bound, x, words in ((panel.low, 0.0, "← {} at {}"), (panel.high, 1.0, "{} at {} →")):
        there = int(np.isclose(values, bound, rtol=AT_BOUND).sum())
        if there and not ends[0] < bound < ends[1]:
            told = words.format(percent(there, len(values)), number(bound))
            note(axis, x, y - 0.125, told, OURS, ha="right" if x else "left")


def _lost(panel: _StiffnessPanel, frame: pd.DataFrame) -> int:
    """Fits that do not identify the stiffness."""
    flags = frame[f"{panel.coordinate}_identifiable"]
    return int((flags == False).sum())  # noqa: E712  (None: held fixed)


def _median_and_iqr(found: Quartiles) -> str:
    return f"median {number(found.median)} (IQR {number(found.low)}–{number(found.high)})"


def _shares(panel: _StiffnessPanel, frame: pd.DataFrame) -> str:
    """Shares at a bound and not identifiable, of the solved fits."""
    values = finite(frame[panel.column])
    at = percent(len(values) - len(panel.inside(values)), len(values))
    lost = percent(_lost(panel, frame), len(values))
    return f"at a bound {at}, not identifiable {lost}, n = {len(values)}"


def _words(bound_factor: float, found: int, poses: int, rows: PanelRows) -> str:
    solved = f"{count(found, 'joint pose')} of {poses} with a stiffness"
    parts = (solved, rows.note, KEY, f"bounds: start times and divided by {number(bound_factor)}")
    return "; ".join(part for part in parts if part) + "."
