"""Descents look by look by hand (damping, promises, ends), and against scipy's bounded solvers.

Catches a damping, promise or end that is off by one rule, and a descent that leaves its bounds.
"""

import numpy as np
import pytest
from scipy.optimize import lsq_linear, minimize
from sweeps import sweep

from spinepipe.calibration.descent import (
    DescentTolerances,
    damped_step,
    descend,
    descend_along,
    once,
)
from spinepipe.effects.contract import Array

pytestmark = pytest.mark.numeric

NOTHING = DescentTolerances(cost=0.0, step=0.0, slope=0.0, evaluations=100)
FAR = (np.full(1, -1e3), np.full(1, 1e3))
ONE = np.ones(1)


@sweep("damping", [1e-3, 0.5, 4.0])
@sweep("size", [1e-6, 1.0, 1e6])
def test_a_damped_step_is_a_share_of_the_whole_one_in_any_unit(damping: float, size: float) -> None:
    """(r + a s)^2 + d (a s)^2 is least where s = -r / (a (1 + d))."""
    step = damped_step(
        np.array([3.0, 1.0]), np.array([[size], [0.0]]), damping, np.array([[-1e9], [1e9]])
    )
    assert step[0] == pytest.approx(-3.0 / (size * (1.0 + damping)), rel=1e-9)


def test_each_column_is_damped_by_its_own_size() -> None:
    jacobian = np.diag([1e-3, 10.0])
    step = damped_step(np.array([1.0, 1.0]), jacobian, 1.0, np.array([[-1e9] * 2, [1e9] * 2]))
    np.testing.assert_allclose(step, [-500.0, -0.05], rtol=1e-9)


def test_a_column_that_tells_next_to_nothing_is_damped_as_a_millionth_of_the_largest() -> None:
    """s = -a r / (a^2 + d (1e-6 A)^2): at a tenth of that, with d = 1, 10 / 1.01 / 100."""
    jacobian = np.diag([2.0, 2e-7, 0.0])[:, :2]
    far = np.array([[-1e9] * 2, [1e9] * 2])
    step = damped_step(np.array([0.0, 1.0, 0.0]), jacobian, 1.0, far)
    assert step[1] == pytest.approx(-2e-7 / (4e-14 + 4e-12), rel=1e-6)
    silent = damped_step(np.array([2.0, 1.0, 0.0]), jacobian * [1.0, 0.0], 1.0, far)
    np.testing.assert_allclose(silent, [-0.5, 0.0], atol=1e-12)
    assert damped_step(ONE, np.zeros((1, 1)), 1.0, far[:, :1])[0] == pytest.approx(0.0, abs=1e-9)


def test_a_step_ends_at_its_reach_and_the_other_makes_the_best_of_it() -> None:
    """(a - 3)^2 + (a + b)^2, a at most 1: b goes to -1. Damping next to none."""
    jacobian, residual = np.array([[1.0, 0.0], [1.0, 1.0]]), np.array([-3.0, 0.0])
    step = damped_step(residual, jacobian, 1e-12, np.array([[-9.0, -9.0], [1.0, 9.0]]))
    np.testing.assert_allclose(step, [1.0, -1.0], rtol=1e-6)
    held = damped_step(residual, jacobian, 1e-12, np.array([[0.0, -9.0], [0.0, 9.0]]))
    np.testing.assert_allclose(held, [0.0, 0.0], atol=2e-12)


class Looked:
    """x - 1, and a constant; where it stands, every look remembered."""

    def __init__(self, constant: float = 0.0, most: float = np.inf) -> None:
        self.looks: list[float] = []
        self.constant, self.most = constant, most

    def __call__(self, x: Array) -> tuple[Array, Array] | None:
        self.looks.append(float(x[0]))
        if x[0] > self.most:
            return None
        return np.array([x[0] - 1.0, self.constant]), np.array([[1.0], [0.0]])


def test_damping_is_eased_by_ten_after_each_step_that_keeps_its_promise() -> None:
    """Of what is left, d / (1 + d) stays; d = 1e-3, 1e-4, ..."""
    point = Looked()
    ended = descend_along(point, np.zeros(1), FAR, ONE, DescentTolerances(0.0, 0.0, 0.0, 4))
    left = np.cumprod([1.0, 1e-3 / 1.001, 1e-4 / 1.0001, 1e-5 / 1.00001])
    np.testing.assert_allclose(1.0 - np.array(point.looks), left, rtol=1e-3)
    assert not ended.arrived
    assert ended.evaluations == 4
    assert ended.half_cost == pytest.approx(0.5 * left[-1] ** 2, rel=1e-2)


