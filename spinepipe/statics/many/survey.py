"""Chains of joints at one pose each, in compiled loops: where they are and what their loads do.

A vertebra's small displacement is a twist xi = (omega, v at the origin of ground). A joint moves by
its six axes S. W_b is the wrench (moment about the origin, force) on vertebra b, and L_b its
derivative by xi_b: forces do not turn and moments do not move, so that it has three rows that are
not zero. With all wrenches beyond joint j added up, its axes' loads change by C xi when they turn
with the twist below.

What PyBullet does for one chain is done here for many; tests hold the two against each other.
"""

from collections.abc import Callable
from typing import Any, NamedTuple, ParamSpec, TypeVar

import numpy as np
from numba import njit
from numpy.typing import NDArray

from spinepipe.effects.contract import Array, Indices

Plain = tuple[NDArray[Any], ...]
"""Arrays as compiled code takes them: what is kept of a compilation must not name our classes,
for it is read again before one knows whether they have changed."""

P = ParamSpec("P")
R = TypeVar("R")

Flags = NDArray[np.bool_]


def compiled(function: Callable[P, R]) -> Callable[P, R]:
    """The function as machine code, kept beside this file; division by zero is no exception.

    Entries are copied and added one by one in loops: for `a[:] = b` or `a += b` of arrays a message
    about shapes is compiled each time, which takes longer than all the rest.
    """
    result: Callable[P, R] = njit(cache=True, error_model="numpy")(function)
    return result


class Chains(NamedTuple):
    """M chains of J joints; SI, ground axes, neutral pose.

    Attributes
    ----------
    rotations, origins : (M, J, 3, 3) and (M, J, 3) m, joint frames.
    masses, coms, inertias : (M, J) kg, (M, J, 3) m, (M, J, 3, 3) kg m2 about it.
    damping : (M, J, 6) N s/m and N m s/rad. gravity : (M, 3) m/s2.
    """

    rotations: Array
    origins: Array
    masses: Array
    coms: Array
    inertias: Array
    damping: Array
    gravity: Array


class Supports(NamedTuple):
    """Which joint coordinates of each of N lanes a rig fixes; none anywhere when N is 0.

    Attributes
    ----------
    fixed : (N, J, 6). values : (N, J, 6) m and rad, where they are fixed.
    read_as : (N, J, 6) m per N or rad per N m by which the reaction is read, 0 where it is not.
    """

    fixed: Flags
    values: Array
    read_as: Array

    @property
    def there(self) -> bool:
        """Whether any lane may have one."""
        return len(self.fixed) > 0

    def part(self, lanes: Indices) -> "Supports":
        """Those of some lanes."""
        if not self.there:
            return self
        return Supports(self.fixed[lanes], self.values[lanes], self.read_as[lanes])

    def towards(self, later: "Supports", share: Array) -> "Supports":
        """The values a share (N,) of the way to those of a later step."""
        if not self.there:
            return self
        part = share[:, None, None]
        return later._replace(values=self.values + part * (later.values - self.values))

    def on(self, q: Array) -> Array:
        """The poses q (N, J, 6) with fixed coordinates where they are fixed."""
        return np.where(self.fixed, self.values, q) if self.there else q.copy()


FREE = Supports(np.zeros((0, 0, 6), dtype=bool), np.zeros((0, 0, 6)), np.zeros((0, 0, 6)))
"""No supports."""


class Loads(NamedTuple):
    """What acts on each of N lanes; a lane is a chain under one set of loads.

    Attributes
    ----------
    chain : (N,) which chain it is.
    bodies : (N, W) vertebra of each wrench, -1 for none. points : (N, W, 3) m, neutral pose.
    forces, moments : (N, W, 3) N and N m, fixed in ground.
    supports : joint coordinates that a rig fixes.
    """

    chain: Indices
    bodies: Indices
    points: Array
    forces: Array
    moments: Array
    supports: Supports = FREE


def part(loads: Loads, lanes: Indices) -> Loads:
    """The loads of some lanes."""
    chain, bodies, points, forces, moments, supports = loads
    places, wrenches = (chain[lanes], bodies[lanes], points[lanes]), (forces[lanes], moments[lanes])
    return Loads(*places, *wrenches, supports.part(lanes))


@compiled
def cross_into(a: Array, b: Array, out: Array) -> None:
    """out = a x b, (3,) each."""
    out[0] = a[1] * b[2] - a[2] * b[1]
    out[1] = a[2] * b[0] - a[0] * b[2]
    out[2] = a[0] * b[1] - a[1] * b[0]


@compiled
def turned_into(matrix: Array, vector: Array, out: Array) -> None:
    """out = matrix (3, 3) times vector (3,)."""
    for r in range(3):
        out[r] = matrix[r, 0] * vector[0] + matrix[r, 1] * vector[1] + matrix[r, 2] * vector[2]


