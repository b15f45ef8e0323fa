"""Panels side by side that share their rows."""

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from spinepipe.report.rows import Rows
from spinepipe.report.style import blank

MOST_PANELS_ACROSS = 4
_ABOVE_AND_BELOW_MM = 14.0
_KEY_MM = 8.0
_CROWDED_MM = 3.6


def row_height(rows: Rows, with_numbers_mm: float) -> float:
    """Height of a row, mm."""
    return with_numbers_mm if rows.with_numbers else _CROWDED_MM


def grid(n: int, rows: Rows, row_mm: float) -> tuple[list[Axes], Figure]:
    """``n`` panels of the same rows, at most four side by side, and their figure."""
    down = -(-n // MOST_PANELS_ACROSS)
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
