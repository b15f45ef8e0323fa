"""Statistics where they change their way, and of few numbers: counts, rounding, signs, small cases.

Catches a test that takes the wrong way exactly at its threshold, and means, bins and likeness that
are off with few numbers.
"""

import numpy as np
import pytest
from scipy import stats
from sweeps import sweep

from spinepipe.statistics import (
    ComputationStatus,
    bland_altman,
    f_test_nested,
    kendall,
    kruskal_wallis,
    lilliefors_normality,
    mean_of,
    spearman,
    wilcoxon_signed_rank,
)
from spinepipe.statistics.normality import _pooled
from spinepipe.statistics.waveforms import Likeness, multiple_correlation


@sweep("sign", [-1.0, 1.0])
@sweep("size", [1e-6, 1.0, 1e6])
def test_curves_below_zero_are_held_against_their_size_as_those_above(
    sign: float, size: float
) -> None:
    """One part in 2^50 is rounding, one in 10^6 is variation."""
    unit = sign * size
    same = multiple_correlation(unit * np.array([[1.0, 1.0, 1.0], [1.0, 1.0, 1.0 + 2.0**-50]]))
    assert (same.status, same.message) == (Likeness.UNDEFINED, "nothing varies")
    alike = multiple_correlation(unit * np.array([[1.0, 1.0 + 1e-6, 1.0]] * 2))
    assert alike.value == pytest.approx(1.0, abs=1e-6)
    none = multiple_correlation(np.zeros((2, 3)))
    assert none.message == "nothing varies"


def test_the_least_variation_is_the_rounding_of_the_values_squares() -> None:
    """Variance over mean square: values 1 and 1 + d, half of each, have d^2 / 4 times 4/3."""
    for d, varies in ((3.0e-8, True), (2.0e-8, False)):
        found = multiple_correlation(-np.array([[1.0, 1.0 + d]] * 2))
        assert (found.status is Likeness.DONE) is varies


def test_rank_correlation_is_exact_up_to_ten_pairs() -> None:
    y = [2.0, 1.0, 4.0, 3.0, 6.0, 5.0, 8.0, 7.0, 10.0, 9.0, 11.0]
    assert spearman(np.arange(10.0), y[:10]).message == "exact p"
    assert spearman(np.arange(11.0), y).message == ""
    assert spearman(np.arange(4.0), y[:4]).message == "exact p"
    assert kendall(np.arange(11.0), y).message == ""
    # the smaller tail twice, never more than one
    assert spearman([1.0, 2, 3, 4], [2.0, 4, 1, 3]).p == pytest.approx(1.0)


@sweep(
    "sizes, how",
    [
        ((8, 8), "exact p, by"),  # 12,870 ways
        ((8, 9), "chi-squared p"),  # 24,310
        ((5, 5, 5), "chi-squared p"),
        ((4, 6, 6), "p from 20000 random arrangements, by chi-squared"),
        ((3, 3, 3), "exact p, by"),
        ((2, 4, 5), "exact p, by"),  # 6930
    ],
)
def test_how_p_of_groups_is_found_hangs_on_their_sizes(sizes: tuple[int, ...], how: str) -> None:
    values = np.random.default_rng(20021).permutation(float(sum(sizes)) + np.arange(sum(sizes)))
    groups = np.split(values, np.cumsum(sizes)[:-1])
    found = kruskal_wallis(groups)
    assert f"; {how}" in found.message
    assert 0.0 < found.p < 1.0  # type: ignore[operator]
    assert "ties" not in found.message


def test_a_group_of_a_single_value_is_said_to_be_too_small() -> None:
    """It was an error of a library's before."""
    assert kruskal_wallis([[1.0], [2.0]]).status is ComputationStatus.TOO_FEW
    for groups, alone in (([[1.0], [2.0, 3.0]], 1), ([[5.0], [1.0, 2.0, 3.0, 4.0], [9.0]], 2)):
        found = kruskal_wallis(groups)
        assert (found.status, found.p) == (ComputationStatus.TOO_FEW, None)
        assert found.message.startswith(f"{alone} of {len(groups)} groups with a single value")
    least = kruskal_wallis([[1.0, 2.0], [3.0, 4.0]])
    assert least.p == pytest.approx(2.0 / 6.0)
    assert least.status is ComputationStatus.DONE


