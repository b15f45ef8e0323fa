"""Figure: how far vertebrae are from the truth, level by level and approach by approach."""

from collections.abc import Mapping, Sequence

import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from spinepipe.cohort import Cohort
from spinepipe.motion.skeleton import BODIES, JOINTS
from spinepipe.report.panels import explain_marks, head, lines_of, log_ticks
from spinepipe.report.style import LineStyle, blank, saying
from spinepipe.report.words import capital, plain
from spinepipe.studies.tracking.error_metrics import SAGITTAL
from spinepipe.studies.tracking.figures.line_styles import (
    choose_approaches,
    key_of,
    persons_words,
    say_empty,
    styles_of_approaches,
    trials_of,
)
from spinepipe.studies.tracking.settings import Tracking

LEVELS = {"centre_mm": BODIES[1:], "angle_deg": JOINTS[SAGITTAL]}
"""Measures that are drawn, with their levels from below."""

LABELS = {
    "centre_mm": ("vertebral centres", "error of the centre (mm)"),
    "angle_deg": ("sagittal angles", "error of the sagittal angle (°)"),
}
NO_TRUTH = "Nothing can be shown: where vertebrae truly were is not known of any motion."
MOST_TRIALS = 3
_ROW_MM, _KEY_MM = 62.0, 18.0
_LOG_FROM = 12.0
"""Ratio of the largest to the least error from which an axis is logarithmic."""

_LEAST = {"centre_mm": 0.1, "angle_deg": 0.05}
"""Left end of a logarithmic axis at least, mm and deg."""


def error_by_level_figure(
    study: Tracking, cohort: Cohort, tables: Mapping[str, pd.DataFrame]
) -> Figure:
    """A line of panels for each trial, centres on the left and sagittal angles on the right."""
    rows = tables["errors"]
    rows = rows[rows["measure"].isin(list(LEVELS))] if len(rows) else rows
    if rows.empty:
        return saying(NO_TRUTH)
    names = choose_approaches(study, rows["approach"].unique(), 4)
    rows = rows[rows["approach"].isin(names)]
    looks = styles_of_approaches(names)
    trials = trials_of(rows)
    shown = trials[:MOST_TRIALS]
    figure = blank(len(shown) * _ROW_MM + _KEY_MM)
    lines = lines_of(figure, 2 * len(shown), 2)
    for k, (line, trial) in enumerate(zip(lines, shown, strict=True)):
        for axis, measure in zip(line, LEVELS, strict=True):
            index = 2 * k + list(LEVELS).index(measure)
            head(axis, index, f"{capital(plain(trial))}: {LABELS[measure][0]}")
            own = rows[rows["measure"] == measure]
            # panels of a measure share their axis: errors of all trials
            ends = float(own["mean"].min()), float(own["mean"].max())
            _panel(axis, own[own["trial"] == trial], measure, looks, ends)
    _explain(figure, looks, rows, len(trials) - len(shown))
    return figure


def _panel(
    axis: Axes,
    rows: pd.DataFrame,
    measure: str,
    looks: Mapping[str, LineStyle],
    ends: tuple[float, float],
) -> None:
    levels = LEVELS[measure]
    if rows.empty:
        say_empty(axis, "no truth is known")
        return
    for name, look in looks.items():
        own = rows[rows["approach"] == name]
        if len(own):
            _course(axis, own, levels, look)
    axis.set_yticks(range(len(levels)), levels)
    axis.tick_params(axis="y", labelsize=5.5)
    axis.set_ylim(-0.6, len(levels) - 0.4)
    axis.set_xlabel(LABELS[measure][1])
    if ends[1] > _LOG_FROM * max(ends[0], 1e-12):
        low = max(ends[0], _LEAST[measure])
        axis.set_xscale("log")
        axis.set_xlim(0.9 * low, 1.15 * ends[1])
        log_ticks(axis.xaxis, 0.9 * low, 1.15 * ends[1], 6)
    else:
        axis.set_xlim(0.0, 1.1 * ends[1])


def _course(axis: Axes, rows: pd.DataFrame, levels: Sequence[str], look: LineStyle) -> None:
    """Mean over persons from the lowest level up, and the range of persons."""
    by_level = rows.groupby("level", observed=True)["mean"]
    means = by_level.mean().reindex(list(levels))
    axis.plot(means.to_numpy(), range(len(levels)), **look.line(ms=2.6, zorder=3))
    if rows["specimen"].nunique() > 1:
        low, high = (ends.reindex(list(levels)) for ends in (by_level.min(), by_level.max()))
        axis.fill_betweenx(
            range(len(levels)), low.to_numpy(), high.to_numpy(), color=look.color, alpha=0.14, lw=0
        )


def _explain(figure: Figure, looks: dict[str, LineStyle], rows: pd.DataFrame, more: int) -> None:
    persons = int(rows["specimen"].nunique())
    words = persons_words(persons)
    if persons > 1:
        words += " Line: mean over persons of their mean error over time; band: range of persons."
    if more > 0:
        words += f" {more} more trials are not shown."
    explain_marks(figure, key_of(looks), words, 4)
