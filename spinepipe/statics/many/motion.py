"""Many chains at one pose each: axes, pivots and positions of points, by the same joint convention.

A joint moves along the x, y and z axes of its frame, then turns by Z, X', Y''. What PyBullet does
for one chain is done here for M at once; tests hold the two against each other.
"""

from dataclasses import dataclass

import numpy as np

from spinepipe.effects.contract import Array, Indices
from spinepipe.statics.many.spines import Spines


@dataclass(frozen=True, eq=False)
class ManyMotion:
    """M chains at coordinates q (M, J, 6).

    Attributes
    ----------
    sliding, turning : (M, J, 3, 3) axes of the translations and rotations in ground, by row.
    pivots : (M, J, 3) m, about which each joint turns.
    rotations, translations : (M, J, 3, 3) and (M, J, 3) m, displacement of each vertebra.
    """

    sliding: Array
    turning: Array
    pivots: Array
    rotations: Array
    translations: Array

    def point(self, body: int, neutral: Array) -> Array:
        """(M, 3) where a vertebra's points, (M, 3) at the neutral pose, are, m."""
        turned = (self.rotations[:, body] @ neutral[:, :, None])[:, :, 0]
        result: Array = turned + self.translations[:, body]
        return result

    def points(self, neutral: Array) -> Array:
        """(M, J, 3) where one point of each vertebra, (M, J, 3) at the neutral pose, is, m."""
        result: Array = (self.rotations @ neutral[..., None])[..., 0] + self.translations
        return result

    def part(self, chosen: Indices) -> "ManyMotion":
        """Some of the chains."""
        return ManyMotion(
            self.sliding[chosen],
            self.turning[chosen],
            self.pivots[chosen],
            self.rotations[chosen],
            self.translations[chosen],
        )

    def velocities(self, body: int, point: Array) -> Array:
        """(M, n, 3) velocity of a vertebra's points, (M, 3) where they are, by coordinate."""
        count, joints = self.pivots.shape[:2]
        found = np.zeros((count, joints, 6, 3))
        upto = slice(0, body + 1)
        found[:, upto, :3] = self.sliding[:, upto]
        arms = point[:, None, None, :] - self.pivots[:, upto, None, :]
        found[:, upto, 3:] = np.cross(self.turning[:, upto], arms)
        return found.reshape(count, -1, 3)

    def axes(self, body: int | None = None) -> Array:
        """(M, n, 3) axes of the rotations that carry a vertebra (or all), zero elsewhere."""
        count, joints = self.pivots.shape[:2]
        found = np.zeros((count, joints, 6, 3))
        upto = slice(0, joints if body is None else body + 1)
        found[:, upto, 3:] = self.turning[:, upto]
        return found.reshape(count, -1, 3)


def moved(spines: Spines, q: Array) -> ManyMotion:
    """The chains at q (M, J, 6), m and rad."""
    count, joints = q.shape[:2]
    sliding, turning = np.empty((2, count, joints, 3, 3))
    pivots, translations = np.empty((2, count, joints, 3))
    rotations = np.empty((count, joints, 3, 3))
    rotation, translation = np.broadcast_to(np.eye(3), (count, 3, 3)), np.zeros((count, 3))
    for joint in range(joints):
        frame, origin = spines.rotations[:, joint], spines.origins[:, joint]
        before = rotation @ frame
        slid = (before @ q[:, joint, :3, None])[:, :, 0]
        pivot = (rotation @ origin[:, :, None])[:, :, 0] + translation + slid
        axes, turned = _turned(before, q[:, joint, 3:])
        rotation = turned @ frame.transpose(0, 2, 1)
        translation = pivot - (rotation @ origin[:, :, None])[:, :, 0]
        sliding[:, joint], turning[:, joint] = before.transpose(0, 2, 1), axes
        pivots[:, joint], rotations[:, joint] = pivot, rotation
        translations[:, joint] = translation
    return ManyMotion(sliding, turning, pivots, rotations, translations)


def _turned(before: Array, angles: Array) -> tuple[Array, Array]:
    """Axes (M, 3, 3) by row, and frames (M, 3, 3) after turning by Z, X', Y''."""
    x, y, z = before.transpose(2, 0, 1)
    (cz, sz), (cx, sx), (cy, sy) = (
        (np.cos(angle)[:, None], np.sin(angle)[:, None]) for angle in angles.T
    )
    by_z = cz * x + sz * y
    across = cz * y - sz * x
    by_x = cx * across + sx * z
    along = cx * z - sx * across
    axes = np.stack([z, by_z, by_x], axis=1)
    turned = np.stack([cy * by_z - sy * along, by_x, sy * by_z + cy * along], axis=2)
    return axes, turned
