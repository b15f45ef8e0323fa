"""Finite helical axes: turns about known lines, another library, and sampled noise.

Catches a helical axis of wrong place, direction or error.
"""

import numpy as np
import pinocchio as pin
import pytest
from numpy.typing import NDArray

from spinepipe.experiment.screw import SMALLEST_ANGLE, derivatives, screw_between
from spinepipe.frames import Pose, coordinates_of, transform_of

Array = NDArray[np.float64]


def turned_about(line: Array, point: Array, angle: float, shift: float) -> Pose:
    """Rodrigues' formula by hand: a turn about a line through a point, and a shift along it."""
    x, y, z = line
    across = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    rotation = np.eye(3) + np.sin(angle) * across + (1.0 - np.cos(angle)) * across @ across
    return Pose(rotation, point - rotation @ point + shift * line)


@pytest.mark.parametrize("seed", range(5))
def test_a_turn_about_a_known_line(seed: int) -> None:
    rng = np.random.default_rng(seed)
    line = rng.normal(size=3)
    line /= np.linalg.norm(line)
    point, angle, shift = 0.03 * rng.normal(size=3), rng.uniform(0.04, 0.4), 0.002 * rng.normal()
    before = np.array([*0.004 * rng.normal(size=3), *0.1 * rng.normal(size=3)])
    after = coordinates_of(turned_about(line, point, angle, shift) @ transform_of(before))
    found = screw_between(before, after)
    assert found.angle == pytest.approx(angle, rel=1e-10)
    np.testing.assert_allclose(found.direction, line, atol=1e-9)
    np.testing.assert_allclose(found.centre, point - (point @ line) * line, atol=1e-10)
    assert found.shift == pytest.approx(shift, abs=1e-11)


def test_the_logarithm_of_pinocchio_is_the_same_screw() -> None:
    rng = np.random.default_rng(9)
    before, after = 0.1 * rng.normal(size=(2, 6))
    motion = transform_of(after) @ transform_of(before).inverse()
    twist = pin.log6(pin.SE3(motion.rotation, motion.origin))
    angle = np.linalg.norm(twist.angular)
    found = screw_between(before, after)
    assert found.angle == pytest.approx(angle)
    np.testing.assert_allclose(found.direction, twist.angular / angle, atol=1e-12)
    centre = np.cross(twist.angular, twist.linear) / angle**2
    np.testing.assert_allclose(found.centre, centre, atol=1e-12)
    assert found.shift == pytest.approx(twist.angular @ twist.linear / angle)


def test_there_and_back_are_one_axis_turned_round() -> None:
    before, after = np.zeros(6), np.array([0.001, 0.0, 0.002, 0.1, 0.02, -0.03])
    there, back = screw_between(before, after), screw_between(after, before)
    np.testing.assert_allclose(there.direction, -back.direction, atol=1e-12)
    np.testing.assert_allclose(there.centre, back.centre, atol=1e-12)
    with pytest.raises(ValueError, match="no axis"):
        screw_between(before, before)


@pytest.mark.parametrize("angle_deg", [2.0, 8.0])
def test_propagated_sds_are_those_of_sampled_noise(angle_deg: float) -> None:
    """0.1 deg and 0.1 mm on both poses; at 2 deg second order is a few percent."""
    rng = np.random.default_rng(2)
    line = np.array([0.1, -0.05, 1.0])
    line /= np.linalg.norm(line)
    point = np.array([-0.005, -0.012, 0.0])
    after = coordinates_of(turned_about(line, point, np.deg2rad(angle_deg), 0.0))
    sd = np.tile([1e-4] * 3 + [np.deg2rad(0.1)] * 3, 2)
    propagated = np.linalg.norm(derivatives(np.zeros(6), after) * sd, axis=1)
    noise = sd * rng.normal(size=(1500, 12))
    samples = np.array([screw_between(n[:6], after + n[6:]).numbers() for n in noise])
    # along the axis itself direction and centre move to second order only
    seen = propagated > 0.3 * propagated[[0, 1, 1, 1, 4, 4, 4, 7]]
    np.testing.assert_allclose(samples.std(axis=0)[seen], propagated[seen], rtol=0.08)


def test_the_centre_is_as_noisy_as_translations_over_the_angle() -> None:
    """Woltring et al. 1985: SD of the place of the axis grows with one over the angle."""
    sd = np.tile([1e-4] * 3 + [0.0] * 3, 2)
    for angle in (SMALLEST_ANGLE, 5 * SMALLEST_ANGLE):
        after = np.array([0.0, 0.0, 0.0, angle, 0.0, 0.0])
        sds = np.linalg.norm(derivatives(np.zeros(6), after) * sd, axis=1)
        closed = 1e-4 * np.sqrt(2.0) / (2.0 * np.sin(0.5 * angle))
        np.testing.assert_allclose(sds[4:6], closed, rtol=1e-3)
