"""Figure: computed against measured pressure of the disc L4L5, by what was fitted."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from spinepipe.cohort import Cohort
from spinepipe.report.panels import explain_marks, head
from spinepipe.report.style import BLACK, BLUE, GREEN, GREY, VERMILLION, WHITE, blank, note, saying
from spinepipe.report.words import fixed, plain
from spinepipe.studies.trunk_loads.figures.line_styles import scale, task_label
from spinepipe.studies.trunk_loads.selection import sound
from spinepipe.studies.trunk_loads.settings import TrunkLoads
from spinepipe.studies.trunk_loads.tables import TIERS
from spinepipe.studies.trunk_loads.words import ENDED
from spinepipe.studies.trunk_loads.words import TIERS as FITTED

COLORS = dict(zip(TIERS, (BLUE, VERMILLION, GREEN), strict=True))
MARKERS = dict(zip(TIERS, ("o", "s", "^"), strict=True))

_SQUARE_MM, _ROW_MM, _AROUND_MM, _KEY_MM = 62.0, 7.0, 16.0, 17.0
_BESIDE = {"untuned": 0.24, "tuned": 0.0, "left_out": -0.24}
"""Where a tier stands in the row of a task."""

_NEAR_PT = 5.5
_AROUND = tuple((np.cos(a * np.pi), np.sin(a * np.pi)) for a in (0.75, 1.0, 1.25, 1.75, 2.0, 2.25))
"""Directions in which a number may stand from its point, up and left first, intervals spared."""


@dataclass(frozen=True, eq=False)
class PersonPanel:
    """What is drawn of one person.

    Attributes
    ----------
    rows : of pressures. tasks : in the order of measured pressure. tiers : those there are.
    ends : low and high of the nominal pressure by task, where it was sampled.
    """

    rows: pd.DataFrame
    tasks: tuple[str, ...]
    tiers: tuple[str, ...]
    ends: Mapping[str, tuple[float, float]]

    @property
    def top(self) -> float:
        """Where axes end, MPa."""
        values = self.rows[["measured_mpa", "computed_mpa"]].to_numpy(float)
        highs = [high for _, high in self.ends.values()]
        return 1.08 * float(np.nanmax([*values.ravel(), *highs, 0.1]))


def pressure_against_measured_figure(
    study: TrunkLoads, cohort: Cohort, tables: Mapping[str, pd.DataFrame]
) -> Figure:
    """A square for each tier, and below them a row for each task."""
    rows = tables["pressures"]
    if rows["computed_mpa"].isna().all():
        return saying("No pressure was computed for a task whose pressure was measured.")
    compared = _compared(rows, tables.get("intervals", pd.DataFrame()))
    below = _ROW_MM * len(compared.tasks) + _AROUND_MM
    figure = blank(_SQUARE_MM + below + _KEY_MM)
    grid = figure.add_gridspec(2, len(TIERS), height_ratios=[_SQUARE_MM, below])
    for index, tier in enumerate(compared.tiers):
        axis = figure.add_subplot(grid[0, index])
        head(axis, index, plain(tier))
        _square(axis, compared, tier, _agreement(tables["agreement"], tier))
    figure.axes[0].set_ylabel("computed (MPa)")
    listed = figure.add_subplot(grid[1, :])
    head(listed, len(compared.tiers), "The same by task")
    _list(listed, compared)
    _explain(figure, compared)
    figure.draw_without_rendering()
    for axis, tier in zip(figure.axes, compared.tiers, strict=False):
        _number(axis, compared, tier)
    return figure


def _compared(rows: pd.DataFrame, intervals: pd.DataFrame) -> PersonPanel:
    order = rows.drop_duplicates("task").sort_values("measured_mpa", kind="stable")["task"]
    tiers = tuple(tier for tier in TIERS if (rows["tier"] == tier).any())
    ends = {}
    if len(intervals):
        own = intervals[intervals["specimen"].isin(rows["specimen"])]
        own = own[own["quantity"] == "l4l5_pressure_mpa"].dropna(subset=["low", "high"])
        ends = {
            str(task): (float(low), float(high))
            for task, low, high in zip(own["task"], own["low"], own["high"], strict=True)
            if task in set(order)
        }
    return PersonPanel(rows, tuple(order), tiers, ends)


def _agreement(agreement: pd.DataFrame, tier: str) -> str:
    """r with its interval, and the error, in words."""
    rows = agreement[agreement["tier"] == tier]
    if rows.empty or rows["rmse_mpa"].isna().all():
        return "no task counted"
    row = rows.iloc[0]
    told = [f"{int(row['n_tasks'])} tasks counted"]
    if pd.notna(row["r"]):
        known = pd.notna(row["r_low"]) and pd.notna(row["r_high"])
        ends = f" ({fixed(row['r_low'])} to {fixed(row['r_high'])})" if known else ""
        told.append(f"r {fixed(row['r'])}{ends}")
    told.append(f"off by {fixed(row['rmse_mpa'])} MPa")
    return "\n".join(told)


def _square(axis: Axes, compared: PersonPanel, tier: str, words: str) -> None:
    """Points beside the line on which both pressures are the same."""
    top = compared.top
    axis.plot([0.0, top], [0.0, top], color=GREY, lw=0.7, zorder=1)
    rows = _of_tier(compared, tier)
    for row in rows.to_dict("records"):
        x, y = float(row["measured_mpa"]), float(row["computed_mpa"])
        if tier == "untuned" and row["task"] in compared.ends:
            axis.plot([x, x], compared.ends[row["task"]], color=COLORS[tier], lw=0.9, zorder=2)
        axis.plot([x], [y], **_mark(tier, row), zorder=3)
    axis.set_xlim(0.0, top)
    axis.set_ylim(0.0, top)
    axis.set_aspect("equal", adjustable="box")
    axis.set_xlabel("measured (MPa)")
    scale(axis)
    axis.text(0.97, 0.03, words, transform=axis.transAxes, ha="right", va="bottom", fontsize=6.0)


def _of_tier(compared: PersonPanel, tier: str) -> pd.DataFrame:
    rows = compared.rows[compared.rows["tier"] == tier]
    return rows.dropna(subset=["computed_mpa"]).sort_values("measured_mpa", kind="stable")


def _mark(tier: str, row: Mapping[Any, Any]) -> dict[str, Any]:
    """Filled where it counts, a cross where the forces are not to be trusted."""
    marker = MARKERS[tier] if bool(sound(pd.DataFrame([dict(row)])).iloc[0]) else "X"
    face = COLORS[tier] if row["counted"] else WHITE
    return {"marker": marker, "ls": "", "ms": 4.2, "mec": COLORS[tier], "mfc": face, "mew": 0.9}


def _number(axis: Axes, compared: PersonPanel, tier: str) -> None:
    """The number of each task near its point, where the others leave room."""
    rows = _of_tier(compared, tier)
    points = axis.transData.transform(rows[["measured_mpa", "computed_mpa"]].to_numpy(float))
    pt = axis.figure.dpi / 72.0
    taken = list(points)
    for task, point in zip(rows["task"], points, strict=True):
        options = [
            point + pt * _NEAR_PT * far * np.array(way) for far in (1.0, 1.9) for way in _AROUND
        ]
        others = [other for other in taken if other is not point]
        room = [min(np.linalg.norm(spot - other) for other in others or [spot]) for spot in options]
        least = pt * _NEAR_PT
        chosen = next((k for k, far in enumerate(room) if far > least), int(np.argmax(room)))
        spot = options[chosen]
        taken.append(spot)
        x, y = axis.transData.inverted().transform(spot)
        number = str(compared.tasks.index(str(task)) + 1)
        axis.text(x, y, number, fontsize=5.5, ha="center", va="center", in_layout=False, zorder=5)


def _list(axis: Axes, compared: PersonPanel) -> None:
    """Measured and computed pressure of each task on a line."""
    names = list(compared.tasks)[::-1]
    for y, task in enumerate(names):
        rows = compared.rows[compared.rows["task"] == task]
        first = rows.iloc[0]
        face = BLACK if first["counted"] else WHITE
        axis.axhline(y - 0.5, color=GREY, lw=0.2, zorder=0)
        axis.plot([first["measured_mpa"]], [y], "D", mec=BLACK, mfc=face, ms=4.6, mew=0.9, zorder=3)
        if task in compared.ends:
            at = y + _BESIDE["untuned"]
            axis.plot(compared.ends[task], [at, at], color=COLORS["untuned"], lw=0.9, zorder=2)
        for row in rows.to_dict("records"):
            _place(axis, y, row)
    labels = [f"{len(names) - y}  {task_label(task)}" for y, task in enumerate(names)]
    axis.set_yticks(range(len(names)), labels)
    axis.set_ylim(-0.55, len(names) - 0.45)
    axis.set_xlim(0.0, compared.top)
    axis.set_xlabel("pressure in the disc L4L5 (MPa)")
    axis.spines["left"].set_visible(False)


def _place(axis: Axes, y: float, row: Mapping[Any, Any]) -> None:
    tier, value = str(row["tier"]), row["computed_mpa"]
    at = y + _BESIDE[tier]
    if pd.notna(value):
        axis.plot([value], [at], **_mark(tier, row), zorder=4)
    elif tier == TIERS[0]:
        ended = ENDED.get(str(row["status"]), plain(str(row["status"])))
        note(axis, 0.99, y, f"{ended}: no pressure", GREY, ha="right")


def _explain(figure: Figure, compared: PersonPanel) -> None:
    look: dict[str, Any] = {"ls": "", "ms": 4.2, "mew": 0.9}
    handles = [Line2D([], [], marker="D", color=BLACK, **look, label="measured")]
    handles += [
        Line2D([], [], marker=MARKERS[t], color=COLORS[t], **look, label=f"{plain(t)}: {FITTED[t]}")
        for t in compared.tiers
    ]
    explain_marks(figure, handles, " ".join(_words(compared)), len(handles))


def _words(compared: PersonPanel) -> Sequence[str]:
    words = []
    if not compared.rows["counted"].all():
        words.append("Hollow: does not count, as the measured value is not confirmed.")
    if compared.ends:
        words.append("Line: middle 95 % of samples of the inputs, nothing fitted.")
    computed = compared.rows.dropna(subset=["computed_mpa"])
    if not sound(computed).all():
        words.append("Cross: forces did not settle, or do not hold the task.")
    return words
