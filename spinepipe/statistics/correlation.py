"""Rank correlation of two sets of values, exact among few pairs.

scipy has the t approximation. It is wrong where it matters in a large family of tests of ten pairs:
at rho = 1 it gives p = 0, while one ordering in 10! has p = 5.5e-7 and can be no rarer; of four
pairs with a tie in both it is one in six.
"""

from functools import lru_cache
from math import factorial

import numpy as np
from numpy.typing import ArrayLike
from scipy import stats

from spinepipe.statistics.outcome import (
    Array,
    ComputationStatus,
    StatisticalTest,
    Test,
    constant,
    finite_pairs,
    tied,
)

LARGEST = 10
"""Up to so many pairs; R counts up to 9 and takes an Edgeworth series above."""


def spearman_p(first: Array, second: Array) -> float:
    """Two-sided p of Spearman's rho of pairs of ranks (n,): share of orderings as far to one side.

    The doubled smaller tail, as R's ``cor.test`` has it. With ties the mid-ranks are dealt out.
    """
    x, y = (np.rint(2.0 * ranks).astype(np.int64) for ranks in (first, second))
    share = _distances(tuple(sorted(x.tolist())), tuple(sorted(y.tolist())))
    place = int(np.sum((x - y) ** 2))
    return float(min(1.0, 2.0 * min(share[: place + 1].sum(), share[place:].sum())))


@lru_cache(maxsize=64)
def _distances(first: tuple[int, ...], second: tuple[int, ...]) -> Array:
    """Probability that squared differences of doubled ranks sum to 0, 1, ...

    Counted over the sets of ranks given out so far: the k-th pair takes any rank still free.
    """
    # Dynamic programming over subsets: the set of ranks taken is a number, one bit a rank, and its
    # counts are ways by the sum so far. 2^n sets in place of n! orderings.
    length = 1 + sum((one - other) ** 2 for one, other in zip(first, second[::-1], strict=True))
    counts = {0: np.eye(1, length, dtype=np.int64)[0]}
    for own in first:
        longer: dict[int, np.ndarray[tuple[int], np.dtype[np.int64]]] = {}
        for taken, ways in counts.items():
            for place in (place for place in range(len(second)) if not taken >> place & 1):
                # nothing is lost off the end: no partial sum is above the largest total
                step = (second[place] - own) ** 2
                total = longer.setdefault(taken | 1 << place, np.zeros(length, dtype=np.int64))
                total[step:] += ways[: length - step]
        counts = longer
    found: Array = counts[(1 << len(second)) - 1] / float(factorial(len(second)))
    return found


FEWEST = 4
"""Among fewer pairs no order is rare: one of 3! has p = 0.33."""

SPEARMAN = Test("Spearman", "rho", "rho")
KENDALL = Test("Kendall tau-b", "tau", "tau")


def spearman(x: ArrayLike, y: ArrayLike) -> StatisticalTest:
    """Spearman's rank correlation of pairs x (n,) and y (n,), two-sided.

    p is exact up to 10 pairs, also with ties, otherwise from scipy's t approximation.
    """
    first, second = finite_pairs(x, y)
    refused = _refused(SPEARMAN, first, second)
    if refused:
        return refused
    n, ties = len(first), _ties(first, second)
    found = stats.spearmanr(first, second)
    rho = float(found.statistic)
    if n > LARGEST:
        return SPEARMAN.done(rho, found.pvalue, n, rho, ties)
    p = spearman_p(stats.rankdata(first), stats.rankdata(second))
    return SPEARMAN.done(rho, p, n, rho, f"exact p; {ties}" if ties else "exact p")


def kendall(x: ArrayLike, y: ArrayLike) -> StatisticalTest:
    """Kendall's tau-b of pairs x (n,) and y (n,), two-sided; scipy counts p exactly if n <= 33."""
    first, second = finite_pairs(x, y)
    refused = _refused(KENDALL, first, second)
    if refused:
        return refused
    found = stats.kendalltau(first, second)
    ties = _ties(first, second)
    return KENDALL.done(found.statistic, found.pvalue, len(first), found.statistic, ties)


def _refused(test: Test, x: Array, y: Array) -> StatisticalTest | None:
    """The outcome of pairs that have no correlation, or None."""
    n = len(x)
    if n < FEWEST:
        return test.without(
            ComputationStatus.TOO_FEW, n, f"{n} pairs; at least {FEWEST} are needed"
        )
    same = [name for name, values in (("first", x), ("second", y)) if constant(values)]
    if same:
        return test.without(
            ComputationStatus.CONSTANT, n, f"all {' and all '.join(same)} values are the same"
        )
    return None


def _ties(x: Array, y: Array) -> str:
    """How many values share their rank with another, "" for none."""
    parts = [
        f"{shared} of the {name}"
        for name, values in (("first", x), ("second", y))
        if (shared := tied(values))
    ]
    return f"ties: {' and '.join(parts)} values" if parts else ""
