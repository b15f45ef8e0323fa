"""What postures cost: markers, loads, ranges; each with its slopes by the coordinates.

All come as residuals, so that a cost is a sum of squares and half its curvature their slopes'.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np
import pinocchio as pin
from numba import njit

from spinepipe.effects.contract import Array
from spinepipe.motion.objective import SHAPE, MotionObjective, SampledTrial
from spinepipe.motion.passive import PassiveLaw
from spinepipe.motion.points import COUNT, marker_places, with_slopes
from spinepipe.motion.skeleton import BODIES, JOINTS, Skeleton
from spinepipe.units import STANDARD_GRAVITY

_AXES_OF_JOINT = (
    *(pin.JointModelPX, pin.JointModelPY, pin.JointModelPZ),
    *(pin.JointModelRZ, pin.JointModelRX, pin.JointModelRY),
)
"""Six joints of one coordinate stand for each of ours, so that generalised forces belong to the
coordinates: a load on `extension` is the moment about the axis of that rotation."""

_PELVIS = 6
"""Coordinates of the pelvis; what holds it up is the seat, and costs nothing."""


class RigidBodies:
    """Inverse dynamics of a skeleton: recursive Newton-Euler and its derivatives, by pinocchio.

    Carpentier and Mansard 2018 for the derivatives.

    Parameters
    ----------
    weight : whether gravity pulls.
    """

    def __init__(self, skeleton: Skeleton, weight: bool = True) -> None:
        self._model, parent, masses = pin.Model(), 0, skeleton.masses
        for body, name in enumerate(BODIES):
            here = pin.SE3.Identity()
            if body:
                step = skeleton.steps[body - 1]
                here = pin.SE3(np.asarray(step.rotation, float), np.asarray(step.origin, float))
            for k, joint in enumerate(_AXES_OF_JOINT):
                parent = self._model.addJoint(parent, joint(), here, f"{name}_{k}")
                here = pin.SE3.Identity()
            com, about = masses.com[body].copy(), masses.about_com[body].copy()
            inertia = pin.Inertia(float(masses.kg[body]), com, about)
            self._model.appendBodyToJoint(parent, inertia, pin.SE3.Identity())
        self._model.gravity.linear = np.asarray(STANDARD_GRAVITY) if weight else np.zeros(3)
        self._data = self._model.createData()

    def loads(self, q: Array, velocity: Array, acceleration: Array) -> Array:
        """(F, 108) N and N m that hold and move the bodies, of postures (F, 108)."""
        return np.array(
            [
                pin.rnea(self._model, self._data, *now)
                for now in zip(q, velocity, acceleration, strict=True)
            ]
        )

    def with_slopes(self, q: Array, velocity: Array, acceleration: Array) -> tuple[Array, Array]:
        """Loads (F, 108), and slopes (F, 3, 108, 108) by places, velocities and accelerations."""
        loads = np.empty((len(q), COUNT))
        slopes = np.empty((len(q), 3, COUNT, COUNT))
        for k, now in enumerate(zip(q, velocity, acceleration, strict=True)):
            pin.computeRNEADerivatives(self._model, self._data, *now)
            loads[k] = self._data.tau
            slopes[k, 0], slopes[k, 1] = self._data.dtau_dq, self._data.dtau_dv
            slopes[k, 2] = self._data.M
        _mirror(slopes[:, 2])
        return loads, slopes


@njit(cache=True)
def _mirror(matrices: Array) -> None:
    """Below their diagonals what is above: pinocchio writes one half of an inertia matrix."""
    for k in range(len(matrices)):
        for i in range(len(matrices[k])):
            for j in range(i):
                matrices[k, i, j] = matrices[k, j, i]


@lru_cache(maxsize=8)
def bodies_of(skeleton: Skeleton, weight: bool = True) -> RigidBodies:
    """The bodies of a skeleton, made once: making them takes as long as fifty postures."""
    return RigidBodies(skeleton, weight)


@dataclass(frozen=True, eq=False)
class Markers:
    """Markers off their places, over their size; (F, 3 K) and slopes (F, 3 K, 108)."""

    watched: SampledTrial
    ask: MotionObjective

    def residuals(self, q: Array) -> Array:
        """Of postures (F, 18, 6)."""
        at = marker_places(self.watched.skeleton, self.watched.markers, q)
        return self._weighed((at - self.watched.places).reshape(len(q), -1, 1))[..., 0]

    def with_slopes(self, q: Array) -> tuple[Array, Array]:
        """Residuals and their slopes."""
        at, slopes = with_slopes(self.watched.skeleton, self.watched.markers, q)
        off = (at - self.watched.places).reshape(len(q), -1, 1)
        return self._weighed(off)[..., 0], self._weighed(slopes.reshape(len(q), -1, COUNT))

    def _weighed(self, rows: Array) -> Array:
        """(F, 3 K, n) over their sizes."""
        seen, size = self.watched, self.ask.sizes.marker_m
        share = np.repeat(np.sqrt(seen.weight), 3, axis=1)[..., None]
        found: Array = rows * share if seen.shares is None else seen.shares @ rows
        found /= size
        return found


class LoadSlopes(NamedTuple):
    """Loads of one node, over their sizes, and what moves them.

    Attributes
    ----------
    each : (n, 102, 108) slopes by its coefficients. weighed : the same, each load with those that
        it is held against (`MuscleDemand.metric` times it): `weighed.T @ each` is a curvature.
    active : (102,) what muscles do. by_size, by_shape : (102,) slopes of each load by the
        logarithms of A and of B of its own passive element.
    """

    each: Array
    weighed: Array
    active: Array
    by_size: Array
    by_shape: Array


@dataclass(frozen=True, eq=False)
class MuscleDemand:
    """What muscles have to do at the joints, over its size; (F, 102).

    `squared`: all that is not done by passive elements. `minus_gravity`: as if bodies had mass and
    no weight. `level_difference`: by how much that differs from joint to joint, since muscles span
    several, and beside it by the mean force of all joints: without it, a spine that is pressed
    together as a whole costs nothing.
    """

    bodies: RigidBodies
    ask: MotionObjective

    @classmethod
    def of(cls, watched: SampledTrial, ask: MotionObjective) -> "MuscleDemand":
        """Of the bodies of a trial."""
        return cls(bodies_of(watched.skeleton, ask.force_cost != "minus_gravity"), ask)

    def active(self, law: PassiveLaw | None, motion: tuple[Array, Array, Array]) -> Array:
        """(F, 17, 6) N and N m that muscles do; motion (F, 18, 6) each, place to acceleration."""
        q, velocity, acceleration = (one.reshape(len(one), COUNT) for one in motion)
        loads = self.bodies.loads(q, velocity, acceleration)[:, _PELVIS:].reshape(
            -1, len(JOINTS), 6
        )
        return loads if law is None else loads + law.forces(motion[0][:, 1:])

    def residuals(self, law: PassiveLaw | None, motion: tuple[Array, Array, Array]) -> Array:
        """(F, 102)."""
        active = self.active(law, motion) / self.ask.sizes.of_loads
        return self._between(active.reshape(len(active), len(JOINTS), -1)).reshape(len(active), -1)

    def by_node(
        self, law: PassiveLaw | None, motion: tuple[Array, Array, Array], weights: Array
    ) -> Iterator[LoadSlopes]:
        """Of each node, with slopes by its coefficients.

        Parameters
        ----------
        weights : (3, n) of the n coefficients of a node: place, velocity, acceleration (`spline`).
        """
        frames, count = len(motion[0]), COUNT - _PELVIS
        force, stiffness, by_shape = np.zeros((3, frames, count))
        if law is not None:
            force, stiffness, by_shape = (
                np.ascontiguousarray(one).reshape(frames, count)
                for one in law.with_slopes(motion[0][:, 1:])
            )
        size, common = self.ask.sizes.of_loads, self._common
        whole_size = np.tile(size, len(JOINTS))
        flat = [one.reshape(frames, COUNT) for one in motion]
        for k in range(frames):
            loads, by_motion = self.bodies.with_slopes(*(one[k : k + 1] for one in flat))
            # chain rule: by motion, then by the coefficients that make it
            each = np.empty((weights.shape[1], count, COUNT))
            _by_coefficients(by_motion[0], stiffness[k], size, weights, each)
            # levels against each other: the metric is sparse, so it is not multiplied out
            weighed = each
            if self.ask.force_cost == "level_difference":
                weighed = np.empty_like(each)
                _weigh_levels(each, common**2, weighed)
            own = (loads[0, _PELVIS:] + force[k], force[k], by_shape[k])
            yield LoadSlopes(each, weighed, *(one / whole_size for one in own))

    def pulls(self, active: Array) -> Array:
        """(F, 102) half of what a cost falls by each N and N m, of loads (F, 102) over sizes."""
        found: Array = active @ self.metric / np.tile(self.ask.sizes.of_loads, len(JOINTS))
        return found

    @property
    def metric(self) -> Array:
        """(102, 102) by which loads over their sizes are multiplied before they meet each other."""
        count = COUNT - _PELVIS
        rows = self._between(np.eye(count).reshape(len(JOINTS), SHAPE[1], count), 0)
        flat = rows.reshape(count, count)
        found: Array = flat.T @ flat
        return found

    @property
    def _common(self) -> Array:
        """(6,) of the sum over joints of loads over their sizes."""
        found: Array = self.ask.sizes.of_loads / self.ask.sizes.of_common / np.sqrt(len(JOINTS))
        return found

    def _between(self, by_level: Array, axis: int = 1) -> Array:
        """Rows (..., 17, 6, ...) as they cost, levels on that axis."""
        if self.ask.force_cost != "level_difference":
            return by_level
        whole = by_level.sum(axis=axis, keepdims=True)
        whole *= self._common.reshape(-1, *[1] * (by_level.ndim - axis - 2))
        return np.concatenate([np.diff(by_level, axis=axis), whole], axis=axis)


def range_excess(ask: MotionObjective, q: Array) -> tuple[Array, Array]:
    """How far coordinates (F, 18, 6) are beyond their range, over its size; and its slope."""
    over = np.maximum(q - ask.high, 0.0) + np.minimum(q - ask.low, 0.0)
    size = np.broadcast_to(ask.sizes.beyond, SHAPE)
    return over / size, (over != 0.0) / size


@njit(cache=True)
def _by_coefficients(
    by_motion: Array, stiffness: Array, size: Array, weights: Array, found: Array
) -> None:
    """Slopes (n, 102, 108) of joints' loads over their size, from those (3, 108, 108) by motion."""
    joint_rows, columns = found.shape[1:]
    for i in range(len(found)):
        place, velocity, acceleration = weights[:, i]
        for r in range(joint_rows):
            row, per = r + _PELVIS, 1.0 / size[r % len(size)]
            for s in range(columns):
                found[i, r, s] = per * (
                    place * by_motion[0, row, s]
                    + velocity * by_motion[1, row, s]
                    + acceleration * by_motion[2, row, s]
                )
            found[i, r, row] += per * place * stiffness[r]


@njit(cache=True)
def _weigh_levels(each: Array, common: Array, found: Array) -> None:
    """Differences from level to level, and the sum of all with its share `common` (6,), transposed
    times themselves: the Laplacian of a path, and a constant beside it."""
    coefficients, rows, columns = each.shape
    axes = len(common)
    whole = np.empty((axes, columns))
    for i in range(coefficients):
        whole[:] = 0.0
        for r in range(rows):
            for s in range(columns):
                whole[r % axes, s] += common[r % axes] * each[i, r, s]
        for r in range(rows):
            for s in range(columns):
                found[i, r, s] = whole[r % axes, s]
            if r >= axes:
                for s in range(columns):
                    found[i, r, s] += each[i, r, s] - each[i, r - axes, s]
            if r + axes < rows:
                for s in range(columns):
                    found[i, r, s] += each[i, r, s] - each[i, r + axes, s]
