"""Rank tests of groups and pairs, and the F test of nested fits, against published examples.

Catches a rank test or F test that differs from the published numbers.
"""

import math
from itertools import combinations, product

import numpy as np
import pytest
import statsmodels.api as sm
from scipy import stats
from sweeps import sweep

from spinepipe.statistics import (
    ComputationStatus,
    critical_h,
    f_test_nested,
    kruskal_wallis,
    wilcoxon_signed_rank,
)

FERTILISERS = [[6, 8, 4, 5, 3, 4], [8, 12, 9, 11, 6, 8], [13, 9, 11, 8, 7, 12]]
"""Plant growth of the encyclopaedia's one-way example; kruskal.test of R: 9.4207, p = 0.009002."""

MEMBRANES = (
    [0.80, 0.83, 1.89, 1.04, 1.45, 1.38, 1.91, 1.64, 0.73, 1.46],
    [1.15, 0.88, 0.90, 0.74, 1.21],
)
"""Permeability, Hollander and Wolfe 1973, p. 69; R's wilcox.test: one-sided exact p = 0.1272."""

DEPRESSION = (
    [1.83, 0.50, 1.62, 2.48, 1.68, 1.88, 1.55, 3.06, 1.30],
    [0.878, 0.647, 0.598, 2.05, 1.06, 1.29, 1.06, 3.14, 1.29],
)
"""Hollander and Wolfe 1973, p. 29; R's example of wilcox.test: V = 40, one-sided p = 0.01953."""

MAIZE = [6, 8, 14, 16, 23, 24, 28, 29, 41, -48, 49, 56, 60, -67, 75]
"""Differences of Darwin's 15 pairs (eighths of an inch); scipy's example of wilcoxon."""


# Kruskal-Wallis


def test_kruskal_wallis_gives_the_published_result_with_ties() -> None:
    found = kruskal_wallis(FERTILISERS)
    assert found.statistic == pytest.approx(9.4207, abs=5e-5)
    assert found.p == pytest.approx(0.009002, abs=5e-7)
    assert (found.n, found.status) == (18, ComputationStatus.DONE)
    # 3 5 7 13 stand alone; 4 6 8 9 11 12 share their ranks
    assert found.message == "H_c 5.99 (df 2); chi-squared p; ties: 14 of 18 values"


@sweep(
    "groups, h, p",
    [
        ([[1, 2], [3, 4], [5, 6]], 4.5714, 0.067),
        ([[1, 2, 3], [4, 5, 6], [7, 8, 9]], 7.2, 0.004),
        ([[1, 2, 3], [4, 5, 9], [6, 7, 8]], 5.6, 0.050),
    ],
)
def test_few_values_have_the_p_of_kruskal_and_wallis_1952(groups, h: float, p: float) -> None:
    found = kruskal_wallis(groups)  # table 6.1 of that paper
    assert (found.statistic, found.p) == pytest.approx((h, p), abs=5e-4)
    assert "exact p" in found.message


def test_too_many_ways_to_count_are_drawn_at_random() -> None:
    # rank sums 14, 32, 32: H = 12 (14^2 + 32^2 + 32^2) / (4 12 13) - 39 = 4.1538
    groups = [[1, 2, 3, 8], [4, 6, 10, 12], [5, 7, 9, 11]]
    found, again = kruskal_wallis(groups), kruskal_wallis(groups)
    ranks = np.concatenate(groups)
    null = [_sum_of_squares(*two) for two in _two_of_three(ranks)]
    exact = np.mean(np.array(null) >= 14**2 + 32**2 + 32**2)
    assert found.statistic == pytest.approx(4.1538, abs=5e-5)
    assert found.p == pytest.approx(exact, abs=3 * math.sqrt(exact * (1 - exact) / 20_000))
    assert "20000 random arrangements" in found.message
    assert found == again


def _two_of_three(ranks):
    """The first two of three groups of four, dealt out in all 34,650 ways."""
    everyone = set(ranks.tolist())
    for first in combinations(sorted(everyone), 4):
        for second in combinations(sorted(everyone - set(first)), 4):
            yield first, second


def _sum_of_squares(first, second) -> int:
    """Sum of the squared rank sums of three groups of 1 to 12."""
    return sum(first) ** 2 + sum(second) ** 2 + (78 - sum(first) - sum(second)) ** 2


def test_two_groups_are_the_exact_rank_sum_test() -> None:
    found = kruskal_wallis(MEMBRANES)
    assert found.p == pytest.approx(2 * 0.1272, abs=1e-4)
    # W = 35 of 10 and 5 values: z^2 without continuity correction
    assert found.statistic == pytest.approx((35 - 25) ** 2 / (10 * 5 * 16 / 12), rel=1e-12)
    assert found.message == "H_c 3.84 (df 1); exact p, by chi-squared 0.22"


