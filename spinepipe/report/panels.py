"""Panels side by side that share their rows."""

import textwrap
from collections.abc import Mapping, Sequence

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from spinepipe.report.rows import Rows
from spinepipe.report.spread import BAR_PT
from spinepipe.report.style import GREY, blank

_ABOVE_AND_BELOW_MM = 14.0
_KEY_MM = 17.0
_CROWDED_MM = 4.2
_LINE_LENGTH = 150
_START_LINE: tuple[int, tuple[int, int]] = (0, (4, 2))


def row_height(rows: Rows, with_numbers_mm: float) -> float:
    """Height of a row, mm."""
    return with_numbers_mm if rows.with_numbers else _CROWDED_MM


def grid(n: int, rows: Rows, row_mm: float, most_across: int = 3) -> tuple[list[Axes], Figure]:
    """``n`` panels of the same rows, so many side by side at most, and their figure."""
    down = -(-n // most_across)
    across = -(-n // down)
    height = down * (len(rows) * row_mm + _ABOVE_AND_BELOW_MM) + _KEY_MM
    figure = blank(max(height, 45.0))
    axes = figure.subplots(down, across, squeeze=False)
    panels = list(axes.ravel())
    for spare in panels[n:]:
        spare.set_visible(False)
    return panels[:n], figure


def label_rows(axis: Axes, rows: Rows, below: float, above: float) -> None:
    """Names of the rows on the left panels; room for what is drawn below and above each row."""
    axis.set_ylim(-below, len(rows) - 1 + above)
    axis.set_yticks(range(len(rows)), rows.labels)
    place = axis.get_subplotspec()
    axis.tick_params(labelleft=place is None or place.is_first_col())
    axis.spines["left"].set_visible(False)


def head(axis: Axes, number: int, words: str) -> None:
    """Letter and heading of a panel."""
    axis.set_title(f"{chr(ord('a') + number)}   {words}")


def mark_start(axis: Axes, x: float) -> None:
    """The dashed line of the value that a fit starts from."""
    axis.axvline(x, color=GREY, lw=0.7, ls=_START_LINE, zorder=1)


def explain(figure: Figure, bars: Mapping[str, str], words: str, dashed: str = "") -> None:
    """Below the panels: what each colour is, what a dashed line is, and a few words more."""
    handles = [
        Line2D([], [], color=color, lw=BAR_PT, solid_capstyle="butt", label=meaning)
        for color, meaning in bars.items()
    ]
    if dashed:
        handles.append(Line2D([], [], color=GREY, lw=0.7, ls=_START_LINE, label=dashed))
    explain_marks(figure, handles, words, len(handles))


def explain_marks(
    figure: Figure, handles: Sequence[Line2D | Patch], words: str, across: int
) -> None:
    """Below the panels: a few words, and each mark with its label, so many side by side."""
    legend = figure.legend(
        handles=list(handles),
        title=textwrap.fill(words, _LINE_LENGTH),
        loc="outside lower center",
        ncols=across,
        fontsize=6.5,
        title_fontsize=6.0,
        handlelength=1.6,
        columnspacing=2.0,
        borderaxespad=0.2,
    )
    legend.get_title().set_multialignment("center")
