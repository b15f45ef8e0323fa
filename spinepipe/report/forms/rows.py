"""The form of rows: a number of each with its interval; and that of before and after."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator

from spinepipe.report.forms.axes import log_ticks
from spinepipe.report.forms.chart import Panel
from spinepipe.report.forms.look import COLORS, SEVERAL, SMALL, Look
from spinepipe.report.words import short

ROW, ABOVE_AND_BELOW = 21.0, 52.0
"""Height of a row, and of all that stands above and below the rows, in units."""

_WITHIN = 0.62
"""Share of a row's height over which its series are spread."""

LETTERS = 26
"""Of a row's name; the middle of a longer one is left out."""


@dataclass(frozen=True, kw_only=True)
class Rows(Panel):
    """Rows from the top down, in each of them a symbol and an interval of each series.

    Attributes
    ----------
    frame : columns ``row``, ``value``, ``low``, ``high`` (empty: no interval, or an open end where
        the other is there); ``series`` where there are several; ``note`` (text at the right end),
        ``hollow`` (not to be trusted), ``inner_low`` and ``inner_high`` (a thicker line, such as
        the middle half) where they are told.
    looks : of each series, in the order from the top of a row down.
    marks : a dashed vertical line at each value, with its words; zero has a solid one.
    bars : whether a bar from zero stands in the place of a symbol.
    log : whether the axis is logarithmic. x_limits : its ends.
    letters : most of a row's name, where a wide panel has room for sentences.
    """

    frame: pd.DataFrame
    looks: Mapping[str, Look] = field(default_factory=dict)
    marks: Mapping[float, str] = field(default_factory=dict)
    bars: bool = False
    log: bool = False
    x_limits: tuple[float, float] | None = None
    letters: int = LETTERS

    @property
    def names(self) -> list[str]:
        """The rows, from the top down."""
        return list(dict.fromkeys(self.frame["row"].astype(str)))

    @property
    def height(self) -> float:
        """By the number of rows, and of series in a row."""
        row = max(ROW, 7.5 * max(map(len, self._series_of_rows().values())) + 5.0)
        return (
            row * len(self.names)
            + ABOVE_AND_BELOW
            + 14.0 * bool(self.title)
            + 12.0 * bool(self.marks)
        )

    @property
    def series(self) -> list[str]:
        """Names of the series, in the order of their looks."""
        if "series" not in self.frame:
            return [""]
        found = set(self.frame["series"])
        return [name for name in self.looks if name in found] or list(
            dict.fromkeys(self.frame["series"])
        )

    def _series_of_rows(self) -> dict[str, list[str]]:
        """Series that each row has: these alone share its height."""
        if "series" not in self.frame:
            return {name: [""] for name in self.names}
        rows = self.frame.groupby(self.frame["row"].astype(str), sort=False)["series"]
        return {str(name): [one for one in self.series if one in set(own)] for name, own in rows}

    def draw(self, axes: Axes) -> None:
        """Symbols, intervals, notes and marks."""
        names, series, of_rows = self.names, self.series, self._series_of_rows()
        if self.log:
            axes.set_xscale("log")
        if self.x_limits:
            axes.set_xlim(*self.x_limits)
        else:  # open ends go to the edge, which lies beyond all symbols
            columns = self.frame.columns.intersection(["value", "low", "high"])
            numbers = self.frame[columns].to_numpy(float)
            axes.update_datalim([(x, 0.0) for x in numbers[np.isfinite(numbers)]])
            axes.autoscale_view(scaley=False)
        for number, one in enumerate(series):
            rows = self.frame if one == "" else self.frame[self.frame["series"] == one]
            look = self.looks.get(one, SEVERAL[number % len(SEVERAL)])
            own = [(names.index(name), of_rows[name]) for name in rows["row"].astype(str)]
            y = np.array(
                [
                    at + _WITHIN * ((in_row.index(one) + 0.5) / len(in_row) - 0.5)
                    for at, in_row in own
                ]
            )
            self._draw_series(axes, rows, y, look)
        for place, words in self.marks.items():  # alone on a logarithmic axis it has no limits
            axes.axvline(place, color=COLORS["soft"], lw=1.0, ls=(0, (3.0, 2.0)), zorder=1)
            _small(axes, place, 1.0, words, "bottom", "center")
        axes.set_ylim(len(names) - 0.45, -0.55)
        axes.set_yticks(range(len(names)), [short(name, self.letters) for name in names])
        axes.tick_params(axis="y", colors=COLORS["ink"])
        axes.grid(axis="y", visible=False)
        axes.spines["left"].set_visible(False)
        if self.log:
            log_ticks(axes.xaxis, *axes.get_xlim())
        else:  # as many ticks whatever the width, which the layout is still to find
            axes.xaxis.set_major_locator(MaxNLocator(4, steps=[1, 2, 5, 10]))
        low, high = axes.get_xlim()
        if not self.log and low < 0.0 < high:
            axes.axvline(0.0, color=COLORS["soft"], lw=0.8, zorder=1)
        if "note" in self.frame:
            told = self.frame.drop_duplicates("row").set_index("row")["note"]
            for place, name in enumerate(names):
                _small(axes, 1.01, place, str(told[name] or ""), "center", "left", across=True)

    def _draw_series(self, axes: Axes, rows: pd.DataFrame, y: np.ndarray, look: Look) -> None:
        value = rows["value"].to_numpy(float)
        if self.bars:
            axes.barh(y, value, height=_WITHIN / len(self.series), color=look.color, zorder=2)
        left, right = axes.get_xlim()
        ends = [
            rows.get(name, pd.Series(np.nan, rows.index)).to_numpy(float)
            for name in ("low", "high")
        ]
        known = ~(np.isnan(ends[0]) & np.isnan(ends[1]))
        low = np.where(known & np.isnan(ends[0]), left, ends[0])
        high = np.where(known & np.isnan(ends[1]), right, ends[1])
        color = COLORS["ink"] if self.bars else look.color
        axes.hlines(y[known], low[known], high[known], color=color, lw=1.6, zorder=3)
        if "inner_low" in rows:
            inner_low, inner_high = (
                rows[f"inner_{end}"].to_numpy(float) for end in ("low", "high")
            )
            axes.hlines(y, inner_low, inner_high, color=look.color, lw=4.5, zorder=3)
        if not self.bars:
            hollow = rows.get("hollow", pd.Series(False, rows.index)).to_numpy(bool)
            for doubtful in set(hollow):
                chosen = hollow == doubtful
                axes.plot(
                    value[chosen], y[chosen], **look.points(doubtful), zorder=4, clip_on=False
                )


