"""How samples, single results and intervals are drawn in a row; what is only rounding."""

from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import NDArray
from scipy.stats import gaussian_kde

from spinepipe.report.style import BLACK, WHITE

Array = NDArray[np.float64]
BAR_PT, THIN_BAR_PT = 4.0, 2.5
CROWDED_ALPHA = 0.5
FEWEST_FOR_DENSITY = 10
KEY = "bar: interquartile range (IQR), tick: median, thin line: 5th to 95th percentile"
STRIP_KEY = "dot: one fit, line: range, tick: median"
_MOST_OUTLINES = 400
"""More dots than this become a picture inside the SVG, which stays small."""

_GOLDEN = 0.5 * (5.0**0.5 - 1.0)

EXACT_BELOW = 1e-9
"""Errors below this, mm or degrees, are rounding: no instrument and no fit resolves them."""

EXACT = "exact to rounding"


@dataclass(frozen=True)
class Quartiles:
    """Median and quartiles of n values."""

    low: float
    median: float
    high: float
    n: int

    @property
    def iqr(self) -> float:
        """Interquartile range."""
        return self.high - self.low


def draw_bar(
    panel: Axes, values: Array, y: float, color: str, thick_pt: float = BAR_PT
) -> Quartiles:
    """Middle half as a bar, median as a tick that stands out of it, middle 90 % as a thin line."""
    found = quartiles(values)
    ends = np.percentile(values, [5.0, 95.0])
    panel.plot(ends, [y, y], color=color, lw=0.8, solid_capstyle="butt", zorder=3)
    draw_iqr(panel, found, y, color, thick_pt)
    return found


def draw_iqr(panel: Axes, found: Quartiles, y: float, color: str, thick_pt: float = BAR_PT) -> None:
    """Middle half as a bar, median as a tick that stands out of it."""
    ends = [found.low, found.high]
    panel.plot(ends, [y, y], color=color, lw=thick_pt, solid_capstyle="butt", zorder=4)
    panel.plot([found.median], [y], "|", color=BLACK, ms=1.6 * thick_pt + 0.6, mew=1.0, zorder=5)


def draw_upright(panel: Axes, values: Array, x: float, color: str, width: float) -> None:
    """Every value as a dot spread over a width, the middle half as a bar, the median as a tick."""
    panel.plot(
        x + spread_out(len(values)) * width,
        values,
        "o",
        color=color,
        ms=1.8,
        mew=0.0,
        alpha=0.5,
        zorder=3,
    )
    found = quartiles(values)
    panel.plot(
        [x, x], [found.low, found.high], color=color, lw=BAR_PT, solid_capstyle="butt", zorder=4
    )
    panel.plot([x], [found.median], "_", color=BLACK, ms=1.6 * BAR_PT + 0.6, mew=1.0, zorder=5)


def draw_density(
    panel: Axes, values: Array, base: float, height: float, color: str, logarithmic: bool = False
) -> None:
    """Density of a sample as a hill on a base line; single marks where there are few values."""
    if logarithmic:
        values = np.log(values)
    spread = float(np.ptp(values)) if len(values) else 0.0
    if len(values) < FEWEST_FOR_DENSITY or spread <= 1e-9 * float(np.abs(values).max()):
        shown = np.exp(values) if logarithmic else values
        panel.plot(
            shown, np.full(len(shown), base + 0.2 * height), "|", color=color, ms=5.0, mew=0.7
        )
        return
    low, high = np.percentile(values, [0.5, 99.5])
    margin = 0.1 * (high - low)
    at = np.linspace(low - margin, high + margin, 200)
    density = gaussian_kde(values)(at)
    x = np.exp(at) if logarithmic else at
    top = base + height * density / density.max()
    panel.fill_between(x, base, top, color=color, alpha=0.3, lw=0, zorder=2)
    panel.plot(x, top, color=color, lw=0.6, zorder=2)


def draw_strip(panel: Axes, values: Array, y: float, color: str) -> None:
    """Dots spread over a height around y, always alike; finite values (n,), n at least 1."""
    panel.plot(
        values,
        y + spread_out(len(values)) * 0.3,
        "o",
        color=color,
        ms=2.0,
        mew=0.0,
        alpha=0.45,
        zorder=3,
        rasterized=len(values) > _MOST_OUTLINES,
    )
    panel.plot([values.min(), values.max()], [y, y], color=color, lw=0.8, zorder=4)
    panel.plot([np.median(values)], [y], "|", color=BLACK, ms=7.0, mew=1.0, zorder=5)


def spread_out(n: int) -> Array:
    """(n,) between -0.5 and 0.5, evenly mixed and always alike: where dots of a row stand in it."""
    return np.asarray(np.arange(n) * _GOLDEN % 1.0 - 0.5, dtype=np.float64)


def draw_interval(
    panel: Axes, x: float, ends: tuple[float, float], y: float, color: str, crowded: bool = False
) -> None:
    """A dot with a line from end to end; fainter where many share a row."""
    alpha = CROWDED_ALPHA if crowded else 1.0
    panel.plot(ends, [y, y], color=color, lw=1.2, alpha=alpha, solid_capstyle="butt", zorder=3)
    panel.plot(
        [x],
        [y],
        "o",
        color=color,
        ms=3.0 if crowded else 4.0,
        mec=WHITE,
        mew=0.4,
        alpha=alpha,
        zorder=4,
        clip_on=False,
    )


def quartiles(values: Array) -> Quartiles:
    """Median and quartiles of finite values (n,), n at least 1."""
    low, median, high = np.percentile(values, [25.0, 50.0, 75.0])
    return Quartiles(float(low), float(median), float(high), len(values))


def finite(values: object) -> Array:
    """The finite ones of some values as (n,) numbers."""
    array = np.asarray(values, dtype=float).ravel()
    return array[np.isfinite(array)]


def rounded(values: object) -> Array:
    """The values as an array, those that are only rounding as zero."""
    array = np.asarray(values, dtype=float)
    return np.where(np.abs(array) < EXACT_BELOW, 0.0, array)


def exact(values: object) -> bool:
    """Whether there are values and all of them are zero but for rounding."""
    array = np.asarray(values, dtype=float)
    return bool(array.size) and bool((np.abs(array) < EXACT_BELOW).all())
