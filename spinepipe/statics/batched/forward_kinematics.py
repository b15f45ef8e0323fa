"""Chains of joints at one pose each, in compiled loops: where they are and what their loads do.

Forward kinematics from the base up, sums of wrenches from the top down, in the spatial vectors of
Featherstone (2008, doi 10.1007/978-1-4899-7560-7), all about the origin of ground, so that nothing
has to be carried from one body's frame to the next.

A vertebra's small displacement is a twist xi = (omega, v at the origin of ground). A joint moves by
its six axes S. W_b is the wrench (moment about the origin, force) on vertebra b, and L_b its
derivative by xi_b: forces do not turn and moments do not move, so that it has three rows that are
not zero. With all wrenches beyond joint j added up, its axes' loads change by C xi when they turn
with the twist below.

What PyBullet does for one chain is done here for many; tests hold the two against each other.
"""

from dataclasses import dataclass
from math import prod

import numpy as np
from numpy.typing import NDArray

from spinepipe.effects.contract import Array, Indices
from spinepipe.statics.batched.loads import Chains, Loads
from spinepipe.statics.batched.vectors import (
    WIDTH,
    Plain,
    add_product,
    blocks,
    compiled,
    gather,
    inner,
    lanes,
    vectors,
)

Flags = NDArray[np.bool_]


@inner
def cross_into(a: Array, b: Array, out: Array) -> None:
    """out = a x b, (3,) each."""
    out[0] = a[1] * b[2] - a[2] * b[1]
    out[1] = a[2] * b[0] - a[0] * b[2]
    out[2] = a[0] * b[1] - a[1] * b[0]


@inner
def turned_into(matrix: Array, vector: Array, out: Array) -> None:
    """out = matrix (3, 3) times vector (3,)."""
    for r in range(3):
        out[r] = matrix[r, 0] * vector[0] + matrix[r, 1] * vector[1] + matrix[r, 2] * vector[2]


@inner
def _place_vertebrae(
    frames: Plain, q: Array, width: int, axes: Array, turned: Array, shifted: Array
) -> None:
    """Forward kinematics: four chains at q (J, 6, 4), m and rad, from the base up.

    Entries of all other arrays are four lanes.

    Parameters
    ----------
    frames : (J, 3, 3) and (J, 3), rotations and origins. width : lanes that are not repeated ones.
    axes : (J, 6, 6), filled with the twist of each coordinate by row.
    turned, shifted : (J, 3, 3) and (J, 3), filled with the displacement of each vertebra.
    """
    (rotations, origins), numbers = frames, np.empty((33, WIDTH))
    work, coordinates = vectors(numbers), vectors(q)
    below, final = work[:9].reshape((3, 3)), work[9:18].reshape((3, 3))
    slid, pivot, back, turns = work[18:21], work[21:24], work[24:27], work[27:33]
    for j in range(len(q)):
        # the joint's lower frame, carried by the vertebra below it
        if j:
            turned_into(turned[j - 1], origins[j], pivot)
            for c in range(3):
                turned_into(turned[j - 1], rotations[j, :, c], below[:, c])
        else:
            for r in range(3):
                pivot[r] = origins[j, r]
                for c in range(3):
                    below[r, c] = rotations[j, r, c]
        # translations along its axes bring the pivot to where the rotations happen
        turned_into(below, coordinates[j, :3], slid)
        for r in range(3):
            pivot[r] += slid[r]
            if j:
                pivot[r] += shifted[j - 1, r]
        for k in range(3):
            # libm is called lane by lane; what fills up a block is copied, not computed again
            for lane in range(width):
                numbers[27 + k, lane] = np.cos(q[j, 3 + k, lane])
                numbers[30 + k, lane] = np.sin(q[j, 3 + k, lane])
            for lane in range(width, WIDTH):
                numbers[27 + k, lane] = numbers[27 + k, width - 1]
                numbers[30 + k, lane] = numbers[30 + k, width - 1]
        _axes_and_frame(below, turns, pivot, axes[j], final)
        # displacement of the vertebra from the neutral pose: X_joint now times its inverse then
        turned[j][:] = 0.0
        add_product(final, rotations[j].T, turned[j])
        turned_into(turned[j], origins[j], back)
        for r in range(3):
            shifted[j, r] = pivot[r] - back[r]