def test_the_exact_p_counts_ties() -> None:
    """1 1 2 against 2 3 3: of 20 ways to choose three, those with both ones or both threes."""
    found = kruskal_wallis([[1, 1, 2], [2, 3, 3]])
    mid_ranks = [1.5, 1.5, 3.5, 3.5, 5.5, 5.5]
    sums = [sum(chosen) for chosen in combinations(mid_ranks, 3)]
    extreme = sum(abs(total - 10.5) >= abs(6.5 - 10.5) for total in sums)
    assert found.p == pytest.approx(extreme / 20, abs=1e-12)
    assert "ties: 6 of 6 values" in found.message


def test_the_effect_is_the_share_of_ranks_between_the_groups() -> None:
    found = kruskal_wallis([[1, 2, 6], [3, 4, 5, 7]])
    # ranks 1..7 about 4: total 28; means 3 and 4.75
    between = 3 * (3 - 4) ** 2 + 4 * (4.75 - 4) ** 2
    assert found.effect == pytest.approx(between / 28, rel=1e-12)
    assert found.effect_name == "epsilon squared"


def test_groups_of_the_same_mean_rank_do_not_differ() -> None:
    found = kruskal_wallis([[1, 4], [2, 3]])
    assert (found.statistic, found.p, found.effect) == pytest.approx((0.0, 1.0, 0.0), abs=1e-12)


def test_neither_order_nor_unit_of_the_groups_matters() -> None:
    one = kruskal_wallis(FERTILISERS)
    other = kruskal_wallis([1e-3 * np.array(group) for group in FERTILISERS[::-1]])
    assert other.statistic == pytest.approx(one.statistic, rel=1e-12)
    assert other.p == pytest.approx(one.p, rel=1e-9)


def test_critical_h_is_that_of_the_degrees_of_freedom() -> None:
    # two groups: a squared normal deviate; three: an exponential of mean 2
    assert critical_h(2) == pytest.approx(1.959964**2, rel=1e-6)
    assert critical_h(3) == pytest.approx(-2 * math.log(0.05), rel=1e-12)
    assert critical_h(3, 0.01) == pytest.approx(-2 * math.log(0.01), rel=1e-12)
    with pytest.raises(ValueError, match="2 groups, found 1"):
        critical_h(1)


@sweep("groups", [[], [[1, 2, 3]], [[1, 2], []], [[1], [2], [3]]])
def test_groups_that_cannot_be_compared(groups) -> None:
    found = kruskal_wallis(groups)
    assert (found.status, found.statistic, found.p) == (ComputationStatus.TOO_FEW, None, None)
    assert f"in {len(groups)} groups" in found.message


def test_groups_of_one_and_the_same_value_are_constant() -> None:
    found = kruskal_wallis([[0.1, 0.1], [0.1]])
    assert (found.status, found.p, found.n) == (ComputationStatus.CONSTANT, None, 3)


# Wilcoxon


def test_wilcoxon_gives_the_published_depression_result() -> None:
    found = wilcoxon_signed_rank(*DEPRESSION)
    assert (found.statistic, found.n) == (40.0, 9)
    assert found.p == pytest.approx(2 * 0.01953, abs=1e-5)
    # of the rank sum 45 only 5 lies below
    assert found.effect == pytest.approx((40 - 5) / 45, rel=1e-12)
    assert found.message == "exact p"


def test_wilcoxon_gives_the_published_maize_result() -> None:
    found = wilcoxon_signed_rank(MAIZE, np.zeros(15))
    assert found.statistic == 120 - 24
    assert found.p == pytest.approx(0.041259765625, abs=1e-12)


@sweep("n", [20, 50])
def test_wilcoxon_without_ties_agrees_with_another_library(n: int) -> None:
    x, y = np.random.default_rng(n).normal((0.3, 0.0), 1.0, size=(n, 2)).T
    found = stats.wilcoxon(x - y, method="exact")
    assert wilcoxon_signed_rank(x, y).p == pytest.approx(found.pvalue, rel=1e-9)


def test_the_smallest_p_of_fifteen_pairs_is_one_sign_in_2_to_the_14() -> None:
    x = np.arange(1.0, 16.0)
    for found, effect in (
        (wilcoxon_signed_rank(2 * x, x), 1.0),
        (wilcoxon_signed_rank(x, 2 * x), -1.0),
    ):
        assert found.p == pytest.approx(2.0**-14, rel=1e-12)
        assert found.effect == effect


def test_ties_have_the_p_of_all_signs() -> None:
    differences = np.array([1, -1, 2, 2, 2, -3, 4, 4.0])
    ranks = np.array([1.5, 1.5, 4, 4, 4, 6, 7.5, 7.5])
    sums = np.array([np.dot(signs, ranks) for signs in product((0, 1), repeat=8)])
    v = 36 - 1.5 - 6
    found = wilcoxon_signed_rank(differences, np.zeros(8))
    assert found.statistic == v
    assert found.p == pytest.approx(min(1.0, 2 * np.mean(sums >= v)), abs=1e-12)
    assert found.message == "exact p; ties: 7 of 8 differences"


def test_equal_pairs_are_left_out_and_counted() -> None:
    found = wilcoxon_signed_rank([5, 6, 7, 8, 9, 3], [1, 1, 1, 1, 10, 3])
    # differences 4 5 6 7 -1 are ranked; the last pair is equal
    assert (found.statistic, found.n) == (14.0, 6)
    assert found.p == pytest.approx(2 * 2 / 2**5)
    assert found.message == (
        "exact p; equal pairs left out: 1; with 5 differences p is never below 0.0625"
    )


