"""Parts of equilibrium and settling by closed forms: factors, decay, sizes of steps, the method.

Catches a wrong factor, decay or step size inside equilibrium and settling.
"""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from sweeps import sweep

from spinepipe.statics.equilibrium import (
    STEP_TOLERANCE,
    SingularTangent,
    decays,
    factor,
    newton,
)
from spinepipe.statics.system import Loading
from spinepipe.statics.transient import (
    ALPHA,
    COUPLING,
    EMBEDDED,
    GAMMA,
    STAGE_TIMES,
    TIME_WEIGHTS,
    WEIGHTS,
    Course,
    Program,
    _between,
    new_size,
)

# Factors of a tangent


@sweep(
    "matrix, sign",
    [
        (np.eye(3), 1),
        (np.diag([1.0, -2.0, 3.0]), -1),
        (np.diag([-1.0, -2.0, 3.0]), 1),
        (np.eye(3)[[1, 0, 2]], -1),
        (np.eye(3)[[1, 2, 0]], 1),
        (-np.eye(3)[[1, 0, 2]], 1),
    ],
)
def test_factors_tell_the_sign_of_the_determinant_and_solve(matrix: np.ndarray, sign: int) -> None:
    found = factor(matrix)
    assert found.sign == sign
    right = np.array([[1.0, 2.0], [3.0, 4.0], [5.0, 6.0]])
    np.testing.assert_allclose(matrix @ found.solve(right), right, rtol=1e-14)


@sweep("matrix, why", [(np.diag([1.0, 0.0]), "singular"), (np.diag([1.0, np.inf]), "not finite")])
def test_a_tangent_without_an_inverse_has_no_factors(matrix: np.ndarray, why: str) -> None:
    with pytest.raises(SingularTangent, match=why):
        factor(matrix)


# What decays


@sweep("share", [0.99, 1.01])
@sweep("mass", [0.5, 2.0])
def test_a_twisted_mode_decays_below_the_root_of_stiffness_over_mass(
    mass: float, share: float
) -> None:
    """m l^2 + l + s + i a = 0 has roots in the left half alone where a^2 m < s."""
    stiffness = 3.0
    twist = share * np.sqrt(stiffness / mass)
    matrix = np.array([[stiffness, twist], [-twist, stiffness]])
    assert decays(mass * np.eye(2), matrix) is (share < 1.0)


@sweep("mass", [0.0, 1.0, 1e-12])
def test_stiffness_decides_without_a_twist(mass: float) -> None:
    assert decays(mass * np.eye(2), np.diag([2.0, 1e-3]))
    assert not decays(mass * np.eye(2), np.diag([2.0, -1e-3]))


def test_a_massless_mode_decays_whatever_its_twist() -> None:
    assert decays(np.zeros((2, 2)), np.array([[0.1, 50.0], [-50.0, 0.1]]))
    assert not decays(np.zeros((2, 2)), np.array([[-0.1, 50.0], [-50.0, -0.1]]))


# The method in time: conditions of W-methods (Rang and Angermann 2005)


def test_the_method_keeps_its_order_with_any_jacobian() -> None:
    """What stands before an approximate Jacobian vanishes up to the third order."""
    jacobian, one = COUPLING + GAMMA * np.eye(4), np.ones(4)
    np.testing.assert_allclose(STAGE_TIMES, ALPHA @ one, atol=1e-15)
    np.testing.assert_allclose(TIME_WEIGHTS, jacobian @ one, atol=1e-15)
    for first, second in ((ALPHA, jacobian), (jacobian, ALPHA), (jacobian, jacobian)):
        assert abs(WEIGHTS @ first @ second @ one) < 1e-13
    assert abs(EMBEDDED.sum() - 1.0) < 1e-14
    for weights in (WEIGHTS, EMBEDDED):
        assert abs(weights @ STAGE_TIMES - 0.5) < 1e-14
        assert abs(weights @ TIME_WEIGHTS) < 1e-14


def test_the_method_forgets_the_stiffest_modes() -> None:
    """L-stability: R(z) = 1 + z b (I - z B)^-1 1 goes to nought far out, and never grows."""
    whole, one = ALPHA + COUPLING + GAMMA * np.eye(4), np.ones(4)

    def factor_of(z: complex) -> complex:
        return 1.0 + z * (WEIGHTS @ np.linalg.solve(np.eye(4) - z * whole, one))

    assert abs(1.0 - WEIGHTS @ np.linalg.solve(whole, one)) < 1e-13
    for z in (-1e-3, -1.0, -50.0, 0.5j, 3j, 1000j):
        assert abs(factor_of(z)) <= 1.0 + 1e-12
    assert abs(factor_of(-0.01) - np.exp(-0.01)) < 0.01**4