def test_damping_grows_fivefold_where_nothing_stands_until_it_is_as_large_as_may_be() -> None:
    """1e-3 times 5^18 is the first beyond 1e9: with it the last step is tried, then no more."""
    point = Looked(most=0.0)
    ended = descend_along(point, np.zeros(1), FAR, ONE, NOTHING)
    steps = 1.0 / (1.0 + 1e-3 * 5.0 ** np.arange(19))
    np.testing.assert_allclose(point.looks, [0.0, *steps], rtol=1e-6)
    assert not ended.arrived
    assert (ended.x[0], ended.half_cost, ended.evaluations) == (0.0, 0.5, 100)


def test_a_scale_is_the_unit_in_which_steps_are_taken() -> None:
    """Of one unknown the step is the same in any scale, but for when it counts as nothing."""
    for scale in (0.1, 10.0):
        point = Looked()
        descend_along(
            point, np.zeros(1), FAR, np.array([scale]), DescentTolerances(0.0, 0.0, 0.0, 2)
        )
        np.testing.assert_allclose(point.looks, [0.0, 1.0 / 1.001])
    whole = DescentTolerances(cost=0.0, step=0.5, slope=0.0, evaluations=9)
    for scale, looks in ((1.0, 2), (1.9, 2), (2.1, 1)):
        point = Looked()
        ended = descend_along(point, np.zeros(1), FAR, np.array([scale]), whole)
        assert (len(point.looks), ended.arrived, ended.evaluations) == (looks, True, looks)


@sweep("tolerance, looks", [(0.19, 2), (0.21, 1)])
def test_a_gain_that_is_a_small_share_of_the_cost_is_none(tolerance: float, looks: int) -> None:
    """1 of 5 is to be gained at first; then next to nothing."""
    point = Looked(constant=2.0)
    settled = DescentTolerances(cost=tolerance, step=0.0, slope=0.0, evaluations=9)
    ended = descend_along(point, np.zeros(1), FAR, ONE, settled)
    assert (len(point.looks), ended.arrived, ended.evaluations) == (looks, True, looks)
    assert ended.half_cost == pytest.approx(2.5 if looks == 1 else 2.0, rel=1e-5)


@sweep("share, taken", [(2e-3, True), (0.5e-3, False), (-0.1, False)])
def test_a_step_that_breaks_its_promise_is_not_taken(share: float, taken: bool) -> None:
    """At least a thousandth of the gain that the slope promises."""

    def point(x: Array) -> tuple[Array, Array]:
        return np.array([np.sqrt(1.0 - share) if x[0] else 1.0]), -np.ones((1, 1))

    ended = descend_along(point, np.zeros(1), FAR, ONE, DescentTolerances(0.0, 0.0, 0.0, 2))
    assert bool(ended.x[0] > 0.9) is taken
    assert ended.half_cost == pytest.approx(0.5 * (1.0 - share if taken else 1.0))


@sweep("low, high, end", [(-1.0, 0.25, 0.25), (1.5, 4.0, 1.5)])
def test_it_stops_at_a_bound_from_either_side(low: float, high: float, end: float) -> None:
    for scale in (0.2, 5.0):
        start, bounds = np.array([0.5 * (low + high)]), (np.array([low]), np.array([high]))
        settled = DescentTolerances(1e-12, 1e-12, 0.0, 30)
        ended = descend_along(Looked(), start, bounds, np.array([scale]), settled)
        assert ended.arrived
        assert ended.x[0] == end
        assert ended.half_cost == pytest.approx(0.5 * (end - 1.0) ** 2)


def test_where_a_start_does_not_stand_there_is_no_descent() -> None:
    ended = descend_along(lambda x: None, np.array([0.3]), FAR, ONE, NOTHING)
    assert (ended.x[0], ended.half_cost, ended.arrived, ended.evaluations) == (
        0.3,
        np.inf,
        False,
        1,
    )