@inner
def _axes_and_frame(below: Array, turns: Array, pivot: Array, axes: Array, final: Array) -> None:
    """Twists (6, 6) of a joint's coordinates and its frame (3, 3) after turning by Z, X', Y''.

    ``turns`` (6,): the cosines of the three angles, and their sines.
    """
    cz, cx, cy, sz, sx, sy = turns[0], turns[1], turns[2], turns[3], turns[4], turns[5]
    # each rotation is about an axis that the ones before it have turned: z, then x', then y''
    for r in range(3):
        x, y, z = below[r, 0], below[r, 1], below[r, 2]
        by_z, across = cz * x + sz * y, cz * y - sz * x
        by_x, along = cx * across + sx * z, cx * z - sx * across
        axes[3, r], axes[4, r], axes[5, r] = z, by_z, by_x
        final[r, 0], final[r, 1], final[r, 2] = cy * by_z - sy * along, by_x, sy * by_z + cy * along
        for k in range(3):
            axes[k, r], axes[k, 3 + r] = 0.0, below[r, k]
    for k in range(3, 6):  # a line through the pivot moves the origin by pivot x axis
        cross_into(pivot, axes[k, :3], axes[k, 3:])


@inner
def _add_force(
    turned: Array,
    shifted: Array,
    neutral: Array,
    force: Array,
    work: Array,
    wrench: Array,
    slope: Array,
) -> None:
    """Add a force at a vertebra's point (3,) to its wrench (6,) and the slope (3, 6) of that.

    ``work`` (6,) is work space.
    """
    point, moment = work[:3], work[3:]
    turned_into(turned, neutral, point)
    for r in range(3):
        point[r] += shifted[r]
    cross_into(point, force, moment)
    # a twist (w, v) moves the point p by w x p + v, so the moment p x f changes by
    # (w x p) x f + v x f = p (f . w) - w (f . p) + v x f: three rows, by w and by v
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


@inner
def _load_vertebrae(
    weighing: Plain, listed: Plain, first: int, turned: Array, shifted: Array, found: Plain
) -> None:
    """Wrench on each vertebra (J, 6) and its slope by the vertebra's twist, (J, 3, 6), of a block.

    Parameters
    ----------
    weighing : masses (J,), coms (J, 3) and gravity (3,), entries four lanes. listed : wrenches of
        all lanes (N, W, ...), of which those of the block begin at ``first``.
    """
    (masses, coms, gravity), (bodies, points, forces, moments) = weighing, listed
    wrenches, slopes = found
    numbers = np.empty((15, WIDTH))
    every = vectors(numbers)
    force, point, moment, work = every[:3], every[3:6], every[6:9], every[9:]
    for j in range(len(wrenches)):
        for r in range(6):
            wrenches[j, r] = 0.0
            for k in range(3):
                slopes[j, k, r] = 0.0
        for r in range(3):  # the weight, at the centre of mass
            force[r] = masses[j] * gravity[r]
        _add_force(turned[j], shifted[j], coms[j], force, work, wrenches[j], slopes[j])
    rows = np.minimum(np.arange(first, first + WIDTH), len(bodies) - 1)
    for w in range(bodies.shape[1]):
        for lane in range(WIDTH):
            # lanes may load different vertebrae: each of these once, with zeros in other lanes
            body = bodies[rows[lane], w]
            fresh = body >= 0
            for earlier in range(lane):
                fresh = fresh and bodies[rows[earlier], w] != body
            if not fresh:
                continue
            for other in range(WIDTH):
                row = rows[other]
                on = 1.0 if bodies[row, w] == body else 0.0
                for r in range(3):
                    numbers[r, other] = on * forces[row, w, r]
                    numbers[3 + r, other] = points[row, w, r]
                    numbers[6 + r, other] = on * moments[row, w, r]
            _add_force(
                turned[body], shifted[body], point, force, work, wrenches[body], slopes[body]
            )
            for r in range(3):
                wrenches[body, r] += moment[r]


