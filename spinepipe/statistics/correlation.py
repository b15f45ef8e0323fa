"""Rank correlation of two sets of values, exact among few untied pairs.

scipy has the t approximation. It is wrong where it matters in a large family of tests of ten pairs:
at rho = 1 it gives p = 0, while one ordering in 10! has p = 5.5e-7 and can be no rarer.
"""

from functools import cache

import numpy as np
from numpy.typing import ArrayLike
from scipy import stats

from spinepipe.statistics.outcome import Array, Ended, Outcome, Test, constant, finite_pairs, tied

LARGEST = 10
"""Up to so many pairs; R counts up to 9 and takes an Edgeworth series above."""


def exact_p(rho: float, n: int) -> float:
    """Two-sided p of rho between n untied pairs: share of orderings at least as far from 0.

    The doubled smaller tail, as R's ``cor.test`` has it; the null is symmetric.
    """
    distance = round((1.0 - abs(rho)) * (n**3 - n) / 6.0)
    return float(min(1.0, 2.0 * _cumulated(n)[distance]))


@cache
def _cumulated(n: int) -> Array:
    """Probability that the squared rank differences sum to at most 0, 1, ... (n^3 - n)/3.

    Counted over the sets of ranks given out so far: the k-th pair takes any rank still free.
    """
    length = (n**3 - n) // 3 + 1
    counts = {0: np.eye(1, length, dtype=np.int64)[0]}
    for place in range(n):
        longer: dict[int, np.ndarray[tuple[int], np.dtype[np.int64]]] = {}
        for taken, ways in counts.items():
            for rank in (rank for rank in range(n) if not taken >> rank & 1):
                # nothing is lost off the end: no partial sum is above the largest total
                step = (rank - place) ** 2
                total = longer.setdefault(taken | 1 << rank, np.zeros(length, dtype=np.int64))
                total[step:] += ways[: length - step]
        counts = longer
    cumulated: Array = np.cumsum(counts[(1 << n) - 1]) / float(np.prod(np.arange(1.0, n + 1)))
    return cumulated


FEWEST = 4
"""Among fewer pairs no order is rare: one of 3! has p = 0.33."""

SPEARMAN = Test("Spearman", "rho", "rho")
KENDALL = Test("Kendall tau-b", "tau", "tau")


def spearman(x: ArrayLike, y: ArrayLike) -> Outcome:
    """Spearman's rank correlation of pairs x (n,) and y (n,), two-sided.

    p is exact up to 10 pairs without ties, otherwise from scipy's t approximation.
    """
    first, second = finite_pairs(x, y)
    refused = _refused(SPEARMAN, first, second)
    if refused:
        return refused
    n, ties = len(first), _ties(first, second)
    found = stats.spearmanr(first, second)
    rho = float(found.statistic)
    if ties or n > LARGEST:
        return SPEARMAN.done(rho, found.pvalue, n, rho, ties)
    return SPEARMAN.done(rho, exact_p(rho, n), n, rho, "exact p")


def kendall(x: ArrayLike, y: ArrayLike) -> Outcome:
    """Kendall's tau-b of pairs x (n,) and y (n,), two-sided; scipy counts p exactly if n <= 33."""
    first, second = finite_pairs(x, y)
    refused = _refused(KENDALL, first, second)
    if refused:
        return refused
    found = stats.kendalltau(first, second)
    ties = _ties(first, second)
    return KENDALL.done(found.statistic, found.pvalue, len(first), found.statistic, ties)


def _refused(test: Test, x: Array, y: Array) -> Outcome | None:
    """The outcome of pairs that have no correlation, or None."""
    n = len(x)
    if n < FEWEST:
        return test.without(Ended.TOO_FEW, n, f"{n} pairs; at least {FEWEST} are needed")
    same = [name for name, values in (("first", x), ("second", y)) if constant(values)]
    if same:
        return test.without(Ended.CONSTANT, n, f"all {' and all '.join(same)} values are the same")
    return None


def _ties(x: Array, y: Array) -> str:
    """How many values share their rank with another, "" for none."""
    parts = [
        f"{shared} of the {name}"
        for name, values in (("first", x), ("second", y))
        if (shared := tied(values))
    ]
    return f"ties: {' and '.join(parts)} values" if parts else ""
