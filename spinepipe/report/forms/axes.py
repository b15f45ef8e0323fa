"""Ticks of logarithmic axes."""

from collections.abc import Sequence
from math import floor, log10

from matplotlib.axis import Axis
from matplotlib.ticker import FixedLocator, LogLocator, MaxNLocator, NullFormatter, NullLocator

from spinepipe.report.words import tick

_STEPS: tuple[tuple[float, ...], ...] = ((1.0, 2.0, 5.0), (1.0, 3.0), (1.0,))

_APART = 0.18
"""Share of an axis that two numbers at it are apart."""


def log_ticks(axis: Axis, low: float, high: float, most: int = 4) -> None:
    """Few ticks with plain numbers: even ones in about half a decade, else 1, 2, 5 or fewer.

    Where even decades are more than ``most``, only some of them have a number.
    """
    if log10(high / low) < 0.5 or len(_within(low, high, _STEPS[0])) < 2:
        even: list[float] = []
        for x in MaxNLocator(most).tick_values(low, high):  # closer and closer together
            room = not even or log10(x / even[-1]) > _APART * log10(high / low)
            even += [float(x)] if low <= x <= high and room else []
        axis.set_major_locator(FixedLocator(even))
    else:
        subs = next((s for s in _STEPS if len(_within(low, high, s)) <= most), _STEPS[-1])
        axis.set_major_locator(LogLocator(subs=subs, numticks=most if subs == _STEPS[-1] else None))
    axis.set_minor_locator(NullLocator())
    axis.set_major_formatter(lambda x, _: tick(x))
    axis.set_minor_formatter(NullFormatter())


def _within(low: float, high: float, subs: Sequence[float]) -> list[float]:
    """Multiples of the decades from low to high."""
    ends = floor(log10(low)), floor(log10(high)) + 1
    found = [s * 10.0**decade for decade in range(*ends) for s in subs]
    return [x for x in found if low <= x <= high]
