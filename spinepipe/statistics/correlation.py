"""Rank correlation of two sets of values."""

from numpy.typing import ArrayLike
from scipy import stats

from spinepipe.statistics.outcome import Array, Ended, Outcome, Test, constant, finite_pairs, tied
from spinepipe.statistics.spearman_null import LARGEST, exact_p

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
