"""What the specimens of a paper let one expect of other specimens."""

from collections.abc import Collection
from math import exp

import numpy as np
from scipy.stats import norm

from spinepipe.comparison.ranges import LEVEL, Range

_ENDS = ((1.0 - LEVEL) / 2.0, (1.0 + LEVEL) / 2.0)


def median_of(values: Collection[float]) -> Range:
    """Between the smallest and the largest value, a distribution-free interval of the median.

    All n values lie on one side of the population's median with probability 2 / 2**n.
    """
    percent = 100.0 * (1.0 - 2.0 / 2 ** len(values))
    what = (
        f"the paper's smallest to largest of {len(values)}: the {percent:.3g} % distribution-free "
        "interval of the median"
    )
    return Range(min(values), max(values), what)


def smallest_of(values: Collection[float], n: int) -> Range:
    """Where the smallest of n others lies, the logarithm taken as normal."""
    chances = [1.0 - (1.0 - end) ** (1.0 / n) for end in _ENDS]
    return _log_normal(values, chances, f"the smallest of {n}")


def largest_of(values: Collection[float], n: int) -> Range:
    """Where the largest of n others lies, the logarithm taken as normal."""
    chances = [end ** (1.0 / n) for end in _ENDS]
    return _log_normal(values, chances, f"the largest of {n}")


def _log_normal(values: Collection[float], chances: list[float], name: str) -> Range:
    logs = np.log(list(values))
    middle, sd = float(np.mean(logs)), float(np.std(logs, ddof=1))
    low, high = (exp(middle + sd * float(norm.ppf(chance))) for chance in chances)
    what = (
        f"where {name} other specimens lies in {100.0 * LEVEL:g} % of cases: log-normal with the "
        f"mean and SD of the logarithm of the paper's {len(values)}, these taken as exact"
    )
    return Range(low, high, what)
