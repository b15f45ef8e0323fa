"""What a test of values hands back: its numbers, or the reason why there are none.

Also p values corrected for the number of tests in a family, and means with Student's t interval.
Effect means effect size here, not an effect of a model, and family means tests that are corrected
together.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Literal, SupportsFloat

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import stats

Array = NDArray[np.float64]


P_ZERO = "p is too small for a number: 0 stands for it"
"""Message of a p below the smallest floating-point number."""


class ComputationStatus(StrEnum):
    """Whether a statistic could be computed, and if not, why.

    CONSTANT: values do not vary as the test needs. TOO_FEW: there are too few.
    """

    DONE = "done"
    CONSTANT = "constant"
    TOO_FEW = "too_few"


@dataclass(frozen=True)
class StatisticalTest:
    """The outcome of one test, ready to be a row of a table.

    Attributes
    ----------
    test, statistic_name : names of the test and of its statistic.
    statistic, p, effect : None where the status is not ``done``.
    n : how many observations went in (pairs, or blocks of a Friedman test).
    effect_name : the effect size's name, e.g. ``rho``. effect : the effect size.
    message : what a reader of the numbers must know, in plain words.
    """

    test: str
    statistic_name: str
    statistic: float | None
    p: float | None
    n: int
    effect_name: str
    effect: float | None
    status: ComputationStatus
    message: str = ""


@dataclass(frozen=True)
class Test:
    """A kind of test: the names that all its outcomes have; see `StatisticalTest`."""

    test: str
    statistic_name: str
    effect_name: str

    __test__ = False  # not for pytest to collect

    def done(
        self,
        statistic: SupportsFloat,
        p: SupportsFloat,
        n: int,
        effect: SupportsFloat,
        message: str = "",
    ) -> StatisticalTest:
        """The outcome of a test that could be computed."""
        return StatisticalTest(
            self.test,
            self.statistic_name,
            float(statistic),
            float(p),
            n,
            self.effect_name,
            float(effect),
            ComputationStatus.DONE,
            message if float(p) > 0.0 else f"{message}; {P_ZERO}".removeprefix("; "),
        )

    def without(self, status: ComputationStatus, n: int, message: str) -> StatisticalTest:
        """The outcome of a test that has no numbers; ``message`` says why."""
        return StatisticalTest(
            self.test, self.statistic_name, None, None, n, self.effect_name, None, status, message
        )


def finite(values: ArrayLike, dimensions: int = 1) -> Array:
    """The values as floats, checked; nothing is left out.

    Raises
    ------
    ValueError
        For other than that many dimensions, or values that are not finite: whoever asks decides
        what to leave out, and says so.
    """
    array: Array = np.asarray(values, dtype=np.float64)
    if array.ndim != dimensions:
        raise ValueError(f"expected {dimensions} dimension(s), found {array.ndim}")
    if not np.isfinite(array).all():
        raise ValueError("a statistic needs finite numbers: leave out what failed, and say so")
    return array


def constant(values: Array) -> bool:
    """Whether all values (at least one) are exactly the same."""
    return bool((values == values.flat[0]).all())


def tied(values: Array) -> int:
    """How many values are equal to another one; of 1, 1, 2 these are two."""
    counts = np.unique(values, return_counts=True)[1]
    return int(counts[counts > 1].sum())


def finite_pairs(x: ArrayLike, y: ArrayLike) -> tuple[Array, Array]:
    """Both sets of values as floats; ValueError also where a value has no partner."""
    first, second = finite(x), finite(y)
    if len(first) != len(second):
        raise ValueError(f"pairs are needed, found {len(first)} and {len(second)} values")
    return first, second


def family_size(ps: Sequence[float | None]) -> int:
    """How many tests of a family have a p: what `corrected` corrects for."""
    return sum(p is not None for p in ps)


def corrected(
    ps: Sequence[float | None], method: Literal["bonferroni", "holm"]
) -> list[float | None]:
    """The p values corrected for their family, in their order, none above 1.

    Bonferroni: each times the number of tests. Holm: see `_holm`. A test without p (None) stays
    without, and does not count in the family.

    Raises
    ------
    ValueError
        For a p outside 0 to 1.
    """
    known = np.array([p for p in ps if p is not None], dtype=float)
    if not np.all((known >= 0.0) & (known <= 1.0)):  # also false for a NaN
        raise ValueError("a p value lies between 0 and 1")
    values = iter((_holm(known) if method == "holm" else len(known) * known).clip(max=1.0).tolist())
    return [None if p is None else next(values) for p in ps]


def _holm(p: NDArray[np.float64]) -> NDArray[np.float64]:
    """Holm's step-down method (1979); p (n,), in any order, to corrected p in that order.

    The smallest of n is multiplied by n, the next by n - 1, the largest by 1, and none is below the
    one before. May be above 1.

    Written out because statsmodels collects garbage at each call, 0.1 s in a long-lived process.
    """
    order = np.argsort(p, kind="stable")
    steps = np.maximum.accumulate(np.arange(len(p), 0, -1) * p[order])
    result = np.empty_like(steps)
    result[order] = steps
    return result


LEVEL = 0.95
"""Confidence level of the interval of a mean."""

SAME = 1e-9
"""Values differ by rounding alone if their range is within this share of the largest size."""


@dataclass(frozen=True)
class Mean:
    """Mean of values that are independent of each other.

    Attributes
    ----------
    n : how many values there are. value : their mean; None without any.
    interval : low and high end of its 95 % t interval, n - 1 degrees of freedom.
    p : of the one-sample t test against zero, two-sided.

    Interval and p are None with fewer than two values, and where all are the same (`SAME`).
    """

    n: int
    value: float | None = None
    interval: tuple[float, float] | None = None
    p: float | None = None


def mean_of(values: Array) -> Mean:
    """Mean of finite values (n,), its t interval and its p."""
    n = len(values)
    if n == 0:
        return Mean(n)
    value = float(values.mean())
    if n == 1 or np.ptp(values) <= SAME * np.abs(values).max():
        return Mean(n, value)
    tested = stats.ttest_1samp(values, 0.0)
    ends = tested.confidence_interval(LEVEL)
    return Mean(n, value, (float(ends.low), float(ends.high)), float(tested.pvalue))
