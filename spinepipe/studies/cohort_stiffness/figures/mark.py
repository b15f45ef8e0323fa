"""Symbols of stiffness with its interval, upright; hollow where the data do not hold it."""

from dataclasses import dataclass, replace

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from spinepipe.report.cohort.chosen import doubted
from spinepipe.report.style import BLACK, WHITE

_EDGE = 0.025
"""How far from the end of the axis something beyond it is marked, as a share of the axis."""


@dataclass(frozen=True)
class Mark:
    """Colour, shape and size of a symbol, and whether it is filled."""

    color: str
    shape: str
    size_pt: float
    filled: bool = True

    def hollow(self) -> "Mark":
        """The same symbol, not filled."""
        return replace(self, filled=False)


def handle(mark: Mark, label: str) -> Line2D:
    """The symbol as the key shows it."""
    return Line2D([], [], color=mark.color, lw=0.9, marker=mark.shape, ms=mark.size_pt,
                  mfc=mark.color if mark.filled else WHITE, mew=0.7, label=label)  # fmt: skip


def draw_marks(axis: Axes, rows: pd.DataFrame, x: pd.Series, mark: Mark) -> None:
    """Stiffness of each row at its place (n,); the axis has its limits already."""
    low, high = axis.get_ylim()
    doubt = doubted(rows)
    for at, row, doubtful in zip(x, rows.to_dict("records"), doubt, strict=True):
        value = row["stiffness"]
        if value is None or not np.isfinite(value):
            _at_edge(axis, at, 0.0, "x", BLACK)
        elif value > high or value < low:
            _at_edge(axis, at, float(value > high), "^" if value > high else "v", mark.color)
        else:
            if not pd.isna(row["low"]):
                axis.plot([at, at], [max(row["low"], low), min(row["high"], high)],
                          color=mark.color, lw=0.9, solid_capstyle="butt", zorder=3)  # fmt: skip
            face = WHITE if doubtful or not mark.filled else mark.color
            axis.plot([at], [value], mark.shape, color=mark.color, mfc=face, ms=mark.size_pt,
                      mew=0.7, zorder=4)  # fmt: skip


def _at_edge(axis: Axes, x: float, top: float, shape: str, color: str) -> None:
    y = 1.0 - _EDGE if top else _EDGE
    axis.plot([x], [y], shape, color=color, mfc=WHITE, ms=3.5, mew=0.8,
              transform=axis.get_xaxis_transform(), zorder=5)  # fmt: skip
