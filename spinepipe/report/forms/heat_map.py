"""The forms of a heat map with numbers and of stacked shares."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.colors import to_rgb
from matplotlib.patches import Rectangle

from spinepipe.report.forms.chart import Panel
from spinepipe.report.forms.look import COLORS, SMALL, Look
from spinepipe.report.forms.rows import ABOVE_AND_BELOW, ROW
from spinepipe.report.words import number, percent, short

_DARKEST = 0.55
"""Share of the colour in the fullest cell: text in ink still has a contrast of 4.5 to 1."""

_FITS = 0.11
"""A share whose part of the bar is wider than this has room for its number."""


@dataclass(frozen=True, kw_only=True)
class HeatMap(Panel):
    """Cells coloured by a number that stands in each.

    Attributes
    ----------
    frame : columns ``row``, ``column`` and ``value`` (empty: the cell stays empty); ``text`` where
        something else than the number stands in a cell, such as why it is empty.
    full : the value of the fullest colour; by default the largest size there is.
    color : of positive values; negative ones have ``negative``.
    """

    frame: pd.DataFrame
    full: float | None = None
    color: str = COLORS["model"]
    negative: str = COLORS["base"]

    @property
    def height(self) -> float:
        """By the number of rows, and the letters of slanted names below the columns."""
        longest = max((len(str(name)) for name in self._columns), default=0)
        return (
            ROW * len(self._rows)
            + ABOVE_AND_BELOW
            + (3.4 * min(longest, 20) if self._slanted else 0.0)
        )

    @property
    def _rows(self) -> list[str]:
        return list(dict.fromkeys(self.frame["row"].astype(str)))

    @property
    def _columns(self) -> list[str]:
        return list(dict.fromkeys(self.frame["column"].astype(str)))

    @property
    def _slanted(self) -> bool:
        return sum(len(name) + 2 for name in self._columns) * 6.6 > 0.75 * self.width

    def draw(self, axes: Axes) -> None:
        """A rectangle with its number for each cell."""
        rows, columns = self._rows, self._columns
        sizes = self.frame["value"].abs()
        full = self.full or float(sizes.max() if sizes.notna().any() else 0.0) or 1.0
        axes.set_xlim(-0.5, len(columns) - 0.5)
        axes.set_ylim(len(rows) - 0.5, -0.5)
        for cell in self.frame.to_dict("records"):
            x, y = columns.index(str(cell["column"])), rows.index(str(cell["row"]))
            value, known = cell["value"], pd.notna(cell["value"])
            if known:
                color = to_rgb(self.color if value >= 0.0 else self.negative)
                share = _DARKEST * min(1.0, abs(value) / full)
                axes.add_patch(
                    Rectangle((x - 0.48, y - 0.46), 0.96, 0.92, fc=(*color, share), lw=0)
                )
            text = cell.get("text") or (number(float(value), 2) if known else "–")
            axes.text(x, y, str(text), ha="center", va="center", fontsize=SMALL)
        turned = {"rotation": 35, "ha": "right", "rotation_mode": "anchor"} if self._slanted else {}
        axes.set_xticks(range(len(columns)), [short(name, 20) for name in columns], **turned)  # type: ignore[arg-type]
        axes.set_yticks(range(len(rows)), [short(name, 24) for name in rows])
        axes.tick_params(colors=COLORS["ink"])
        axes.grid(visible=False)
        for spine in axes.spines.values():
            spine.set_visible(False)


@dataclass(frozen=True, kw_only=True)
class Shares(Panel):
    """Bars of 100 %, each part with its number where it has room.

    Attributes
    ----------
    frame : columns ``row``, ``series``, ``share`` (0 to 1; parts of a row sum to 1 at most).
    looks : of each series, from the left.
    """

    frame: pd.DataFrame
    looks: Mapping[str, Look] = field(default_factory=dict)

    @property
    def height(self) -> float:
        """By the number of rows."""
        return ROW * self.frame["row"].nunique() + ABOVE_AND_BELOW

    def draw(self, axes: Axes) -> None:
        """Parts of each row, side by side."""
        names = list(dict.fromkeys(self.frame["row"].astype(str)))
        for y, name in enumerate(names):
            parts = self.frame[self.frame["row"].astype(str) == name].set_index("series")["share"]
            left = 0.0
            for one, look in self.looks.items():
                share = float(np.clip(parts.get(one, 0.0), 0.0, 1.0))
                axes.barh(
                    y,
                    100.0 * share,
                    left=100.0 * left,
                    height=0.72,
                    fc=(*to_rgb(look.color), _DARKEST),
                    ec=COLORS["paper"],
                    lw=1.0,
                )
                if share > _FITS:
                    words = percent(round(1000 * share), 1000)
                    axes.text(
                        100.0 * (left + 0.5 * share),
                        y,
                        words,
                        ha="center",
                        va="center",
                        fontsize=SMALL,
                    )
                left += share
        axes.set_xlim(0.0, 100.0)
        axes.set_ylim(len(names) - 0.45, -0.55)
        axes.set_yticks(range(len(names)), [short(name, 24) for name in names])
        axes.tick_params(axis="y", colors=COLORS["ink"])
        axes.grid(visible=False)
        axes.spines["left"].set_visible(False)
