"""Tests of values exactly where they change their way: counts, sizes, rounding, signs.

Catches a test that takes the wrong way exactly at its threshold.
"""

import numpy as np
import pytest
from scipy.stats import norm
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


def test_two_curves_of_two_points_are_enough() -> None:
    """0 1 and 0 3: apart 2 in 2, whole 6 in 3: 1 - 1 / 2."""
    found = multiple_correlation(np.array([[0.0, 1.0], [0.0, 3.0]]))
    assert found.value == pytest.approx(np.sqrt(0.5))


def test_curves_that_differ_more_than_they_vary_have_no_coefficient() -> None:
    """0 1, 1 0 and 1 1: 4/3 in 4 about their means, 4/3 in 5 in all."""
    below = multiple_correlation(np.array([[0.0, 1.0], [1.0, 0.0], [1.0, 1.0]]))
    assert (below.status, below.value) == (Likeness.UNDEFINED, None)
    assert below.message.endswith("the square is -0.25")


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

    found = lilliefors_normality(norm.ppf((np.arange(40) + 0.5) / 40))
    assert found.message == "p at least 0.99"
    assert found.p == pytest.approx(0.99)
    assert lilliefors_normality([1.0, 2.0, 4.0, 9.0]).status is ComputationStatus.DONE
    between = lilliefors_normality([0.0, 1.0, 1.2, 3.0, 3.1, 7.0, 3.3])
    assert between.message == ""


def test_a_mean_of_two_has_an_interval() -> None:
    """12.706 is the 97.5 % point of t with one degree of freedom."""
    found = mean_of(np.array([1.0, 3.0]))
    assert found.interval == pytest.approx((2.0 - 12.706, 2.0 + 12.706), abs=1e-3)
    assert found.p == pytest.approx(1.0 - 2.0 * np.arctan(2.0) / np.pi)
