"""Steps of one specimen of a cohort, and what spreads are told by, in numbers worked by hand.

Catches a step of one specimen, or a told spread, that is off by one rule.
"""

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from sweeps import sweep

from spinepipe.calibration.hierarchy import (
    Hierarchy,
    LinearReadings,
    Spreads,
    _first_scatter,
    largest_change,
    tellable_spreads,
)
from spinepipe.calibration.pooling import PoolMember
from spinepipe.effects.contract import Array

pytestmark = pytest.mark.numeric


def seen(residual: Array | None, jacobian: Array | None = None) -> Any:
    return SimpleNamespace(residual=residual, jacobian=jacobian)


class Asked:
    """Residual x - 0.3; nothing stands above ``most``. Every x that was asked for."""

    def __init__(self, most: float) -> None:
        self.most, self.x = most, cast(list[float], [])

    def at(self, x: Array) -> Any:
        self.x.append(float(x[0]))
        return seen(None) if x[0] > self.most else seen(x - 0.3, np.eye(1))


def member(size: int = 1, most: float = np.inf, scale: float = 1.0, high: float = 5.0) -> Any:
    """At 0, bounds of 5, about to step by 1."""
    made = cast(Any, PoolMember.__new__(PoolMember))
    made.problem = SimpleNamespace(lower=np.full(size, -5.0), upper=np.full(size, high) * scale)
    made.x, made.scale, made.noise = np.zeros(size), np.full(size, scale), None
    made.evaluator, made.step = Asked(most), np.ones(size)
    made.evaluation = seen(np.full(size, -0.3), np.eye(size))
    made.arrived, made.stuck = False, False
    return made


def around(own: float, scatter: float = 1.0, size: int = 1) -> Any:
    """A cohort about nought."""
    spreads = SimpleNamespace(scatter=scatter)
    return SimpleNamespace(common=np.zeros(size), own=own * np.eye(size), spreads=spreads)


@sweep(
    "target, step",
    [([0.5, -0.3], [0.5, -0.3]), ([3.0, -1.5], [1.0, -0.5]), ([0.4, -2.0], [0.2, -1.0])],
)
def test_a_step_is_as_long_as_one_linearisation_is_trusted(
    target: list[float], step: list[float]
) -> None:
    one = member(2)
    one.plan_step(np.array(target), np.full(2, 0.1), around(1.0))
    np.testing.assert_allclose(one.step, step)
    assert not one.arrived
    assert not one.stuck


@sweep(
    "way, deviation, arrived",
    [
        *((0.9e-4, 1e-3, True), (1.1e-4, 1e-3, False), (-1.1e-4, 1e-3, False)),
        *((0.009, 1.0, True), (0.011, 1.0, False), (-0.009, 1.0, True)),
    ],
)
def test_it_has_arrived_within_a_ten_thousandth_or_a_hundredth_of_its_sd(
    way: float, deviation: float, arrived: bool
) -> None:
    one = member(2)
    one.plan_step(np.array([0.0, way]), np.full(2, deviation), around(1.0))
    assert one.arrived is arrived
    assert one.arrived is arrived


def test_beyond_a_bound_the_best_inside_is_aimed_at() -> None:
    """(a + b - 2)^2 / s^2 + a^2 + b^2, a at most 1/2: at (1/2, 3/4), with s = 2 at thirds."""
    for scatter, best in ((1.0, [0.5, 0.75]), (2.0, [1.0 / 3.0, 1.0 / 3.0])):
        one = member(2)
        one.problem.upper[0] = 0.5
        one.evaluation = seen(np.array([-2.0]), np.ones((1, 2)))
        one.plan_step(np.array([0.9, 0.9]), np.ones(2), around(1.0, scatter, 2))
        np.testing.assert_allclose(one.step, best, rtol=1e-6)
    for target in ([0.5, 0.9], [-5.0, 5.0]):
        one = member(2)
        one.problem.upper[0] = 0.5
        one.plan_step(np.array(target), np.ones(2), around(1.0, 1.0, 2))
        np.testing.assert_allclose(one.step, np.array(target) / max(1.0, np.abs(target).max()))


