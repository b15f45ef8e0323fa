"""Grids of numbers as colours, with the number in each cell where there is room."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LinearSegmentedColormap, Normalize
from matplotlib.image import AxesImage
from matplotlib.patches import Patch, Rectangle
from numpy.typing import NDArray

from spinepipe.report.spread import Array
from spinepipe.report.style import BLACK, GREY, WHITE
from spinepipe.report.words import fixed

COLORS = LinearSegmentedColormap.from_list("gap", (WHITE, "#FEC44F", "#D95F0E", "#662506"))
"""From white to brown: it darkens steadily, for all kinds of eyes and for print."""

_EMPTY, _HATCH, _EDGE = "#E4E4E4", "#9A9A9A", "#C4C4C4"
_DARK = 0.62


def draw_heat(
    axis: Axes,
    grid: Array,
    scale: Normalize,
    decimals: int | None,
    pale: NDArray[np.bool_] | None = None,
) -> AxesImage:
    """Cells of a grid (rows, columns), NaN hatched; no numbers where ``decimals`` is None.

    Parameters
    ----------
    pale : (rows, columns) cells that stay white, their numbers grey.
    """
    quiet = np.zeros(grid.shape, dtype=bool) if pale is None else pale
    axis.set_facecolor(_EMPTY)
    axis.add_patch(Rectangle((-0.5, -0.5), grid.shape[1], grid.shape[0], hatch="//////", lw=0,
                             facecolor="none", edgecolor=_HATCH, zorder=0))  # fmt: skip
    image = axis.imshow(
        np.ma.masked_invalid(np.where(quiet, 0.0, grid)),
        cmap=COLORS,
        norm=scale,
        aspect="auto",
        zorder=1,
    )
    for row, column in np.argwhere(np.isfinite(grid)) if decimals is not None else ():
        value = grid[row, column]
        words = fixed(value, decimals or 0) if value else "0"
        color = GREY if quiet[row, column] else WHITE if scale(value) > _DARK else BLACK
        axis.text(column, row, words, ha="center", va="center", fontsize=5.0, zorder=3,
                  color=color, in_layout=False)  # fmt: skip
    for side in axis.spines.values():
        side.set(visible=True, color=_EDGE, linewidth=0.5)
    axis.tick_params(length=0.0, pad=2.0, labelsize=6.0)
    return image


def name_cells(axis: Axes, rows: Sequence[str], columns: Sequence[str], turned: bool) -> None:
    """Names of the rows and columns of a grid."""
    axis.set_yticks(range(len(rows)), list(rows))
    axis.set_xticks(range(len(columns)), list(columns))
    if turned:
        for label in axis.get_xticklabels():
            label.set(rotation=40.0, ha="right", rotation_mode="anchor")


def empty_cell(label: str) -> Patch:
    """The hatched cell as the key shows it."""
    return Patch(facecolor=_EMPTY, edgecolor=_HATCH, hatch="//////", lw=0, label=label)
