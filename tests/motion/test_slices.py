"""Inertias of slices: sums over points of a cylinder, de Leva's trunk, what is no slice."""

import numpy as np
import pytest

from spinepipe.decomposition import eigh
from spinepipe.effects.contract import Array
from spinepipe.frames import Pose, rotation_zxy
from spinepipe.motion.body_segments import (
    DEPTH_OVER_WIDTH,
    cylinder,
    pelvis_inertia,
    slice_inertias,
)
from spinepipe.muscles.masses import slice_percents
from spinepipe.muscles.subject import REFERENCE, Subject

MAN = Subject("male", 30.0, 1.741, 73.0)


def points_of_cylinder(height: float, half_depth: float, half_width: float) -> Array:
    """(N, 3) centres of cells that fill an elliptic cylinder, up along y."""
    n = 120
    side = (np.arange(n) + 0.5) / n * 2.0 - 1.0
    x, y, z = np.meshgrid(half_depth * side, 0.5 * height * side, half_width * side)
    inside = (x / half_depth) ** 2 + (z / half_width) ** 2 <= 1.0
    return np.stack([x[inside], y[inside], z[inside]], axis=1)


def inertia_of(points: Array, kg: float) -> Array:
    x, y, z = points.T
    products = [[y * y + z * z, -x * y, -x * z], [-x * y, x * x + z * z, -y * z]]
    products.append([-x * z, -y * z, x * x + y * y])
    return kg * np.array([[entry.mean() for entry in row] for row in products])


def test_a_slice_is_a_cylinder_of_water_with_its_mass() -> None:
    """Summed over cells, which miss the round edge by a hundredth of the width."""
    height, kg = 0.035, 2.0
    half_width = np.sqrt(kg / (1000.0 * np.pi * height * DEPTH_OVER_WIDTH))
    points = points_of_cylinder(height, DEPTH_OVER_WIDTH * half_width, half_width)
    found = cylinder(np.array([0.0, height, 0.0]), kg, "L3")
    np.testing.assert_allclose(found, inertia_of(points, kg), rtol=2e-3, atol=1e-6)


def test_a_leaning_slice_is_the_upright_one_turned() -> None:
    lean = rotation_zxy(-0.4, 0.0, 0.0)
    upright = cylinder(np.array([0.0, 0.03, 0.0]), 1.5, "T8")
    leaning = cylinder(lean @ [0.0, 0.03, 0.0], 1.5, "T8")
    np.testing.assert_allclose(leaning, lean @ upright @ lean.T, atol=1e-17)


def steps() -> list[Pose]:
    turn = rotation_zxy(-0.05, 0.0, 0.0)
    return [Pose(turn, np.array([0.005, 0.03, 0.0])) for _ in range(17)]


def slices_kg() -> Array:
    """(18,) pelvis and slices of the reference person, L5 to T1."""
    return np.array([12.0, *(p / 100.0 * REFERENCE.mass_kg for p in slice_percents()[::-1])])


def test_every_body_gets_an_inertia_that_a_slice_of_a_trunk_can_have() -> None:
    """About the long axis. De Leva 1996, men: 101 mm in the middle and 112 mm in the upper part."""
    found = slice_inertias(steps(), slices_kg(), REFERENCE)
    assert found.shape == (18, 3, 3)
    np.testing.assert_allclose(found, found.transpose(0, 2, 1), rtol=0, atol=1e-17)
    sizes = np.array([eigh(one)[0] for one in found])
    assert (sizes[:, 0] > 0.0).all()
    assert (sizes[:, 0] + sizes[:, 1] >= sizes[:, 2] * (1.0 - 1e-12)).all()
    radii = np.sqrt(found[1:, 1, 1] / slices_kg()[1:])
    assert (radii > 0.06).all()
    assert (radii < 0.13).all()


def test_the_share_of_depth_is_that_of_de_leva_s_middle_trunk() -> None:
    """A cylinder's squared radii are width^2 / 4 + height^2 / 12, and so with the depth."""
    radii, length = np.array([0.482, 0.383]), 0.2155
    squares = (length * radii) ** 2 - length**2 / 12.0
    assert np.sqrt(squares[1] / squares[0]) == pytest.approx(DEPTH_OVER_WIDTH, abs=5e-3)


@pytest.mark.parametrize(
    ("person", "length", "radii"),
    [
        (MAN, 0.1457, (0.615, 0.587, 0.551)),
        (Subject("female", 30.0, 1.735, 61.9), 0.1815, (0.433, 0.444, 0.402)),
        (Subject("male", 30.0, 1.1 * 1.741, 73.0), 1.1 * 0.1457, (0.615, 0.587, 0.551)),
    ],
)
def test_the_pelvis_is_de_leva_s_lower_trunk(
    person: Subject, length: float, radii: tuple[float, ...]
) -> None:
    """Table 4: length in m and radii over it, sagittal, longitudinal, transverse."""
    expected = 8.0 * (length * np.array(radii)) ** 2
    np.testing.assert_allclose(pelvis_inertia(8.0, person), np.diag(expected), rtol=1e-14)


def test_each_slice_stands_between_its_own_joints() -> None:
    """Unlike heights: the second step leads from L5's lower joint to its upper one."""
    unlike = [
        Pose(rotation_zxy(-0.01 * k, 0.0, 0.0), np.array([0.001 * k, 0.03 + 0.001 * k, 0.0]))
        for k in range(17)
    ]
    found = slice_inertias(unlike, slices_kg(), REFERENCE)
    axes = [step.origin for step in unlike[1:]]
    axes.append(np.array([0.0, np.linalg.norm(axes[-1]), 0.0]))  # T1, as high as T2, upright
    for body, axis in enumerate(axes, start=1):
        np.testing.assert_array_equal(found[body], cylinder(axis, slices_kg()[body], "any"))


def test_a_slice_may_be_just_narrower_than_60_cm() -> None:
    """Wide 2 a and deep 0.65 of it: pi a 0.65 a height 1000 kg."""
    up, kg = np.array([0.0, 0.03, 0.0]), np.pi * 0.65 * 0.3**2 * 0.03 * 1000.0
    assert cylinder(up, 0.999 * kg, "T1")[0, 0] > 0.0
    with pytest.raises(ValueError, match=r"between joints 30 mm apart .* 600 mm wide"):
        cylinder(up, 1.001 * kg, "T1")
