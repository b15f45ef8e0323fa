"""Chains of joints in compiled loops: where they are, Newton steps, derivatives.

A vertebra's small displacement is a twist xi = (omega, v at the origin of ground). Joint j moves by
its six axes S_j; with rates u_j

    xi_j = xi_(j-1) + a_j + S_j u_j + b_j,

where a_j and b_j are displacements of its lower and upper frame, zero but for derivatives by joint
poses. W_b is the wrench (moment about the origin, force) on vertebra b, L_b its derivative by xi_b,
w_b a change of it from elsewhere. To first order the loads of joint j balance where

    D_j u_j - C_j (xi_(j-1) + a_j) - S_j' sum_(b>=j) (L_b xi_b + w_b) = rho_j.

C_j and D_j, the tangent of what the joint holds, contain how the axes turn under the wrenches
beyond. Eliminated from the top down this is one 6 x 6 solution per joint, as for articulated bodies
(Featherstone 2008, doi 10.1007/978-1-4899-7560-7): time grows with the number of joints, not with
its cube. Forces do not turn and moments do not move, so that L_b has three rows that are not zero.

What PyBullet does for one chain is done here for many; tests hold the two against each other.
"""

from collections.abc import Callable
from typing import NamedTuple, ParamSpec, TypeVar

import numpy as np
from numba import njit
from numpy.typing import NDArray

from spinepipe.effects.contract import Array, Indices

P = ParamSpec("P")
R = TypeVar("R")

Flags = NDArray[np.bool_]


def compiled(function: Callable[P, R]) -> Callable[P, R]:
    """The function as machine code, kept beside this file; division by zero is no exception."""
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


class Loads(NamedTuple):
    """What acts on each of N lanes; a lane is a chain under one set of loads.

    Attributes
    ----------
    chain : (N,) which chain it is.
    bodies : (N, W) vertebra of each wrench, -1 for none. points : (N, W, 3) m, neutral pose.
    forces, moments : (N, W, 3) N and N m, fixed in ground.
    """

    chain: Indices
    bodies: Indices
    points: Array
    forces: Array
    moments: Array


def part(loads: Loads, lanes: Indices) -> Loads:
    """The loads of some lanes."""
    chain, bodies, points, forces, moments = loads
    return Loads(chain[lanes], bodies[lanes], points[lanes], forces[lanes], moments[lanes])


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
            below[:] = rotations[j]
            pivot[:] = origins[j]
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
def _set_up(
    chains: Chains,
    loads: Loads,
    lane: int,
    q: Array,
    axes: Array,
    turned: Array,
    shifted: Array,
    wrenches: Array,
    slopes: Array,
) -> None:
    """A lane at q (J, 6): where it is and what acts on it; see `move` and `_load`."""
    chain = loads.chain[lane]
    move(chains.rotations[chain], chains.origins[chain], q, axes, turned, shifted)
    _load(
        chains.gravity[chain],
        chains.masses[chain],
        chains.coms[chain],
        loads.bodies[lane],
        loads.points[lane],
        loads.forces[lane],
        loads.moments[lane],
        turned,
        shifted,
        wrenches,
        slopes,
    )


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


@compiled
def _eliminate(matrix: Array, right: Array) -> int:
    """Solve a (6, 6) for the right-hand sides (6, m) in place; sign of its determinant or 0."""
    sign, m = 1, right.shape[1]
    for k in range(6):
        p = k
        for r in range(k + 1, 6):
            if abs(matrix[r, k]) > abs(matrix[p, k]):
                p = r
        if not abs(matrix[p, k]) > 0.0:
            return 0
        if p != k:
            sign = -sign
            for c in range(6):
                matrix[k, c], matrix[p, c] = matrix[p, c], matrix[k, c]
            for c in range(m):
                right[k, c], right[p, c] = right[p, c], right[k, c]
        if matrix[k, k] < 0.0:
            sign = -sign
        inverse = 1.0 / matrix[k, k]
        for r in range(k + 1, 6):
            f = matrix[r, k] * inverse
            for c in range(k + 1, 6):
                matrix[r, c] -= f * matrix[k, c]
            for c in range(m):
                right[r, c] -= f * right[k, c]
    for k in range(5, -1, -1):
        inverse = 1.0 / matrix[k, k]
        for c in range(m):
            right[k, c] *= inverse
        for r in range(k):
            f = matrix[r, k]
            for c in range(m):
                right[r, c] -= f * right[k, c]
    return sign


