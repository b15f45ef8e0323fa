"""Many chains at one pose each: axes and positions, residuals and exact tangents.

By the same joint convention as for one chain: a joint moves along the x, y and z axes of its frame,
then turns by Z, X', Y''. What PyBullet does for one chain is done here for M at once, each under
its own wrenches and weight; tests hold the two against each other.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from spinepipe.effects.contract import Array, Indices
from spinepipe.model import ScopedEffect
from spinepipe.statics.holding import NO_STATES, ActiveLaw, Holding, hold
from spinepipe.statics.many.spines import Spines
from spinepipe.statics.placement import Placed


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


_NOTHING = np.empty(0)


@dataclass(frozen=True, eq=False)
class Loads:
    """Wrenches of one step on M chains: vertebrae (W,) and (M, W, 3) m, N, N m in ground."""

    bodies: tuple[int, ...]
    points: Array
    forces: Array
    moments: Array

    def part(self, chosen: Indices) -> "Loads":
        """Those of some chains."""
        return Loads(self.bodies, self.points[chosen], self.forces[chosen], self.moments[chosen])


def held(spines: Spines, effects: Sequence[tuple[int, ScopedEffect]], q: Array) -> Holding:
    """Loads (M, J, 6) that hold the joints at q (M, J, 6), and their tangents (M, J, 6, 6).

    The laws of all chains act as one long list of joints.
    """
    count, joints = q.shape[:2]
    first = joints * np.arange(count)[:, None]
    laws = []
    for index, scoped in effects:
        places = (first + np.array(scoped.joints)).ravel()
        values = spines.values[index]
        if values.shape[1] == 1 and len(scoped.joints) > 1:
            values = np.repeat(values, len(scoped.joints), axis=1)
        flat = values.reshape(-1, values.shape[2])
        laws.append(ActiveLaw(scoped.effect, index, places, flat, True))  # type: ignore[arg-type]
    unmoved = Placed(q.reshape(-1, 6), _NOTHING, _NOTHING, {})
    found = hold(unmoved, laws, NO_STATES, moved=False)
    return Holding(found.load.reshape(q.shape), found.tangent.reshape(*q.shape, 6))


def balance(
    spines: Spines, effects: Sequence[tuple[int, ScopedEffect]], loads: Loads, q: Array
) -> tuple[Array, Array]:
    """Residuals (M, n), what the joints hold less what is applied, and tangents (M, n, n)."""
    motion = moved(spines, q)
    applied, tangent = _applied(spines, loads, motion)
    holding = held(spines, effects, q)
    stiffness = np.negative(tangent, out=tangent)
    for joint in range(q.shape[1]):
        at = slice(6 * joint, 6 * joint + 6)
        stiffness[:, at, at] += holding.tangent[:, joint]
    return holding.load.reshape(len(q), -1) - applied, stiffness


def _applied(spines: Spines, loads: Loads, motion: ManyMotion) -> tuple[Array, Array]:
    """Generalised loads (M, n) and their tangents (M, n, n); see `spinepipe.statics.motion`."""
    axes = motion.axes()
    count, n = axes.shape[:2]
    load, tangent = np.zeros((count, n)), np.zeros((count, n, n))
    gravity = spines.like.gravity
    if np.any(gravity):
        weighed = _mass_velocity(spines, motion)
        load += weighed @ gravity
        tangent += np.cross(gravity, axes) @ weighed.transpose(0, 2, 1)
    for number, body in enumerate(loads.bodies):
        force = loads.forces[:, number]
        if np.any(force):
            point = motion.point(body, loads.points[:, number])
            velocities = motion.velocities(body, point)
            load += (velocities @ force[:, :, None])[:, :, 0]
            tangent += np.cross(force[:, None], axes) @ velocities.transpose(0, 2, 1)
    tangent = np.triu(tangent) + np.triu(tangent, 1).transpose(0, 2, 1)
    for number, body in enumerate(loads.bodies):
        moment = loads.moments[:, number]
        if np.any(moment):
            angular = motion.axes(body)
            load += (angular @ moment[:, :, None])[:, :, 0]
            turned = np.cross(moment[:, None], angular).transpose(0, 2, 1)
            tangent += np.tril(angular @ turned, -1)
    return load, tangent


def _mass_velocity(spines: Spines, motion: ManyMotion) -> Array:
    """(M, n, 3) kg: generalised weight per unit of gravity along each axis."""
    count, joints = spines.masses.shape
    centres = motion.points(spines.coms)
    carried = _and_above(spines.masses)
    moment = _and_above(spines.masses[..., None] * centres)
    found = np.empty((count, joints, 6, 3))
    found[:, :, :3] = carried[:, :, None, None] * motion.sliding
    arms = moment - carried[..., None] * motion.pivots
    found[:, :, 3:] = np.cross(motion.turning, arms[:, :, None])
    return found.reshape(count, -1, 3)


def _and_above(values: Array) -> Array:
    """Sums over a joint's vertebra and all those cranial to it, along axis 1."""
    result: Array = np.cumsum(values[:, ::-1], axis=1)[:, ::-1]
    return result
