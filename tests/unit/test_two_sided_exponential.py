"""The two-sided exponential: Wang 2021 eq. 3 on each side, one slope at zero, derivatives.

Catches sides exchanged, a jump of slope at zero, or a wrong derivative.
"""

import numpy as np
import pytest
from example_effects import NOWHERE, scoped, slope, spine
from sweeps import sweep

from spinepipe.effects import Wrench, create
from spinepipe.effects.contract import Array
from spinepipe.model import LoadCase, LoadStep, SpineModel
from spinepipe.statics import System, follow
from spinepipe.units import COORDINATES
from spinepipe.world import Chain

EXTENSION = COORDINATES.index("extension")
LAW = create("two_sided_exponential", {})
STIFFNESS, FORWARDS, BACKWARDS = 27.0, 16.0, 10.0
VALUES = np.array([STIFFNESS, FORWARDS, BACKWARDS])
LEAST = 1e-4
"""N m/rad, the least that a bushing may have; the law carries the rest."""


def pose(q: float) -> Array:
    found = np.zeros((1, 6))
    found[0, EXTENSION] = q
    return found


def load(q: float, values: Array = VALUES) -> float:
    return float(LAW.respond(pose(q), values[None], np.zeros((1, 6))).load[0, EXTENSION])


def tangent(q: float, values: Array = VALUES) -> float:
    response = LAW.respond(pose(q), values[None], np.zeros((1, 6)))
    return float(response.tangent[0, EXTENSION, EXTENSION])


@sweep("q", [1e-7, 2e-5, 9e-5, 0.004, 0.1, 0.3])
def test_each_side_is_an_exponential_of_its_own(q: float) -> None:
    """A (exp(B q) - 1) with A = k / B, in extended precision where numbers are nearly equal."""
    for sign, rate in ((1.0, FORWARDS), (-1.0, BACKWARDS)):
        size = np.longdouble(rate) * np.longdouble(q)
        exact = float(np.longdouble(STIFFNESS / rate) * np.expm1(size))
        assert load(sign * q) == pytest.approx(sign * exact, rel=1e-13)


def test_stiffness_is_the_rate_times_load_and_stretch_together() -> None:
    """k = B (F + A), which follows from Wang 2021 eq. 3."""
    for q, rate in ((0.09, FORWARDS), (-0.13, BACKWARDS)):
        assert tangent(q) == pytest.approx(rate * (abs(load(q)) + STIFFNESS / rate), rel=1e-13)


def test_the_slope_at_zero_is_the_same_on_both_sides() -> None:
    assert load(0.0) == 0.0
    for q in (-1e-9, 0.0, 1e-9):
        assert tangent(q) == pytest.approx(STIFFNESS, rel=1e-7)


def test_it_goes_on_straight_beyond_five() -> None:
    for sign, rate in ((1.0, FORWARDS), (-1.0, BACKWARDS)):
        edge = sign * 5.0 / rate
        steepest = STIFFNESS * np.exp(5.0)
        assert tangent(1.001 * edge) == pytest.approx(steepest, rel=1e-12)
        assert tangent(3.0 * edge) == pytest.approx(steepest, rel=1e-12)
        grown = load(3.0 * edge) - load(2.0 * edge)
        assert grown == pytest.approx(steepest * edge, rel=1e-12)


def test_without_a_rate_it_is_a_spring() -> None:
    spring = np.array([STIFFNESS, 0.0, 0.0])
    for q in (-0.3, 0.2):
        assert load(q, spring) == pytest.approx(STIFFNESS * q, rel=1e-15)
        assert tangent(q, spring) == pytest.approx(STIFFNESS, rel=1e-15)


@sweep("coordinate", COORDINATES)
def test_derivatives_are_those_of_the_load(coordinate: str) -> None:
    """At rest, bent to both sides, near zero and beyond the straight end."""
    law = create("two_sided_exponential", {"coordinate": coordinate})
    at = COORDINATES.index(coordinate)
    size = 1e-3 if at < 3 else 0.1
    values = np.array([p.default * f for p, f in zip(law.parameters, (1, 1.3, 0.7), strict=True)])
    beyond = 6.0 / values[1] / size
    rest = np.zeros((1, 6))
    for share in (-2.0, -0.4, -5e-4, 5e-4, 0.7, 1.9, beyond):
        q = np.zeros((1, 6))
        q[0, at] = share * size
        found = law.respond(q, values[None], rest)
        along = np.eye(6)[at]
        by_q = slope(lambda h, q=q, d=along: law.respond(q + h * d, values[None], rest).load, 1e-7)
        # fourth-order differences over 1e-7: rounding of the load over the step, 1e-9 of it
        np.testing.assert_allclose(found.tangent[:, :, at], by_q, rtol=1e-6, atol=1e-6)
        by_values = law.by_parameter(q, values[None], rest)
        for column in range(3):
            step = 1e-4 * values[column] * np.eye(3)[column]
            expected = slope(
                lambda h, q=q, d=step: law.respond(q, (values + h * d)[None], rest).load, 1.0
            )
            np.testing.assert_allclose(
                by_values[:, :, column] * step[column], expected, rtol=1e-7, atol=1e-12
            )


def test_other_coordinates_bear_nothing() -> None:
    q = np.full((1, 6), 0.02)
    response = LAW.respond(q, VALUES[None], np.zeros((1, 6)))
    assert not np.delete(response.load, EXTENSION).any()
    assert np.count_nonzero(response.tangent) == 1


def bent(moment_nm: float, joints: int = 1) -> tuple[SpineModel, LoadCase]:
    """Joints of which each bears the moment about its own extension axis, springs of no account."""
    model = spine(joints, gravity=False)
    springs = model.effects[0].values.copy()
    springs[:, EXTENSION] = LEAST
    law = scoped(LAW, tuple(range(joints)), *(tuple(VALUES.tolist()),) * joints)
    model = model.with_effects((model.effects[0].with_values(springs), law))
    axis = model.frames[0].rotation[:, 2]
    step = LoadStep(0, (Wrench(joints - 1, NOWHERE, NOWHERE, moment_nm * axis),))
    return model, LoadCase("bent", 1, (step,))


@sweep("moment_nm", [-60.0, -7.5, 0.1, 7.5, 200.0])
def test_a_joint_turns_as_far_as_the_law_says(moment_nm: float) -> None:
    """q = log(1 + M / A) / B."""
    model, case = bent(moment_nm)
    (found,) = follow(System(Chain(model), model, case))
    assert found.usable, found.equilibrium.message
    rate = FORWARDS if moment_nm > 0.0 else BACKWARDS
    turned = np.sign(moment_nm) * np.log1p(abs(moment_nm) * rate / STIFFNESS) / rate
    # the spring beside it holds 1e-4 of 27 N m/rad at most
    assert found.equilibrium.q[EXTENSION] == pytest.approx(turned, rel=1e-5)


def test_an_unknown_coordinate_is_refused() -> None:
    with pytest.raises(ValueError, match="flexion"):
        create("two_sided_exponential", {"coordinate": "flexion"})
