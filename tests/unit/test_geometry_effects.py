"""Effects on geometry: where a joint's laws act, worked by hand, and all their derivatives.

Catches a displaced law that acts elsewhere, and any wrong derivative of it.
"""

from itertools import product

import numpy as np
from effect_slopes import (
    assert_placement_derivatives,
    assert_sensitivities,
    assert_tangent,
    poses,
    reported,
    system_with,
)
from example_effects import scoped
from scipy.spatial.transform import Rotation
from sweeps import sweep

from spinepipe.effects import PlaceSpread, create

NAMES = ("joint_centre_offset", "joint_centre_migration", "axes_tilt", "rotation_order")
JOINTS = (0, 1, 2)


def somewhere(name: str, joints: int) -> np.ndarray:
    """(J, P) values about as large as the effect's defaults."""
    size = np.array([p.default for p in create(name).parameters])
    return np.random.default_rng(5).uniform(-2.0, 2.0, (joints, len(size))) * size


def at_off(name: str, joints: int) -> np.ndarray:
    return np.zeros((joints, len(create(name).parameters)))


@sweep("values", [somewhere, at_off])
@sweep("name", NAMES)
def test_derivatives_of_placements_are_slopes(name: str, values) -> None:
    q = poses()
    assert_placement_derivatives(create(name), q, values(name, len(q)))


@sweep("name", NAMES)
def test_off_leaves_the_coordinates_alone(name: str) -> None:
    q, effect = poses(), create(name)
    assert {p.off for p in effect.parameters} == {0.0}
    placed = effect.place(q, at_off(name, len(q)))
    np.testing.assert_allclose(placed.q, q, rtol=0, atol=1e-15)
    np.testing.assert_allclose(placed.by_coordinate, np.tile(np.eye(6), (len(q), 1, 1)), atol=1e-15)


@sweep("name", NAMES)
def test_each_strength_shows_at_its_off_value(name: str) -> None:
    q = poses()
    by_parameter = create(name).by_parameter(q, at_off(name, len(q)))
    assert np.all(np.abs(by_parameter.q[:-1]).max(axis=(0, 1)) > 1e-3)


@sweep("values", [somewhere, at_off])
@sweep("name", NAMES)
def test_tangents_and_sensitivities_of_whole_spines(name: str, values) -> None:
    system = system_with(scoped(create(name), JOINTS, *map(tuple, values(name, 3))))
    assert_tangent(system)
    assert_sensitivities(system)


@sweep("order", [NAMES, NAMES[::-1]])
def test_geometry_effects_on_top_of_each_other(order: tuple[str, ...]) -> None:
    effects = (scoped(create(name), (0, 2), *map(tuple, somewhere(name, 2))) for name in order)
    system = system_with(*effects)
    assert_tangent(system)
    assert_sensitivities(system)


def test_a_displaced_centre_moves_on_an_arc() -> None:
    """A quarter turn in extension about the stated centre carries (10, 20, 5) mm to (-20, 10, 5);
    in right bending (about x) to (10, -5, 20), in left rotation (about y) to (5, 20, -10)."""
    q = np.zeros((3, 6))
    q[:, 3:] = np.diag(np.full(3, np.pi / 2))
    centres = np.tile([0.010, 0.020, 0.005], (3, 1))
    moved = create("joint_centre_offset").place(q, centres).q
    expected = [[-0.030, -0.010, 0.0], [0.0, -0.025, 0.015], [-0.005, 0.0, -0.015]]
    np.testing.assert_allclose(moved[:, :3], expected, rtol=0, atol=1e-15)
    np.testing.assert_array_equal(moved[:, 3:], q[:, 3:])


def test_a_translation_is_that_of_the_displaced_centre_too() -> None:
    q = np.array([[0.001, -0.002, 0.003, 0.0, 0.0, 0.0]])
    np.testing.assert_array_equal(
        create("joint_centre_offset").place(q, np.array([[0.01, 0.02, 0.0]])).q, q
    )


def test_a_migrating_centre_is_a_displaced_one_that_grows_with_extension() -> None:
    """At 0.2 rad of extension a path of 50 mm/rad has gone 10 mm; flexion sends it back."""
    q = np.array([[0.0, 0.0, 0.0, 0.2, 0.1, -0.3], [0.0, 0.0, 0.0, -0.2, 0.1, -0.3]])
    moved = create("joint_centre_migration").place(q, np.array([[0.05, -0.025]] * 2)).q
    for row, centre in zip((0, 1), ([0.01, -0.005, 0.0], [-0.01, 0.005, 0.0]), strict=True):
        turned = Rotation.from_euler("ZXY", q[row, 3:]).apply(centre)
        np.testing.assert_allclose(moved[row, :3], turned - centre, rtol=0, atol=1e-15)
    np.testing.assert_array_equal(moved[:, 3:], q[:, 3:])


def test_tilted_axes_see_the_same_motion() -> None:
    """Against rotations multiplied out by scipy, at tilts and angles up to half a radian."""
    q = poses(6)
    tilts = np.random.default_rng(8).uniform(-0.5, 0.5, (len(q), 3))
    tilt = Rotation.from_euler("ZXY", tilts)
    seen = create("axes_tilt").place(q, tilts).q
    expected = (tilt.inv() * Rotation.from_euler("ZXY", q[:, 3:]) * tilt).as_euler("ZXY")
    np.testing.assert_allclose(seen[:, 3:], expected, rtol=0, atol=1e-14)
    np.testing.assert_allclose(seen[:, :3], tilt.inv().apply(q[:, :3]), rtol=0, atol=1e-16)


def test_another_order_of_rotations_turns_about_x_first() -> None:
    """Right bending, left rotation and extension seen, made in that order, are the same motion."""
    q = poses()
    seen = create("rotation_order").place(q, np.ones((len(q), 1))).q
    same = Rotation.from_euler("XYZ", seen[:, [4, 5, 3]]).as_matrix()
    expected = Rotation.from_euler("ZXY", q[:, 3:]).as_matrix()
    np.testing.assert_allclose(same, expected, rtol=0, atol=1e-14)
    np.testing.assert_array_equal(seen[:, :3], q[:, :3])


def test_an_order_half_way_is_half_the_change() -> None:
    q, effect = poses(), create("rotation_order")
    half, whole = (effect.place(q, np.full((len(q), 1), s)).q - q for s in (0.5, 1.0))
    np.testing.assert_allclose(half, whole / 2.0, rtol=0, atol=1e-15)
    assert np.abs(whole).max() > 0.02


def test_the_difference_of_the_orders_is_as_documented() -> None:
    angles = np.deg2rad(list(product((-10.0, 0.0, 10.0), repeat=3)))
    q = np.hstack([np.zeros_like(angles), angles])
    change = create("rotation_order").place(q, np.ones((len(q), 1))).q - q
    assert 1.85 < np.rad2deg(np.abs(change).max()) < 1.9


@sweep("name", NAMES)
def test_effects_change_the_motion_of_a_spine(name: str) -> None:
    plain = reported(system_with())
    found = reported(system_with(scoped(create(name), JOINTS)))
    assert np.rad2deg(np.abs(found - plain)[..., 3:].max()) > 0.02


def test_only_physics_is_looked_for() -> None:
    for name in ("joint_centre_offset", "joint_centre_migration"):
        assert set(create(name).trial.spreads) == set(PlaceSpread) - {PlaceSpread.BY_TEST}
    for name in ("axes_tilt", "rotation_order"):
        assert not hasattr(create(name), "trial")
