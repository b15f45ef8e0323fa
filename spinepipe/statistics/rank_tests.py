"""Rank tests of groups and pairs, with p values that also hold for few values and with ties.

Wilcoxon's signed rank sum has its exact distribution here: scipy's exact one holds without ties
only, and its permutations take a second for 14 differences. So has Friedman's statistic, for which
scipy has chi-squared's alone.
"""

from collections.abc import Sequence
from functools import lru_cache
from itertools import combinations, permutations
from math import factorial, prod

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import stats

from spinepipe.statistics.outcome import (
    Array,
    ComputationStatus,
    StatisticalTest,
    Test,
    constant,
    finite,
    finite_pairs,
    tied,
)

FEWEST_GROUPS = 2

MOST_ARRANGEMENTS = 20_000
"""Up to so many ways to deal the values out to the groups, p is counted over all of them."""

FEWEST_FOR_CHI_SQUARED = 5
"""Values that every group needs before chi-squared is near the truth (Kruskal and Wallis 1952)."""

ARRANGEMENTS_AT_ONCE = 500

ROUNDING = 1e-12
"""Share within which sums of squared ranks are one."""

SEED = 1952

KRUSKAL_WALLIS = Test("Kruskal-Wallis", "H", "epsilon squared")


def kruskal_wallis(groups: Sequence[ArrayLike]) -> StatisticalTest:
    """Kruskal and Wallis' rank sum test of independent groups, H corrected for ties.

    Groups that hold the same specimens are paired, not independent: `friedman` (or
    `wilcoxon_signed_rank` for two) is the test for them.

    Parameters
    ----------
    groups : the values of each group, (n,) each; the groups may differ in length, and a group of a
        single value is too few.

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
    p, how = _p_of_groups(values, float(found.pvalue))
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


def _refused(groups: Sequence[Array], n: int) -> StatisticalTest | None:
    """The outcome of groups that cannot be compared, or None."""
    empty = sum(len(group) == 0 for group in groups)
    if len(groups) < FEWEST_GROUPS or empty or n == len(groups):
        message = f"{n} values in {len(groups)} groups, {empty} of them empty; at least "
        return KRUSKAL_WALLIS.without(
            ComputationStatus.TOO_FEW, n, f"{message}{FEWEST_GROUPS} groups of two values needed"
        )
    if constant(np.concatenate(groups)):
        return KRUSKAL_WALLIS.without(ComputationStatus.CONSTANT, n, "all values are the same")
    alone = sum(len(group) == 1 for group in groups)
    if alone:
        message = f"{alone} of {len(groups)} groups with a single value; each needs two"
        return KRUSKAL_WALLIS.without(ComputationStatus.TOO_FEW, n, message)
    return None


def _p_of_groups(groups: Sequence[Array], approximate: float) -> tuple[float, str]:
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
    sizes = tuple(len(group) for group in groups)
    if factorial(len(ranks)) // prod(map(factorial, sizes)) <= MOST_ARRANGEMENTS:
        # H grows with the sum of squared rank sums over sizes, the rest is the same in all dealings
        dealings = _dealings(sizes)  # the first is as the groups are
        found = _between(*np.split(ranks[dealings], np.cumsum(sizes)[:-1], axis=1), axis=1)
        return float(np.mean(found >= found[0] * (1.0 - ROUNDING)))
    dealt = np.split(ranks, np.cumsum(sizes)[:-1])
    at_random = stats.permutation_test(
        dealt,
        _between,
        vectorized=True,
        n_resamples=MOST_ARRANGEMENTS,
        alternative="greater",
        rng=np.random.default_rng(SEED),
    )
    return float(at_random.pvalue)


@lru_cache(maxsize=4)
def _dealings(sizes: tuple[int, ...]) -> NDArray[np.int8]:
    """(ways, n) all ways to deal n places out to groups of these sizes, group after group."""
    dealt = np.zeros((1, 0), dtype=np.int8)
    left = np.arange(sum(sizes), dtype=np.int8)[None]
    for size in sizes:
        chosen = np.array(list(combinations(range(left.shape[1]), size)), dtype=np.int64)
        others = np.array(
            [np.setdiff1d(np.arange(left.shape[1]), one) for one in chosen], dtype=np.int64
        ).reshape(len(chosen), -1)
        taken = left[:, chosen].reshape(-1, size)
        dealt = np.hstack([np.repeat(dealt, len(chosen), axis=0), taken])
        left = left[:, others].reshape(len(dealt), -1)
    return dealt


def _between(*ranks: NDArray[np.float64], axis: int) -> Array:
    """What grows with H when the same ranks are dealt out anew, along one axis."""
    shares = [group.sum(axis=axis) ** 2 / group.shape[axis] for group in ranks]
    total: Array = np.sum(shares, axis=0)
    return total


FEWEST_BLOCKS, FEWEST_TREATMENTS = 2, 3

MOST_SUMS = 5_000_000
"""Up to so many sums of ranks, a second of work, p is counted over all orders in the blocks."""

MOST_TREATMENTS = 8
"""More have too many orders to be listed."""

FEWEST_BLOCKS_FOR_CHI_SQUARED = 10
"""Of fewer blocks chi-squared's p of 0.05 is up to a third too large, and its 0.001 tenfold."""