def test_signed_ranks_are_exact_up_to_fifty_differences() -> None:
    x = np.random.default_rng(20022).normal(0.4, 1.0, 51)
    fifty, more = (wilcoxon_signed_rank(x[:n], np.zeros(n)) for n in (50, 51))
    assert (fifty.message, more.message) == ("exact p", "approximate p")
    six = wilcoxon_signed_rank(np.arange(1.0, 7.0), np.zeros(6))
    assert (six.message, six.p) == ("exact p", 2.0 / 2**6)
    four = wilcoxon_signed_rank(np.arange(1.0, 5.0), np.zeros(4))
    assert four.message == "exact p; with 4 differences p is never below 0.125"


@sweep("unit", [-1e3, 1e-3, 1.0])
def test_differences_are_told_apart_by_a_millionth_of_a_millionth(unit: float) -> None:
    """Of the largest value, whatever its sign: a tenth of it is rounding, ten times is none."""
    y = unit * np.array([1.0, 2.0, 3.0, 10.0])
    apart = unit * np.array([0.5, 0.5, 1.0, 2.0])
    x = y - apart
    for step, ties in ((1e-12, True), (1e-10, False)):
        moved = x + unit * step * np.array([1.0, 0.0, 0.0, 0.0])
        found = wilcoxon_signed_rank(np.append(moved, unit * 7.0), np.append(y, unit * 7.0))
        assert ("ties: 2 of 4" in found.message) is ties
        assert "equal pairs left out: 1" in found.message


def test_three_pairs_are_enough_for_limits_of_agreement() -> None:
    found = bland_altman([1.0, 2.0, 3.0], [1.0, 2.5, 3.1])
    assert (found.status, found.n) == (ComputationStatus.DONE, 3)
    assert found.bias == pytest.approx(0.2)
    one, none = bland_altman([1.0], [2.0]), bland_altman([], [])
    assert (one.measured_sd, one.predicted_sd, one.comparable) == (None, None, False)
    assert none.status is ComputationStatus.TOO_FEW
    two = bland_altman([1.0, 3.0], [2.0, 4.0])
    assert (two.measured_sd, two.predicted_sd) == pytest.approx((np.sqrt(2.0), np.sqrt(2.0)))
    assert two.comparable
    assert two.message == "2 pairs; at least 3 are needed"
    exactly = bland_altman([0.0, 2.0, 4.0, 9.0], [0.0, 4.0, 8.0, 18.0])
    assert exactly.comparable


def test_a_model_that_fits_worse_by_rounding_is_not_said_to() -> None:
    assert f_test_nested(4.0, 12, 4.0 * (1.0 + 1e-10), 10).message == "F(2, 10)"
    assert "worse" in f_test_nested(4.0, 12, 4.0 * (1.0 + 1e-8), 10).message
    assert f_test_nested(1.0, 0, 0.5, -2).n == 0
    assert f_test_nested(1.0, 2, 0.5, 1).status is ComputationStatus.DONE
    assert f_test_nested(1.0, 2, 0.0, 1).n == 1


def test_what_is_as_normal_as_can_be_is_at_the_other_end_of_the_table() -> None:
    """Quantiles of a normal themselves, and four values, with which the table begins."""

    found = lilliefors_normality(stats.norm.ppf((np.arange(40) + 0.5) / 40))
    assert found.message == "p at least 0.99"
    assert found.p == pytest.approx(0.99)
    assert lilliefors_normality([1.0, 2.0, 4.0, 9.0]).status is ComputationStatus.DONE
    between = lilliefors_normality([0.0, 1.0, 1.2, 3.0, 3.1, 7.0, 3.3])
    assert between.message == ""


def test_a_mean_of_three_has_the_interval_of_student() -> None:
    """4.303 is the 97.5 % point of t with two degrees of freedom, in any table."""
    found = mean_of(np.array([1.0, 2.0, 6.0]))
    half = 4.303 * np.sqrt(7.0 / 3.0)  # variance 7
    assert (found.n, found.value) == (3, 3.0)
    assert found.interval == pytest.approx((3.0 - half, 3.0 + half), abs=2e-3)
    # with two degrees of freedom p = 1 - t / sqrt(2 + t^2)
    t = 3.0 / np.sqrt(7.0 / 3.0)
    assert found.p == pytest.approx(1.0 - t / np.sqrt(2.0 + t**2))


