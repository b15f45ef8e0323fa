"""The chain at one pose: velocities of points, generalised loads of wrenches and their tangents.

With v_i and a_i the linear and angular velocity of a body's point by coordinate i (a_i zero for
translations), the exact tangents on a serial chain are

    d(v_i . f) / dq_j = f . (a_min(i,j) x v_max(i,j))
    d(a_i . m) / dq_j = m . (a_j x a_i)  for j < i, else 0

so a constant force has a symmetric tangent and a constant moment has not.
"""

from functools import cache, cached_property

import numpy as np
from numpy.typing import NDArray

from spinepipe.effects.contract import AppliedLoad, Array, Neutral
from spinepipe.frames import Pose, transform_of
from spinepipe.world import Chain


def cross_matrix(vector: Array) -> Array:
    """(3, 3) matrix W with ``W @ u = vector x u``."""
    x, y, z = vector.tolist()
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


def dead_tangent(by_force: Array, by_moment: Array) -> Array:
    """(n, n) tangent of dead loads: of forces symmetric as it is above, of moments as it is below.

    Parameters
    ----------
    by_force : (n, n) f . (a_i x v_j), summed over forces. by_moment : (n, n) m . (a_j x a_i).
    """
    below = _below(len(by_force))
    return np.where(below, by_force.T + by_moment, by_force)


@cache
def _below(n: int) -> NDArray[np.bool_]:
    """(n, n) whether a place is below the diagonal."""
    return np.tri(n, k=-1, dtype=bool)


class ChainMotion:
    """Implements `spinepipe.effects.Motion` on a loaded chain at coordinates q (n,)."""

    def __init__(self, chain: Chain, q: Array) -> None:
        self.chain = chain
        self.q = q
        self._known: dict[tuple[int, bytes], Array] = {}

    @cached_property
    def axes(self) -> Array:
        """(n, 3) axis of each rotational coordinate in ground, zero for translations."""
        return self._jacobian(self.chain.model.n_joints - 1, np.zeros(3))[1]

    @cached_property
    def mass_velocity(self) -> Array:
        """(n, 3) kg: generalised weight per unit of gravity along each axis."""
        return self.chain.mass_velocity(self.q)

    @property
    def neutral(self) -> Neutral:
        """Where the chain is in its neutral pose."""
        return self.chain.model.neutral

    def displacement(self, body: int) -> Pose:
        """Displacement of a body from the neutral pose, in ground; body -1 is ground itself."""
        return self._displacements[body + 1]

    @cached_property
    def _displacements(self) -> list[Pose]:
        placed = [Pose(np.eye(3), np.zeros(3))]
        for frame, q in zip(self.chain.model.frames, self.q.reshape(-1, 6), strict=True):
            placed.append(placed[-1] @ frame @ transform_of(q) @ frame.inverse())
        return placed

    def velocities(self, body: int, point: Array) -> Array:
        """(n, 3) velocity of the body's point (neutral position in ground, m)."""
        key = (body, point.tobytes())
        if key not in self._known:
            self._known[key] = self._jacobian(body, self.chain.local_point(body, point))[0]
        return self._known[key]

    def angular(self, body: int) -> Array:
        """(n, 3) angular velocity of a body: the axes of the coordinates that carry it."""
        carried = self.axes.copy()
        carried[6 * (body + 1) :] = 0.0
        return carried

    def wrench(self, body: int, point: Array, force: Array, moment: Array) -> AppliedLoad:
        """Generalised load (n,) of a ground-fixed wrench and its tangent (n, n)."""
        velocities, angular = self.velocities(body, point), self.angular(body)
        load = velocities @ force + angular @ moment
        by_force, by_moment = np.zeros((2, len(load), len(load)))
        if force.any():
            by_force = (self.axes @ cross_matrix(force).T) @ velocities.T
        if moment.any():
            by_moment = angular @ (angular @ cross_matrix(moment).T).T
        return AppliedLoad(load, dead_tangent(by_force, by_moment))

    def _jacobian(self, body: int, local_point: Array) -> tuple[Array, Array]:
        return self.chain.jacobian(self.q, body, local_point)
