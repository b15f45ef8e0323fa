"""How the hidden truth is told: other frames, other angles, skin; against scipy and differences.

Catches a hidden truth told in other frames or angles than it says.
"""

from functools import partial

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tests.generators.hidden import turns
from tests.generators.hidden.contacts import OffDiagonals
from tests.generators.hidden.foreign import OrderDrift
from tests.generators.hidden.readouts import COURSES, PoseDrift, SoftTissue
from tests.generators.hidden.scope import scope
from tests.generators.hidden.world import Now, Place

NOW = Now(np.array([0]), np.array([0]), 0.0)


def test_a_tilted_marker_frame_tells_a_turned_motion() -> None:
    q = np.array([[0.001, -0.002, 0.003, 0.1, -0.05, 0.07]])
    tilt = Rotation.from_rotvec([0.02, 0.1, -0.05])
    told = turns.told_from(q, tilt.as_matrix()[None], np.zeros((1, 3)))[0]
    turned = tilt.inv() * Rotation.from_euler("ZXY", q[0, 3:]) * tilt
    np.testing.assert_allclose(told[3:], turned.as_euler("ZXY"), atol=1e-14)
    np.testing.assert_allclose(told[:3], tilt.inv().apply(q[0, :3]), atol=1e-16)


MOVING = partial(turns.moving_centre, direction=np.array([[0.05, -0.1, 0.02]]), coordinate=3)


@pytest.mark.parametrize("place", [turns.as_xyz, MOVING])
def test_places_know_their_derivative(place: Place) -> None:
    q = np.array([[0.001, -0.002, 0.003, 0.2, -0.15, 0.1]])
    _, derivative = place(q)
    moves = 1e-6 * np.eye(6)
    slopes = [(place(q + d)[0] - place(q - d)[0])[0] / 2e-6 for d in moves]
    np.testing.assert_allclose(derivative[0], np.array(slopes).T, atol=1e-9)


def test_xyz_angles_are_scipys() -> None:
    q = np.array([[0.0, 0.0, 0.0, 0.2, -0.15, 0.1]])
    x, y, z = Rotation.from_euler("ZXY", q[0, 3:]).as_euler("XYZ")
    np.testing.assert_allclose(turns.as_xyz(q)[0][0, 3:], [z, x, y], atol=1e-14)


def test_another_origin_moves_with_the_rotation() -> None:
    q = np.array([[0.001, -0.002, 0.003, 0.1, -0.05, 0.07]])
    offset = np.array([[0.01, 0.02, -0.03]])
    told = turns.told_from(q, np.eye(3)[None], offset)[0]
    moved = q[0, :3] + Rotation.from_euler("ZXY", q[0, 3:]).apply(offset[0]) - offset[0]
    np.testing.assert_allclose(told, [*moved, *q[0, 3:]], atol=1e-15)


def test_skin_follows_the_joint_above_up_to_its_reach() -> None:
    q = np.zeros((1, 1, 3, 6))
    q[..., 3] = [0.01, 0.02, 10.0]
    told = SoftTissue(scope("extension", None, 3), reach=0.05, share=0.2)(q)
    added = [0.01 * np.tanh(0.4), 0.01, 0.0]
    np.testing.assert_allclose((told - q)[0, 0, :, 3], added, atol=1e-12)
    assert not (told - q)[..., [0, 1, 2, 4, 5]].any()


def test_drift_grows_with_the_number_of_the_test() -> None:
    share = np.array([[0.0, 0.5], [0.0, 1.0]])
    told = OrderDrift(scope("left_rotation", 1, 2), share, 0.004)(np.zeros((2, 2, 2, 6)))
    np.testing.assert_allclose(told[..., 1, 5], [[0.0, 0.001], [0.0, 0.008]])
    assert not told[..., 0, :].any()


def test_off_diagonals_push_the_other_rotation() -> None:
    matrix = np.zeros((1, 6, 6))
    matrix[0, 3, 4] = matrix[0, 4, 3] = 2.0
    q = np.array([[0, 0, 0, 0.1, 0.0, 0.0]])
    load = OffDiagonals(matrix)(q, np.zeros((1, 6)), np.zeros((2, 1, 6)), NOW)
    np.testing.assert_allclose(load, [[0, 0, 0, 0, 0.2, 0]])


@pytest.mark.parametrize("formula", COURSES)
def test_a_zero_that_moves_on_starts_at_zero_and_ends_at_its_drift(formula: str) -> None:
    told = PoseDrift(scope("extension", 1, 2), 0.004, 0.4, formula)(np.zeros((3, 7, 2, 6)))
    np.testing.assert_allclose(told[:, [0, -1], 1, 3], np.tile([0.0, 0.004], (3, 1)), atol=1e-15)
    assert np.all(np.diff(told[0, :, 1, 3]) > 0.0)
    assert not told[:, :, 0].any()