@compiled
def move(
    rotations: Array, origins: Array, q: Array, axes: Array, turned: Array, shifted: Array
) -> None:
    """One chain at q (J, 6), m and rad.

    Parameters
    ----------
    axes : (J, 6, 6), filled with the twist of each coordinate by row.
    turned, shifted : (J, 3, 3) and (J, 3), filled with the displacement of each vertebra.
    """
    below, final = np.empty((3, 3)), np.empty((3, 3))
    slid, pivot, back = np.empty(3), np.empty(3), np.empty(3)
    for j in range(len(q)):
        if j:
            turned_into(turned[j - 1], origins[j], pivot)
            for r in range(3):
                turned_into(turned[j - 1], rotations[j, :, r], below[:, r])
        else:
            for r in range(3):
                pivot[r] = origins[j, r]
                for c in range(3):
                    below[r, c] = rotations[j, r, c]
        turned_into(below, q[j, :3], slid)
        for r in range(3):
            pivot[r] += slid[r] + (shifted[j - 1, r] if j else 0.0)
        _turn(below, q[j, 3:], pivot, axes[j], final)
        for r in range(3):
            for c in range(3):
                turned[j, r, c] = 0.0
                for i in range(3):
                    turned[j, r, c] += final[r, i] * rotations[j, c, i]
        turned_into(turned[j], origins[j], back)
        for r in range(3):
            shifted[j, r] = pivot[r] - back[r]


@compiled
def _turn(below: Array, angles: Array, pivot: Array, axes: Array, final: Array) -> None:
    """Twists (6, 6) of a joint's coordinates and its frame (3, 3) after turning by Z, X', Y''."""
    cz, sz = np.cos(angles[0]), np.sin(angles[0])
    cx, sx = np.cos(angles[1]), np.sin(angles[1])
    cy, sy = np.cos(angles[2]), np.sin(angles[2])
    for r in range(3):
        x, y, z = below[r, 0], below[r, 1], below[r, 2]
        by_z, across = cz * x + sz * y, cz * y - sz * x
        by_x, along = cx * across + sx * z, cx * z - sx * across
        axes[3, r], axes[4, r], axes[5, r] = z, by_z, by_x
        final[r, 0], final[r, 1], final[r, 2] = cy * by_z - sy * along, by_x, sy * by_z + cy * along
        for k in range(3):
            axes[k, r], axes[k, 3 + r] = 0.0, below[r, k]
    for k in range(3, 6):
        cross_into(pivot, axes[k, :3], axes[k, 3:])


@compiled
def _push(
    turned: Array, shifted: Array, neutral: Array, force: Array, wrench: Array, slope: Array
) -> None:
    """Add a force at a vertebra's point (3,) to its wrench (6,) and the slope (3, 6) of that."""
    point, moment = np.empty(3), np.empty(3)
    turned_into(turned, neutral, point)
    for r in range(3):
        point[r] += shifted[r]
    cross_into(point, force, moment)
    inner = point[0] * force[0] + point[1] * force[1] + point[2] * force[2]
    for r in range(3):
        wrench[r] += moment[r]
        wrench[3 + r] += force[r]
        for c in range(3):
            slope[r, c] += point[r] * force[c]
        slope[r, r] -= inner
    slope[0, 4] += force[2]
    slope[0, 5] -= force[1]
    slope[1, 3] -= force[2]
    slope[1, 5] += force[0]
    slope[2, 3] += force[1]
    slope[2, 4] -= force[0]


@compiled
def _load(
    gravity: Array,
    masses: Array,
    coms: Array,
    bodies: Indices,
    points: Array,
    forces: Array,
    moments: Array,
    turned: Array,
    shifted: Array,
    wrenches: Array,
    slopes: Array,
) -> None:
    """Wrench on each vertebra (J, 6) and its slope by the vertebra's twist, (J, 3, 6)."""
    wrenches[:] = 0.0
    slopes[:] = 0.0
    if gravity[0] != 0.0 or gravity[1] != 0.0 or gravity[2] != 0.0:
        weight = np.empty(3)
        for b in range(len(turned)):
            for r in range(3):
                weight[r] = masses[b] * gravity[r]
            _push(turned[b], shifted[b], coms[b], weight, wrenches[b], slopes[b])
    for w in range(len(bodies)):
        b = bodies[w]
        if b >= 0:
            if forces[w, 0] != 0.0 or forces[w, 1] != 0.0 or forces[w, 2] != 0.0:
                _push(turned[b], shifted[b], points[w], forces[w], wrenches[b], slopes[b])
            for r in range(3):
                wrenches[b, r] += moments[w, r]


@compiled
def _turning_rows(axes: Array, beyond: Array, rows: Array) -> None:
    """C (6, 6): what turning a joint under the wrench beyond (6,) adds to its axes' loads."""
    m0, m1, m2 = beyond[0], beyond[1], beyond[2]
    f0, f1, f2 = beyond[3], beyond[4], beyond[5]
    for k in range(6):
        a0, a1, a2 = axes[k, 0], axes[k, 1], axes[k, 2]
        v0, v1, v2 = axes[k, 3], axes[k, 4], axes[k, 5]
        rows[k, 0] = a1 * m2 - a2 * m1 + v1 * f2 - v2 * f1
        rows[k, 1] = a2 * m0 - a0 * m2 + v2 * f0 - v0 * f2
        rows[k, 2] = a0 * m1 - a1 * m0 + v0 * f1 - v1 * f0
        rows[k, 3] = a1 * f2 - a2 * f1
        rows[k, 4] = a2 * f0 - a0 * f2
        rows[k, 5] = a0 * f1 - a1 * f0


