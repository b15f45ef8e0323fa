"""Statistics against published examples, hand-worked cases and closed forms.

Catches a statistic or p-value that is not the published one.
"""

import math
from itertools import pairwise, permutations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats
from statsmodels.stats.multitest import multipletests
from sweeps import sweep

from spinepipe.statistics import (
    ComputationStatus,
    bland_altman,
    chi_squared_normality,
    corrected,
    f_test_nested,
    family_size,
    friedman,
    kendall,
    kolmogorov_smirnov_normality,
    lilliefors_normality,
    rank_tests,
    spearman,
)

HUNTER = [44.4, 45.9, 41.9, 53.3, 44.7, 44.1, 50.7, 45.2, 60.1]
PANEL = [2.6, 3.1, 2.5, 5.0, 3.6, 4.0, 5.2, 2.8, 3.8]
"""Tuna lightness and panel scores, Hollander and Wolfe 1973, p. 187; R's example of cor.test."""

ROUNDING = [
    *([5.40, 5.50, 5.55], [5.85, 5.70, 5.75], [5.20, 5.60, 5.50], [5.55, 5.50, 5.40]),
    *([5.90, 5.85, 5.70], [5.45, 5.55, 5.60], [5.40, 5.40, 5.35], [5.45, 5.50, 5.35]),
    *([5.25, 5.15, 5.00], [5.85, 5.80, 5.70], [5.25, 5.20, 5.10], [5.65, 5.55, 5.45]),
    *([5.60, 5.35, 5.45], [5.05, 5.00, 4.95], [5.50, 5.50, 5.40], [5.45, 5.55, 5.50]),
    *([5.55, 5.55, 5.35], [5.45, 5.50, 5.55], [5.50, 5.45, 5.25], [5.65, 5.60, 5.40]),
    *([5.70, 5.65, 5.55], [6.30, 6.30, 6.25]),
]
"""Times of 22 players rounding first base, Hollander and Wolfe 1973, p. 140; R's friedman.test."""

WRIGHT = [494, 395, 516, 434, 476, 557, 413, 442, 650, 433, 417, 656, 267, 478, 178, 423, 427]
MINI = [512, 430, 520, 428, 500, 600, 364, 380, 658, 445, 432, 626, 260, 477, 259, 350, 451]
"""Peak expiratory flow (l/min) by two meters, Bland and Altman 1986, table 1, first readings."""

NORMALITY = [chi_squared_normality, kolmogorov_smirnov_normality, lilliefors_normality]
CORRELATIONS = [spearman, kendall]


def normal_cdf(z: float) -> float:
    return 0.5 * math.erfc(-z / math.sqrt(2.0))


# correlation


def test_kendall_gives_the_published_tuna_result() -> None:
    found = kendall(HUNTER, PANEL)
    assert found.effect == pytest.approx(0.4444444, abs=5e-8)
    assert found.p == pytest.approx(0.1194, abs=5e-5)
    assert (found.n, found.status, found.message) == (9, ComputationStatus.DONE, "")


def test_spearman_gives_the_published_tuna_result() -> None:
    found = spearman(HUNTER, PANEL)  # R: S = 48, p-value = 0.0968, rho = 0.6
    assert found.statistic == found.effect == pytest.approx(0.6, abs=1e-12)
    assert found.p == pytest.approx(0.0968, abs=5e-5)
    assert found.message == "exact p"


