"""How joint frames move with palpated landmarks: offset and tilt of each, with exact derivatives.

A joint whose laws act in another frame is the same joint with its centre offset and its axes tilted
(`joint_centre_offset`, then `axes_tilt`): with D the pose of the other frame in the stated one, a
motion T of the stated frame is ``D^-1 T D`` there. So measured motion stays in the frame in which
it was told, whatever the landmarks.

The frames are those of `spinepipe.frames.joint_pose`, of many sets of landmarks at once.
Derivatives are by complex steps: dot products, cross products and square roots are analytic, so
that they are exact to rounding (Martins 2003, doi:10.1145/838250.838251).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from spinepipe.effects.contract import Array, Indices
from spinepipe.frames import FRAME_LANDMARKS, SMALLEST_LENGTH_M, SMALLEST_SINE, Pose, zxy_angles

STEP = 1e-30
"""Of the complex steps, m: nothing is subtracted, so that it may be as small as one likes."""

_Complex = NDArray[np.complex128]
_Points = dict[str, _Complex]
"""Landmark to (..., 3), of one vertebra."""


@dataclass(frozen=True)
class FrameDisplacements:
    """Frames of J joints of P sets of landmarks, seen from the frames they are stated in.

    Attributes
    ----------
    by : (P, J, 6) offset of the centre in m and tilt of the axes as Z-X'-Y'' angles in rad.
    by_points : (P, J, 6, F, 3) derivative by the positions of the F free landmarks, m.
    defined : (P,) whether the landmarks define all frames; the numbers of others are none.
    """

    by: Array
    by_points: Array
    defined: NDArray[np.bool_]


def displacement(stated: Sequence[Pose], frames: Sequence[Pose]) -> Array:
    """(J, 6) offset in m and tilt in rad of frames as seen from the stated ones."""
    found = [one.inverse() @ other for one, other in zip(stated, frames, strict=True)]
    return np.array([[*pose.origin, *zxy_angles(pose.rotation)] for pose in found])


class LandmarkFrames:
    """Joint frames of one specimen as functions of where its landmarks are."""

    def __init__(
        self, vertebrae: Sequence[str], names: Sequence[tuple[str, str]], stated: Sequence[Pose]
    ) -> None:
        """Frames of the joints between vertebrae, caudal to cranial.

        Parameters
        ----------
        names : (vertebra, landmark) of each of L points. stated : the frames looked from.
        """
        self._vertebrae, self._names, self._stated = tuple(vertebrae), tuple(names), tuple(stated)

    def at(self, points: Array, free: Indices) -> FrameDisplacements:
        """Frames from landmarks (P, L, 3) m, ground.

        Parameters
        ----------
        free : (F,) landmarks by which derivatives are told.
        """
        # Set 0 of each batch is unmoved, set 1 + 3 f + k has landmark f stepped along axis k: the
        # imaginary part of a result, over the step, is its derivative by that coordinate.
        many, count = points.shape[:2]
        steps = np.zeros((3 * len(free), count, 3))
        steps[np.arange(3 * len(free)), np.repeat(free, 3), np.tile(np.arange(3), len(free))] = STEP
        moved = np.concatenate([np.zeros((1, count, 3)), steps])
        sides = self._sides(points[:, None] + 1j * moved)
        by, by_points, defined = [], [], np.ones(many, dtype=bool)
        with np.errstate(divide="ignore", invalid="ignore"):  # of landmarks that define no frame
            for stated, (lower, upper) in zip(self._stated, pairwise(self._vertebrae), strict=True):
                rotation, origin, good = _frame(sides[lower], sides[upper])
                # seen from the stated frame: R^T (p - p0) and R^T R'
                offset = (origin - stated.origin) @ stated.rotation
                seen = stated.rotation.T @ rotation
                angles, slopes = _angles(seen)
                by.append(np.concatenate([offset[:, 0].real, angles[:, 0]], axis=-1))
                by_points.append(np.concatenate([offset.imag / STEP, slopes], axis=-1)[:, 1:])
                defined &= good
        slopes = np.stack(by_points, axis=1).swapaxes(2, 3)
        shape = (many, len(by), 6, len(free), 3)
        return FrameDisplacements(np.stack(by, axis=1), slopes.reshape(shape), defined)

    def moving(self, points: Array) -> Indices:
        """Which of the landmarks (L, 3) move any joint."""
        found = self.at(points[None], np.arange(len(points)))
        return np.flatnonzero(np.any(found.by_points[0] != 0.0, axis=(0, 1, 3)))

    def _sides(self, points: _Complex) -> dict[str, _Points]:
        """Vertebra to landmark to (..., 3) of points (..., L, 3)."""
        sides: dict[str, _Points] = {name: {} for name in self._vertebrae}
        for place, (vertebra, landmark) in enumerate(self._names):
            sides.setdefault(vertebra, {})[landmark] = points[..., place, :]
        return sides


def _frame(lower: _Points, upper: _Points) -> tuple[_Complex, _Complex, NDArray[np.bool_]]:
    """Rotations (P, B, 3, 3), origins (P, B, 3), and of which sets (P,) there are any."""
    complete = [side for side in (lower, upper) if all(name in side for name in FRAME_LANDMARKS)]
    found = [_vertebra(side) for side in complete]
    rotations, good = [one for one, _ in found], [there for _, there in found]
    rotation = rotations[0] if len(rotations) == 1 else _midway(*rotations)
    facing = upper["inferior_endplate_centre"] + lower["superior_endplate_centre"]
    return rotation, facing / 2.0, np.logical_and.reduce(good)


def _vertebra(side: _Points) -> tuple[_Complex, NDArray[np.bool_]]:
    z, long = _unit(side["right_pedicle_base"] - side["left_pedicle_base"])
    y, high = _unit(side["superior_endplate_centre"] - side["inferior_endplate_centre"])
    x, sine = _unit(_cross(y, z))
    good = (long >= SMALLEST_LENGTH_M) & (high >= SMALLEST_LENGTH_M) & (sine >= SMALLEST_SINE)
    return np.stack([x, _cross(z, x), z], axis=-1), good


def _unit(lines: _Complex) -> tuple[_Complex, Array]:
    """Lines (P, B, 3) of length one, and the length (P,) of each set's."""
    length: _Complex = np.sqrt(np.einsum("...x,...x->...", lines, lines))
    return lines / length[..., None], length[:, 0].real