@compiled
def _balance(
    axes: Array,
    tangent: Array,
    beyond: Array,
    slope: Array,
    rows: Array,
    matrix: Array,
    right: Array,
) -> None:
    """A joint's matrix (6, 6) of u, and how the twist below enters, (6, 6) of the right side."""
    _turning_rows(axes, beyond, rows)
    for k in range(6):
        for c in range(6):
            right[k, c] = rows[k, c]
            for r in range(3):
                right[k, c] += axes[k, r] * slope[r, c]
    for k in range(6):
        for c in range(6):
            value = 0.0
            if c < k:
                for i in range(6):
                    value += right[k, i] * axes[c, i]
            elif k > 2:
                for i in range(6):
                    value += (right[k, i] - rows[k, i]) * axes[c, i]
            matrix[k, c] = tangent[k, c] - value


@compiled
def _hand_down(axes: Array, right: Array, slope: Array, passed: Array) -> None:
    """Make slope (3, 6) and passed (6, m) those of all that hangs on the twist below the joint."""
    along = np.empty(6)
    for r in range(3):
        for k in range(6):
            along[k] = 0.0
            for c in range(6):
                along[k] += slope[r, c] * axes[k, c]
        for k in range(6):
            for c in range(6):
                slope[r, c] += along[k] * right[k, c]
            for c in range(passed.shape[1]):
                passed[r, c] += along[k] * right[k, 6 + c]


@compiled
def _add_product(matrix: Array, vectors: Array, out: Array) -> None:
    """Add matrix (r, k) times vectors (k, m) to out (r, m)."""
    for r in range(matrix.shape[0]):
        for k in range(matrix.shape[1]):
            f = matrix[r, k]
            for c in range(vectors.shape[1]):
                out[r, c] += f * vectors[k, c]


@compiled
def answers(
    chains: Chains,
    loads: Loads,
    q: Array,
    tangents: Array,
    sources: Array,
    loaded: bool,
    pushes: Array,
    lower: Array,
    upper: Array,
    rates: Array,
    signs: Indices,
) -> None:
    """Rates (N, J, 6, m) that answer m changes of each lane.

    Parameters
    ----------
    q, tangents : (N, J, 6) and (N, J, 6, 6) of what the joints hold.
    sources : (N, J, 6, m) rho. loaded : whether what the loads do to each axis is added to them:
        with what the joints hold, taken off, the rates are Newton's step.
    pushes, lower, upper : (N, J, 6, m) w, a and b, or with m = 0 none.
    rates, signs : filled; signs (N,) of the tangents' determinants, 0 where there is no answer.
    """
    joints, m = sources.shape[1], sources.shape[3]
    pushed, displaced = pushes.shape[3] > 0, lower.shape[3] > 0
    axes, turned = np.empty((joints, 6, 6)), np.empty((joints, 3, 3))
    shifted, wrenches = np.empty((joints, 3)), np.empty((joints, 6))
    slopes = np.empty((joints, 3, 6))
    rows, matrix = np.empty((6, 6)), np.empty((6, 6))
    gains = np.empty((joints, 6, 6 + m))  # u = gains (xi, 1)
    beyond, slope = np.empty(6), np.empty((3, 6))
    passed, twist = np.empty((6, m)), np.empty((6, m))
    for lane in range(len(q)):
        _set_up(chains, loads, lane, q[lane], axes, turned, shifted, wrenches, slopes)
        beyond[:] = 0.0
        slope[:] = 0.0
        passed[:] = 0.0
        sign = 1
        for j in range(joints - 1, -1, -1):
            right = gains[j]
            for i in range(6):
                beyond[i] += wrenches[j, i]
                for r in range(3):
                    slope[r, i] += slopes[j, r, i]
            if pushed:
                passed += pushes[lane, j]
            if displaced:
                _add_product(slope, upper[lane, j], passed)
            _balance(axes[j], tangents[lane, j], beyond, slope, rows, matrix, right)
            for k in range(6):
                applied = 0.0
                if loaded:
                    for i in range(6):
                        applied += axes[j, k, i] * beyond[i]
                for c in range(m):
                    right[k, 6 + c] = sources[lane, j, k, c] + applied
            _add_product(axes[j], passed, right[:, 6:])
            sign *= _eliminate(matrix, right)
            if sign == 0:
                break
            _hand_down(axes[j], right, slope, passed)
            if displaced:
                _add_product(slope, lower[lane, j], passed)
        signs[lane] = sign
        rates[lane] = 0.0
        if sign == 0:
            continue
        twist[:] = 0.0
        for j in range(joints):
            if displaced:
                twist += lower[lane, j]
            for k in range(6):
                for c in range(m):
                    rates[lane, j, k, c] = gains[j, k, 6 + c]
            _add_product(gains[j, :, :6], twist, rates[lane, j])
            _add_product(axes[j].T, rates[lane, j], twist)
            if displaced:
                twist += upper[lane, j]


