"""Kruskal-Wallis test of independent groups, with a p that also holds for few values."""

from collections.abc import Sequence
from math import factorial, prod

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import stats

from spinepipe.statistics.outcome import Array, Ended, Outcome, Test, constant, finite, tied

FEWEST_GROUPS = 2

MOST_ARRANGEMENTS = 20_000
"""Up to so many ways to deal the values out to the groups, p is counted over all of them."""

FEWEST_FOR_CHI_SQUARED = 5
"""Values that every group needs before chi-squared is near the truth (Kruskal and Wallis 1952)."""

SEED = 1952

KRUSKAL_WALLIS = Test("Kruskal-Wallis", "H", "epsilon squared")


def kruskal_wallis(groups: Sequence[ArrayLike]) -> Outcome:
    """Kruskal and Wallis' rank sum test of independent groups, H corrected for ties.

    Groups that hold the same specimens are paired, not independent: `friedman` (or
    `wilcoxon_signed_rank` for two) is the test for them.

    Parameters
    ----------
    groups : the values of each group, (n,) each; the groups may differ in length.

    p is exact where the values can be dealt out in at most 20,000 ways (two groups of up to 8,
    three of up to 3). Above that it is chi-squared's with groups - 1 degrees of freedom if all
    groups have 5 values or more, else the share among 20,000 random dealings (fixed seed). The
    message says which, chi-squared's p if another was taken, and `critical_h`.

    Effect size: epsilon squared = H / (n - 1), the share of the ranks' sum of squares that lies
    between the groups, 0 to 1.
    """
    values = [finite(group) for group in groups]
    n = sum(len(group) for group in values)
    refused = _refused(values, n)
    if refused:
        return refused
    found = stats.kruskal(*values)
    h = max(float(found.statistic), 0.0)  # groups of the same mean rank may leave -1e-15
    critical = f"H_c {critical_h(len(values)):.2f} (df {len(values) - 1})"
    ties = tied(np.concatenate(values))
    p, how = _p(values, float(found.pvalue))
    message = [critical, how, f"ties: {ties} of {n} values" if ties else ""]
    return KRUSKAL_WALLIS.done(h, p, n, h / (n - 1), "; ".join(filter(None, message)))


def critical_h(groups: int, p_below: float = 0.05) -> float:
    """H above which chi-squared's p is below a level; 3.84 for two groups, 5.99 for three.

    Raises
    ------
    ValueError
        For fewer than two groups.
    """
    if groups < FEWEST_GROUPS:
        raise ValueError(f"H needs at least {FEWEST_GROUPS} groups, found {groups}")
    return float(stats.chi2.isf(p_below, groups - 1))


def _refused(groups: Sequence[Array], n: int) -> Outcome | None:
    """The outcome of groups that cannot be compared, or None."""
    empty = sum(len(group) == 0 for group in groups)
    if len(groups) < FEWEST_GROUPS or empty or n == len(groups):
        message = f"{n} values in {len(groups)} groups, {empty} of them empty; at least "
        return KRUSKAL_WALLIS.without(
            Ended.TOO_FEW, n, f"{message}{FEWEST_GROUPS} groups with values, one with two, needed"
        )
    if constant(np.concatenate(groups)):
        return KRUSKAL_WALLIS.without(Ended.CONSTANT, n, "all values are the same")
    return None


def _p(groups: Sequence[Array], approximate: float) -> tuple[float, str]:
    """p, and where it comes from."""
    sizes = [len(group) for group in groups]
    ways = factorial(sum(sizes)) // prod(factorial(size) for size in sizes)
    if ways <= MOST_ARRANGEMENTS:
        how = "exact p"
    elif min(sizes) >= FEWEST_FOR_CHI_SQUARED:
        return approximate, "chi-squared p"
    else:
        how = f"p from {MOST_ARRANGEMENTS} random arrangements"
    return _dealt_p(groups), f"{how}, by chi-squared {approximate:.2g}"


def _dealt_p(groups: Sequence[Array]) -> float:
    """Share of dealings, all or at random, with an H at least as large."""
    ranks = stats.rankdata(np.concatenate(groups))
    dealt = np.split(ranks, np.cumsum([len(group) for group in groups])[:-1])
    found = stats.permutation_test(
        dealt,
        _between,
        vectorized=True,
        n_resamples=MOST_ARRANGEMENTS,
        alternative="greater",
        rng=np.random.default_rng(SEED),
    )
    return float(found.pvalue)


def _between(*ranks: NDArray[np.float64], axis: int) -> Array:
    """What grows with H when the same ranks are dealt out anew, along one axis."""
    shares = [group.sum(axis=axis) ** 2 / group.shape[axis] for group in ranks]
    total: Array = np.sum(shares, axis=0)
    return total
