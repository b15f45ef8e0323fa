"""Figure: residuals of motion that no fit has seen, fold by fold."""

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import FuncFormatter, MaxNLocator

from spinepipe.cohort import Cohort
from spinepipe.report.marks import finite
from spinepipe.report.panels import explain_marks, head, log_ticks, side_by_side
from spinepipe.report.style import BLACK, GREY, OURS, THEIRS, blank, note, saying
from spinepipe.report.words import plain, short
from spinepipe.studies.discrepancy.settings import Discrepancy
from spinepipe.tables import Tables

KINDS = {"specimen": "One specimen left out", "test": "One test left out"}
MODELS = {
    "rms_base": (THEIRS, "s", 6.0, "base model"),
    "rms_surrogate": (GREY, "D", 4.0, "generic surrogate without physics"),
    "rms_with_effects": (OURS, "o", 3.6, "with the effects"),
}
"""Colour, shape, size (pt) and words of each model; what lies below is larger."""

_ROW_MM, _AROUND_MM, _KEY_MM = 5.2, 20.0, 14.0
_WIDE = 8.0
"""Residuals that differ by more than this factor are drawn on a logarithmic axis."""


def gap_held_out_figure(study: Discrepancy, cohort: Cohort, tables: Tables) -> Figure:
    """A panel for left-out specimens and one for left-out tests; a row for each fold."""
    rows = tables["held_out"]
    kinds = [kind for kind in KINDS if (rows["kind"] == kind).any()]
    added = not rows["rms_base"].fillna(0.0).equals(rows["rms_with_effects"].fillna(0.0))
    shown = {name: how for name, how in MODELS.items() if added or name != "rms_with_effects"}
    values = np.concatenate([finite(rows[name]) for name in shown])
    if not kinds or not len(values):
        return saying("No held-out motion can be shown: nothing was left out, or no fit ended.")
    longest = max(int((rows["kind"] == kind).sum()) for kind in kinds)
    figure = blank(longest * _ROW_MM + _AROUND_MM + _KEY_MM)
    axes = side_by_side(figure, len(kinds), len(kinds))
    for index, (axis, kind) in enumerate(zip(axes, kinds, strict=True)):
        head(axis, index, KINDS[kind])
        folds = rows[rows["kind"] == kind].iloc[::-1]
        _draw(axis, folds, list(shown))
        axis.set_ylim(len(folds) - longest - 0.7, len(folds) - 0.3)
        _scale(axis, values)
    handles = [
        Line2D([], [], color=color, marker=shape, ms=size, lw=0, label=words)
        for color, shape, size, words in shown.values()
    ]
    handles.append(Line2D([], [], color=BLACK, lw=0.8, ls="--", label="only noise"))
    explain_marks(figure, handles, _words(added), len(handles))
    return figure


def _draw(axis: Axes, rows: pd.DataFrame, names: list[str]) -> None:
    for y, row in enumerate(rows.to_dict("records")):
        found = finite([row[name] for name in names])
        if not len(found):
            note(axis, 0.02, y, f"no result: {row['message'] or row['status']}")
            continue
        axis.plot([found.min(), found.max()], [y, y], color=GREY, lw=0.6, zorder=2)
        for name in names:
            color, shape, size, _ = MODELS[name]
            axis.plot([row[name]], [y], shape, color=color, ms=size, mew=0.0, zorder=4)
    axis.axvline(1.0, color=BLACK, lw=0.8, ls="--", zorder=1)
    axis.set_yticks(
        range(len(rows)),
        [_name(fold, kind) for fold, kind in zip(rows["fold"], rows["kind"], strict=True)],
    )
    axis.spines["left"].set_visible(False)
    axis.set_xlabel("root mean square residual (noise SD)")


def _name(fold: str, kind: str) -> str:
    return short(plain(fold.removeprefix(f"{kind} ").removeprefix(f"{kind}=")), 24)


def _scale(axis: Axes, values: np.ndarray) -> None:
    low, high = min(1.0, float(values.min())), max(1.0, float(values.max()))
    if high > _WIDE * low and low > 0.0:
        axis.set_xscale("log")
        axis.set_xlim(low / 1.25, high * 1.25)
        log_ticks(axis.xaxis, low / 1.25, high * 1.25, 6)
        return
    axis.set_xlim(0.0, 1.08 * high)
    axis.xaxis.set_major_locator(MaxNLocator(6))
    axis.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))


def _words(added: bool) -> str:
    told = (
        "Left out and then predicted. 1: noise alone; what posture, frames and loads leave open "
        "may add a little."
    )
    return told if added else f"{told} No effect was added: there is one model."