def test_a_descent_asks_once_and_again_for_what_is_new() -> None:
    point = Looked(most=2.0)
    looked = once(point)
    for x in (0.0, 1.5, 0.0, 3.0, 3.0, 1.5):
        assert (looked(np.array([x])) is None) == (x > 2.0)
    assert point.looks == [0.0, 1.5, 3.0]


def test_inside_bounds_a_straight_cost_ends_at_its_least() -> None:
    settled = DescentTolerances(cost=1e-12, step=1e-12, slope=1e-12, evaluations=50)
    ended = descend(Looked(2.0), np.zeros(1), FAR, ONE, 2, settled)
    assert ended.arrived
    assert ended.x[0] == pytest.approx(1.0, abs=1e-5)
    assert ended.half_cost == pytest.approx(2.0)
    few = DescentTolerances(cost=1e-15, step=1e-15, slope=1e-15, evaluations=1)
    given_up = descend(Looked(2.0), np.zeros(1), FAR, ONE, 2, few)
    assert not given_up.arrived
    assert given_up.evaluations == 1
    assert few.given_up == "no optimum within 1 evaluations"


def test_inside_bounds_it_turns_back_from_where_nothing_stands() -> None:
    """And takes the slope of the point before for one that is lost on being asked again."""
    settled = DescentTolerances(cost=1e-9, step=1e-9, slope=1e-9, evaluations=60)
    ended = descend(Looked(most=0.5), np.zeros(1), FAR, ONE, 2, settled)
    assert 0.3 < ended.x[0] <= 0.5
    asked: set[bytes] = set()

    def forgetful(x: Array) -> tuple[Array, Array] | None:
        known = x.tobytes() in asked
        asked.add(x.tobytes())
        return None if known else (x - 1.0, np.eye(1))

    assert descend(forgetful, np.zeros(1), FAR, ONE, 1, settled).x[0] == pytest.approx(1.0)


# Along bounds, against scipy

TIGHT = DescentTolerances(cost=1e-13, step=1e-10, slope=0.0, evaluations=200)


def test_a_linear_problem_ends_on_the_bounds_that_scipy_finds() -> None:
    rng = np.random.default_rng(4)
    for _ in range(20):
        matrix, target = rng.normal(size=(15, 8)), rng.normal(size=15)
        bounds = (np.full(8, -0.05), np.full(8, 0.2))
        expected = lsq_linear(matrix, target, bounds, "bvls")
        ended = descend_along(
            lambda x, a=matrix, b=target: (a @ x - b, a), np.zeros(8), bounds, np.ones(8), TIGHT
        )
        assert ended.arrived
        assert ended.half_cost == pytest.approx(expected.cost, rel=1e-9)
        np.testing.assert_allclose(ended.x, expected.x, atol=1e-5)
        assert ((expected.active_mask != 0) == ((ended.x == -0.05) | (ended.x == 0.2))).all()


def rosenbrock(x: Array) -> tuple[Array, Array]:
    """Chained, a curved valley; (2 (m - 1),) residuals."""
    m = len(x)
    curve, off = 10.0 * (x[1:] - x[:-1] ** 2), 1.0 - x[:-1]
    jacobian = np.zeros((2 * (m - 1), m))
    for k in range(m - 1):
        jacobian[k, k], jacobian[k, k + 1] = -20.0 * x[k], 10.0
        jacobian[m - 1 + k, k] = -1.0
    return np.append(curve, off), jacobian


@pytest.mark.parametrize("most", [0.5, 0.9, 3.0])
def test_a_curved_valley_cut_off_by_bounds(most: float) -> None:
    bounds, scale = (np.full(4, -0.2), np.full(4, most)), np.array([1.0, 0.3, 2.0, 1.0])
    ended = descend_along(rosenbrock, np.zeros(4), bounds, scale, TIGHT)
    expected = minimize(
        lambda x: 0.5 * float(rosenbrock(x)[0] @ rosenbrock(x)[0]),
        np.zeros(4),
        method="L-BFGS-B",
        bounds=list(zip(*bounds, strict=True)),
        options={"ftol": 1e-15, "gtol": 1e-10, "maxiter": 5000},
    )
    assert ended.arrived
    np.testing.assert_allclose(ended.x, expected.x, atol=1e-4)
    assert ended.half_cost <= expected.fun + 1e-9