@sweep("most, looks", [(2.0, [1.0]), (0.6, [1.0, 0.5]), (0.5, [1.0, 0.5])])
def test_of_a_step_half_is_tried_where_nothing_stands(most: float, looks: list[float]) -> None:
    one = member(most=most)
    one.try_share(1.0)
    assert one.evaluator.x == looks
    assert one.trial[0] == looks[-1]
    one.accept()
    assert (one.x[0], one.stuck) == (looks[-1], False)
    wide = member(most=most * 3.0, scale=3.0)
    wide.try_share(1.0)
    np.testing.assert_allclose(wide.evaluator.x, 3.0 * np.array(looks))
    assert wide.trial[0] == looks[-1]


def test_without_a_way_on_it_stays_and_is_stuck() -> None:
    """1, 1/2, ..., 1/512."""
    one = member(most=0.0)
    one.try_share(1.0)
    np.testing.assert_allclose(one.evaluator.x, 0.5 ** np.arange(10))
    one.accept()
    assert (one.x[0], one.stuck) == (0.0, True)


@sweep("own, scatter, end", [(1e6, 1.0, 0.5), (0.01, 1.0, 2.0**-8), (0.01, 0.1, 0.25)])
def test_alone_it_goes_as_far_as_lowers_its_own_cost(
    own: float, scatter: float, end: float
) -> None:
    """(s - 0.3)^2 / scatter^2 + s^2 / own is at most what it is at 0: s below 0.6, 0.0059, 0.3."""
    one = member()
    one.move_alone(around(own, scatter))
    assert one.x[0] == end
    assert not one.stuck
    backwards = member()
    backwards.step = -np.ones(1)
    backwards.move_alone(around(own, scatter))
    assert (backwards.x[0], backwards.stuck) == (0.0, True)
    assert len(backwards.evaluator.x) == 10


def test_squares_are_in_sds_of_a_reading() -> None:
    assert member(2).squares(seen(np.array([3.0, 4.0]), np.eye(2)), 0.5) == 100.0


def readings(design: Array, left_over: float = 0.0, count: int = 0) -> LinearReadings:
    return LinearReadings(design, np.zeros(design.shape[:2]), left_over, count)


@sweep("share, told", [(1.2e-4, True), (0.8e-4, False)])
def test_less_than_a_hundred_millionth_of_the_information_is_no_reading(
    share: float, told: bool
) -> None:
    """The information is the square of the design."""
    design = np.array([np.eye(2), np.diag([share, 1.0])])
    found = tellable_spreads(readings(design), np.zeros(2, dtype=int))
    assert found[:, 0].tolist() == [told, True, True] if told else [False, False, True]


def test_what_is_left_over_is_shared_among_readings_less_unknowns() -> None:
    """Two specimens, of whose four unknowns three are read."""
    design = np.array([np.eye(2), np.diag([0.0, 2.0])])
    assert _first_scatter(readings(design, 36.0, 12)) == pytest.approx(2.0)
    assert _first_scatter(readings(design, 36.0, 4)) == 6.0
    assert _first_scatter(readings(design, 36.0, 3)) == 6.0
    assert _first_scatter(readings(design, 0.0, 12)) == 1e-6


def test_a_change_is_the_largest_factor_of_what_both_have() -> None:
    one = Spreads(np.array([0.1, 0.0]), np.array([0.2, 0.2]), np.array([0.3, 0.3]), 1.0)
    other = Spreads(np.array([0.2, 9.0]), np.array([0.2, 0.2]), np.array([0.3, 0.1]), 1.5)
    assert largest_change(one, other) == pytest.approx(np.log(3.0))
    assert largest_change(other, one) == pytest.approx(np.log(3.0))
    assert largest_change(one, one) == 0.0


def test_the_distance_of_specimens_is_that_of_their_common_normal() -> None:
    """One unknown of two specimens: variance 100 + l^2 in common, s^2 + r^2 of each."""
    spreads = Spreads(np.array([0.5]), np.array([0.3]), np.array([0.4]), 1.0)
    made = Hierarchy(readings(np.ones((1, 1, 1)), 0.0, 1), np.zeros(1, dtype=int), spreads)
    covariance = 100.25 * np.ones((2, 2)) + 0.25 * np.eye(2)
    x = np.array([0.7, -0.2])
    expected = x @ np.linalg.solve(covariance, x)
    assert made.distance(x[:, None]) == pytest.approx(expected, rel=1e-9)
