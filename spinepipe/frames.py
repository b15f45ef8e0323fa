"""ISB frames: joint poses from landmarks, and the Z, X', Y'' coordinates of a joint.

Axes are right-handed: x anterior, y superior, z right (Wu et al. 2002,
doi 10.1016/S0021-9290(01)00222-6).
"""

from collections.abc import Mapping
from dataclasses import dataclass
from math import cos, sin

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

from spinepipe.units import COORDINATES

__all__ = [
    "COORDINATES",
    "Pose",
    "coordinates_of",
    "joint_pose",
    "reexpress",
    "rotation_zxy",
    "transform_of",
    "vertebra_rotation",
    "zxy_angles",
]

Array = NDArray[np.float64]

FRAME_LANDMARKS = (
    "superior_endplate_centre",
    "inferior_endplate_centre",
    "left_pedicle_base",
    "right_pedicle_base",
)
"""The four landmarks that give a vertebra its own ISB frame."""

SMALLEST_LENGTH_M = 1e-4
"""Landmarks closer than this define no direction: palpation errors are ten times larger."""

SMALLEST_SINE = 0.05
"""Pedicle line and endplate line closer than 3 degrees define no plane."""


@dataclass(frozen=True)
class Pose:
    """A rigid transform ``X_A_B``: frame B seen from frame A.

    Attributes
    ----------
    rotation : (3, 3) axes of B as columns, in A.
    origin : (3,) origin of B in A, m.
    """

    rotation: Array
    origin: Array

    def __matmul__(self, other: "Pose") -> "Pose":
        """``X_A_B @ X_B_C = X_A_C``."""
        return Pose(self.rotation @ other.rotation, self.rotation @ other.origin + self.origin)

    def inverse(self) -> "Pose":
        """``X_B_A``."""
        return Pose(self.rotation.T, -self.rotation.T @ self.origin)

    def apply(self, points: ArrayLike) -> Array:
        """(…, 3) points given in B, expressed in A."""
        return np.asarray(points, dtype=float) @ self.rotation.T + self.origin


def rotation_zxy(extension: float, right_bending: float, left_rotation: float) -> Array:
    """(3, 3) ``Rz(extension) @ Rx(right_bending) @ Ry(left_rotation)``, angles in rad."""
    ce, se = cos(extension), sin(extension)
    cb, sb = cos(right_bending), sin(right_bending)
    cl, sl = cos(left_rotation), sin(left_rotation)
    return np.array(
        [
            [ce * cl - se * sb * sl, -se * cb, ce * sl + se * sb * cl],
            [se * cl + ce * sb * sl, ce * cb, se * sl - ce * sb * cl],
            [-cb * sl, sb, cb * cl],
        ]
    )


def zxy_angles(rotation: ArrayLike) -> Array:
    """(…, 3) extension, right bending, left rotation in rad of (…, 3, 3) rotations."""
    matrix = np.asarray(rotation, dtype=float)
    extension = np.arctan2(-matrix[..., 0, 1], matrix[..., 1, 1])
    right_bending = np.arcsin(np.clip(matrix[..., 2, 1], -1.0, 1.0))
    left_rotation = np.arctan2(-matrix[..., 2, 0], matrix[..., 2, 2])
    return np.stack([extension, right_bending, left_rotation], axis=-1)


def transform_of(coordinates: ArrayLike) -> Pose:
    """Pose of the upper joint frame in the lower one for six joint coordinates (m, rad)."""
    q = np.asarray(coordinates, dtype=float)
    return Pose(rotation_zxy(*q[3:]), q[:3].copy())


def coordinates_of(pose: Pose) -> Array:
    """(6,) joint coordinates (m, rad) of the pose of the upper joint frame in the lower one."""
    return np.concatenate([pose.origin, zxy_angles(pose.rotation)])


def reexpress(coordinates: ArrayLike, from_frame: Pose, to_frame: Pose) -> Array:
    """Joint coordinates of the same rigid motion, measured in another joint frame.

    Parameters
    ----------
    coordinates : (6,) motion of the upper vertebra in ``from_frame`` (m, rad).
    from_frame, to_frame : the two joint frames in any common frame, neutral pose.
    """
    motion = from_frame @ transform_of(coordinates) @ from_frame.inverse()
    return coordinates_of(to_frame.inverse() @ motion @ to_frame)


def vertebra_rotation(landmarks: Mapping[str, Array]) -> Array:
    """(3, 3) ISB axes of one vertebra from its four landmarks (points in m).

    z runs exactly along the line joining the pedicle bases, to the right; x is normal to it and
    to the line from the inferior to the superior endplate centre.

    Raises
    ------
    ValueError
        When the landmarks coincide or are collinear.
    """
    z = _direction(landmarks, "left_pedicle_base", "right_pedicle_base")
    y0 = _direction(landmarks, "inferior_endplate_centre", "superior_endplate_centre")
    normal = np.cross(y0, z)
    sine = float(np.linalg.norm(normal))
    if sine < SMALLEST_SINE:
        raise ValueError("the pedicle line and the endplate line are parallel: no frame")
    x = normal / sine
    return np.column_stack([x, np.cross(z, x), z])


def _direction(landmarks: Mapping[str, Array], start: str, end: str) -> Array:
    line = landmarks[end] - landmarks[start]
    length = float(np.linalg.norm(line))
    if not length >= SMALLEST_LENGTH_M:
        raise ValueError(f"{start} and {end} coincide ({length * 1000:.3g} mm apart)")
    return line / length


def joint_pose(lower: Mapping[str, Array], upper: Mapping[str, Array]) -> Pose:
    """Pose of a joint frame from the landmarks of the two vertebrae (points in m, any frame).

    The origin is midway between the facing endplate centres; the orientation is the mean rotation
    of the two vertebrae's frames, or the frame of the one that has all four landmarks.

    Raises
    ------
    ValueError
        With the reason, when the landmarks do not define the frame.
    """
    for name, side in (("inferior_endplate_centre", upper), ("superior_endplate_centre", lower)):
        if name not in side:
            which = "upper" if side is upper else "lower"
            raise ValueError(f"{name} of the {which} vertebra is missing")
    complete = [side for side in (lower, upper) if all(n in side for n in FRAME_LANDMARKS)]
    if not complete:
        raise ValueError(f"neither vertebra has all of {', '.join(FRAME_LANDMARKS)}")
    rotations = np.stack([vertebra_rotation(side) for side in complete])
    facing = (upper["inferior_endplate_centre"], lower["superior_endplate_centre"])
    return Pose(Rotation.from_matrix(rotations).mean().as_matrix(), (facing[0] + facing[1]) / 2.0)
