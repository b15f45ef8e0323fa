"""Where bodies are: rotations shared among joints, joints that move, rotation vectors."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation, Slerp
from trunk_cases import made_up_trunk
from trunk_person import made_up, tasks, volunteer

from spinepipe.muscles.pose import (
    BodyPoses,
    JointCentres,
    place_bodies,
    rotation_of_vector,
    rotation_vector,
    rotations_of,
)
from spinepipe.muscles.trunk import BODIES, LEVELS

ROUND_OFF = 1e-14
"""Products of a few rotations, each good to 1e-16; metres of half a metre likewise."""

CHAIN = JointCentres.of(made_up_trunk(), 0.004)
STILL = np.zeros((len(LEVELS), 3))


def random_angles(seed: int, largest_deg: float = 40.0) -> np.ndarray:
    """(8, 3) rad, any way round."""
    drawn = np.random.default_rng(seed).uniform(-largest_deg, largest_deg, (len(BODIES), 3))
    return np.deg2rad(drawn)


def random_moves(seed: int) -> np.ndarray:
    """(7, 3) m, up to 3 mm on the axes of the discs."""
    return np.random.default_rng(seed).uniform(-3e-3, 3e-3, (len(LEVELS), 3))


@pytest.mark.parametrize("size", [0.0, 1e-12, 1e-8, 1e-4, 0.3, 1.5, 3.1])
def test_rotation_vectors_are_scipys(size: float) -> None:
    for seed in range(5):
        axis = np.random.default_rng(seed).normal(size=3)
        vector = size * axis / np.linalg.norm(axis)
        rotation = rotation_of_vector(vector)
        np.testing.assert_allclose(
            rotation, Rotation.from_rotvec(vector).as_matrix(), rtol=0.0, atol=ROUND_OFF
        )
        # Near half a turn the sine is small and its rounding is magnified: 1e-16 / 0.04.
        np.testing.assert_allclose(rotation_vector(rotation), vector, rtol=0.0, atol=1e-13)


def test_in_the_sagittal_plane_every_body_turns_by_its_own_angle() -> None:
    angles = random_angles(1) * [1.0, 0.0, 0.0]
    plain = Rotation.from_rotvec(angles[:, [1, 2, 0]]).as_matrix()
    np.testing.assert_allclose(rotations_of(CHAIN, angles), plain, rtol=0.0, atol=ROUND_OFF)


def test_the_pelvis_turns_about_z_then_x_then_y() -> None:
    angles = random_angles(2)
    pelvis = Rotation.from_euler("ZXY", angles[0]).as_matrix()
    np.testing.assert_allclose(rotations_of(CHAIN, angles)[0], pelvis, rtol=0.0, atol=ROUND_OFF)


@pytest.mark.parametrize("axis", [1, 2], ids=["right bending", "left rotation"])
def test_a_turn_about_one_axis_of_leaning_discs_stays_on_it(axis: int) -> None:
    """Discs lean up to 20 deg here: turns about ground axes would twist what only bends."""
    assert np.ptp(made_up_trunk().disc_tilt) > 0.5
    angles = np.zeros((len(BODIES), 3))
    angles[:, axis] = np.deg2rad(np.linspace(2.0, 20.0, len(BODIES)))
    turned = place_bodies(CHAIN, rotations_of(CHAIN, angles), STILL).turned
    expected = np.zeros((len(LEVELS), 3))
    expected[:, axis - 1] = np.deg2rad(18.0 / 7.0)
    np.testing.assert_allclose(turned, expected, rtol=0.0, atol=ROUND_OFF)


def test_joints_turn_by_the_difference_of_their_bodies_angles() -> None:
    angles = random_angles(3, 20.0)
    turned = place_bodies(CHAIN, rotations_of(CHAIN, angles), STILL).turned
    extension, bending, rotation = np.diff(angles, axis=0).T
    expected = np.column_stack([bending, rotation, extension])
    np.testing.assert_allclose(turned, expected, rtol=0.0, atol=1e-13)


def test_discs_lie_halfway_between_their_vertebrae() -> None:
    poses = place_bodies(CHAIN, rotations_of(CHAIN, random_angles(4)), STILL)
    for level, disc in enumerate(poses.discs):
        ends = Rotation.from_matrix(poses.rotations[level : level + 2])
        halfway = Slerp([0.0, 1.0], ends)(0.5).as_matrix()
        np.testing.assert_allclose(disc, halfway @ CHAIN.discs[level], rtol=0.0, atol=1e-13)


def test_joints_move_the_vertebra_above_along_the_axes_of_the_disc() -> None:
    moves = random_moves(5)
    poses = place_bodies(CHAIN, rotations_of(CHAIN, random_angles(5)), moves)
    for level in range(len(LEVELS)):
        joint = CHAIN.centres[level][None]
        below, above = (poses.of(np.array([body]), joint)[0] for body in (level, level + 1))
        told = poses.discs[level].T @ (above - below)
        np.testing.assert_allclose(told, moves[level], rtol=0.0, atol=ROUND_OFF)
        np.testing.assert_allclose(poses.centres[level], below, rtol=0.0, atol=ROUND_OFF)


def test_moves_add_up_towards_the_thorax_and_leave_the_pelvis() -> None:
    rotations, moves = rotations_of(CHAIN, random_angles(6)), random_moves(6)
    still, moved = (place_bodies(CHAIN, rotations, by) for by in (STILL, moves))
    steps = np.einsum("kij,kj->ki", moved.discs, moves)
    for body in range(len(BODIES)):
        np.testing.assert_allclose(
            moved.places[body] - still.places[body],
            steps[:body].sum(axis=0),
            rtol=0.0,
            atol=ROUND_OFF,
        )


def test_nothing_turned_leaves_every_point_where_it_was() -> None:
    poses = place_bodies(CHAIN, rotations_of(CHAIN, np.zeros((len(BODIES), 3))), STILL)
    points = np.random.default_rng(7).uniform(-0.3, 0.3, (len(BODIES), 3))
    there = poses.of(np.arange(len(BODIES)), points)
    np.testing.assert_allclose(there, points, rtol=0.0, atol=ROUND_OFF)
    np.testing.assert_allclose(poses.centres, CHAIN.centres, rtol=0.0, atol=ROUND_OFF)


def test_joints_lie_behind_their_centres_along_the_disc() -> None:
    trunk = made_up_trunk()
    tilt = trunk.disc_tilt
    forwards = np.column_stack([np.cos(tilt), np.sin(tilt), np.zeros(len(LEVELS))])
    np.testing.assert_allclose(CHAIN.centres, trunk.joints - 0.004 * forwards, rtol=0.0, atol=1e-15)


def turned_as_one(poses: BodyPoses, turn: np.ndarray) -> BodyPoses:
    """The whole trunk, pelvis and all, turned about the origin of ground."""
    return BodyPoses(
        turn @ poses.rotations,
        poses.places @ turn.T,
        poses.origins,
        poses.centres @ turn.T,
        turn @ poses.discs,
        poses.turned,
    )


def test_a_trunk_turned_as_one_keeps_its_lengths_and_turns_its_pulls() -> None:
    """Of all fascicles: those on bars, and those that hang in the sheath."""
    person = volunteer()
    poses = place_bodies(
        person.chain, rotations_of(person.chain, tasks()["forward_60"].turned), STILL
    )
    turn = Rotation.from_rotvec([0.4, -0.7, 1.1]).as_matrix()
    here, there = (person.lines.pulls(one) for one in (poses, turned_as_one(poses, turn)))
    assert here.contacts.sum() > 10
    np.testing.assert_array_equal(there.contacts, here.contacts)
    np.testing.assert_allclose(there.lengths, here.lengths, rtol=0.0, atol=1e-13)
    # Where a string slides its place is good to the square root of what its length is.
    for one, other in ((there.forces, here.forces), (there.moments, here.moments)):
        np.testing.assert_allclose(one, other @ turn.T, rtol=0.0, atol=1e-9)
    np.testing.assert_allclose(there.along_sheath, here.along_sheath, rtol=0.0, atol=1e-13)


@pytest.mark.parametrize("make", [made_up, volunteer], ids=["made up", "volunteer"])
def test_standing_muscles_are_at_rest(make) -> None:
    """Upright and unloaded no path is longer than at rest, so nothing is stretched."""
    person = make()
    poses = place_bodies(person.chain, rotations_of(person.chain, person.upright), STILL)
    lengths, ones = person.lines.pulls(poses).lengths, np.ones(len(person.rest))
    np.testing.assert_array_equal(lengths, person.rest)
    assert not person.passive.forces(lengths, person.rest, person.fibres, ones).any()
