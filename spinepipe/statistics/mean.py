"""Mean of independent values with Student's interval."""

from dataclasses import dataclass

import numpy as np
from scipy import stats

from spinepipe.statistics.outcome import Array

LEVEL = 0.95

SAME = 1e-9
"""Values that differ by less than this share of their size differ by rounding."""


@dataclass(frozen=True)
class Mean:
    """Mean of values that are independent of each other.

    Attributes
    ----------
    n : how many values there are. value : None without any.
    interval : 95 % t interval. p : of the t test against zero, two-sided. None of fewer than two
        values, and where all are the same.
    """

    n: int
    value: float | None = None
    interval: tuple[float, float] | None = None
    p: float | None = None


def mean_of(values: Array) -> Mean:
    """Mean of values (n,) and its t interval."""
    n = len(values)
    if n == 0:
        return Mean(n)
    value = float(values.mean())
    if n == 1 or np.ptp(values) <= SAME * np.abs(values).max():
        return Mean(n, value)
    tested = stats.ttest_1samp(values, 0.0)
    ends = tested.confidence_interval(LEVEL)
    return Mean(n, value, (float(ends.low), float(ends.high)), float(tested.pvalue))
