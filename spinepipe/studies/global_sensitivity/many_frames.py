"""Joint frames of many landmark sets at once, each as `spinepipe.frames.joint_pose` makes it."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from spinepipe.effects.contract import Array
from spinepipe.frames import FRAME_LANDMARKS, SMALLEST_LENGTH_M, SMALLEST_SINE, Pose, joint_pose

Flags = NDArray[np.bool_]

SUPERIOR, INFERIOR, LEFT, RIGHT = range(len(FRAME_LANDMARKS))
"""Places of the landmarks, in the order of `FRAME_LANDMARKS`."""


@dataclass(frozen=True, eq=False)
class ManyFrames:
    """One joint's frame of M landmark sets.

    Attributes
    ----------
    rotations : (M, 3, 3); the identity where there is no frame.
    origins : (M, 3) m, ground.
    defined : (M,) whether the landmarks define a frame.
    """

    rotations: Array
    origins: Array
    defined: Flags


def many_joint_frames(lower: Array, upper: Array, in_lower: Flags, in_upper: Flags) -> ManyFrames:
    """Frames of a joint from landmarks (M, 4, 3) m of its two vertebrae, see `joint_pose`.

    Parameters
    ----------
    in_lower, in_upper : (4,) which landmarks a vertebra has; those of the facing endplates are
        there, and one of the two vertebrae has all. What it has not may hold any number.
    """
    sides = [points for points, there in ((lower, in_lower), (upper, in_upper)) if there.all()]
    rotations, defined = zip(*(_vertebra_rotations(points) for points in sides), strict=True)
    whole: Flags = np.logical_and.reduce(defined)
    stacked = np.stack(rotations, axis=1)
    stacked[~whole] = np.eye(3)
    mean = Rotation.from_matrix(stacked).mean(axis=1).as_matrix()
    return ManyFrames(mean, (upper[:, INFERIOR] + lower[:, SUPERIOR]) / 2.0, whole)


def _vertebra_rotations(points: Array) -> tuple[Array, Flags]:
    """(M, 3, 3) ISB axes of a vertebra and (M,) whether there are any, from (M, 4, 3) landmarks."""
    z, wide = _directions(points[:, LEFT], points[:, RIGHT])
    y0, high = _directions(points[:, INFERIOR], points[:, SUPERIOR])
    normal = np.cross(y0, z)
    sine = np.linalg.norm(normal, axis=1)
    defined = wide & high & (sine >= SMALLEST_SINE)
    x = normal / np.where(defined, sine, 1.0)[:, None]
    return np.stack([x, np.cross(z, x), z], axis=2), defined


def _directions(start: Array, end: Array) -> tuple[Array, Flags]:
    """(M, 3) unit vectors, and (M,) whether the points are far enough apart to have one."""
    line = end - start
    length = np.linalg.norm(line, axis=1)
    apart = length >= SMALLEST_LENGTH_M
    return line / np.where(apart, length, 1.0)[:, None], apart


def why_none(lower: Array, upper: Array, in_lower: Flags, in_upper: Flags) -> str:
    """Why one landmark set (4, 3) of each vertebra defines no frame."""
    try:
        one_joint_frame(lower, upper, in_lower, in_upper)
    except ValueError as error:
        return str(error)
    return "the landmarks are at the edge of defining no frame"


def one_joint_frame(lower: Array, upper: Array, in_lower: Flags, in_upper: Flags) -> Pose:
    """The frame of one landmark set (4, 3) of each vertebra, by `joint_pose` itself."""
    sides = ((lower, in_lower), (upper, in_upper))
    named = (
        {name: p for name, p, there in zip(FRAME_LANDMARKS, points, given, strict=True) if there}
        for points, given in sides
    )
    return joint_pose(*named)