class Survey(NamedTuple):
    """N lanes at one pose each: what the tangents and the mass matrices are made of.

    Attributes
    ----------
    axes : (N, J, 6, 6) twist of each coordinate, by row.
    applied : (N, J, 6) what the loads do to each axis.
    rows : (N, J, 6, 6) C. blocks : (N, J, 6, 6) tangent of what the joint holds, with how its own
        axes turn each other.
    slopes : (N, J, 3, 6) sum of L_b over the joint's vertebra and those beyond.
    turned, shifted : (N, J, 3, 3) and (N, J, 3) displacement of each vertebra.
    fixed : (N, J, 6) coordinates that do not move, or (0, 0, 6) where all do.
    """

    axes: Array
    applied: Array
    rows: Array
    blocks: Array
    slopes: Array
    turned: Array
    shifted: Array
    fixed: Flags

    def part(self, lanes: Indices) -> "Survey":
        """Some of the lanes."""
        fixed = self.fixed[lanes] if len(self.fixed) else self.fixed
        axes, applied, rows, blocks, slopes, turned, shifted = (one[lanes] for one in self.numbers)
        return Survey(axes, applied, rows, blocks, slopes, turned, shifted, fixed)

    @property
    def numbers(self) -> Plain:
        """All of it but what is fixed, as compiled code takes it."""
        return self[:-1]


@compiled
def _add_up(
    axes: Array,
    tangents: Array,
    wrenches: Array,
    slopes: Array,
    applied: Array,
    rows: Array,
    blocks: Array,
) -> None:
    """From the top down: loads of the axes, C and blocks; slopes become sums."""
    beyond = np.zeros(6)
    for j in range(len(axes) - 1, -1, -1):
        s = axes[j]
        for r in range(6):
            beyond[r] += wrenches[j, r]
        if j + 1 < len(axes):
            for r in range(3):
                for c in range(6):
                    slopes[j, r, c] += slopes[j + 1, r, c]
        _turning_rows(s, beyond, rows[j])
        for k in range(6):
            applied[j, k] = 0.0
            for i in range(6):
                applied[j, k] += s[k, i] * beyond[i]
            for c in range(6):
                value = tangents[j, k, c]
                if c < k:
                    for i in range(6):
                        value -= rows[j, k, i] * s[c, i]
                blocks[j, k, c] = value


@compiled
def _look(chains: Plain, loads: Plain, q: Array, tangents: Array, found: Plain) -> None:
    """Fill the parts of a survey."""
    rotations, origins, masses, coms, _, _, gravity = chains
    chain_of, bodies, points, forces, moments = loads
    axes, applied, rows, blocks, slopes, turned, shifted = found
    wrenches = np.empty((q.shape[1], 6))
    for n in range(len(q)):
        chain = chain_of[n]
        move(rotations[chain], origins[chain], q[n], axes[n], turned[n], shifted[n])
        _load(
            gravity[chain],
            masses[chain],
            coms[chain],
            bodies[n],
            points[n],
            forces[n],
            moments[n],
            turned[n],
            shifted[n],
            wrenches,
            slopes[n],
        )
        _add_up(axes[n], tangents[n], wrenches, slopes[n], applied[n], rows[n], blocks[n])


def survey(chains: Chains, loads: Loads, q: Array, tangents: Array) -> Survey:
    """Lanes at q (N, J, 6) whose joints hold with tangents (N, J, 6, 6)."""
    shapes = ((6, 6), (6,), (6, 6), (6, 6), (3, 6), (3, 3), (3,))
    numbers = [np.empty((*q.shape[:2], *shape)) for shape in shapes]
    _look(tuple(chains), loads[:-1], q, tangents, tuple(numbers))
    axes, applied, rows, blocks, slopes, turned, shifted = numbers
    fixed = loads.supports.fixed
    return Survey(axes, applied, rows, blocks, slopes, turned, shifted, fixed)


@compiled
def _place(
    rotations: Array, origins: Array, q: Array, axes: Array, turned: Array, shifted: Array
) -> None:
    """Move every chain."""
    for n in range(len(q)):
        move(rotations[n], origins[n], q[n], axes[n], turned[n], shifted[n])


def placed(rotations: Array, origins: Array, q: Array) -> tuple[Array, Array, Array]:
    """Axes (N, J, 6, 6) and displacements of N chains at q (N, J, 6), as of `Survey`.

    Parameters
    ----------
    rotations, origins : (N, J, 3, 3) and (N, J, 3) m, joint frames of each.
    """
    axes, turned, shifted = (np.empty((*q.shape[:2], *s)) for s in ((6, 6), (3, 3), (3,)))
    _place(rotations, origins, q, axes, turned, shifted)
    return axes, turned, shifted