@inner
def _crossed_rows(axes: Array, beyond: Array, rows: Array) -> None:
    """C (6, 6): what turning a joint under the wrench beyond (6,) adds to its axes' loads.

    With a twist t the axis S becomes S + t x S, so its load S . W grows by (t x S) . W, which is
    t . (S x* W): row k is the spatial force cross product of axis k with the wrench.
    """
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


@dataclass(frozen=True, eq=False)
class KinematicsAndLoads:
    """N lanes at one pose each: what the tangents and the mass matrices are made of.

    Compiled code takes the numbers in blocks of four lanes (B, ..., 4); the properties are the same
    lane by lane (N, ...).

    Attributes
    ----------
    numbers : axes (J, 6, 6), twist of each coordinate, by row; applied (J, 6), what the loads do to
        each axis; rows (J, 6, 6), C; stiff (J, 6, 6), tangent of what the joint holds, with how its
        own axes turn each other; slopes (J, 3, 6), sum of L_b over the joint's vertebra and those
        beyond; turned, shifted (J, 3, 3) and (J, 3), displacement of each vertebra.
    count : N.
    fixed : (N, J, 6) coordinates that do not move, or (0, 0, 6) where all do.
    """

    numbers: Plain
    count: int
    fixed: Flags

    def part(self, chosen: Indices) -> "KinematicsAndLoads":
        """Some of the lanes."""
        fixed = self.fixed[chosen] if len(self.fixed) else self.fixed
        numbers = tuple(blocks(lanes(one, self.count)[chosen]) for one in self.numbers)
        return KinematicsAndLoads(numbers, len(chosen), fixed)

    def _lanes(self, which: int) -> Array:
        found: Array = lanes(self.numbers[which], self.count)
        return found

    axes = property(lambda self: self._lanes(0))
    applied = property(lambda self: self._lanes(1))
    rows = property(lambda self: self._lanes(2))
    stiff = property(lambda self: self._lanes(3))
    slopes = property(lambda self: self._lanes(4))
    turned = property(lambda self: self._lanes(5))
    shifted = property(lambda self: self._lanes(6))


@inner
def _sum_from_the_top(
    axes: Array,
    tangents: Array,
    wrenches: Array,
    slopes: Array,
    applied: Array,
    rows: Array,
    stiff: Array,
) -> None:
    """From the top down: loads of the axes, C and stiffness; slopes and wrenches become sums."""
    # as the backward pass of recursive Newton-Euler, with no inertia in it
    for j in range(len(axes) - 1, -1, -1):
        s, beyond = axes[j], wrenches[j]
        if j + 1 < len(axes):
            for r in range(6):
                beyond[r] += wrenches[j + 1, r]
            for r in range(3):
                for c in range(6):
                    slopes[j, r, c] += slopes[j + 1, r, c]
        _crossed_rows(s, beyond, rows[j])
        for k in range(6):
            load = s[k, 0] * beyond[0]
            for i in range(1, 6):
                load += s[k, i] * beyond[i]
            applied[j, k] = load
            for c in range(6):
                value = tangents[j, k, c]
                if c < k:  # a joint's earlier coordinates carry its later axes along
                    for i in range(6):
                        value -= rows[j, k, i] * s[c, i]
                stiff[j, k, c] = value


