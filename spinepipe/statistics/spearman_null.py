"""Exact distribution of Spearman's rho among few untied pairs; scipy has the t approximation.

The approximation is wrong where it matters in a large family of tests of ten pairs: at rho = 1 it
gives p = 0, while one ordering in 10! has p = 5.5e-7 and can be no rarer.
"""

from functools import cache

import numpy as np

from spinepipe.statistics.outcome import Array

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
