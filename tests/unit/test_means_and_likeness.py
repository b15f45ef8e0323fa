"""Means, how alike curves are, pooled bins and exact limits: boundaries and small numbers.

Catches means, bins and likeness that are off at boundaries or with few numbers.
"""

import numpy as np
import pytest
from scipy import stats
from sweeps import sweep

from spinepipe.statistics import bland_altman, mean_of
from spinepipe.statistics.normality import _pooled
from spinepipe.statistics.waveforms import Likeness, multiple_correlation


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


@sweep("unit", [1e-9, 1.0, 1e9])
def test_rounding_is_no_variation(unit: float) -> None:
    curves = unit * np.array([[1.0, 1.0], [1.0, 1.0 + 1e-15]])
    found = multiple_correlation(curves)
    assert (found.status, found.value) == (Likeness.UNDEFINED, None)
    assert found.message == "nothing varies"


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
