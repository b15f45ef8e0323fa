"""Moving chains, many at once, in compiled loops: mass matrices, tangents, velocity-product forces.

Composite rigid bodies (CRBA) and recursive Newton-Euler (RNEA) of Featherstone (2008, doi
10.1007/978-1-4899-7560-7), all in ground axes about the origin of ground. Spatial vectors are
[angular; linear] as in `forward_kinematics`: a twist is (w, v), a momentum or wrench (moment about
the origin, momentum or force).
"""

from dataclasses import dataclass

import numpy as np

from spinepipe.effects.contract import Array, Indices
from spinepipe.statics.batched.forward_kinematics import KinematicsAndLoads, flat
from spinepipe.statics.batched.loads import Chains
from spinepipe.statics.batched.vectors import (
    WIDTH,
    Plain,
    compiled,
    gather,
    inner,
    lanes,
    vectors,
)


@dataclass(frozen=True, eq=False)
class Moving:
    """N lanes at one pose each; n = 6 J.

    Attributes
    ----------
    mass : (N, n, n) mass matrix. inertias : (N, J, 6, 6) of each vertebra by its twist.
    """

    seen: KinematicsAndLoads
    inertias: Array
    mass: Array

    @classmethod
    def of(cls, chains: Chains, chain: Indices, seen: KinematicsAndLoads) -> "Moving":
        """Lanes (N,) of which each is a pose of a chain."""
        inertias = lanes(inertias_of(chains, chain, seen), seen.count)
        return cls(seen, inertias, masses_of(seen, inertias))

    def velocity_product_forces(self, rates: Array) -> Array:
        """(N, J, 6) what inertia asks of each axis at rates (N, J, 6) that do not change."""
        found = np.empty(rates.shape)
        _newton_euler(self.seen.axes, self.inertias, rates, found)
        return found

    def accelerations(self, forces: Array) -> Array:
        """(N, n) the mass matrix's answer to forces (N, n); NaN where it is not positive."""
        found = forces.copy()
        _cholesky_solve(self.mass, found)
        return found


def inertias_of(chains: Chains, chain: Indices, seen: KinematicsAndLoads) -> Array:
    """Inertia of each vertebra by its twist, about the origin of ground, in blocks."""
    turned, shifted = seen.numbers[5:]
    found = np.empty((*shifted.shape[:2], 6, 6, WIDTH))
    bodies = tuple(map(flat, (chains.masses, chains.coms, chains.inertias)))
    _place_inertias(chain, bodies, turned, shifted, found)
    return found


def momenta_of(axes: Array, inertias: Array) -> Array:
    """(N, J, 6, 6) momentum by each axis of all that its joint carries."""
    found: Array = axes @ np.cumsum(inertias[:, ::-1], axis=1)[:, ::-1]
    return found


def masses_of(seen: KinematicsAndLoads, inertias: Array) -> Array:
    """(N, n, n) mass matrices by composite rigid bodies (CRBA).

    Row i, column j <= i: momentum of all that axis i carries, moved by axis i, along axis j.
    """
    axes = seen.axes
    shape = (len(axes), 6 * axes.shape[1], 6)
    momenta = momenta_of(axes, inertias).reshape(shape)
    lower = np.tril(momenta @ axes.reshape(shape).swapaxes(1, 2))
    found: Array = lower + np.tril(lower, -1).swapaxes(1, 2)
    return found


def tangents_of(seen: KinematicsAndLoads) -> Array:
    """(N, n, n) tangents of what the joints hold less what is applied.

    The whole matrix of which `elimination` solves the equations joint by joint.
    """
    axes, slopes, joints = seen.axes, seen.slopes, seen.numbers[0].shape[1]
    count, n = len(axes), 6 * joints
    # an axis feels a lower one in two ways: it is turned by it (rows), and the loads beyond it
    # change as all that it carries moves along (slopes); a higher one by the latter alone
    down, moments = axes[..., :3] @ slopes, axes @ slopes.swapaxes(2, 3)
    along = axes.reshape(count, n, 6).swapaxes(1, 2)
    below = (down + seen.rows).reshape(count, n, 6) @ along
    above = moments.reshape(count, n, 3) @ along[:, :3]
    earlier = np.kron(np.tri(joints, k=-1), np.ones((6, 6)))
    found: Array = -earlier * below - (earlier * above).swapaxes(1, 2)
    own = seen.stiff - down @ axes.swapaxes(2, 3)  # of a joint's own coordinates on each other
    for j in range(joints):
        found[:, 6 * j : 6 * j + 6, 6 * j : 6 * j + 6] = own[:, j]
    return found


