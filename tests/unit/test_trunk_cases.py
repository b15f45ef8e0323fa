"""The made-up trunk is a trunk: symmetric, whole, and its muscles can hold every level.

Catches made-up trunks that hold nothing, by which other tests would then see nothing.
"""

import numpy as np
import pytest
from scipy.optimize import linprog
from trunk_cases import made_up_trunk
from trunk_posture import lever_arms

from spinepipe.muscles.trunk import NO_BODY, SLICES, THORAX

G = 9.81
STRESS_PA = 0.6e6
SLICE_KG = 30.0 / len(SLICES)
AHEAD_M = np.array([0.02, 0.0, 0.0])

LOADS = {
    "weight": (0.0, 0.0, 0.0),
    "20 kg held in front": (0.0, 0.0, -60.0),
    "15 N m backwards": (0.0, 0.0, 15.0),
    "right": (-15.0, 0.0, 0.0),
    "twist": (0.0, 7.0, 0.0),
}
"""Moment on the thorax besides weight, N m about x, y and z."""


def test_left_mirrors_right() -> None:
    muscles = made_up_trunk().muscles
    half = len(muscles) // 2
    assert half == 22
    np.testing.assert_array_equal(muscles.body[:half], muscles.body[half:])
    np.testing.assert_array_equal(
        muscles.point[:half] * [1.0, 1.0, -1.0], muscles.point[half:] + 0.0
    )
    assert (muscles.point[:half, :, 2] > 0.0).all()
    assert len(set(muscles.names)) == 44


def test_paths_run_upwards_and_those_of_the_sheath_start_on_bone() -> None:
    muscles = made_up_trunk().muscles
    for name, body, hangs in zip(muscles.names, muscles.body, muscles.in_sheath, strict=True):
        on = body[body != NO_BODY]
        assert len(on) >= 2
        assert (np.diff(on) >= 0).all()
        if hangs:
            assert tuple(on) == ((THORAX if "external" in name else 0), THORAX)


def weight_moments() -> np.ndarray:
    """(7,) N m about z of slices and head about each joint."""
    trunk = made_up_trunk()
    at = np.vstack([trunk.vertebrae + AHEAD_M, trunk.head])
    kg = np.array([SLICE_KG] * len(SLICES) + [5.0])
    above = at[None, :, 1] > trunk.joints[:, None, 1]
    ahead = at[None, :, 0] - trunk.joints[:, None, 0]
    return -(above * ahead * kg).sum(axis=1) * G


@pytest.mark.parametrize("name", LOADS)
def test_muscles_can_hold_all_seven_levels_about_three_axes(name: str) -> None:
    """21 equations, no passive help: largest share of the stress is below one."""
    trunk = made_up_trunk()
    muscles = trunk.muscles
    free = ~muscles.in_sheath
    extension, bending, rotation = -np.moveaxis(lever_arms(trunk, np.zeros((7, 3))), 2, 0)
    of_force = np.stack([bending, rotation, extension])[:, free].transpose(2, 0, 1).reshape(21, -1)
    needed = np.tile(-np.array(LOADS[name]), (7, 1))
    needed[:, 2] -= weight_moments()
    pcsa = muscles.pcsa[free]
    columns = np.hstack([of_force * pcsa * STRESS_PA, np.zeros((21, 1))])
    caps = np.hstack([np.eye(len(pcsa)), -np.ones((len(pcsa), 1))])
    found = linprog(
        np.append(np.zeros(len(pcsa)), 1.0),
        A_ub=caps,
        b_ub=np.zeros(len(pcsa)),
        A_eq=columns,
        b_eq=needed.ravel(),
    )
    assert found.success
    assert found.fun < 1.0
