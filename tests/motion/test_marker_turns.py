"""Turns of groups of markers against scipy's; groups that tell none."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from spinepipe.motion.marker_groups import rigid_rotations

RNG = np.random.default_rng(11)
MIDDLE = np.array([3.0, 2.0, 1.0])
MODEL = RNG.normal(size=(5, 3))


def test_turns_are_those_of_scipy_also_where_markers_are_lost() -> None:
    """Noise of a tenth of the group's size; rounding of both is all that may differ."""
    true = Rotation.random(20, rng=3)
    places = np.array([turn.apply(MODEL) for turn in true]) + RNG.normal(0.0, 0.1, (20, 5, 3))
    seen = np.ones((20, 5), dtype=bool)
    seen[::2, 1] = seen[::3, 4] = False
    found, told = rigid_rotations(MODEL, np.where(seen[..., None], places + MIDDLE, 0.0), seen)
    assert told.all()
    for frame in range(20):
        there = seen[frame]
        clouds = (places[frame, there], MODEL[there])
        centred = (cloud - cloud.mean(axis=0) for cloud in clouds)
        wanted = Rotation.align_vectors(*centred)[0].as_matrix()
        np.testing.assert_allclose(found[frame], wanted, atol=1e-10)


def test_too_few_markers_and_markers_in_a_line_tell_no_turn() -> None:
    line = np.outer(np.arange(5.0), [1.0, 2.0, 3.0])
    whole, few = np.ones((1, 5), dtype=bool), np.array([[True, True, False, False, False]])
    for model, seen in ((line, whole), (MODEL, few), (MODEL, ~whole)):
        found, told = rigid_rotations(model, model[None], seen)
        assert not told.any()
        np.testing.assert_array_equal(found, np.eye(3)[None])


@pytest.mark.parametrize("size_m", [1e-7, 1e-4, 0.03, 40.0])
def test_a_group_tells_its_turn_by_its_shape_whatever_its_size(size_m: float) -> None:
    """A rectangle, a thousand times as long as wide: extents are squares, so a millionth."""
    turn = Rotation.from_rotvec([0.3, -0.2, 0.9])
    seen = np.ones((1, 4), dtype=bool)
    for square, tells in ((1.1e-6, True), (0.9e-6, False)):
        wide = np.sqrt(square)
        group = size_m * np.array([[1, wide, 0], [1, -wide, 0], [-1, wide, 0], [-1, -wide, 0]])
        found, told = rigid_rotations(group, turn.apply(group)[None], seen)
        assert told[0] == tells
        wanted = turn.as_matrix() if tells else np.eye(3)
        np.testing.assert_allclose(found[0], wanted, atol=1e-6)


def test_markers_all_at_one_place_tell_no_turn() -> None:
    found, told = rigid_rotations(
        np.zeros((3, 3)), np.zeros((1, 3, 3)), np.ones((1, 3), dtype=bool)
    )
    assert not told.any()
    np.testing.assert_array_equal(found[0], np.eye(3))


def test_a_mirrored_group_is_met_by_a_rotation() -> None:
    found, _ = rigid_rotations(MODEL, MODEL[None] * [1.0, 1.0, -1.0], np.ones((1, 5), dtype=bool))
    assert np.isclose(np.linalg.det(found[0]), 1.0)