@dataclass(frozen=True, kw_only=True)
class BeforeAfter(Panel):
    """Rows with an arrow from what was before to what is after.

    Attributes
    ----------
    frame : columns ``row``, ``before``, ``after``, with ``before_low``, ``before_high``,
        ``after_low``, ``after_high`` where intervals are known; ``note`` at the right end.
    before, after : looks of both.
    """

    frame: pd.DataFrame
    before: Look
    after: Look
    x_limits: tuple[float, float] | None = None

    @property
    def height(self) -> float:
        """By the number of rows."""
        return 1.25 * ROW * len(self.frame) + ABOVE_AND_BELOW + 14.0 * bool(self.title)

    def draw(self, axes: Axes) -> None:
        """As rows of two series, with arrows between them."""
        parts = []
        for name in ("before", "after"):
            columns = {
                "row": "row",
                name: "value",
                f"{name}_low": "low",
                f"{name}_high": "high",
                "note": "note",
            }
            kept = {key: to for key, to in columns.items() if key in self.frame}
            parts.append(self.frame[list(kept)].rename(columns=kept).assign(series=name))
        looks = {"before": self.before, "after": self.after}
        Rows(frame=pd.concat(parts), looks=looks, x_limits=self.x_limits).draw(axes)
        for y, row in enumerate(self.frame.to_dict("records")):
            arrow = {"arrowstyle": "->", "color": COLORS["soft"], "shrinkA": 4, "shrinkB": 4}
            ends = (row["after"], y + 0.25 * _WITHIN), (row["before"], y - 0.25 * _WITHIN)
            axes.annotate("", *ends, arrowprops=arrow, zorder=2)


def _small(
    axes: Axes, x: float, y: float, words: str, va: str, ha: str, across: bool = False
) -> None:
    """Small print at a place of one axis and a share of the other."""
    place = axes.get_yaxis_transform() if across else axes.get_xaxis_transform()
    how: Mapping[str, str] = {"va": va, "ha": ha, "color": COLORS["soft"]}
    axes.text(x, y, words, transform=place, fontsize=SMALL, **how)  # type: ignore[arg-type]


def ordered(frame: pd.DataFrame, column: str, order: Sequence[str]) -> pd.DataFrame:
    """Rows in the order of a column's values; what the order does not name comes last."""
    places = {name: place for place, name in enumerate(order)}
    return frame.sort_values(
        column,
        key=lambda names: names.map(lambda name: places.get(name, len(places))),
        kind="stable",
    )