FRIEDMAN = Test("Friedman", "chi2", "Kendall's W")


def friedman(grid: ArrayLike) -> StatisticalTest:
    """Friedman's rank sum test of unreplicated complete blocks, corrected for ties.

    Parameters
    ----------
    grid : (blocks, treatments); the values of a block are ranked among each other.

    p is exact where it can be counted: up to 100 blocks of 3 treatments, 20 of 4, 10 of 5, 6 of 6,
    fewer where many different ranks are tied. Else it is chi-squared's with treatments - 1 degrees
    of freedom of 10 blocks or more, and the share among 20,000 random orders (fixed seed) of fewer.
    The message says which, and chi-squared's p if another was taken.

    Effect size: Kendall's W = chi2 / (blocks (treatments - 1)), 0 no agreement between the
    blocks' orders, 1 the same order in all.
    """
    values = finite(grid, dimensions=2)
    blocks, treatments = values.shape
    if blocks < FEWEST_BLOCKS or treatments < FEWEST_TREATMENTS:
        return FRIEDMAN.without(
            ComputationStatus.TOO_FEW,
            blocks,
            f"{blocks} blocks of {treatments} treatments; at least "
            f"{FEWEST_BLOCKS} of {FEWEST_TREATMENTS} are needed",
        )
    if (values == values[:, :1]).all():
        return FRIEDMAN.without(
            ComputationStatus.CONSTANT, blocks, "within every block all values are equal"
        )
    found = stats.friedmanchisquare(*values.T)
    effect = found.statistic / (blocks * (treatments - 1))
    tied = sum(len(np.unique(block)) < treatments for block in values)
    p, how = _p_of_blocks(values, float(found.pvalue))
    message = f"{how}; ties: in {tied} of {blocks} blocks" if tied else how
    return FRIEDMAN.done(found.statistic, p, blocks, effect, message)


