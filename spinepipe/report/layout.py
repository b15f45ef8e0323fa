"""Panels side by side that share their rows."""

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from spinepipe.report.rows import Rows
from spinepipe.report.style import blank

MOST_PANELS_ACROSS = 3
_ABOVE_AND_BELOW_MM = 14.0
_KEY_MM = 8.0
_CROWDED_MM = 3.6


def row_height(rows: Rows, with_numbers_mm: float) -> float:
    """Height of a row, mm."""
    return with_numbers_mm if rows.with_numbers else _CROWDED_MM


def grid(n: int, rows: Rows, row_mm: float) -> tuple[list[Axes], Figure]:
    """``n`` panels of the same rows, at most three side by side, and their figure."""
    across = min(n, MOST_PANELS_ACROSS)
    down = -(-n // across)
    height = down * (len(rows) * row_mm + _ABOVE_AND_BELOW_MM) + _KEY_MM
    figure = blank(max(height, 45.0))
    axes = figure.subplots(down, across, squeeze=False, sharey=True)
    panels = list(axes.ravel())
    for spare in panels[n:]:
        spare.set_visible(False)
    return panels[:n], figure


def label_rows(axis: Axes, rows: Rows, below: float = 0.5, above: float = 0.85) -> None:
    """Names of the rows on the left; room for what is drawn below and above each."""
    axis.set_ylim(-below, len(rows) - 1 + above)
    axis.set_yticks(range(len(rows)), rows.labels)
    axis.spines["left"].set_visible(False)