def _cross(one: _Complex, other: _Complex) -> _Complex:
    (a, b, c), (x, y, z) = np.moveaxis(one, -1, 0), np.moveaxis(other, -1, 0)
    return np.stack([b * z - c * y, c * x - a * z, a * y - b * x], axis=-1)


def _midway(one: _Complex, other: _Complex) -> _Complex:
    """The mean of two rotations: one, and then half of the turn from it to the other."""
    # unit quaternion (w, v) of the turn, from its trace and skew part
    turn = one.swapaxes(-1, -2) @ other
    w = 0.5 * np.sqrt(1.0 + np.trace(turn, axis1=-2, axis2=-1))
    spin = turn - turn.swapaxes(-1, -2)
    v = np.stack([spin[..., 2, 1], spin[..., 0, 2], spin[..., 1, 0]], -1) / (4.0 * w[..., None])
    # that of half of the angle bisects it and the identity: (1 + w, v), to length one
    half, _ = _unit(np.concatenate([1.0 + w[..., None], v], axis=-1))
    return one @ _turned(half[..., 0, None, None], half[..., 1:])


def _turned(w: _Complex, v: _Complex) -> _Complex:
    """(..., 3, 3) rotations of unit quaternions, w (..., 1, 1) and v (..., 3)."""
    cross = np.zeros((*v.shape, 3), dtype=complex)
    cross[..., 2, 1], cross[..., 0, 2], cross[..., 1, 0] = v[..., 0], v[..., 1], v[..., 2]
    cross[..., 1, 2], cross[..., 2, 0], cross[..., 0, 1] = -v[..., 0], -v[..., 1], -v[..., 2]
    found: _Complex = np.eye(3) + 2.0 * w * cross + 2.0 * cross @ cross
    return found


def _angles(rotation: _Complex) -> tuple[Array, Array]:
    """Z-X'-Y'' angles (P, B, 3) and their slopes, which rotations carry as imaginary parts."""
    # arctan2 is not analytic: the slopes of the angles follow by the chain rule instead
    value, slope = rotation.real, rotation.imag / STEP

    def turn(y: tuple[int, int], x: tuple[int, int]) -> Array:
        """Of arctan2(-value[y], value[x])."""
        a, b = -value[..., *y], value[..., *x]
        found: Array = (-slope[..., *y] * b - a * slope[..., *x]) / (a**2 + b**2)
        return found

    bending = slope[..., 2, 1] / np.sqrt(1.0 - value[..., 2, 1] ** 2)
    slopes = np.stack([turn((0, 1), (1, 1)), bending, turn((2, 0), (2, 2))], axis=-1)
    return zxy_angles(value), slopes
