"""The forms of curves in small multiples and of a scatter with limits."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator

from spinepipe.report.forms.axes import log_ticks
from spinepipe.report.forms.chart import Panel
from spinepipe.report.forms.look import COLORS, SEVERAL, SMALL, Look
from spinepipe.report.words import tick


@dataclass(frozen=True, kw_only=True)
class Curves(Panel):
    """Lines, points with intervals, and bands, over one axis.

    Attributes
    ----------
    frame : columns ``x``, ``y`` and ``series``; ``x_low``, ``x_high``, ``y_low``, ``y_high`` of
        points with intervals (of a line: a band by ``y_low`` and ``y_high``); ``part`` where a
        series is several lines.
    looks : of each series. points : those drawn as symbols; all others are lines.
    labels : words beside the end of a line, by series.
    zeros : whether the axes through zero are drawn.
    """

    frame: pd.DataFrame
    looks: Mapping[str, Look] = field(default_factory=dict)
    points: tuple[str, ...] = ()
    labels: Mapping[str, str] = field(default_factory=dict)
    zeros: bool = True
    x_log: bool = False
    y_log: bool = False
    x_limits: tuple[float, float] | None = None
    y_limits: tuple[float, float] | None = None
    high: float = 230.0

    @property
    def height(self) -> float:
        """As given."""
        return self.high

    def draw(self, axes: Axes) -> None:
        """All series, the first one below."""
        names = list(dict.fromkeys(self.frame["series"]))
        names = [*(n for n in self.looks if n in names), *(n for n in names if n not in self.looks)]
        for number, name in enumerate(names):
            rows = self.frame[self.frame["series"] == name]
            look = self.looks.get(name, SEVERAL[number % len(SEVERAL)])
            draw = _points if name in self.points else _lines
            draw(axes, rows, look)
            if name in self.labels:
                last = rows.iloc[-1]
                axes.annotate(
                    self.labels[name], (last["x"], last["y"]), (4.0, 0.0), va="center",
                    textcoords="offset points", color=look.color, fontsize=SMALL,
                )  # fmt: skip
        set_axes(axes, self.x_log, self.y_log, self.x_limits, self.y_limits)
        if self.zeros:
            for crosses, draw_zero, log in (
                (axes.get_ylim(), axes.axhline, self.y_log),
                (axes.get_xlim(), axes.axvline, self.x_log),
            ):
                if not log and crosses[0] <= 0.0 <= crosses[1]:
                    draw_zero(0.0, color=COLORS["soft"], lw=0.8, zorder=1)


@dataclass(frozen=True, kw_only=True)
class Scatter(Panel):
    """Points, with the line of equality or limits of agreement.

    Attributes
    ----------
    frame : columns ``x``, ``y``; ``series`` where there are several; ``x_low`` and so on where
        intervals are known; ``label`` beside a point where that is told.
    identity : whether x = y is drawn, and both axes are alike.
    limits : horizontal lines with their words. bands : of each limit, both ends of its interval.
    """

    frame: pd.DataFrame
    looks: Mapping[str, Look] = field(default_factory=dict)
    identity: bool = False
    limits: Mapping[float, str] = field(default_factory=dict)
    bands: tuple[tuple[float, float], ...] = ()
    x_log: bool = False
    y_log: bool = False
    high: float = 260.0

    @property
    def height(self) -> float:
        """As given."""
        return self.high

    def draw(self, axes: Axes) -> None:
        """Points, then lines."""
        series = self.frame["series"] if "series" in self.frame else pd.Series("", self.frame.index)
        for number, name in enumerate(dict.fromkeys(series)):
            rows = self.frame[series == name]
            many = len(rows) > 60
            look = self.looks.get(name, SEVERAL[number % len(SEVERAL)])
            _points(
                axes,
                rows,
                look,
                ms=3.0 if many else 5.5,
                alpha=0.5 if many else 1.0,
                rasterized=len(rows) > 400,
            )
        limits = None
        if self.identity:
            both = np.r_[self.frame["x"].to_numpy(float), self.frame["y"].to_numpy(float)]
            room = 0.05 * float(np.ptp(both)) or 1.0
            limits = (float(both.min()) - room, float(both.max()) + room)
            axes.plot(limits, limits, color=COLORS["soft"], lw=1.0, zorder=1)
        set_axes(axes, self.x_log, self.y_log, limits, limits)
        for ends in self.bands:
            axes.axhspan(*ends, color=COLORS["line"], alpha=0.6, lw=0, zorder=0)
        for y, words in self.limits.items():
            axes.axhline(y, color=COLORS["soft"], lw=1.0, ls=(0, (3.0, 2.0)), zorder=1)
            axes.text(
                0.99, y, words, transform=axes.get_yaxis_transform(), ha="right", va="bottom",
                fontsize=SMALL, color=COLORS["soft"],
            )  # fmt: skip
        for row in self.frame.to_dict("records") if "label" in self.frame else ():
            axes.annotate(
                row["label"], (row["x"], row["y"]), (5.0, 3.0), textcoords="offset points",
                fontsize=SMALL, color=COLORS["soft"],
            )  # fmt: skip


def set_axes(
    axes: Axes,
    x_log: bool,
    y_log: bool,
    x_limits: tuple[float, float] | None,
    y_limits: tuple[float, float] | None,
) -> None:
    """Scales, ends and ticks."""
    for axis, log, limits in ((axes.xaxis, x_log, x_limits), (axes.yaxis, y_log, y_limits)):
        set_scale, set_limits = (
            (axes.set_xscale, axes.set_xlim)
            if axis is axes.xaxis
            else (axes.set_yscale, axes.set_ylim)
        )
        if log:
            set_scale("log")
        if limits:
            set_limits(*limits)
        if log:
            low, high = sorted(axis.get_view_interval())
            log_ticks(axis, low, high)
        else:
            axis.set_major_formatter(lambda x, _: tick(round(x, 12)))
            axis.set_major_locator(MaxNLocator(5))


def _lines(axes: Axes, rows: pd.DataFrame, look: Look) -> None:
    for _, part in rows.groupby("part", sort=False) if "part" in rows else (("", rows),):
        axes.plot(part["x"].to_numpy(float), part["y"].to_numpy(float), **look.line(), zorder=3)
        if "y_low" in part and part["y_low"].notna().any():
            low, high = (part[name].to_numpy(float) for name in ("y_low", "y_high"))
            axes.fill_between(
                part["x"].to_numpy(float), low, high, color=look.color, alpha=0.15, lw=0
            )


def _points(axes: Axes, rows: pd.DataFrame, look: Look, **how: Any) -> None:
    x, y = rows["x"].to_numpy(float), rows["y"].to_numpy(float)
    for low, high, draw, at in (
        ("x_low", "x_high", axes.hlines, y),
        ("y_low", "y_high", axes.vlines, x),
    ):
        if low in rows:
            ends = rows[low].to_numpy(float), rows[high].to_numpy(float)
            draw(at, *ends, color=look.color, lw=1.2, zorder=2)
    axes.plot(x, y, **look.points(**how), zorder=4)