@inner
def _spatial_inertia(turned: Array, shifted: Array, body: Plain, work: Array, found: Array) -> None:
    """Fill the spatial inertia (6, 6) of a displaced vertebra about the origin of ground.

    With c the centre of mass and [c] its cross product matrix (Featherstone 2008, eq. 2.63):
    R I R' + m [c] [c]', m [c]; m [c]', m 1.

    Parameters
    ----------
    body : mass (1,), centre of mass (3,) and inertia (3, 3) about it. work : (12,).
    """
    masses, com, own = body
    mass, c, half = masses[0], work[:3], work[3:].reshape((3, 3))
    for r in range(3):
        c[r] = shifted[r]
        for k in range(3):
            c[r] += turned[r, k] * com[k]
            half[r, k] = turned[r, 0] * own[0, k]
            for i in range(1, 3):
                half[r, k] += turned[r, i] * own[i, k]
    # R I R' and the parallel axes' part, m ((c . c) 1 - c c')
    square = c[0] * c[0] + c[1] * c[1] + c[2] * c[2]
    found[:] = 0.0
    for r in range(3):
        for k in range(3):
            value = -mass * c[r] * c[k]
            for i in range(3):
                value += half[r, i] * turned[k, i]
            found[r, k] = value
        found[r, r] += mass * square
        found[3 + r, 3 + r] = mass
    # m [c] and its transpose
    found[0, 4], found[0, 5] = -mass * c[2], mass * c[1]
    found[1, 3], found[1, 5] = mass * c[2], -mass * c[0]
    found[2, 3], found[2, 4] = -mass * c[1], mass * c[0]
    for r in range(3):
        for k in range(3):
            found[3 + k, r] = found[r, 3 + k]


@compiled
def _place_inertias(
    chain: Indices, bodies: Plain, every_turned: Array, every_shifted: Array, every: Array
) -> None:
    """Fill the inertias (B, J, 6, 6, 4); bodies (M, n)."""
    joints = every.shape[1]
    given, work = np.empty((13 * joints, WIDTH)), vectors(np.empty((12, WIDTH)))
    numbers = vectors(given)
    coms = numbers[joints : 4 * joints].reshape((joints, 3))
    own = numbers[4 * joints :].reshape((joints, 3, 3))
    for block in range(len(every)):
        at = 0
        for one in bodies:
            gather(one, chain, WIDTH * block, given[at : at + one.shape[1]])
            at += one.shape[1]
        turned, shifted = vectors(every_turned[block]), vectors(every_shifted[block])
        found = vectors(every[block])
        for j in range(joints):
            body = (numbers[j : j + 1], coms[j], own[j])
            _spatial_inertia(turned[j], shifted[j], body, work, found[j])


@compiled
def add_cross(a: Array, b: Array, factor: float, out: Array) -> None:
    """Add a x b times a factor to out, (3,) each."""
    out[0] += factor * (a[1] * b[2] - a[2] * b[1])
    out[1] += factor * (a[2] * b[0] - a[0] * b[2])
    out[2] += factor * (a[0] * b[1] - a[1] * b[0])


