"""How far a motion is from the truth: centres, sagittal angles, rotations of joints."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from spinepipe.cohort import Cohort
from spinepipe.effects.contract import Array
from spinepipe.motion.measures import between_neighbours, sagittal_angles, turned_apart
from spinepipe.motion.scaling import by_body, steps_of
from spinepipe.motion.skeleton import BODIES, JOINTS, PELVIS, Skeleton, body_poses
from spinepipe.studies.subjects import subject_of
from spinepipe.studies.tracking.persons import centres_of, skeleton_in
from spinepipe.studies.tracking.reload_motions import ReloadedMotions
from spinepipe.studies.tracking.truth import Truth
from spinepipe.units import DEG_PER_RAD, MM_PER_M

SAGITTAL = slice(JOINTS.index("L4L5"), JOINTS.index("T7T8") + 1)
"""Joints whose sagittal angle counts (Wang et al. 2021)."""


@dataclass(frozen=True, eq=False)
class Bones:
    """A person's skeleton, and the centres (18, 3) m of its bodies in their frames."""

    skeleton: Skeleton
    centres: Array


@dataclass(frozen=True, eq=False)
class ErrorFromTruth:
    """Errors of a measure.

    Attributes
    ----------
    measure : its name. levels : (L,) vertebrae or joints. size : (N, L) mm or deg.
    told : (N, L) whether the truth is known.
    """

    measure: str
    levels: tuple[str, ...]
    size: Array
    told: NDArray[np.bool_]


def bones_of(cohort: Cohort, specimen: str, factors: Array | None = None) -> Bones:
    """A person's skeleton and centres; factors : (3,) by which its parts were made larger."""
    skeleton = skeleton_in(cohort, specimen, subject_of(cohort, specimen))
    centres = centres_of(cohort, specimen, skeleton)
    if factors is None:
        return Bones(skeleton, centres)
    grown = Skeleton(steps_of(skeleton, factors), skeleton.masses)
    return Bones(grown, by_body(factors)[:, None] * centres)


def errors_of(moved: ReloadedMotions, truth: Truth, bones: Bones) -> Iterator[ErrorFromTruth]:
    """Errors of a motion at the instants of its truth."""
    turns, places = body_poses(bones.skeleton, moved.at(truth.time_s))
    at = places + np.einsum("fbij,bj->fbi", turns, bones.centres)
    apart = MM_PER_M * np.linalg.norm(at - truth.centres, axis=-1)
    above = slice(PELVIS + 1, None)
    yield ErrorFromTruth("centre_mm", BODIES[above], apart[:, above], truth.known[:, above])
    both = truth.turned[:, :-1] & truth.turned[:, 1:]
    off = sagittal_angles(turns) - sagittal_angles(truth.turns)
    wrapped = np.abs((off + np.pi) % (2.0 * np.pi) - np.pi)
    names = JOINTS[SAGITTAL]
    yield ErrorFromTruth("angle_deg", names, DEG_PER_RAD * wrapped[:, SAGITTAL], both[:, SAGITTAL])
    yield _joint_rotations(between_neighbours(turns), between_neighbours(truth.turns), both)


def _joint_rotations(ours: Array, true: Array, told: NDArray[np.bool_]) -> ErrorFromTruth:
    """Angle between both changes of joint rotations (N, 17, 3, 3) since the first instant told."""
    size, later = np.zeros(told.shape), told.copy()
    for k in np.flatnonzero(told.any(axis=0)):
        first = int(np.argmax(told[:, k]))
        changes = [one[first, k].T @ one[:, k] for one in (ours, true)]
        size[:, k] = DEG_PER_RAD * turned_apart(*changes)
        later[first, k] = False
    return ErrorFromTruth("joint_angle_deg", JOINTS, size, later)