@compiled
def _fill_blocks(chains: Plain, loads: Plain, q: Array, tangents: Array, found: Plain) -> None:
    """Fill the numbers of `KinematicsAndLoads`, block by block.

    Parameters
    ----------
    chains : rotations, origins, masses, coms, gravity (M, n). q, tangents : (N, n).
    loads : chain of each lane, and its wrenches.
    """
    (chain_of, bodies, points, forces, moments), joints = loads, q.shape[1] // 6
    listed, own = (bodies, points, forces, moments), np.arange(len(q))
    # of a joint 9 + 3 numbers of its frame, 1 + 3 of its body; gravity behind all of them
    given = np.empty((16 * joints + 3, WIDTH))
    frames = vectors(given)
    rotations = frames[: 9 * joints].reshape((joints, 3, 3))
    origins = frames[9 * joints : 12 * joints].reshape((joints, 3))
    coms = frames[13 * joints : 16 * joints].reshape((joints, 3))
    weighing = (frames[12 * joints : 13 * joints], coms, frames[16 * joints :])
    pose, held = np.empty((6 * joints, WIDTH)), np.empty((36 * joints, WIDTH))
    tangent = vectors(held).reshape((joints, 6, 6))
    wrenches = vectors(np.empty((joints, 6, WIDTH)))
    axes, applied, rows, stiff, slopes, turned, shifted = found
    for block in range(len(axes)):
        # numbers of each lane's own chain, its pose and its joints' tangents, four side by side
        first, at = WIDTH * block, 0
        for one in chains:
            gather(one, chain_of, first, given[at : at + one.shape[1]])
            at += one.shape[1]
        gather(q, own, first, pose)
        gather(tangents, own, first, held)
        s, turn, shift = vectors(axes[block]), vectors(turned[block]), vectors(shifted[block])
        slope = vectors(slopes[block])
        width = min(WIDTH, len(q) - first)
        _place_vertebrae(
            (rotations, origins), pose.reshape((joints, 6, WIDTH)), width, s, turn, shift
        )
        _load_vertebrae(weighing, listed, first, turn, shift, (wrenches, slope))
        load, row, own_stiff = vectors(applied[block]), vectors(rows[block]), vectors(stiff[block])
        _sum_from_the_top(s, tangent, wrenches, slope, load, row, own_stiff)


def forward_kinematics(
    chains: Chains, loads: Loads, q: Array, tangents: Array
) -> KinematicsAndLoads:
    """Lanes at q (N, J, 6) whose joints hold with tangents (N, J, 6, 6)."""
    count, joints = q.shape[:2]
    shapes = ((6, 6), (6,), (6, 6), (6, 6), (3, 6), (3, 3), (3,))
    numbers = tuple([np.empty((-(-count // WIDTH), joints, *one, WIDTH)) for one in shapes])
    given = (*chains[:4], chains.gravity)
    _fill_blocks(tuple(map(flat, given)), loads[:-1], flat(q), flat(tangents), numbers)
    return KinematicsAndLoads(numbers, count, loads.supports.fixed)


def flat(numbers: Array) -> Array:
    """(N, n) of (N, ...)."""
    return np.ascontiguousarray(numbers).reshape(len(numbers), prod(numbers.shape[1:]))


def unloaded_kinematics(rotations: Array, origins: Array, q: Array) -> tuple[Array, Array, Array]:
    """Axes (N, J, 6, 6) and displacements of N chains at q (N, J, 6), as of `KinematicsAndLoads`.

    Parameters
    ----------
    rotations, origins : (N, J, 3, 3) and (N, J, 3) m, joint frames of each.
    """
    (count, joints), own = q.shape[:2], np.arange(len(q))
    nothing, none = np.zeros((count, joints, 3)), np.zeros((count, 0, 3))
    masses, inertias = nothing[..., 0], np.zeros((count, joints, 3, 3))
    chains = Chains(rotations, origins, masses, nothing, inertias, q, nothing[:, 0])
    unloaded = Loads(own, np.zeros((count, 0), dtype=np.int64), none, none, none)
    seen = forward_kinematics(chains, unloaded, q, np.zeros((*q.shape, 6)))
    return seen.axes, seen.turned, seen.shifted
