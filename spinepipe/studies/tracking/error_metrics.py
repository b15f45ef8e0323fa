"""How far a motion is from the truth: centres, sagittal angles, rotations of joints.

Angles between neighbours are those of Z, X', Y'', like the coordinates of joints, but between the
frames of bodies: a spine that stands curved has angles that are not zero.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from spinepipe.effects.contract import Array
from spinepipe.frames import zxy_angles
from spinepipe.motion.skeleton import BODIES, JOINTS, PELVIS, Skeleton, body_poses, rotations
from spinepipe.studies.tracking.tracked_motions import TrackedMotion
from spinepipe.studies.tracking.trials import TRUTH_CENTRES
from spinepipe.units import DEG_PER_RAD, MM_PER_M, ROTATIONS

SAGITTAL = slice(JOINTS.index("L4L5"), JOINTS.index("T7T8") + 1)
"""Joints whose sagittal angle counts (Wang et al. 2021)."""

_PLACE = ["x_mm", "y_mm", "z_mm"]
_TURN = [f"{axis}_deg" for axis in ROTATIONS]


@dataclass(frozen=True, eq=False)
class Truth:
    """True poses of bodies in ground, at some instants of a trial.

    Attributes
    ----------
    specimen, trial : of what. time_s : (N,). centres : (N, 18, 3) m, zero where not known.
    known : (N, 18). turns : (N, 18, 3, 3), unity where not known. turned : (N, 18).
    """

    specimen: str
    trial: str
    time_s: Array
    centres: Array
    known: NDArray[np.bool_]
    turns: Array
    turned: NDArray[np.bool_]


def truths(further: dict[str, pd.DataFrame]) -> Iterator[Truth]:
    """All that a cohort's `truth_centres.csv` tells, in its order; nothing where it has none."""
    every = further.get(TRUTH_CENTRES.stem)
    if every is None:
        return
    for (specimen, trial), rows in every.groupby(["specimen", "trial"], sort=False):
        times, at = np.unique(rows["time_s"].to_numpy(float), return_inverse=True)
        body = np.array([BODIES.index(name) for name in rows["vertebra"]])
        shape = (len(times), len(BODIES))
        known, turned = np.zeros(shape, dtype=bool), np.zeros(shape, dtype=bool)
        centres, turns = np.zeros((*shape, 3)), np.tile(np.eye(3), (*shape, 1, 1))
        known[at, body] = True
        centres[at, body] = rows[_PLACE].to_numpy(float) / MM_PER_M
        angles = np.deg2rad(rows[_TURN].to_numpy(float))
        told = np.isfinite(angles).all(axis=1)
        turned[at[told], body[told]] = True
        turns[at[told], body[told]] = rotations(angles[told])
        yield Truth(str(specimen), str(trial), times, centres, known, turns, turned)


@dataclass(frozen=True, eq=False)
class ErrorFromTruth:
    """Errors of a measure.

    Attributes
    ----------
    measure : its name. levels : (L,) vertebrae or joints. size : (N, L) mm or deg.
    known : (N, L) whether the truth is.
    """

    measure: str
    levels: tuple[str, ...]
    size: Array
    known: NDArray[np.bool_]


def errors_of(
    motion: TrackedMotion, truth: Truth, skeleton: Skeleton, centres: Array
) -> Iterator[ErrorFromTruth]:
    """Errors of a motion at the instants of its truth.

    Parameters
    ----------
    skeleton, centres : of the person, centres (18, 3) m of bodies in their frames.
    """
    turns, places = body_poses(skeleton, motion.at(truth.time_s))
    at = places + np.einsum("fbij,bj->fbi", turns, centres)
    apart = MM_PER_M * np.linalg.norm(at - truth.centres, axis=-1)
    above = slice(PELVIS + 1, None)
    yield ErrorFromTruth("centre_mm", BODIES[above], apart[:, above], truth.known[:, above])
    # sagittal angles, where both neighbours are known; a whole turn is none
    both = truth.turned[:, :-1] & truth.turned[:, 1:]
    off = sagittal_angles(turns) - sagittal_angles(truth.turns)
    wrapped = np.abs((off + np.pi) % (2.0 * np.pi) - np.pi)
    names = JOINTS[SAGITTAL]
    yield ErrorFromTruth("angle_deg", names, DEG_PER_RAD * wrapped[:, SAGITTAL], both[:, SAGITTAL])
    # angle between both changes of a joint's rotation since the first instant that is known, so
    # that frames of bodies need not be drawn alike
    ours, true = joint_rotations(turns), joint_rotations(truth.turns)
    size, later = np.zeros(both.shape), both.copy()
    for k in np.flatnonzero(both.any(axis=0)):
        first = int(np.argmax(both[:, k]))
        changes = [one[first, k].T @ one[:, k] for one in (ours, true)]
        size[:, k] = DEG_PER_RAD * angle_between(*changes)
        later[first, k] = False
    yield ErrorFromTruth("joint_angle_deg", JOINTS, size, later)


def joint_rotations(turns: Array) -> Array:
    """(..., 17, 3, 3) rotation of each body in the one below, of bodies (..., 18, 3, 3)."""
    found: Array = np.swapaxes(turns[..., :-1, :, :], -1, -2) @ turns[..., 1:, :, :]
    return found


def sagittal_angles(turns: Array) -> Array:
    """(..., 17) rad, extension of each body against the one below, of bodies (..., 18, 3, 3)."""
    found: Array = zxy_angles(joint_rotations(turns))[..., 0]
    return found


def angle_between(one: Array, other: Array) -> Array:
    """(...) rad, angle of the one rotation that leads from one (..., 3, 3) to the other.

    From the distance of the matrices, 2 sqrt(2) sin(angle / 2), which is exact for small angles
    where their trace is not.
    """
    apart = np.linalg.norm(one - other, axis=(-2, -1)) / np.sqrt(8.0)
    found: Array = 2.0 * np.arcsin(np.minimum(apart, 1.0))
    return found