@sweep("n", [4, 5, 6])
def test_spearman_p_is_the_share_of_orderings_as_extreme(n: int) -> None:
    ranks = np.arange(n)
    orders = list(permutations(range(n)))
    distances = np.array([sum((a - b) ** 2 for a, b in enumerate(order)) for order in orders])
    half = (n**3 - n) / 6
    for order, distance in list(zip(orders, distances, strict=True))[:: max(1, len(orders) // 24)]:
        extreme = np.abs(distances - half) >= abs(distance - half)
        assert spearman(ranks, order).p == pytest.approx(min(1.0, extreme.mean()), abs=1e-12)


def test_no_order_of_ten_is_rarer_than_one_in_their_number() -> None:
    ranks = np.arange(10.0)
    for y, rho in ((ranks**3, 1.0), (-ranks, -1.0)):
        found = spearman(ranks, y)
        assert found.effect == pytest.approx(rho, abs=1e-12)
        assert found.p == pytest.approx(2 / math.factorial(10), rel=1e-12)


def test_spearman_of_more_pairs_takes_the_t_approximation() -> None:
    x, y = np.arange(12.0), np.array([1, 0, 3, 2, 5, 4, 7, 6, 9, 8, 11, 10.0])
    rho = 1 - 6 * 12 / (12**3 - 12)  # each rank is one off
    t = rho * math.sqrt(10 / (1 - rho**2))
    found = spearman(x, y)
    assert found.effect == pytest.approx(rho, abs=1e-12)
    assert found.p == pytest.approx(2 * stats.t.sf(t, 10), rel=1e-9)
    assert found.message == ""


def test_kendall_tau_b_allows_for_ties() -> None:
    found = kendall([1, 2, 2, 3], [1, 2, 3, 4])
    # of 6 pairs 5 are concordant and one is tied in x
    assert found.effect == pytest.approx(5 / math.sqrt(5 * 6), abs=1e-12)
    assert found.message == "ties: 2 of the first values"


def test_spearman_with_ties_is_pearson_of_mid_ranks_and_says_so() -> None:
    x, y = [1, 2, 2, 3, 3, 3], [2, 1, 2, 4, 4, 5]
    found = spearman(x, y)
    mid_ranks = [1, 2.5, 2.5, 5, 5, 5], [2.5, 1, 2.5, 4.5, 4.5, 6]
    assert found.effect == pytest.approx(np.corrcoef(*mid_ranks)[0, 1], abs=1e-12)
    assert found.message == "exact p; ties: 5 of the first and 4 of the second values"


def test_spearman_of_four_pairs_with_ties_is_never_certain() -> None:
    """In two of 24 orderings the tied pairs meet so: one in twelve, to either side one in six."""
    found = spearman([1, 1, 2, 3], [1, 1, 2, 3])
    assert (found.effect, found.p) == (pytest.approx(1.0), pytest.approx(1.0 / 6.0))


@given(st.integers(4, 6), st.integers(2, 5), st.integers(0, 10**6))
def test_spearman_p_with_ties_is_the_share_of_orderings(n: int, levels: int, seed: int) -> None:
    x, y = np.random.default_rng(seed).integers(0, levels, (2, n))
    found = spearman(x, y)
    if found.status is not ComputationStatus.DONE:
        return
    first, second = stats.rankdata(x), np.array(list(permutations(stats.rankdata(y))))
    every, own = second @ first, first @ stats.rankdata(y)
    tails = np.mean(every >= own - 1e-9), np.mean(every <= own + 1e-9)
    assert found.p == pytest.approx(min(1.0, 2.0 * min(tails)))
    for one, other in ((y, x), (x[::-1], y[::-1]), (-x, -y), (x, -y)):
        assert spearman(one, other).p == pytest.approx(found.p)


@sweep("test", CORRELATIONS)
def test_a_constant_has_no_correlation(test) -> None:
    found = test([1, 2, 3, 4, 5], [7, 7, 7, 7, 7])
    assert (found.statistic, found.p, found.effect) == (None, None, None)
    assert (found.status, found.n) == (ComputationStatus.CONSTANT, 5)
    assert "second" in found.message
    assert "first" not in found.message


@sweep("test", CORRELATIONS)
def test_three_pairs_are_too_few(test) -> None:
    found = test([1, 2, 3], [1, 3, 2])
    assert (found.p, found.status, found.n) == (None, ComputationStatus.TOO_FEW, 3)
    assert test([1, 2, 3, 4], [1, 3, 2, 4]).status is ComputationStatus.DONE


@sweep("test", CORRELATIONS)
@sweep("bad", [np.nan, np.inf])
def test_what_is_not_finite_is_refused(test, bad: float) -> None:
    with pytest.raises(ValueError, match="finite"):
        test([1, 2, 3, bad], [1, 2, 3, 4])


@sweep("test", [*CORRELATIONS, bland_altman])
def test_values_without_partner_are_refused(test) -> None:
    with pytest.raises(ValueError, match="pairs"):
        test([1, 2, 3, 4, 5], [1, 2, 3, 4])


def test_a_p_that_underflows_says_so() -> None:
    x = np.arange(5000.0)
    found = spearman(x, x)
    assert found.p == 0.0
    assert "too small" in found.message


# Friedman


def test_friedman_gives_the_published_rounding_result() -> None:
    found = friedman(ROUNDING)
    assert found.statistic == pytest.approx(11.143, abs=5e-4)
    assert stats.chi2.sf(found.statistic, 2) == pytest.approx(0.003805, abs=5e-7)  # R's p
    assert found.p == pytest.approx(0.003805, rel=0.2)  # 22 blocks are many
    assert found.effect == pytest.approx(11.143 / (22 * 2), abs=2e-5)
    assert found.n == 22
    assert found.message == "exact p, by chi-squared 0.0038; ties: in 4 of 22 blocks"


@sweep(
    "blocks, p, chi_squared",
    [
        ([[1, 2, 3], [1, 2, 3], [1, 3, 2]], 7 / 36, 0.097),
        ([[1, 2, 3], [1, 3, 2], [1, 3, 2], [1, 2, 3]], 15 / 216, 0.0498),
        ([[1, 2, 3]] * 5, 6**-4, 0.0067),
        ([[1, 2, 3]] * 2, 1 / 6, 0.135),
        ([[3, 2, 1], [1, 2, 3]], 1.0, 1.0),
    ],
)
def test_friedman_s_p_is_counted_over_all_orders(blocks, p: float, chi_squared: float) -> None:
    found = friedman(blocks)
    assert found.p == pytest.approx(p, rel=1e-12)
    assert found.message == f"exact p, by chi-squared {stats.chi2.sf(found.statistic, 2):.2g}"
    assert stats.chi2.sf(found.statistic, 2) == pytest.approx(chi_squared, abs=5e-4)


@given(st.integers(2, 4), st.integers(3, 4), st.integers(2, 5), st.integers(0, 10**6))
def test_friedman_s_p_with_ties_is_the_share_of_orders(
    blocks: int, treatments: int, levels: int, seed: int
) -> None:
    """Listed one by one; the order of the blocks, or of the treatments, is of no account."""
    values = np.random.default_rng(seed).integers(0, levels, (blocks, treatments))
    found = friedman(values)
    if found.status is not ComputationStatus.DONE:
        return
    ranks = stats.rankdata(values, axis=1)
    sums = ranks[0]
    for block in ranks[1:]:
        ways = np.array(list(permutations(block)))
        sums = (sums[..., None, :] + ways).reshape(-1, treatments)
    squares = np.sum(sums**2, axis=1)
    share = np.mean(squares >= np.sum(ranks.sum(axis=0) ** 2) - 1e-9)
    assert found.p == pytest.approx(share, rel=1e-9)
    for same in (values[::-1], values[:, ::-1], -values):
        assert friedman(same).p == pytest.approx(found.p, rel=1e-9)


def test_what_cannot_be_counted_is_drawn_or_chi_squared() -> None:
    rng = np.random.default_rng(3)
    few, many = rng.random((6, 9)), rng.random((12, 9))
    drawn, approximate = friedman(few), friedman(many)
    assert drawn.message.startswith("p from 20000 random arrangements, by chi-squared 0.")
    assert friedman(few[:, ::-1]).p == pytest.approx(drawn.p, abs=0.02)
    assert approximate.message == "chi-squared p"
    assert approximate.p == pytest.approx(stats.chi2.sf(approximate.statistic, 8))
    alike = friedman([np.arange(9.0)] * 6)
    assert alike.p == 1 / 20001  # as drawn: none of the others is as far out


def test_drawn_and_counted_p_agree(monkeypatch: pytest.MonkeyPatch) -> None:
    few = np.random.default_rng(12).random((4, 5)) + np.arange(5.0) / 6.0
    counted = friedman(few)
    monkeypatch.setattr(rank_tests, "MOST_SUMS", 0)
    rank_tests._tail_of_blocks.cache_clear()
    drawn = friedman(few)
    rank_tests._tail_of_blocks.cache_clear()
    assert "random" in drawn.message
    # four SDs of a share of 20,000
    sd = np.sqrt(counted.p * (1.0 - counted.p) / 20_000)
    assert drawn.p == pytest.approx(counted.p, abs=4.0 * sd)
    assert 0.001 < counted.p < 0.5


def test_friedman_of_one_order_in_all_blocks_is_complete_concordance() -> None:
    found = friedman(np.arange(12.0).reshape(3, 4))
    assert found.effect == pytest.approx(1.0, abs=1e-12)
    assert found.statistic == pytest.approx(3 * 3, abs=1e-12)


def test_friedman_ranks_within_blocks_only() -> None:
    grid = np.array(ROUNDING)
    shifted = grid * np.linspace(1, 3, 22)[:, None] + np.linspace(-9, 9, 22)[:, None]
    assert friedman(np.round(shifted, 9)).p == pytest.approx(friedman(grid).p, rel=1e-9)
    assert friedman(grid.T).p != pytest.approx(friedman(grid).p, rel=0.1)


@sweep("shape", [(1, 5), (5, 2)])
def test_friedman_of_a_small_grid_is_too_few(shape) -> None:
    found = friedman(np.arange(float(np.prod(shape))).reshape(shape))
    assert (found.status, found.p, found.effect) == (ComputationStatus.TOO_FEW, None, None)


def test_friedman_of_equal_treatments_is_constant() -> None:
    found = friedman(np.repeat([[1.0], [2.0], [3.0]], 4, axis=1))
    assert (found.status, found.p) == (ComputationStatus.CONSTANT, None)


def test_friedman_wants_a_full_grid() -> None:
    with pytest.raises(ValueError, match="dimension"):
        friedman([1.0, 2.0, 3.0])
    with pytest.raises(ValueError, match="finite"):
        friedman([[1.0, 2.0, np.nan]] * 3)


# normality


def test_chi_squared_of_a_hand_worked_case() -> None:
    """Counts 1 3 4 8 12 12 9 6 4 1 over bins of width 1, each value in its bin's middle."""
    counts = [1, 3, 4, 8, 12, 12, 9, 6, 4, 1]
    # the ends of the range are values themselves, so the outer ones go to 0 and 10
    middles = [0.0, 1.5, 2.5, 3.5, 4.5, 5.5, 6.5, 7.5, 8.5, 10.0]
    values = [middle for middle, count in zip(middles, counts, strict=True) for _ in range(count)]
    n = sum(counts)
    mean = sum(values) / n
    sd = math.sqrt(sum((value - mean) ** 2 for value in values) / (n - 1))
    cdf = [0.0, *(normal_cdf((edge - mean) / sd) for edge in range(1, 10)), 1.0]
    each = [n * (high - low) for low, high in pairwise(cdf)]
    # expected 1.2 2.2 4.7 8.0 ... 7.0 3.9 2.7: three bins pooled below, three above
    assert sum(each[:2]) < 5 < sum(each[:3])
    assert sum(each[8:]) < 5 < sum(each[7:])
    pooled = [(sum(c[:3]), *c[3:7], sum(c[7:])) for c in (counts, each)]
    chi2 = sum((seen - due) ** 2 / due for seen, due in zip(*pooled, strict=True))
    found = chi_squared_normality(values)
    assert found.statistic == pytest.approx(chi2, rel=1e-10)
    # survival function of chi-squared with 6 - 1 - 2 = 3 degrees of freedom
    tail = math.erfc(math.sqrt(chi2 / 2)) + math.sqrt(2 * chi2 / math.pi) * math.exp(-chi2 / 2)
    assert found.p == pytest.approx(tail, rel=1e-9)
    assert found.message == "6 bins"


def test_a_larger_model_beside_an_exact_smaller_one_explains_nothing() -> None:
    found = f_test_nested(0.0, 5, 1.0, 4)
    assert (found.statistic, found.p, found.effect) == (0.0, 1.0, 0.0)
    assert "fits worse" in found.message


def test_chi_squared_has_the_degrees_of_freedom_that_its_bins_leave() -> None:
    """Down to a single one: four bins, and mean and SD from the values."""
    seen = set()
    for values in np.random.default_rng(0).uniform(size=(30, 40)):
        found = chi_squared_normality(values)
        bins = int(found.message.split()[0])
        seen.add(bins)
        assert found.status is (ComputationStatus.DONE if bins > 3 else ComputationStatus.TOO_FEW)
        if bins > 3:
            expected = stats.chi2.sf(found.statistic, bins - 1 - 2)
            assert found.p == pytest.approx(expected, rel=1e-12)
    assert {3, 4, 5} <= seen


def test_chi_squared_without_degree_of_freedom_points_to_kolmogorov_smirnov() -> None:
    found = chi_squared_normality(np.linspace(0.0, 1.0, 15))
    assert (found.status, found.p) == (ComputationStatus.TOO_FEW, None)
    assert "Kolmogorov-Smirnov" in found.message


@pytest.mark.full
def test_chi_squared_rejects_true_normals_as_often_as_it_says() -> None:
    draws = np.random.default_rng(1).normal(3.0, 0.2, size=(600, 200))
    rejected = np.mean([chi_squared_normality(values).p < 0.05 for values in draws])
    # estimated parameters and data-given edges make it inexact; 600 draws add 0.9 % scatter
    assert 0.02 < rejected < 0.09


def test_kolmogorov_smirnov_of_one_outlier_in_closed_form() -> None:
    """19 zeros and a one: D is above 1/2, where p is twice the one-sided exact one."""
    n = 20
    mean, sd = 1 / n, math.sqrt((1 - 1 / n) / (n - 1))
    d = (n - 1) / n - normal_cdf(-mean / sd)
    assert d > 0.5
    # Birnbaum and Tingey 1951
    one_sided = d * sum(
        math.comb(n, j) * (1 - d - j / n) ** (n - j) * (d + j / n) ** (j - 1)
        for j in range(int(n * (1 - d)) + 1)
    )
    found = kolmogorov_smirnov_normality([0.0] * (n - 1) + [1.0])
    assert found.statistic == pytest.approx(d, rel=1e-12)
    assert found.p == pytest.approx(2 * one_sided, rel=1e-8)
    # skewness of a Bernoulli variable
    skewness = (1 - 2 / n) / math.sqrt((1 / n) * (1 - 1 / n))
    assert found.effect == pytest.approx(skewness, rel=1e-12)
    assert "too large" in found.message
    assert "Lilliefors" in found.message


def test_lilliefors_agrees_with_simulation_by_another_library() -> None:
    values = np.random.default_rng(4).gamma(4.0, size=30)
    found = lilliefors_normality(values)
    simulated = stats.goodness_of_fit(
        stats.norm, values, statistic="ks", n_mc_samples=1000, rng=np.random.default_rng(5)
    )
    # scipy fits by maximum likelihood: SD with n instead of n - 1, hence the small difference
    assert found.statistic == pytest.approx(simulated.statistic, rel=0.03)
    assert 0.02 < simulated.pvalue < 0.9
    assert found.p == pytest.approx(simulated.pvalue, abs=0.05)


def test_lilliefors_and_kolmogorov_smirnov_differ_in_p_only() -> None:
    for seed in range(5):
        values = np.random.default_rng(seed).normal(size=40)
        right, too_large = lilliefors_normality(values), kolmogorov_smirnov_normality(values)
        assert right.statistic == pytest.approx(too_large.statistic, rel=1e-12)
        assert right.p < too_large.p


def test_lilliefors_says_where_its_table_ends() -> None:
    found = lilliefors_normality([0.0] * 19 + [1.0])
    assert found.p == pytest.approx(0.001, rel=1e-9)
    assert found.message == "p at most 0.001"


@sweep("test", NORMALITY)
def test_normality_does_not_depend_on_the_unit(test) -> None:
    values = np.random.default_rng(2).gamma(9.0, size=150)
    one, other = test(values), test(1e-6 * values + 3e-6)
    assert other.p == pytest.approx(one.p, rel=1e-6)
    assert other.effect == pytest.approx(one.effect, rel=1e-6)


@sweep("test", NORMALITY)
def test_normality_of_what_cannot_be_tested(test) -> None:
    same, few = test([0.1] * 50), test([1.0, 2.0, 4.0])
    assert (same.status, same.p, same.effect) == (ComputationStatus.CONSTANT, None, None)
    assert (few.status, few.p, few.n) == (ComputationStatus.TOO_FEW, None, 3)
    with pytest.raises(ValueError, match="finite"):
        test([1.0, 2.0, 3.0, np.nan])


# correction


def test_corrections_of_hand_worked_families() -> None:
    assert corrected([0.1496, 0.0275, 0.3053, 0.1599, 0.2061], "bonferroni") == pytest.approx(
        [0.748, 0.1375, 1.0, 0.7995, 1.0]
    )
    # sorted times 5 4 3 2 1, none below the one before
    assert corrected([0.319, 0.201, 0.4, 0.374, 0.113], "holm") == pytest.approx(
        [0.957, 0.804, 0.957, 0.957, 0.565]
    )


@sweep("method", ["bonferroni", "holm"])
def test_a_test_without_p_is_not_of_the_family(method) -> None:
    ps = [None, 0.01, None, 0.02, 0.9]
    found = corrected(ps, method)
    assert [value is None for value in found] == [True, False, True, False, False]
    assert found[1] == pytest.approx(0.03)
    assert found[3] == pytest.approx(0.06 if method == "bonferroni" else 0.04)
    assert family_size(ps) == 3
    assert corrected([None, None], method) == [None, None]
    assert family_size([]) == 0


def test_a_p_of_zero_is_one_of_the_family() -> None:
    assert family_size([0.0, 0.3]) == 2
    assert corrected([0.0, 0.3], "bonferroni") == pytest.approx([0.0, 0.6])


@sweep("bad", [-0.1, 1.1, np.nan])
def test_what_is_no_p_is_refused(bad: float) -> None:
    with pytest.raises(ValueError, match="p value"):
        corrected([0.5, bad], "holm")


# agreement


def test_bland_and_altman_1986() -> None:
    found = bland_altman(measured=MINI, predicted=WRIGHT)
    assert found.bias == pytest.approx(-2.1, abs=0.05)
    assert found.sd == pytest.approx(38.8, abs=0.05)
    assert (found.bias_low, found.bias_high) == pytest.approx((-22.0, 17.8), abs=0.1)
    # the paper takes 2 SD: -79.7 and 75.5
    lower, upper = -2.1 - 1.96 * 38.8, -2.1 + 1.96 * 38.8
    assert (found.lower_limit, found.upper_limit) == pytest.approx((lower, upper), abs=0.15)
    # its intervals of the limits are 69.2 wide, by the approximation for many pairs
    for low, high in (
        (found.lower_limit_low, found.lower_limit_high),
        (found.upper_limit_low, found.upper_limit_high),
    ):
        assert high - low == pytest.approx(69.2, rel=0.04)
    assert (found.n, found.status) == (17, ComputationStatus.DONE)


def test_exchanging_the_two_mirrors_the_agreement() -> None:
    one, other = bland_altman(MINI, WRIGHT), bland_altman(WRIGHT, MINI)
    assert other.bias == pytest.approx(-one.bias)
    assert other.upper_limit_high == pytest.approx(-one.lower_limit_low)
    assert other.lower_limit_high == pytest.approx(-one.upper_limit_low)
    assert other.proportional.effect == pytest.approx(-one.proportional.effect)


@pytest.mark.full
def test_the_intervals_cover_what_they_say() -> None:
    """Few pairs, where the approximation for many would miss: 95 % of true values inside."""
    draws = np.random.default_rng(3).normal(0.5, 2.0, size=(1000, 6))
    found = [bland_altman(np.zeros(6), draw) for draw in draws]
    bias = np.mean([a.bias_low <= 0.5 <= a.bias_high for a in found])
    top, bottom = 0.5 + 1.96 * 2.0, 0.5 - 1.96 * 2.0
    upper = np.mean([a.upper_limit_low <= top <= a.upper_limit_high for a in found])
    lower = np.mean([a.lower_limit_low <= bottom <= a.lower_limit_high for a in found])
    # three standard errors of 1000 draws
    assert (bias, upper, lower) == pytest.approx((0.95, 0.95, 0.95), abs=0.021)


def test_a_bias_that_grows_with_size_shows() -> None:
    measured = np.array([1.0, 2.0, 4.0, 7.0, 11.0])
    found = bland_altman(measured, 1.5 * measured)
    assert found.proportional.effect == pytest.approx(1.0)
    assert found.proportional.p == pytest.approx(2 / 120)


def test_motion_that_hardly_varies_correlates_with_its_error_by_itself() -> None:
    """Predicted values that know nothing of the measured ones, and have no bias at all.

    With SDs m and p and no correlation, that of difference and mean is (p^2 - m^2)/(p^2 + m^2):
    0.999 for m = 0.02 p, 0 for m = p.
    """
    rng = np.random.default_rng(7)
    drawn = rng.normal(size=(2, 2000))
    still = bland_altman(5.0 + 0.02 * drawn[0], 5.0 + drawn[1])
    assert still.proportional.effect == pytest.approx(0.999, abs=0.002)
    assert not still.comparable
    assert (still.measured_sd, still.predicted_sd) == pytest.approx((0.02, 1.0), rel=0.05)
    moved = bland_altman(5.0 + drawn[0], 5.0 + drawn[1])
    assert moved.comparable
    assert moved.proportional.effect == pytest.approx(0.0, abs=0.07)  # three standard errors


@sweep("times, comparable", [(1.99, True), (2.01, False), (0.49, False)])
def test_spreads_are_comparable_within_a_factor_of_two(times: float, comparable: bool) -> None:
    values = np.array([1.0, 2.0, 4.0, 7.0])
    assert bland_altman(values, times * values).comparable == comparable


def test_agreement_of_one_and_the_same_difference_has_no_intervals() -> None:
    found = bland_altman([1.0, 2.0, 3.0, 4.0], [1.5, 2.5, 3.5, 4.5])
    assert (found.status, found.bias, found.sd) == (ComputationStatus.CONSTANT, 0.5, 0.0)
    assert (found.lower_limit, found.upper_limit) == (0.5, 0.5)
    assert found.bias_low is None
    assert found.upper_limit_high is None
    assert found.proportional.status is ComputationStatus.CONSTANT


def test_agreement_of_two_pairs_is_too_few() -> None:
    found = bland_altman([1.0, 2.0], [1.5, 3.0])
    assert (found.status, found.bias, found.lower_limit) == (ComputationStatus.TOO_FEW, None, None)
    with pytest.raises(ValueError, match="finite"):
        bland_altman([1.0, np.nan, 3.0], [1.0, 2.0, 3.0])


def test_corrections_are_those_of_statsmodels() -> None:
    rng = np.random.default_rng(4)
    for n in (1, 2, 7, 40):
        ps = rng.uniform(size=n) ** 3
        ps[n // 2 :: 3] = ps[0]  # ties
        for method in ("bonferroni", "holm"):
            expected = multipletests(ps, method=method)[1]
            np.testing.assert_allclose(corrected(ps.tolist(), method), expected, rtol=1e-14)