@sweep(
    "error, growth",
    [
        *((1.0, 0.9), (1.0 / 8.0, 1.8), (8.0, 0.45), (0.9**3, 1.0)),
        *((1e-2, 0.9 * 100.0 ** (1.0 / 3.0)), (1e-3, 6.0), (0.0, 6.0)),
        *((1e4, 0.2), (np.inf, 0.2), (np.nan, 0.2)),
    ],
)
def test_steps_grow_by_the_third_root_of_what_they_err(error: float, growth: float) -> None:
    """A tenth short of it, six times at most and a fifth at least."""
    assert new_size(0.01, error) == pytest.approx(0.01 * growth)


def test_poses_within_a_step_are_those_of_its_cubic() -> None:
    def pose(t: float) -> np.ndarray:
        return np.array([1.0 + 2.0 * t - 3.0 * t**2 + 0.5 * t**3, 4.0 - t**3])

    def rate(t: float) -> np.ndarray:
        return np.array([2.0 - 6.0 * t + 1.5 * t**2, -3.0 * t**2])

    ends = [(t, pose(t), rate(t)) for t in (0.3, 1.1)]
    for time in (0.3, 0.5, 0.9, 1.1):
        np.testing.assert_allclose(_between(ends[0], ends[1], time), pose(time), rtol=1e-14)


# Programs of loads


def loading(force: float) -> Loading:
    return Loading(np.array([[force, 0.0, 0.0]]), np.zeros((1, 3)), 1.0)


def test_loads_go_straight_between_their_times_and_stay_after_the_last() -> None:
    program = Program((0.0, 2.0, 3.0), (loading(1.0), loading(5.0), loading(2.0)))
    at = {time: float(program.at(time).forces[0, 0]) for time in (0.0, 0.5, 2.0, 2.5, 3.0, 9.0)}
    assert at == {0.0: 1.0, 0.5: 2.0, 2.0: 5.0, 2.5: 3.5, 3.0: 2.0, 9.0: 2.0}
    assert [program.corner_after(t) for t in (0.0, 1.9, 2.0, 2.0 - 1e-16, 3.0)] == [
        *(2.0, 2.0, 3.0, 3.0, np.inf)
    ]


def test_a_ramp_is_given_so_many_times_a_second() -> None:
    """Half a second at 25 a second: 12 stretches, as a half rounds to the even one."""
    course = Course(2.0, 0.5)
    np.testing.assert_allclose(course.corners, np.linspace(0.0, 0.5, 13))
    np.testing.assert_allclose(Course(2.0, 0.5, 10.0).corners, np.linspace(0.0, 0.5, 6))
    np.testing.assert_allclose(course.shares(np.array([0.0, 0.25, 0.5, 3.0])), [0, 0.5, 1, 1])
    np.testing.assert_array_equal(Course(2.0).shares(np.array([0.0, 1.0])), [1.0, 1.0])
    step = 0.5 / 12.0
    after = course.corners_after(np.array([0.0, 1.5 * step, 2.0 * step, 0.5, 1.0]))
    np.testing.assert_allclose(after, [step, 2.0 * step, 3.0 * step, np.inf, np.inf])


# Newton's steps


@sweep("beyond, arrives", [(-0.01, True), (0.01, False)])
def test_forty_steps_are_taken_at_most(beyond: float, arrives: bool) -> None:
    """Towards a root of third order each step is two thirds of the one before.

    The fortieth is just within or just beyond what ends the steps.
    """
    first = np.array([3.0 * STEP_TOLERANCE[0] * 1.5**39 * (1.0 + beyond), *[0.0] * 5])

    def balance(q: np.ndarray, *_: object) -> Any:
        slopes = np.diag([3.0 * q[0] ** 2, *[1.0] * 5])
        return SimpleNamespace(residual=np.array([q[0] ** 3, *q[1:]]), tangent=slopes)

    system: Any = SimpleNamespace(start=lambda q, loading: q.copy(), balance=balance)
    found = newton(system, first, None, None)  # type: ignore[arg-type]
    assert (found.arrived, found.iterations) == (arrives, 40)
