"""Passive laws by hand: each side its own, straight on beyond the fifth power of e."""

import numpy as np
import pytest

from spinepipe.motion.passive import PassiveLaw

A, B = np.array([2.0, 3.0]), np.array([30.0, 20.0])
"""Of positive and of negative coordinates; both begin with 60."""

LAW = PassiveLaw(np.tile(A, (17, 6, 1)), np.tile(B, (17, 6, 1)))


def at(q: float) -> tuple[float, float, float]:
    """Force, slope and slope by the logarithm of B of one coordinate."""
    force, slope, by_shape = (one[0, 0, 0] for one in LAW.with_slopes(np.full((1, 17, 6), q)))
    return float(force), float(slope), float(by_shape)


def test_each_side_has_its_own_law() -> None:
    force, slope, by_shape = at(0.1)
    assert force == pytest.approx(2.0 * (np.exp(3.0) - 1.0))
    assert slope == pytest.approx(60.0 * np.exp(3.0))
    assert by_shape == pytest.approx(2.0 * 3.0 * np.exp(3.0))
    force, slope, by_shape = at(-0.1)
    assert force == pytest.approx(-3.0 * (np.exp(2.0) - 1.0))
    assert slope == pytest.approx(60.0 * np.exp(2.0))
    assert by_shape == pytest.approx(-3.0 * 2.0 * np.exp(2.0))


def test_at_rest_there_is_stiffness_and_no_force() -> None:
    assert at(0.0) == (0.0, pytest.approx(60.0), 0.0)


@pytest.mark.parametrize("beyond", [0.0, 1.0, 4.0])
def test_from_the_fifth_power_of_e_on_the_law_goes_straight(beyond: float) -> None:
    """As steep as there, from the force there."""
    force, slope, by_shape = at((5.0 + beyond) / 30.0)
    assert force == pytest.approx(2.0 * (np.exp(5.0) - 1.0 + beyond * np.exp(5.0)))
    assert slope == pytest.approx(60.0 * np.exp(5.0))
    assert by_shape == pytest.approx(2.0 * np.exp(5.0) * (5.0 + beyond))


def test_stiffness_at_a_load_is_that_of_the_side_and_ends_growing() -> None:
    """B (F + A): 30 (8 + 2) and 20 (8 + 3); at most what it is where the law goes straight."""
    np.testing.assert_allclose(LAW.stiffness_at(np.float64(8.0))[4, 2], [300.0, 220.0])
    most = 60.0 * np.exp(5.0)
    np.testing.assert_allclose(LAW.stiffness_at(np.float64(1e6)), most, rtol=1e-12)


def test_scaling_is_of_all_sides_and_each_coordinate_by_itself() -> None:
    size, shape = np.ones((17, 6)), np.ones((17, 6))
    size[3, 4], shape[5, 1] = 2.0, 3.0
    found = LAW.scaled(size, shape)
    np.testing.assert_array_equal(found.a[3, 4], 2.0 * A)
    np.testing.assert_array_equal(found.b[5, 1], 3.0 * B)
    assert (found.a != LAW.a).sum() == (found.b != LAW.b).sum() == 2


@pytest.mark.parametrize("q", [0.1, -0.1, 0.3, -0.4])
def test_second_derivatives_are_differences(q: float) -> None:
    """Below and beyond the fifth power of e, which 0.17 and -0.25 reach."""
    once, small = LAW.curvatures(np.full((1, 17, 6), q)), 1e-6

    def by(step: float, log: float) -> np.ndarray:
        scaled = LAW.scaled(np.ones((17, 6)), np.full((17, 6), np.exp(log)))
        return np.array([one[0, 0, 0] for one in scaled.with_slopes(np.full((1, 17, 6), q + step))])

    along = (by(small, 0.0) - by(-small, 0.0)) / (2.0 * small)
    bent = (by(0.0, small) - by(0.0, -small)) / (2.0 * small)
    found = [one[0, 0, 0] for one in once]
    expected = [along[1], along[2], bent[2]]
    np.testing.assert_allclose(found, expected, rtol=1e-6, atol=1e-4)
    assert bent[1] == pytest.approx(found[1], rel=1e-6)
