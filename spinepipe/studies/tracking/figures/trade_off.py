"""Figure: what it does to count loads more or less beside markers."""

from collections.abc import Mapping
from typing import Any

import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from spinepipe.cohort import Cohort
from spinepipe.effects.contract import Array
from spinepipe.report.panels import explain_marks, head, log_ticks, side_by_side
from spinepipe.report.style import BLACK, SMALL_PT, WHITE, LineStyle, blank, saying
from spinepipe.report.words import plain, tick
from spinepipe.status import Status
from spinepipe.studies.tracking.figures.line_styles import (
    say_empty,
    show_ticks,
    styles_of,
    trials_of,
)
from spinepipe.studies.tracking.settings import Tracking

ERRORS = {"centre_mm": ("Errors of centres", "mm"), "angle_deg": ("Errors of sagittal angles", "°")}
MOST_TRIALS = 5
_HEIGHT_MM, _KEY_MM = 58.0, 17.0


def trade_off_figure(study: Tracking, cohort: Cohort, tables: Mapping[str, pd.DataFrame]) -> Figure:
    """Markers against loads on the left, errors by weight beside it where the truth is known."""
    rows = tables["weights"]
    rows = rows.dropna(subset=["marker_rmse_mm", "load_rms_nm"]) if len(rows) else rows
    if rows.empty:
        return saying("Nothing can be shown: no weight was tried, or no fit found a posture.")
    trials = trials_of(rows)
    looks = styles_of(trials[:MOST_TRIALS])
    figure = blank(_HEIGHT_MM + _KEY_MM)
    axes = side_by_side(figure, 1 + len(ERRORS), 1 + len(ERRORS))
    _against(axes[0], rows, looks)
    for index, (axis, column) in enumerate(zip(axes[1:], ERRORS, strict=True), start=1):
        _errors(axis, index, rows, column, looks)
    _explain(figure, rows, looks, len(trials))
    return figure


def _against(axis: Axes, rows: pd.DataFrame, looks: Mapping[str, LineStyle]) -> None:
    head(axis, 0, "Markers against loads")
    for name, look in looks.items():
        own = rows[rows["trial"] == name].sort_values("ratio")
        x, y = own["load_rms_nm"].to_numpy(float), own["marker_rmse_mm"].to_numpy(float)
        _course(axis, own, x, y, look)
        for k in sorted({0, len(own) - 1}):
            at = (3.0, 2.0) if k else (3.0, -5.0)
            words = f"×{tick(float(own['ratio'].iloc[k]))}"
            axis.annotate(words, (x[k], y[k]), at, textcoords="offset points", fontsize=SMALL_PT)
    axis.set_xlabel("moment of muscles, RMS (N m)")
    axis.set_ylabel("markers off, RMS (mm)")
    axis.set_xlim(0.0, 1.15 * float(rows["load_rms_nm"].max()))
    axis.set_ylim(0.0, 1.12 * float(rows["marker_rmse_mm"].max()))
    show_ticks(axis)


def _errors(
    axis: Axes, index: int, rows: pd.DataFrame, column: str, looks: Mapping[str, LineStyle]
) -> None:
    title, unit = ERRORS[column]
    known = rows.dropna(subset=[column])
    if known.empty:
        say_empty(axis, f"{title.lower()}:\nno truth is known")
        return
    head(axis, index, title)
    for name, look in looks.items():
        own = known[known["trial"] == name].sort_values("ratio")
        _course(axis, own, own["ratio"].to_numpy(float), own[column].to_numpy(float), look)
    ends = 0.8 * float(rows["ratio"].min()), 1.25 * float(rows["ratio"].max())
    axis.set_xscale("log")
    axis.set_xlim(*ends)
    log_ticks(axis.xaxis, *ends, most=5)
    axis.set_xlabel("weight of loads over that of the study (–)")
    axis.set_ylabel(f"mean error ({unit})")
    axis.set_ylim(0.0, 1.12 * float(known[column].max()))
    show_ticks(axis)


def _course(axis: Axes, rows: pd.DataFrame, x: Array, y: Array, look: LineStyle) -> None:
    """A line through the weights, hollow where a fit did not settle, a ring at the study's own."""
    axis.plot(x, y, **look.line(marker="", zorder=2))
    places = zip(x, y, rows["ratio"], rows["status"] == Status.CONVERGED.value, strict=True)
    for at, height, ratio, sound in places:
        axis.plot([at], [height], **look.line(not sound, ls="", zorder=3))
        if ratio == 1.0:
            axis.plot([at], [height], "o", mfc="none", mec=BLACK, ms=7.0, mew=0.7, zorder=4)


def _explain(
    figure: Figure, rows: pd.DataFrame, looks: Mapping[str, LineStyle], trials: int
) -> None:
    handles = [Line2D([], [], **look.line(), label=plain(name)) for name, look in looks.items()]
    ring: dict[str, Any] = {"marker": "o", "ls": "", "mfc": "none", "mec": BLACK, "ms": 6.0}
    handles.append(Line2D([], [], **ring, label="the study's weight"))
    if (rows["status"] != Status.CONVERGED.value).any():
        ring |= {"mfc": WHITE, "ms": 3.4}
        handles.append(Line2D([], [], **ring, label="not settled"))
    words = f"Person: {rows['specimen'].iloc[0]}, dynamics with generic passive elements."
    if trials > len(looks):
        words += f" The first {len(looks)} of {trials} trials."
    explain_marks(figure, handles, words, 6)
