"""Logarithmic axes that people can read."""

from math import log10

from matplotlib.axis import Axis
from matplotlib.ticker import FixedLocator, LogLocator, MaxNLocator, NullFormatter, NullLocator

from spinepipe.report.words import tick


def log_ticks(axis: Axis, low: float, high: float) -> None:
    """Few ticks with plain numbers: even ones within half a decade, else 1, 2, 5 or decades."""
    decades = log10(high / low)
    if decades < 0.5:
        even = [x for x in MaxNLocator(4).tick_values(low, high) if low <= x <= high]
        axis.set_major_locator(FixedLocator(even))
        axis.set_minor_locator(NullLocator())
    else:
        axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0) if decades < 2.2 else (1.0,)))
        axis.set_minor_locator(LogLocator(subs=range(1, 10)))
    axis.set_major_formatter(lambda x, _: tick(x))
    axis.set_minor_formatter(NullFormatter())