def test_many_pairs_take_the_normal_approximation_with_ties() -> None:
    differences = np.array([1.0, -2.0, 2.0] * 20)
    # mid-ranks 10.5 of twenty and 40.5 of forty
    v, mean = 20 * (10.5 + 40.5), 60 * 61 / 4
    variance = 60 * 61 * 121 / 24 - (20**3 - 20 + 40**3 - 40) / 48
    z = (v - mean - 0.5) / math.sqrt(variance)
    found = wilcoxon_signed_rank(differences, np.zeros(60))
    assert found.statistic == v
    assert found.p == pytest.approx(math.erfc(z / math.sqrt(2)), rel=1e-9)
    assert found.message == "approximate p; ties: 60 of 60 differences"


def test_exchanging_the_two_turns_the_effect() -> None:
    one, other = wilcoxon_signed_rank(*DEPRESSION), wilcoxon_signed_rank(*DEPRESSION[::-1])
    assert other.effect == pytest.approx(-one.effect)
    assert other.statistic == 45 - one.statistic
    assert other.p == pytest.approx(one.p, rel=1e-12)


@sweep("values", [[1.0, 2.0, 3.0, 4.0], [0.0, 0.0]])
def test_pairs_without_a_difference(values) -> None:
    found = wilcoxon_signed_rank(values, values)
    assert (found.status, found.p, found.n) == (ComputationStatus.CONSTANT, None, len(values))


def test_three_differences_are_too_few() -> None:
    found = wilcoxon_signed_rank([1, 2, 3, 4], [2, 3, 5, 4])
    assert (found.status, found.p, found.n) == (ComputationStatus.TOO_FEW, None, 4)
    assert found.message == "3 of 4 pairs differ; at least 4 are needed"
    assert wilcoxon_signed_rank([], []).status is ComputationStatus.TOO_FEW


def test_what_is_not_finite_or_has_no_partner_is_refused() -> None:
    with pytest.raises(ValueError, match="pairs"):
        wilcoxon_signed_rank([1, 2, 3], [1, 2])
    for test in (wilcoxon_signed_rank, lambda *groups: kruskal_wallis(groups)):
        with pytest.raises(ValueError, match="finite"):
            test([1, 2, np.nan], [1, 2, 3])


# nested fits


def test_f_test_gives_the_published_puromycin_result() -> None:
    """One Michaelis constant or two, Bates and Watts 1988, chapter 3: F = 1.7, p = 0.21."""
    found = f_test_nested(2241, 20, 2055, 19)
    assert found.statistic == pytest.approx(1.7, abs=0.05)
    assert found.p == pytest.approx(0.21, abs=0.005)
    assert (found.status, found.message) == (ComputationStatus.DONE, "F(1, 19)")


def test_two_further_parameters_have_a_closed_form() -> None:
    found = f_test_nested(10.0, 12, 5.0, 10)
    assert found.statistic == pytest.approx((5 / 2) / (5 / 10))
    assert found.p == pytest.approx((1 + 2 * 5 / 10) ** -5, rel=1e-12)
    assert found.effect == pytest.approx(0.5)


def test_f_test_agrees_with_another_library() -> None:
    rng = np.random.default_rng(2)
    x = sm.add_constant(rng.normal(size=(30, 4)))
    y = x @ [1.0, 0.5, 0.0, 0.4, 0.1] + rng.normal(size=30)
    small, large = sm.OLS(y, x[:, :3]).fit(), sm.OLS(y, x).fit()
    f, p, _ = large.compare_f_test(small)
    found = f_test_nested(small.ssr, int(small.df_resid), large.ssr, int(large.df_resid))
    assert (found.statistic, found.p) == pytest.approx((f, p), rel=1e-9)


def test_a_larger_model_that_fits_worse_says_so() -> None:
    found = f_test_nested(4.0, 12, 5.0, 10)
    assert (found.statistic, found.p, found.effect) == (0.0, 1.0, 0.0)
    assert found.message == "F(2, 10); the larger model fits worse (5 against 4)"
    assert f_test_nested(4.0, 12, 4.0 * (1 + 1e-13), 10).message == "F(2, 10)"


def test_fits_without_residual_have_no_test() -> None:
    exact, none_left = f_test_nested(1.0, 5, 0.0, 3), f_test_nested(1.0, 1, 0.0, 0)
    assert (exact.status, exact.p) == (ComputationStatus.CONSTANT, None)
    assert (none_left.status, none_left.p) == (ComputationStatus.TOO_FEW, None)


@sweep("bad", [(1.0, 10, 0.5, 10), (-1.0, 10, 0.5, 8), (1.0, 10, math.nan, 8)])
def test_what_can_be_no_nested_fits_is_refused(bad) -> None:
    with pytest.raises(ValueError, match=r"degrees of freedom|not negative"):
        f_test_nested(*bad)