@compiled
def _survey(
    axes: Array, tangents: Array, wrenches: Array, slopes: Array, rows: Array, blocks: Array
) -> None:
    """C and D of each joint, (J, 6, 6); slopes become sums over each vertebra and those beyond."""
    joints = len(axes)
    beyond = np.zeros(6)
    for j in range(joints - 1, -1, -1):
        s = axes[j]
        for r in range(6):
            beyond[r] += wrenches[j, r]
        if j + 1 < joints:
            for r in range(3):
                for c in range(6):
                    slopes[j, r, c] += slopes[j + 1, r, c]
        _turning_rows(s, beyond, rows[j])
        for k in range(6):
            for c in range(6):
                value = tangents[j, k, c]
                if c < k:
                    for i in range(6):
                        value -= rows[j, k, i] * s[c, i]
                blocks[j, k, c] = value


class Survey(NamedTuple):
    """N lanes at one pose each: what the tangents and the mass matrices are made of.

    Attributes
    ----------
    axes : (N, J, 6, 6) twist of each coordinate, by row.
    rows, blocks : (N, J, 6, 6) C and D. slopes : (N, J, 3, 6) sum of L_b over vertebrae beyond.
    inertia : (N, J, 6, 6) of each vertebra by its twist.
    turned, shifted : (N, J, 3, 3) and (N, J, 3) displacement of each vertebra.
    """

    axes: Array
    rows: Array
    blocks: Array
    slopes: Array
    inertia: Array
    turned: Array
    shifted: Array


@compiled
def _weigh(
    turned: Array, shifted: Array, mass: float, com: Array, inertia: Array, found: Array
) -> None:
    """Inertia (6, 6) of a vertebra by its twist, about the origin of ground."""
    centre = np.empty(3)
    turned_into(turned, com, centre)
    square = 0.0
    for r in range(3):
        centre[r] += shifted[r]
        square += centre[r] * centre[r]
    for r in range(3):
        for c in range(3):
            value = -mass * centre[r] * centre[c]
            for i in range(3):
                for k in range(3):
                    value += turned[r, i] * inertia[i, k] * turned[c, k]
            found[r, c] = value
            found[3 + r, 3 + c] = mass if r == c else 0.0
            found[r, 3 + c] = 0.0
        found[r, r] += mass * square
    found[0, 4], found[1, 3] = -mass * centre[2], mass * centre[2]
    found[0, 5], found[2, 3] = mass * centre[1], -mass * centre[1]
    found[1, 5], found[2, 4] = -mass * centre[0], mass * centre[0]
    for r in range(3):
        for c in range(3):
            found[3 + c, r] = found[r, 3 + c]


@compiled
def _surveyed(chains: Chains, loads: Loads, q: Array, tangents: Array, found: Survey) -> None:
    wrenches = np.empty((q.shape[1], 6))
    for lane in range(len(q)):
        axes, slopes = found.axes[lane], found.slopes[lane]
        turned, shifted = found.turned[lane], found.shifted[lane]
        _set_up(chains, loads, lane, q[lane], axes, turned, shifted, wrenches, slopes)
        _survey(axes, tangents[lane], wrenches, slopes, found.rows[lane], found.blocks[lane])
        chain = loads.chain[lane]
        for b in range(q.shape[1]):
            mass, com, inertia = (
                chains.masses[chain, b],
                chains.coms[chain, b],
                chains.inertias[chain, b],
            )
            _weigh(turned[b], shifted[b], mass, com, inertia, found.inertia[lane, b])


def surveyed(chains: Chains, loads: Loads, q: Array, tangents: Array) -> Survey:
    """Lanes at q (N, J, 6) with the joints' tangents (N, J, 6, 6)."""
    lanes = q.shape[:2]
    shapes = ((6, 6), (6, 6), (6, 6), (3, 6), (6, 6), (3, 3), (3,))
    found = Survey(*(np.empty((*lanes, *shape)) for shape in shapes))
    _surveyed(chains, loads, q, tangents, found)
    return found
