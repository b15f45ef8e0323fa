"""Moving chains, many at once, in compiled loops: mass matrices, tangents, what inertia asks for.

Twists are written as in `survey`, momenta as (moment about the origin of ground, momentum). With V
the twist of what carries an axis S, the axis changes at the rate V x S; a vertebra with inertia I
and twist V asks for the wrench I A + V x* I V at the acceleration A that is left when no rate
changes (Featherstone 2008, doi 10.1007/978-1-4899-7560-7, recursive Newton-Euler).

"""

from dataclasses import dataclass

import numpy as np

from spinepipe.effects.contract import Array, Indices
from spinepipe.statics.batched.forward_kinematics import (
    Chains,
    KinematicsAndLoads,
    Plain,
    compiled,
    flat,
    inner,
)
from spinepipe.statics.batched.vectors import WIDTH, gather, lanes, vectors


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

    def inertial(self, rates: Array) -> Array:
        """(N, J, 6) what inertia asks of each axis at rates (N, J, 6) that do not change."""
        found = np.empty(rates.shape)
        _whirl(self.seen.axes, self.inertias, rates, found)
        return found

    def accelerations(self, forces: Array) -> Array:
        """(N, n) the mass matrix's answer to forces (N, n); NaN where it is not positive."""
        found = forces.copy()
        _answer(self.mass, found)
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
    """(N, n, n) mass matrices: momentum by each axis along earlier ones (Featherstone's CRBA)."""
    axes = seen.axes
    shape = (len(axes), 6 * axes.shape[1], 6)
    momenta = momenta_of(axes, inertias).reshape(shape)
    lower = np.tril(momenta @ axes.reshape(shape).swapaxes(1, 2))
    found: Array = lower + np.tril(lower, -1).swapaxes(1, 2)
    return found


def tangents_of(seen: KinematicsAndLoads) -> Array:
    """(N, n, n) tangents of what the joints hold less what is applied."""
    axes, slopes, joints = seen.axes, seen.slopes, seen.numbers[0].shape[1]
    count, n = len(axes), 6 * joints
    down, moments = axes[..., :3] @ slopes, axes @ slopes.swapaxes(2, 3)
    along = axes.reshape(count, n, 6).swapaxes(1, 2)
    below = (down + seen.rows).reshape(count, n, 6) @ along
    above = moments.reshape(count, n, 3) @ along[:, :3]
    earlier = np.kron(np.tri(joints, k=-1), np.ones((6, 6)))
    found: Array = -earlier * below - (earlier * above).swapaxes(1, 2)
    own = seen.stiff - down @ axes.swapaxes(2, 3)
    for j in range(joints):
        found[:, 6 * j : 6 * j + 6, 6 * j : 6 * j + 6] = own[:, j]
    return found


@inner
def _inertia(turned: Array, shifted: Array, body: Plain, work: Array, found: Array) -> None:
    """Fill the inertia (6, 6) of a displaced vertebra about the origin of ground.

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
            _inertia(turned[j], shifted[j], body, work, found[j])


@compiled
def add_cross(a: Array, b: Array, factor: float, out: Array) -> None:
    """Add a x b times a factor to out, (3,) each."""
    out[0] += factor * (a[1] * b[2] - a[2] * b[1])
    out[1] += factor * (a[2] * b[0] - a[0] * b[2])
    out[2] += factor * (a[0] * b[1] - a[1] * b[0])


@compiled
def _whirl(axes: Array, inertias: Array, rates: Array, found: Array) -> None:
    """Fill what inertia asks of the axes (N, J, 6) at rates (N, J, 6)."""
    joints = axes.shape[1]
    twist, change, momentum, beyond = np.empty(6), np.empty(6), np.empty(6), np.empty(6)
    wrenches = np.empty((joints, 6))
    for n in range(len(axes)):
        twist[:] = 0.0
        change[:] = 0.0
        for j in range(joints):
            for k in range(6):
                s, rate = axes[n, j, k], rates[n, j, k]
                add_cross(twist[:3], s[:3], rate, change[:3])
                add_cross(twist[:3], s[3:], rate, change[3:])
                add_cross(twist[3:], s[:3], rate, change[3:])
                for r in range(6):
                    twist[r] += rate * s[r]
            for r in range(6):
                momentum[r] = 0.0
                wrenches[j, r] = 0.0
                for c in range(6):
                    momentum[r] += inertias[n, j, r, c] * twist[c]
                    wrenches[j, r] += inertias[n, j, r, c] * change[c]
            add_cross(twist[:3], momentum[:3], 1.0, wrenches[j, :3])
            add_cross(twist[3:], momentum[3:], 1.0, wrenches[j, :3])
            add_cross(twist[:3], momentum[3:], 1.0, wrenches[j, 3:])
        beyond[:] = 0.0
        for j in range(joints - 1, -1, -1):
            for r in range(6):
                beyond[r] += wrenches[j, r]
            for k in range(6):
                found[n, j, k] = 0.0
                for r in range(6):
                    found[n, j, k] += axes[n, j, k, r] * beyond[r]


@compiled
def _answer(matrices: Array, right: Array) -> None:
    """Solve symmetric positive matrices (N, n, n) for right-hand sides (N, n) in place."""
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
        for r in range(n - 1, -1, -1):
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
    """LU with partial pivoting in place; rows (N, n) are filled with the order of the rows."""
    n = matrices.shape[1]
    for lane in range(len(matrices)):
        a, order = matrices[lane], rows[lane]
        for k in range(n):
            order[k] = k
        for k in range(n):
            p = k
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
