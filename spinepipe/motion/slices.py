"""Inertias of the trunk's slices where a cohort has none: elliptic cylinders between two joints.

A slice is as high as its vertebra with one disc, from the joint below it to the one above; T1,
above which no joint is told, is as high as T2. Its area follows from its mass at the density of
water, and it is 0.65 times as deep as wide, as the middle part of de Leva's men is. The pelvis is
turned as his lower trunk, growing with height.
"""

from collections.abc import Sequence

import numpy as np

from spinepipe.anatomy.segments import GYRATION, HEIGHT_M, LENGTH_M
from spinepipe.effects.contract import Array
from spinepipe.facts import number
from spinepipe.frames import Pose
from spinepipe.motion.skeleton import BODIES, PELVIS
from spinepipe.muscles.subject import Subject

DENSITY_KG_PER_M3 = 1000.0
"""A choice; a thorax with its lungs is some 10 % lighter."""

DEPTH_OVER_WIDTH = number(__name__, "trunk_depth_over_width")

WIDEST_M = 0.6
"""A slice wider than this has no slice's mass: head and arms are hung on T1 separately."""


def slice_inertias(steps: Sequence[Pose], kg: Array, subject: Subject) -> Array:
    """(18, 3, 3) kg m2 of all bodies about their centres of mass, in their own axes.

    Parameters
    ----------
    steps : (17,) of a skeleton. kg : (18,) mass of each body, without head and arms.
    subject : whose pelvis it is.

    Raises
    ------
    ValueError
        Where a mass makes a slice wider than `WIDEST_M`.
    """
    slices = [cylinder(axis, kg[k], name) for k, axis, name in _axes(steps, kg)]
    return np.array([pelvis_inertia(float(kg[PELVIS]), subject), *slices])


def _axes(steps: Sequence[Pose], kg: Array) -> list[tuple[int, Array, str]]:
    """Each slice's body, axis (3,) m from its lower to its upper joint, and name."""
    axes = [step.origin for step in steps[1:]]
    axes.append(np.array([0.0, float(np.linalg.norm(axes[-1])), 0.0]))
    return [(k, axis, BODIES[k]) for k, axis in enumerate(axes, start=1)]


def cylinder(axis: Array, kg: float, name: str) -> Array:
    """(3, 3) kg m2 of an elliptic cylinder along an axis (3,) m, wide along the body's z.

    Raises
    ------
    ValueError
        Where it would be wider than `WIDEST_M`.
    """
    height = float(np.linalg.norm(axis))
    half_width = np.sqrt(kg / (DENSITY_KG_PER_M3 * np.pi * height * DEPTH_OVER_WIDTH))
    if 2.0 * half_width > WIDEST_M:
        raise ValueError(
            f"{name}: {kg:.2f} kg between joints {1e3 * height:.0f} mm apart are no slice of a "
            f"trunk, {2e3 * half_width:.0f} mm wide; give its inertia"
        )
    half_depth = DEPTH_OVER_WIDTH * half_width
    deep, high, wide = half_depth**2 / 4.0, height**2 / 12.0, half_width**2 / 4.0
    turn = _upright(axis / height)
    found: Array = kg * turn @ np.diag([wide + high, wide + deep, deep + high]) @ turn.T
    return found


def _upright(up: Array) -> Array:
    """(3, 3) axes forwards, up and to the right of a slice whose axis is up (3,)."""
    forwards = np.cross(up, [0.0, 0.0, 1.0])
    forwards /= np.linalg.norm(forwards)
    return np.column_stack([forwards, up, np.cross(forwards, up)])


def pelvis_inertia(kg: float, subject: Subject) -> Array:
    """(3, 3) kg m2 of the pelvis, axes of ground in the neutral pose."""
    trunk, tall = f"lower_trunk {subject.sex}", subject.height_m / HEIGHT_M[subject.sex]
    forwards, right, up = tall * LENGTH_M[trunk] * np.array(GYRATION[trunk])
    found: Array = kg * np.diag(np.array([forwards, up, right]) ** 2)
    return found
