"""A spine that moves: pelvis and vertebrae up to T1, six coordinates a joint, bodies with mass.

A vertebra's frame is that of its lower joint, so that the joint's coordinates are the pose of the
upper vertebra in the joint's frame, which is fixed in the vertebra below. The pelvis moves with S1;
its frame has the axes of ground and its origin at L5S1 while all coordinates are zero.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from spinepipe.effects.contract import Array
from spinepipe.frames import Pose, rotation_zxy

BODIES = ("S1", "L5", "L4", "L3", "L2", "L1", *(f"T{k}" for k in range(12, 0, -1)))
"""S1 stands for the pelvis; then vertebrae from below."""

JOINTS = tuple(f"{upper}{lower}" for lower, upper in pairwise(BODIES))
"""From below: a joint moves the body of the same place in `BODIES`, one further."""

PELVIS = 0
LUMBAR = slice(0, 6)
LUMBAR_JOINTS = JOINTS[LUMBAR]
"""L5S1 to T12L1."""


@dataclass(frozen=True, eq=False)
class Masses:
    """What a body carries, itself and all that hangs on it.

    Attributes
    ----------
    kg : (18,) mass. com : (18, 3) m, centre of mass in the body's frame. about_com : (18, 3, 3)
        kg m2, inertia about it, in the body's axes.
    """

    kg: Array
    com: Array
    about_com: Array

    def __post_init__(self) -> None:
        for array in (self.kg, self.com, self.about_com):
            array.flags.writeable = False


@dataclass(frozen=True, eq=False)
class Skeleton:
    """Where joints sit in the body below, and what bodies weigh.

    Attributes
    ----------
    steps : (17,) pose of each joint's frame in the frame of the body below. masses : of all bodies.
    """

    steps: tuple[Pose, ...]
    masses: Masses


def skeleton_of(joints: Sequence[Pose], masses: Masses) -> Skeleton:
    """From the poses (17,) of the joints' frames in ground, all coordinates being zero."""
    steps, lower = [], Pose(np.eye(3), joints[0].origin)
    for joint in joints:
        turn = lower.rotation.T
        steps.append(Pose(turn @ joint.rotation, turn @ (joint.origin - lower.origin)))
        lower = joint
    return Skeleton(tuple(steps), masses)


def body_poses(skeleton: Skeleton, q: Array) -> tuple[Array, Array]:
    """Rotations (..., 18, 3, 3) and origins (..., 18, 3) m of all bodies in ground.

    Parameters
    ----------
    q : (..., 18, 6) m and rad, pelvis in ground, then joints from below, as `units.COORDINATES`.
    """
    turns = np.empty((*q.shape[:-1], 3, 3))
    places = np.empty((*q.shape[:-1], 3))
    local = rotations(q[..., 3:])
    turns[..., PELVIS, :, :], places[..., PELVIS, :] = local[..., 0, :, :], q[..., 0, :3]
    for k, step in enumerate(skeleton.steps):
        to_joint = turns[..., k, :, :] @ step.rotation
        at = places[..., k, :] + turns[..., k, :, :] @ step.origin
        moved = np.einsum("...ij,...j->...i", to_joint, q[..., k + 1, :3])
        turns[..., k + 1, :, :] = to_joint @ local[..., k + 1, :, :]
        places[..., k + 1, :] = at + moved
    return turns, places


def rotations(angles: Array) -> Array:
    """(..., 3, 3) of extension, right bending and left rotation (..., 3) rad, Z, X', Y''."""
    if angles.ndim == 1:
        return rotation_zxy(*angles.tolist())
    (cz, cx, cy), (sz, sx, sy) = (np.moveaxis(f(angles), -1, 0) for f in (np.cos, np.sin))
    rows = [
        [cz * cy - sz * sx * sy, -sz * cx, cz * sy + sz * sx * cy],
        [sz * cy + cz * sx * sy, cz * cx, sz * sy - cz * sx * cy],
        [-cx * sy, sx, cx * cy],
    ]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


@dataclass(frozen=True, eq=False)
class MarkerSet:
    """Markers on bodies.

    Attributes
    ----------
    names : (K,). body : (K,) place in `BODIES`. at : (K, 3) m in the body's frame. weight : (K,).
    cluster : (K,) name of the rigid cluster that a marker belongs to, empty for a single one.
    """

    names: tuple[str, ...]
    body: NDArray[np.int64]
    at: Array
    weight: Array
    cluster: tuple[str, ...]

    def __len__(self) -> int:
        return len(self.names)


@dataclass(frozen=True, eq=False)
class MarkerTrial:
    """A motion of markers, in ground axes (x forwards, y up, z right).

    Attributes
    ----------
    name, kind : kind is stance, flexion_extension, lateral_bending or axial_rotation.
    time_s : (F,). places : (F, K, 3) m, zero where not seen. seen : (F, K).
    arms : hanging, behind_head or crossed: where the arms are.
    """

    name: str
    kind: str
    time_s: Array
    places: Array
    seen: NDArray[np.bool_]
    arms: str