@sweep("values", [[], [2.0], [2.0, 2.0], [2.0, 2.0 + 1e-9], [0.0, 0.0]])
def test_what_does_not_vary_has_no_interval(values: list[float]) -> None:
    found = mean_of(np.array(values))
    assert (found.n, found.interval, found.p) == (len(values), None, None)
    assert found.value == (pytest.approx(values[0]) if values else None)


@sweep("unit", [1e-6, 1.0, 1e6])
def test_a_small_scatter_is_one_whatever_the_unit(unit: float) -> None:
    found = mean_of(unit * np.array([-2.0, -2.0 - 1e-8]))
    assert found.interval is not None
    low, high = found.interval
    assert low < found.value < high < 0.0  # type: ignore[operator]


@sweep("unit", [1e-9, 1.0, 1e9])
def test_curves_are_as_alike_in_any_unit(unit: float) -> None:
    """Of 0 1 2 and 0 1 4: apart 2 in 3, whole 34/3 in 5; 1 - (2/3) / (34/15) = 12/17."""
    found = multiple_correlation(unit * np.array([[0.0, 1.0, 2.0], [0.0, 1.0, 4.0]]))
    assert (found.status, found.curves, found.points) == (Likeness.DONE, 2, 3)
    assert found.value == pytest.approx(np.sqrt(12.0 / 17.0))


def test_opposite_curves_have_no_coefficient_and_one_curve_too_few() -> None:
    """Apart by 1 in two points of one further curve, whole 1 in 3: 1 - (4/2) / (4/3) = -1/2."""
    opposite = multiple_correlation(np.array([[-1.0, 1.0], [1.0, -1.0]]))
    assert (opposite.status, opposite.value) == (Likeness.UNDEFINED, None)
    assert opposite.message.endswith("-0.5")
    for shape in ((1, 5), (5, 1)):
        few = multiple_correlation(np.ones(shape))
        assert (few.status, few.curves, few.points) == (Likeness.TOO_FEW, *shape)
    assert multiple_correlation(np.array([[0.0, 1.0]] * 2)).value == 1.0


@sweep(
    "expected, pooled",
    [
        ([6.0, 7.0, 8.0, 4.0, 6.0], [6.0, 7.0, 8.0, 10.0]),  # beside the upper tail
        ([6.0, 4.0, 8.0, 7.0, 9.0], [10.0, 8.0, 7.0, 9.0]),  # beside the lower one
        ([6.0, 7.0, 1.0, 8.0, 6.0], [6.0, 7.0, 1.0, 8.0, 6.0]),  # inner bins are left alone
        ([5.0, 5.0, 5.0], [5.0, 5.0, 5.0]),  # five are enough
        ([4.0, 5.0, 5.0], [9.0, 5.0]),
        ([1.0, 1.0, 1.0], [1.0, 2.0]),  # two stay, the upper tail is emptied first
    ],
)
def test_bins_are_pooled_from_the_emptier_tail(expected: list[float], pooled: list[float]) -> None:
    observed, left = _pooled(np.array(expected) + 1.0, np.array(expected))
    assert left.tolist() == pooled
    assert observed.sum() == sum(expected) + len(expected)
    assert len(observed) == len(left)


def test_limits_of_agreement_are_as_sure_as_draws_of_normal_differences_say() -> None:
    """Of four differences: (bias + 1.96 SD of the truth) in SDs seen, drawn 400,000 times."""
    found = bland_altman([0.0, 0.0, 0.0, 0.0], [1.0, 2.0, 4.0, 9.0])
    rng = np.random.default_rng(20004)
    mean, sd = rng.normal(size=400_000) / 2.0, np.sqrt(rng.chisquare(3, 400_000) / 3.0)
    low, high = np.quantile((1.96 - mean) / sd, [0.025, 0.975])
    assert found.sd == pytest.approx(np.std([1.0, 2.0, 4.0, 9.0], ddof=1))
    assert found.upper_limit_low == pytest.approx(found.bias + low * found.sd, rel=0.02)
    assert found.upper_limit_high == pytest.approx(found.bias + high * found.sd, rel=0.02)
    assert found.lower_limit_low == pytest.approx(found.bias - high * found.sd, rel=0.02)
    assert found.lower_limit_high == pytest.approx(found.bias - low * found.sd, rel=0.02)
    half = stats.t.isf(0.025, 3) * found.sd / 2.0
    assert (found.bias_low, found.bias_high) == pytest.approx((4.0 - half, 4.0 + half))
