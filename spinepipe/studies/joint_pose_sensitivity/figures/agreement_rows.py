"""Bias and limits of agreement of many joints: a row for each, without the readings."""

import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from spinepipe.cohort import Cohort
from spinepipe.report.layout import explain, grid, head, label_rows, row_height
from spinepipe.report.rounding import rounded
from spinepipe.report.rows import Rows, rows_of
from spinepipe.report.style import BLACK, GREY, OURS
from spinepipe.report.words import AXIS, unit
from spinepipe.units import COORDINATES

_NUMBERS = ["lower_limit", "upper_limit", "bias_low", "bias_high", "bias"]


def draw_rows(cohort: Cohort, known: pd.DataFrame, settled: str = "") -> Figure:
    """A panel per coordinate: bias with its interval on a line from limit to limit.

    ``settled`` is what is to be said where motion was not simulated at rest, or nothing.
    """
    names = [name for name in COORDINATES if name in set(known["coordinate"])]
    rows = rows_of(known, cohort.specimen_names, cohort.joint_names)
    axes, figure = grid(len(names), rows, row_height(rows, 8.0))
    for index, (name, axis) in enumerate(zip(names, axes, strict=True)):
        head(axis, index, AXIS[name])
        _draw(name, axis, rows)
    bars = {OURS: "limits of agreement (bias ± 1.96 SD)", BLACK: "bias with 95 % interval"}
    told = ("Reduced poses with their own stiffness.", rows.note and f"{rows.note}.", settled)
    explain(figure, bars, " ".join(words for words in told if words))
    return figure


def _draw(name: str, axis: Axes, rows: Rows) -> None:
    axis.axvline(0.0, color=GREY, lw=0.6, zorder=1)
    for y, frame in enumerate(rows.frames):
        here = frame[frame["coordinate"] == name]
        alpha = 1.0 if len(here) == 1 else 0.35
        for _, row in here.iterrows():
            low, high, bias_low, bias_high, bias = rounded(row[_NUMBERS])
            axis.plot([low, high], [y, y], color=OURS, lw=2.5, alpha=alpha, solid_capstyle="butt")
            axis.plot([bias_low, bias_high], [y, y], color=BLACK, lw=1.2, zorder=4)
            axis.plot([bias], [y], "|", color=BLACK, ms=5.0, mew=1.0, zorder=5)
    label_rows(axis, rows, below=0.6, above=0.6)
    axis.xaxis.set_major_locator(MaxNLocator(4))
    axis.set_xlabel(f"predicted less measured ({unit(name)})")
