"""Frames: rotations and coordinates round trip, joint poses from landmarks in closed cases.

Catches a turned axis, a wrong order of rotations, a frame that is not right-handed.
"""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from spinepipe.frames import (
    FRAME_LANDMARKS,
    Pose,
    coordinates_of,
    joint_pose,
    reexpress,
    rotation_zxy,
    transform_of,
    vertebra_rotation,
    zxy_angles,
)
from spinepipe.units import from_si, to_si

ROUND_OFF = 1e-14
"""Products of a few rotations."""


def random_pose(rng: np.random.Generator) -> Pose:
    return Pose(Rotation.random(rng=rng).as_matrix(), rng.normal(0, 0.1, 3))


def random_coordinates(rng: np.random.Generator) -> np.ndarray:
    return np.concatenate([rng.normal(0, 0.01, 3), rng.uniform(-1.2, 1.2, 3)])


def vertebra(pose: Pose | None = None) -> dict[str, np.ndarray]:
    """Upright landmarks: endplates 26 mm apart, pedicles 30 mm, behind; then moved by a pose."""
    points = {
        "superior_endplate_centre": [0.0, 0.026, 0.0],
        "inferior_endplate_centre": [0.0, 0.0, 0.0],
        "left_pedicle_base": [-0.02, 0.018, -0.015],
        "right_pedicle_base": [-0.02, 0.018, 0.015],
    }
    place = pose or Pose(np.eye(3), np.zeros(3))
    return {name: place.apply(point) for name, point in points.items()}


def test_units_at_the_border_round_trip() -> None:
    assert from_si([0.001, 0.0, 0.0, np.pi, 0.0, 0.0]).tolist() == [1.0, 0, 0, 180.0, 0, 0]
    q = np.random.default_rng(0).normal(size=(3, 6))
    np.testing.assert_allclose(to_si(from_si(q)), q, rtol=1e-15)


@pytest.mark.parametrize(("angles", "axis"), [((0.3, 0, 0), 2), ((0, 0.3, 0), 0), ((0, 0, 0.3), 1)])
def test_each_angle_turns_about_its_axis(angles, axis) -> None:
    vector = 0.3 * np.eye(3)[axis]
    expected = Rotation.from_rotvec(vector).as_matrix()
    np.testing.assert_allclose(rotation_zxy(*angles), expected, rtol=0, atol=ROUND_OFF)


def test_rotation_is_the_product_z_x_y() -> None:
    e, b, r = 0.4, -0.3, 0.7
    expected = rotation_zxy(e, 0, 0) @ rotation_zxy(0, b, 0) @ rotation_zxy(0, 0, r)
    np.testing.assert_allclose(rotation_zxy(e, b, r), expected, rtol=0, atol=ROUND_OFF)


def test_angles_and_coordinates_round_trip() -> None:
    rng = np.random.default_rng(0)
    for _ in range(20):
        q = random_coordinates(rng)
        np.testing.assert_allclose(coordinates_of(transform_of(q)), q, rtol=0, atol=ROUND_OFF)
    stack = Rotation.random(7, rng=rng).as_matrix()
    again = np.stack([rotation_zxy(*angles) for angles in zxy_angles(stack)])
    np.testing.assert_allclose(again, stack, rtol=0, atol=1e-13)


def test_poses_compose_and_invert() -> None:
    rng = np.random.default_rng(1)
    a, b, points = random_pose(rng), random_pose(rng), rng.normal(size=(4, 3))
    np.testing.assert_allclose((a @ b).apply(points), a.apply(b.apply(points)), atol=ROUND_OFF)
    np.testing.assert_allclose(a.inverse().apply(a.apply(points)), points, atol=ROUND_OFF)


def test_reexpress_is_the_same_motion_of_points() -> None:
    rng = np.random.default_rng(2)
    one, other, points = random_pose(rng), random_pose(rng), rng.normal(0, 0.1, (4, 3))
    q = np.concatenate([rng.normal(0, 0.005, 3), rng.normal(0, 0.2, 3)])
    q_other = reexpress(q, one, other)
    moved = [
        (f @ transform_of(c) @ f.inverse()).apply(points) for f, c in ((one, q), (other, q_other))
    ]
    np.testing.assert_allclose(moved[1], moved[0], rtol=0, atol=ROUND_OFF)
    np.testing.assert_allclose(reexpress(q_other, other, one), q, rtol=0, atol=1e-13)
    np.testing.assert_allclose(reexpress(q, one, one), q, rtol=0, atol=1e-13)