@compiled
def _newton_euler(axes: Array, inertias: Array, rates: Array, found: Array) -> None:
    """Recursive Newton-Euler (Featherstone 2008, table 5.1) with joint accelerations of zero.

    Fills what inertia asks of the axes (N, J, 6) at rates (N, J, 6): the centrifugal and Coriolis
    loads alone, for nothing falls and no rate changes.
    """
    joints = axes.shape[1]
    twist, acceleration = np.empty(6), np.empty(6)
    momentum, transmitted = np.empty(6), np.empty(6)
    wrenches = np.empty((joints, 6))
    for n in range(len(axes)):
        twist[:] = 0.0
        acceleration[:] = 0.0
        # outwards: twist V and acceleration A of each vertebra, and the wrench that moves it so
        for j in range(joints):
            for k in range(6):
                # the axis S is carried by V and changes at V x S, so that A grows by V x S rate:
                # spatial cross product of motions, [w x S_w; w x S_v + v x S_w]
                s, rate = axes[n, j, k], rates[n, j, k]
                add_cross(twist[:3], s[:3], rate, acceleration[:3])
                add_cross(twist[:3], s[3:], rate, acceleration[3:])
                add_cross(twist[3:], s[:3], rate, acceleration[3:])
                for r in range(6):
                    twist[r] += rate * s[r]
            for r in range(6):
                momentum[r] = 0.0
                wrenches[j, r] = 0.0
                for c in range(6):
                    momentum[r] += inertias[n, j, r, c] * twist[c]
                    wrenches[j, r] += inertias[n, j, r, c] * acceleration[c]
            # I A + V x* I V, the spatial cross product with a force: [w x m + v x f; w x f]
            add_cross(twist[:3], momentum[:3], 1.0, wrenches[j, :3])
            add_cross(twist[3:], momentum[3:], 1.0, wrenches[j, :3])
            add_cross(twist[:3], momentum[3:], 1.0, wrenches[j, 3:])
        # inwards: each joint transmits the wrenches of all vertebrae beyond it
        transmitted[:] = 0.0
        for j in range(joints - 1, -1, -1):
            for r in range(6):
                transmitted[r] += wrenches[j, r]
            for k in range(6):
                found[n, j, k] = 0.0
                for r in range(6):
                    found[n, j, k] += axes[n, j, k, r] * transmitted[r]


@compiled
def _cholesky_solve(matrices: Array, right: Array) -> None:
    """Solve symmetric positive matrices (N, n, n) for right-hand sides (N, n) in place.

    By Cholesky factors L L', row by row, the forward substitution along with them; a matrix that is
    not positive gives the root of a negative number, NaN.
    """
    n = right.shape[1]
    lower = np.empty((n, n))
    for lane in range(len(right)):
        x = right[lane]
        for r in range(n):
            for c in range(r + 1):
                value = matrices[lane, r, c]
                for i in range(c):
                    value -= lower[r, i] * lower[c, i]
                lower[r, c] = np.sqrt(value) if r == c else value / lower[c, c]
            for c in range(r):
                x[r] -= lower[r, c] * x[c]
            x[r] /= lower[r, r]
        for r in range(n - 1, -1, -1):  # backward, by columns of L', which are rows of L
            x[r] /= lower[r, r]
            for c in range(r):
                x[c] -= lower[r, c] * x[r]


class BatchedLUFactors:
    """LU factors of N matrices (n, n), each with its row exchanges."""

    def __init__(self, matrices: Array) -> None:
        self._lu = matrices.copy()
        self._rows = np.empty(matrices.shape[:2], dtype=np.int64)
        _factor(self._lu, self._rows)

    def solve(self, right: Array) -> Array:
        """(N, n) for right-hand sides (N, n); not finite where a matrix is singular."""
        found = np.empty(right.shape)
        _substitute(self._lu, self._rows, right, found)
        return found


@compiled
def _factor(matrices: Array, rows: Indices) -> None:
    """LU with partial pivoting (Doolittle) in place; rows (N, n) filled with the rows' order.

    numpy keeps no factors of a stack, and a Rosenbrock step needs them for each of four stages.
    """
    n = matrices.shape[1]
    for lane in range(len(matrices)):
        a, order = matrices[lane], rows[lane]
        for k in range(n):
            order[k] = k
        for k in range(n):
            p = k  # the largest entry of the column is the pivot
            for r in range(k + 1, n):
                if abs(a[r, k]) > abs(a[p, k]):
                    p = r
            if p != k:
                order[k], order[p] = order[p], order[k]
                for c in range(n):
                    a[k, c], a[p, c] = a[p, c], a[k, c]
            for r in range(k + 1, n):
                f = a[r, k] / a[k, k]
                a[r, k] = f
                for c in range(k + 1, n):
                    a[r, c] -= f * a[k, c]


@compiled
def _substitute(lu: Array, rows: Indices, right: Array, found: Array) -> None:
    """Forward and backward substitution of (N, n)."""
    n = right.shape[1]
    for lane in range(len(right)):
        a, x = lu[lane], found[lane]
        for r in range(n):
            x[r] = right[lane, rows[lane, r]]
            for c in range(r):
                x[r] -= a[r, c] * x[c]
        for r in range(n - 1, -1, -1):
            for c in range(r + 1, n):
                x[r] -= a[r, c] * x[c]
            x[r] /= a[r, r]
