"""Numbers of the field against closed forms, whatever the law is called.

Catches ranges, stiffness and breaks that hang on the name of a law.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest
from sweeps import sweep

from spinepipe.effects import create
from spinepipe.effects.field_numbers import Law, field_numbers, load_over, numbers_of

K = 50.0


def joint(name: str = "", *values: float, options: Mapping[str, Any] | None = None) -> list[Law]:
    """Springs of 50 N m/rad and 100 N/mm, and a law."""
    springs = (create("linear_bushing"), np.array([1e5] * 3 + [K] * 3))
    return [springs] + ([(create(name, options), np.array(values))] if name else [])


def test_a_spring_has_one_stiffness_and_nothing_else() -> None:
    found = field_numbers(joint(), "extension")
    assert found.stiffness_at_zero == pytest.approx(K)
    assert found.stiffness_at_load == pytest.approx((K, K))
    assert found.motion_at_load == pytest.approx((-0.1, 0.1))
    assert (found.breaks, found.zone) == ((None, None), None)
    assert (found.loop_area, found.drift_per_decade) == (None, None)


def test_shear_is_told_at_fifty_newton() -> None:
    found = field_numbers(joint(), "anterior")
    assert (found.load, found.motion_at_load[1]) == (50.0, pytest.approx(5e-4))


def test_a_zone_is_as_wide_as_its_corners_are_apart() -> None:
    found = field_numbers(joint("neutral_zone", 0.3, 0.02, 50.0), "extension")
    assert found.stiffness_at_zero == pytest.approx(0.3 * K)
    assert found.stiffness_at_load == pytest.approx((K, K), rel=1e-6)
    # G' = 1/2 at u^n = 2^(n / (n + 1)) - 1: 0.3 % inside the corner
    corner = 0.02 * (2.0 ** (50.0 / 51.0) - 1.0) ** (1.0 / 50.0)
    assert found.zone == pytest.approx(2.0 * corner, rel=1e-4)


def test_a_bilinear_law_and_a_zone_of_the_same_curve_have_the_same_numbers() -> None:
    """15 N m/rad up to 0.06 rad, 50 beyond."""
    zone = field_numbers(joint("neutral_zone", 0.3, 0.06, 30.0), "extension")
    soft = (create("linear_bushing"), np.array([1e5] * 3 + [0.3 * K] * 3))
    law = create("nonlinear_stiffening", {"shape": "bilinear"})
    bent = field_numbers([soft, (law, np.array([0.7 / 0.3, 0.06]))], "extension")
    assert bent.stiffness_at_zero == pytest.approx(zone.stiffness_at_zero)
    assert bent.stiffness_at_load == pytest.approx(zone.stiffness_at_load, rel=1e-6)
    assert bent.zone == pytest.approx(zone.zone, rel=0.02)
    assert bent.breaks[1] == pytest.approx(0.06, rel=0.02)


def test_stiffening_is_told_by_its_slopes() -> None:
    found = field_numbers(joint("nonlinear_stiffening", 9.0), "extension")
    # at 5 N m: exp(b q) = 1 + b M / k
    assert found.stiffness_at_load[1] == pytest.approx(K * (1.0 + 9.0 * 5.0 / K), rel=1e-4)


def test_asymmetry_is_told_by_its_sides() -> None:
    found = field_numbers(joint("flexion_extension_asymmetry", 0.2), "extension")
    assert found.stiffness_at_load == pytest.approx((0.8 * K, 1.2 * K), rel=1e-6)
    assert found.zone is None


def test_a_loop_of_friction_has_its_area() -> None:
    """Dahl between -A and A: 4 m (A - y tanh(A / y)); a slider and its spring: 4 m (A - y)."""
    m, y, largest = 0.8, 0.02, 0.1
    found = field_numbers(joint("hysteresis", m, y), "extension")
    assert found.loop_area == pytest.approx(
        4.0 * m * (largest - y * np.tanh(largest / y)), rel=1e-3
    )
    slider = joint("hysteresis", m, y, 0.0, options={"law": "jenkins"})
    found = field_numbers(slider, "extension")
    assert found.loop_area == pytest.approx(4.0 * m * (largest - y), rel=1e-3)
    assert found.stiffness_at_zero == pytest.approx(K)
    assert found.drift_per_decade is None


@sweep("load", ["held", "ramped"])
def test_creep_drifts_as_its_closed_form(load: str) -> None:
    """q(t) / q(0) = 1 + f / (1 - f) (1 - exp(-(1 - f) t / T))."""
    f, time = 0.3, 200.0
    found = field_numbers(joint("creep", f, time, 0.0, options={"load": load}), "extension")
    gone = [np.exp(-(1.0 - f) * t / time) for t in (60.0, 600.0)]
    expected = f / (1.0 - f) * (gone[0] - gone[1])
    assert found.drift_per_decade == pytest.approx(expected, rel=1e-6)
    assert found.loop_area is None


def test_a_load_that_is_never_reached_is_none() -> None:
    lax = [(create("linear_bushing"), np.array([1e5] * 3 + [1.0] * 3))]
    found = field_numbers(lax, "extension")
    assert found.motion_at_load == (None, None)
    assert found.stiffness_at_load == (None, None)
    assert found.zone is None


@sweep("ratio", [1.12, 1.5, 3.0])
def test_a_joint_breaks_where_it_is_half_as_much_stiffer_as_in_the_end(ratio: float) -> None:
    """Stiffness K exp(b q) is K (1 + b M / K) under M: half way at q = log((1 + ratio) / 2) / b."""
    rate = (ratio - 1.0) * K / 5.0
    found = field_numbers(joint("nonlinear_stiffening", rate), "extension")
    # |q| is rounded over 1e-4 rad
    at = np.log(0.5 * (1.0 + ratio)) / rate
    assert found.breaks == pytest.approx((-at, at), abs=1e-4, rel=1e-3)
    assert found.zone == pytest.approx(2.0 * at, abs=2e-4, rel=1e-3)


@sweep("ratio, told", [(1.10, False), (1.115, True)])
def test_a_tenth_of_the_stiffness_makes_a_break(ratio: float, told: bool) -> None:
    """Of the larger: nine tenths of 1.111."""
    found = field_numbers(joint("nonlinear_stiffening", (ratio - 1.0) * K / 5.0), "extension")
    assert (found.breaks[1] is not None) == told


@sweep("coordinate, load, furthest", [("extension", 5.0, 1.5), ("anterior", 50.0, 0.1)])
def test_a_joint_is_asked_up_to_a_and_a_half_radians_or_ten_centimetres(
    coordinate: str, load: float, furthest: float
) -> None:
    for share, told in ((0.99, True), (1.01, False)):
        stiffness = load / (share * furthest)
        springs = [(create("linear_bushing"), np.full(6, stiffness))]
        motion = field_numbers(springs, coordinate).motion_at_load[1]
        assert motion == (pytest.approx(share * furthest) if told else None)


def test_numbers_are_told_at_a_load_that_is_asked_for() -> None:
    found = field_numbers(joint("flexion_extension_asymmetry", 0.2), "extension", 2.0)
    assert found.load == 2.0
    assert found.motion_at_load == pytest.approx((-2.0 / (0.8 * K), 2.0 / (1.2 * K)), rel=1e-3)


def test_many_joints_are_each_as_alone() -> None:
    """More than are held in memory together."""
    count = 66
    stiffness = np.tile([1e5] * 3 + [K] * 3, (count, 1)) * np.linspace(1.0, 2.0, count)[:, None]
    laws: list[Law] = [
        (create("linear_bushing"), stiffness),
        (create("nonlinear_stiffening"), np.linspace(1.0, 9.0, count)[:, None]),
    ]
    found = numbers_of(laws, "extension", 5.0)
    for k in (0, 63, 64, 65):
        alone = numbers_of([(law, own[k : k + 1]) for law, own in laws], "extension", 5.0)
        for name, value in alone.items():
            np.testing.assert_allclose(found[name][k], value[0], rtol=1e-9, err_msg=name)


def test_load_over_another_coordinate_is_the_sum_of_all_laws() -> None:
    """Springs bear nothing there, a coupling 15 N m/rad; friction is at the start of its path."""
    motions = np.array([-0.05, 0.0, 0.1])
    coupled = joint("bending_rotation_coupling", 15.0)
    found = load_over(coupled, "left_rotation", "right_bending", motions)
    np.testing.assert_allclose(found, 15.0 * motions, rtol=1e-14)
    own = load_over(coupled, "right_bending", "right_bending", motions)
    np.testing.assert_allclose(own, K * motions, rtol=1e-14)
    rubbed = load_over(joint("hysteresis", 0.8, 0.02), "extension", "extension", motions)
    branch = 0.8 * np.sign(motions) * -np.expm1(-np.abs(motions) / 0.02)
    np.testing.assert_allclose(rubbed, K * motions + branch, rtol=1e-12)
    lax = load_over(joint("local_laxity", 0.3), "extension", "extension", motions)
    np.testing.assert_allclose(lax, 0.7 * K * motions, rtol=1e-14)