def test_reexpress_of_a_turn_about_a_shifted_centre() -> None:
    """Turned by e about the old origin, a point a in front of it rises by a sin e."""
    here = Pose(np.eye(3), np.zeros(3))
    there = Pose(np.eye(3), np.array([0.02, 0.0, 0.0]))
    found = reexpress(np.array([0, 0, 0, 0.1, 0, 0]), here, there)
    rise = 0.02 * np.array([np.cos(0.1) - 1.0, np.sin(0.1)])
    np.testing.assert_allclose(found, [*rise, 0, 0.1, 0, 0], rtol=0, atol=ROUND_OFF)


def test_an_upright_vertebra_has_ground_axes() -> None:
    np.testing.assert_allclose(vertebra_rotation(vertebra()), np.eye(3), atol=ROUND_OFF)


def test_axes_turn_with_the_vertebra_and_z_is_the_pedicle_line() -> None:
    rng = np.random.default_rng(3)
    pose = random_pose(rng)
    points = vertebra(pose)
    np.testing.assert_allclose(vertebra_rotation(points), pose.rotation, atol=1e-13)
    points["right_pedicle_base"] = points["right_pedicle_base"] + [0.001, 0.002, -0.001]
    rotation = vertebra_rotation(points)
    line = points["right_pedicle_base"] - points["left_pedicle_base"]
    np.testing.assert_allclose(rotation[:, 2], line / np.linalg.norm(line), atol=ROUND_OFF)
    np.testing.assert_allclose(rotation.T @ rotation, np.eye(3), atol=ROUND_OFF)
    assert np.linalg.det(rotation) == pytest.approx(1.0)
    endplates = points["superior_endplate_centre"] - points["inferior_endplate_centre"]
    assert abs(rotation[:, 0] @ endplates) < 1e-16


def test_a_joint_is_midway_between_its_endplates_and_vertebrae() -> None:
    upper = vertebra(Pose(rotation_zxy(0.2, 0, 0), np.array([0.0, 0.036, 0.0])))
    joint = joint_pose(vertebra(), upper)
    np.testing.assert_allclose(joint.origin, [0.0, 0.031, 0.0], atol=ROUND_OFF)
    np.testing.assert_allclose(joint.rotation, rotation_zxy(0.1, 0, 0), atol=ROUND_OFF)


def test_a_joint_turns_with_both_vertebrae_and_takes_the_complete_one() -> None:
    rng = np.random.default_rng(4)
    place = random_pose(rng)
    above = Pose(rotation_zxy(0.2, -0.1, 0.1), np.array([0.002, 0.036, 0.001]))
    plain = joint_pose(vertebra(), vertebra(above))
    turned = joint_pose(vertebra(place), vertebra(place @ above))
    expected = place @ plain
    np.testing.assert_allclose(turned.rotation, expected.rotation, atol=1e-13)
    np.testing.assert_allclose(turned.origin, expected.origin, atol=ROUND_OFF)
    upper = {"inferior_endplate_centre": vertebra(above)["inferior_endplate_centre"]}
    alone = joint_pose(vertebra(), upper)
    np.testing.assert_allclose(alone.rotation, np.eye(3), atol=ROUND_OFF)
    np.testing.assert_allclose(alone.origin, plain.origin, atol=ROUND_OFF)


def test_landmarks_that_define_no_frame_are_named() -> None:
    for name in FRAME_LANDMARKS:
        with pytest.raises(ValueError, match=r"neither vertebra|of the (upper|lower) vertebra"):
            joint_pose(*[{n: p for n, p in vertebra().items() if n != name}] * 2)
    same = vertebra() | {"left_pedicle_base": vertebra()["right_pedicle_base"]}
    with pytest.raises(ValueError, match=r"left_pedicle_base and right_pedicle_base coincide"):
        joint_pose(same, vertebra())
    line = vertebra()
    line["right_pedicle_base"] = line["left_pedicle_base"] + [0.0, 0.03, 0.0]
    with pytest.raises(ValueError, match="parallel"):
        joint_pose(line, vertebra())
    lost = vertebra() | {"superior_endplate_centre": np.full(3, np.nan)}
    with pytest.raises(ValueError, match="superior_endplate_centre"):
        joint_pose(lost, vertebra())
