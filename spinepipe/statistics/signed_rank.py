"""Wilcoxon's signed rank test of paired values."""

import numpy as np
from numpy.typing import ArrayLike
from scipy import stats

from spinepipe.statistics.outcome import Array, Ended, Outcome, Test, finite_pairs, tied
from spinepipe.statistics.signed_rank_null import LARGEST, exact_p

FEWEST = 4
"""Fewer differing pairs have p of 0.25 or more, whatever their values."""

SAME = 1e-12
"""Differences closer than this share of the largest value are equal: 0.3 - 0.2 = 0.2 - 0.1."""

SIGNED_RANK = Test("Wilcoxon signed rank", "V", "rank-biserial r")


def wilcoxon_signed_rank(x: ArrayLike, y: ArrayLike) -> Outcome:
    """Wilcoxon's signed rank test of pairs x (n,) and y (n,), two-sided.

    The statistic V is the sum of the ranks of the pairs with x above y. Pairs without a
    difference are left out (Wilcoxon's way) and counted in the message; n counts them too.

    p is exact up to 50 differences, also with ties; above, it is scipy's normal approximation
    with correction for ties and continuity.

    Effect size: matched-pairs rank-biserial correlation (Kerby 2014), the share of the rank sum
    with x above y less the share below: 1 if x is always above, -1 if always below.
    """
    first, second = finite_pairs(x, y)
    n, differences = len(first), _differences(first, second)
    left = len(differences)
    if left == 0 < n:
        return SIGNED_RANK.without(Ended.CONSTANT, n, f"all {n} pairs are equal")
    if left < FEWEST:
        message = f"{left} of {n} pairs differ; at least {FEWEST} are needed"
        return SIGNED_RANK.without(Ended.TOO_FEW, n, message)
    ranks = stats.rankdata(np.abs(differences))
    v, total = float(ranks[differences > 0.0].sum()), left * (left + 1) / 2
    message = _message(differences, n - left)
    return SIGNED_RANK.done(v, _p(differences, ranks, v), n, 2.0 * v / total - 1.0, message)


def _differences(x: Array, y: Array) -> Array:
    """x - y where they differ, in steps of what rounding can tell apart."""
    largest = max(np.abs(x).max(initial=0.0), np.abs(y).max(initial=0.0))
    if largest == 0.0:
        return np.empty(0)
    steps: Array = np.round((x / largest - y / largest) / SAME)
    return steps[steps != 0.0]


def _p(differences: Array, ranks: Array, v: float) -> float:
    """Two-sided p."""
    if len(ranks) <= LARGEST:
        return exact_p(v, ranks)
    return float(stats.wilcoxon(differences, correction=True).pvalue)


def _message(differences: Array, equal: int) -> str:
    """What a reader of the numbers must know."""
    left, ties = len(differences), tied(np.abs(differences))
    lowest = 2.0 ** (1 - left)
    parts = (
        "exact p" if left <= LARGEST else "approximate p",
        f"equal pairs left out: {equal}" if equal else "",
        f"ties: {ties} of {left} differences" if ties else "",
        f"with {left} differences p is never below {lowest:.3g}" if lowest > 0.05 else "",
    )
    return "; ".join(filter(None, parts))