def _p_of_blocks(values: Array, approximate: float) -> tuple[float, str]:
    """p, and where it comes from."""
    doubled = np.rint(2.0 * stats.rankdata(values, axis=1)).astype(np.int64)  # mid-ranks are halves
    observed = int(np.sum(doubled.sum(axis=0) ** 2))
    blocks = sorted(tuple(sorted(block)) for block in doubled.tolist())
    tail = _tail_of_blocks(tuple(blocks))
    if tail is not None:
        return min(1.0, float(tail[observed])), f"exact p, by chi-squared {approximate:.2g}"
    if len(blocks) >= FEWEST_BLOCKS_FOR_CHI_SQUARED:
        return approximate, "chi-squared p"
    rng, beyond = np.random.default_rng(SEED), 1
    for _ in range(MOST_ARRANGEMENTS // ARRANGEMENTS_AT_ONCE):
        orders = np.broadcast_to(doubled, (ARRANGEMENTS_AT_ONCE, *doubled.shape))
        sums = rng.permuted(orders, axis=2).sum(axis=1)
        beyond += int(np.sum(np.sum(sums**2, axis=1) >= observed))
    how = f"p from {MOST_ARRANGEMENTS} random arrangements, by chi-squared {approximate:.2g}"
    return beyond / (MOST_ARRANGEMENTS + 1), how


@lru_cache(maxsize=32)
def _tail_of_blocks(blocks: tuple[tuple[int, ...], ...]) -> Array | None:
    """Chance that the squares of the treatments' sums of ranks add up to at least 0, 1, ...

    Every order of the ranks in a block is as likely as any other, so the sums are counted block by
    block, in ascending order: which treatment has which sum makes no difference to what comes next.
    None where there are too many.
    """
    treatments, base = len(blocks[0]), sum(blocks[0]) * len(blocks) + 1
    if treatments > MOST_TREATMENTS or base ** (treatments - 1) > np.iinfo(np.int64).max:
        return None
    # A state is the sorted sums of ranks, and its key these as digits of one number; the last sum
    # follows from the others.
    digits = base ** np.arange(treatments - 1)
    counted, sums, chance = 0, np.array(blocks[:1], dtype=np.int32), np.ones(1)
    for block in blocks[1:-1]:
        counted += len(sums) * _orders(block)
        if counted > MOST_SUMS:
            return None
        # every state meets every order of the block's ranks; equal states are added up
        ways = np.array(list(set(permutations(block))), dtype=np.int32)
        every = np.sort((sums[:, None] + ways).reshape(-1, treatments), axis=1)
        keys, at = np.unique(every[:, :-1] @ digits, return_inverse=True)
        one = np.empty(len(keys), dtype=np.int64)
        one[at] = np.arange(len(at))
        shares = np.bincount(at, np.repeat(chance / len(ways), len(ways)))
        sums, chance = every[one], shares.astype(np.float64)
    if len(sums) * _orders(blocks[-1]) > 2 * MOST_SUMS:
        return None
    # of the last block only the squares are asked: |s + w|^2 = |s|^2 + 2 s w + |w|^2
    ways = np.array(list(set(permutations(blocks[-1]))))
    sums = sums.astype(np.int64)
    squares = np.sum(sums**2, axis=1)[:, None] + 2 * sums @ ways.T + sum(np.square(blocks[-1]))
    share = np.bincount(squares.ravel(), np.repeat(chance / len(ways), len(ways)))
    found: Array = np.cumsum(share[::-1], dtype=np.float64)[::-1]
    return found


def _orders(block: tuple[int, ...]) -> int:
    """How many different orders the ranks of a block have."""
    return factorial(len(block)) // prod(factorial(block.count(rank)) for rank in set(block))


LARGEST = 50
"""Up to so many differences."""


def signed_rank_p(v: float, ranks: Array) -> float:
    """Two-sided p of a rank sum v: the doubled smaller tail over all signs of the ranks (n,)."""
    # probability that twice the rank sum is 0, 1, ...: mid-ranks are halves, doubled whole; each
    # rank is in the sum or not, with equal chance
    doubled = np.rint(2.0 * ranks).astype(int)
    share = np.eye(1, doubled.sum() + 1)[0]
    for rank in doubled:
        moved = np.zeros_like(share)
        moved[rank:] = share[:-rank]  # nothing is lost off the end: no sum is above the total
        share = 0.5 * (share + moved)
    place = round(2.0 * v)
    return float(min(1.0, 2.0 * min(share[: place + 1].sum(), share[place:].sum())))


FEWEST = 4
"""Fewer differing pairs have p of 0.25 or more, whatever their values."""

SAME = 1e-12
"""Differences closer than this share of the largest value are equal: 0.3 - 0.2 = 0.2 - 0.1."""

SIGNED_RANK = Test("Wilcoxon signed rank", "V", "rank-biserial r")


def wilcoxon_signed_rank(x: ArrayLike, y: ArrayLike) -> StatisticalTest:
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
        return SIGNED_RANK.without(ComputationStatus.CONSTANT, n, f"all {n} pairs are equal")
    if left < FEWEST:
        message = f"{left} of {n} pairs differ; at least {FEWEST} are needed"
        return SIGNED_RANK.without(ComputationStatus.TOO_FEW, n, message)
    ranks = stats.rankdata(np.abs(differences))
    v, total = float(ranks[differences > 0.0].sum()), left * (left + 1) / 2
    # above the largest count scipy's normal approximation, corrected for ties and continuity
    p = (
        signed_rank_p(v, ranks)
        if left <= LARGEST
        else stats.wilcoxon(differences, correction=True).pvalue
    )
    return SIGNED_RANK.done(v, p, n, 2.0 * v / total - 1.0, _message(differences, n - left))


def _differences(x: Array, y: Array) -> Array:
    """x - y where they differ, in steps of what rounding can tell apart."""
    # steps of `SAME` times the largest value: what is closer than rounding is tied
    largest = max(np.abs(x).max(initial=0.0), np.abs(y).max(initial=0.0))
    if largest == 0.0:
        return np.empty(0)
    steps: Array = np.round((x / largest - y / largest) / SAME)
    return steps[steps != 0.0]


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
