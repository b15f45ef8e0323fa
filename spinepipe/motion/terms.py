"""What postures cost: markers, loads, ranges; each with its slopes by the coordinates.

All come as residuals, so that a cost is a sum of squares and half its curvature their slopes'.
"""

from dataclasses import dataclass

import numpy as np

from spinepipe.effects.contract import Array
from spinepipe.motion.asked import SHAPE, Ask, Watched
from spinepipe.motion.passive import PassiveLaw
from spinepipe.motion.points import COUNT, marker_places, with_slopes
from spinepipe.motion.rigid_body import RigidBodies, bodies_of
from spinepipe.motion.skeleton import JOINTS

_PELVIS = 6
"""Coordinates of the pelvis; what holds it up is the seat, and costs nothing."""


@dataclass(frozen=True, eq=False)
class Markers:
    """Markers off their places, over their size; (F, 3 K) and slopes (F, 3 K, 108)."""

    watched: Watched
    ask: Ask

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
        if seen.shares is not None:
            return seen.shares @ (rows / size)
        share = np.repeat(np.sqrt(seen.weight), 3, axis=1) / size
        found: Array = rows * share[..., None]
        return found


@dataclass(frozen=True, eq=False)
class Loads:
    """What muscles have to do at the joints, over its size; (F, 102).

    `squared`: all that is not done by passive elements. `minus_gravity`: as if bodies had mass and
    no weight. `level_difference`: by how much that differs from joint to joint, since muscles span
    several, and beside it by the mean force of all joints: without it, a spine that is pressed
    together as a whole costs nothing.
    """

    bodies: RigidBodies
    ask: Ask

    @classmethod
    def of(cls, watched: Watched, ask: Ask) -> "Loads":
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

    def with_slopes(
        self, law: PassiveLaw | None, motion: tuple[Array, Array, Array]
    ) -> tuple[Array, Array, Array]:
        """Residuals (F, R), slopes (F, 3, R, 108) by place, velocity and acceleration, and slopes
        (F, R, P) by the logarithms of sizes and shapes that are fitted."""
        frames = len(motion[0])
        loads, slopes = self.bodies.with_slopes(*(one.reshape(frames, COUNT) for one in motion))
        loads, slopes = loads[:, _PELVIS:].copy(), slopes[:, :, _PELVIS:].copy()
        fitted = np.flatnonzero(self.ask.fitted.ravel())
        shared = np.zeros((frames, loads.shape[1], 2 * len(fitted)))
        if law is not None:
            force, stiffness, by_shape = (
                one.reshape(frames, -1) for one in law.with_slopes(motion[0][:, 1:])
            )
            loads += force
            diagonal = np.arange(loads.shape[1])
            slopes[:, 0, diagonal, diagonal + _PELVIS] += stiffness
            shared[:, fitted, np.arange(len(fitted))] = force[:, fitted]
            shared[:, fitted, len(fitted) + np.arange(len(fitted))] = by_shape[:, fitted]
        size = np.tile(self.ask.sizes.of_loads, len(JOINTS))
        loads, slopes, shared = (
            loads / size,
            slopes / size[:, None],
            shared / size[:, None],
        )
        levels = len(JOINTS), SHAPE[1]
        return (
            self._between(loads.reshape(frames, *levels)).reshape(frames, -1),
            self._between(slopes.reshape(frames, 3, *levels, -1), 2).reshape(slopes.shape),
            self._between(shared.reshape(frames, *levels, -1)).reshape(shared.shape),
        )

    def _between(self, by_level: Array, axis: int = 1) -> Array:
        """Rows (..., 17, 6, ...) as they cost, levels on that axis."""
        if self.ask.force_cost != "level_difference":
            return by_level
        lighter = self.ask.sizes.of_loads / self.ask.sizes.of_common / np.sqrt(len(JOINTS))
        whole = by_level.sum(axis=axis, keepdims=True)
        whole *= lighter.reshape(-1, *[1] * (by_level.ndim - axis - 2))
        return np.concatenate([np.diff(by_level, axis=axis), whole], axis=axis)


def beyond(ask: Ask, q: Array) -> tuple[Array, Array]:
    """How far coordinates (F, 18, 6) are beyond their range, over its size; and its slope."""
    over = np.maximum(q - ask.high, 0.0) + np.minimum(q - ask.low, 0.0)
    size = np.broadcast_to(ask.sizes.beyond, SHAPE)
    return over / size, (over != 0.0) / size
