"""How chains of joints answer small changes: one 6 x 6 elimination per joint, in compiled loops.

The tangent of a chain is solved as the articulated-body algorithm solves for accelerations: load
slopes stand in place of inertias. With rates u_j of joint j the twists (see `forward_kinematics`)
are

    xi_j = xi_(j-1) + a_j + S_j u_j + b_j,

where a_j and b_j are displacements of its lower and upper frame, zero but for derivatives by joint
poses. With w_b a change of the wrench on vertebra b, the loads of joint j balance to first order
where

    D_j u_j - C_j (xi_(j-1) + a_j) - S_j' sum_(b>=j) (L_b xi_b + w_b) = rho_j,

but for coordinates that a rig fixes: these have u = 0 whatever is missing there.

What hangs on the twist below a joint is carried down from the top, as for articulated bodies
(Featherstone 2008, doi 10.1007/978-1-4899-7560-7): time grows with the number of joints, not with
its cube.

Rows are eliminated in their order, four lanes side by side (`vectors`); the few lanes whose pivots
look bad go through the whole matrix with pivoting.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from spinepipe.effects.contract import Array, Indices
from spinepipe.statics.batched.dynamics import tangents_of
from spinepipe.statics.batched.forward_kinematics import KinematicsAndLoads, flat
from spinepipe.statics.batched.vectors import (
    WIDTH,
    Plain,
    add_product,
    compiled,
    gather,
    inner,
    scatter,
    vectors,
)

Flags = NDArray[np.bool_]

NONE, EMPTY = np.zeros((0, 0, 0, 0)), np.zeros((0, 0))

POSITIVE, BAD = 2, 3
"""Signs of a tangent that is positive as far as its elimination tells, and of one that needs its
rows in another order."""

LEAST_PIVOT = 1e-4
"""A pivot that elimination makes so many times smaller or larger has cost four of sixteen digits.
Those of a tangent with a positive symmetric part do so at the verge of instability alone."""


class Changes(NamedTuple):
    """m changes of each of N lanes.

    Attributes
    ----------
    sources : (N, J, 6, m) rho, load that is missing on each axis.
    pushes : (N, J, 6, m) w, or with m = 0 none. lower, upper : (N, J, 6, m) a and b, or none.
    """

    sources: Array
    pushes: Array = NONE
    lower: Array = NONE
    upper: Array = NONE


@inner
def _eliminate(matrix: Array, right: Array, pivots: Array) -> None:
    """Gauss: solve a (6, 6) for the right-hand sides (6, m) in place, rows in their order.

    ``pivots`` (2, 6) are filled with the diagonal as it was and as it is divided by.
    """
    m = right.shape[1]
    for k in range(6):
        pivots[0, k] = matrix[k, k]
    for k in range(6):
        pivots[1, k] = matrix[k, k]
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
            value = right[k, c]
            for i in range(k + 1, 6):
                value -= matrix[k, i] * right[i, c]
            right[k, c] = value * inverse


@inner
def _symmetric_pivots(matrix: Array, lower: Array, pivots: Array) -> None:
    """Pivots (6,) of the symmetric part of a matrix (6, 6): L D L', with L D in ``lower``.

    It is positive definite where all of them are positive (Sylvester's law of inertia).
    """
    for k in range(6):
        pivot = matrix[k, k]
        for i in range(k):
            pivot -= lower[k, i] * lower[k, i] / pivots[i]
        pivots[k] = pivot
        for r in range(k + 1, 6):
            value = 0.5 * (matrix[r, k] + matrix[k, r])
            for i in range(k):
                value -= lower[r, i] * lower[k, i] / pivots[i]
            lower[r, k] = value


@inner
def _joint_equations(
    axes: Array, rows: Array, stiff: Array, slope: Array, matrix: Array, right: Array
) -> None:
    """A joint's matrix (6, 6) of u, and how the twist below enters, (6, 6) of the right side."""
    right[:, :6] = 0.0
    add_product(axes[:, :3], slope, right[:, :6])
    for k in range(6):
        for c in range(6):
            value = stiff[k, c]
            if k > 2:  # a translation's axis has no moment
                for i in range(6):
                    value -= right[k, i] * axes[c, i]
            matrix[k, c] = value
    for k in range(6):
        for c in range(6):
            right[k, c] += rows[k, c]


@inner
def _condense(axes: Array, right: Array, slope: Array, passed: Array, along: Array) -> None:
    """Make slope (3, 6) and passed (3, m) those of all that hangs on the twist below the joint.

    The joint's rates are put in, u = gains (xi, 1): the articulated body's step to its parent.
    """
    along[:] = 0.0
    add_product(slope, axes.T, along)
    add_product(along, right[:, :6], slope)
    add_product(along, right[:, 6:], passed[:3])


@inner
def _add(values: Array, out: Array) -> None:
    """Add values (r, m) to out (r, m)."""
    for r in range(values.shape[0]):
        for c in range(values.shape[1]):
            out[r, c] += values[r, c]


@inner
def _fix(free: Array, matrix: Array, right: Array) -> None:
    """Make rows of fixed coordinates say that these do not move, and others not ask.

    ``free`` (6,) is one where a coordinate moves and zero elsewhere.
    """
    for k in range(6):
        for c in range(6):
            matrix[k, c] *= free[k] * free[c]
        matrix[k, k] += 1.0 - free[k]  # 1 u = 0
        for c in range(right.shape[1]):
            right[k, c] *= free[k]


@inner
def _signs(
    pivots: Array, halves: Array, asked: bool, lost: Array, first: int, signs: Indices
) -> bool:
    """Enter the signs of a block from its pivots (J, 2, 6, 4) and those of symmetric parts.

    ``lost`` (4,) is not zero where rates are not finite. Whether all is well with them.
    """
    well = True
    # sign of the determinant: of the product of all pivots, rows staying in their order
    for lane in range(min(WIDTH, len(signs) - first)):
        sign, positive, bad = 1, asked, lost[lane] != 0.0
        for j in range(len(pivots)):
            for k in range(6):
                pivot, before = pivots[j, 1, k, lane], abs(pivots[j, 0, k, lane])
                size = abs(pivot)
                bad = bad or not (size >= LEAST_PIVOT * before and LEAST_PIVOT * size <= before)
                sign = -sign if pivot < 0.0 else sign
                positive = positive and halves[j, k, lane] > 0.0
        signs[first + lane] = BAD if bad else (POSITIVE if positive else sign)
        well = well and not bad
    return well


@compiled
def _solve_chains(
    seen: Plain, free: Array, changes: Plain, asked: bool, rates: Array, signs: Indices
) -> bool:
    """Fill rates (N, n) and the signs (N,), see `eliminate`; whether no sign is `BAD`.

    Parameters
    ----------
    changes : sources (N, n), with n = 6 J m; pushes, lower, upper likewise or (0, 0). free : (N,
        6 J) one where a coordinate moves and zero elsewhere, or none.
    """
    every_axes, _, every_rows, every_stiff, every_slopes, _, _ = seen
    joints, own = every_axes.shape[1], np.arange(len(changes[0]))
    m = changes[0].shape[1] // (6 * joints)
    pushed, displaced, held = len(changes[1]) > 0, len(changes[2]) > 0, len(free) > 0
    given, move = np.empty((4, 6 * joints * m, WIDTH)), np.empty((6 * joints, WIDTH))
    every, moves = vectors(given).reshape((4, joints, 6, m)), vectors(move).reshape((joints, 6))
    source, push, low, high = every[0], every[1], every[2], every[3]
    found = np.empty((6 * joints * m, WIDTH))
    rate = vectors(found).reshape((joints, 6, m))
    gains = vectors(np.empty((joints, 6, 6 + m, WIDTH)))  # u = gains (xi, 1)
    work = vectors(np.empty((18, 6, WIDTH)))
    matrix, root, slope, along = work[:6], work[6:12], work[12:15], work[15:]
    passed, twist = vectors(np.empty((6, m, WIDTH))), vectors(np.empty((6, m, WIDTH)))
    divided, halved = np.empty((joints, 2, 6, WIDTH)), np.empty((joints, 6, WIDTH))
    pivots, halves, strayed, well = vectors(divided), vectors(halved), np.empty((1, WIDTH)), True
    lost = vectors(strayed)
    for block in range(len(every_axes)):
        first = WIDTH * block
        axes, slopes = vectors(every_axes[block]), vectors(every_slopes[block])
        rows, stiff = vectors(every_rows[block]), vectors(every_stiff[block])
        for n, one in enumerate(changes):
            if len(one):
                gather(one, own, first, given[n])
        if held:
            gather(free, own, first, move)
        # from the top down: each joint's rates in terms of the twist below it
        slope[:] = 0.0
        passed[:] = 0.0
        for j in range(joints - 1, -1, -1):
            right = gains[j]
            # slopes are sums over all vertebrae beyond: the difference is this vertebra's own
            for r in range(3):
                for i in range(6):
                    slope[r, i] += slopes[j, r, i]
                    if j + 1 < joints:
                        slope[r, i] -= slopes[j + 1, r, i]
            if pushed:
                _add(push[j], passed)
            if displaced:
                add_product(slope, high[j], passed[:3])
            _joint_equations(axes[j], rows[j], stiff[j], slope, matrix, right)
            for k in range(6):
                for c in range(m):
                    right[k, 6 + c] = source[j, k, c]
            add_product(axes[j], passed, right[:, 6:])
            if held:
                _fix(moves[j], matrix, right)
            if asked:
                _symmetric_pivots(matrix, root, halves[j])
            _eliminate(matrix, right, pivots[j])
            _condense(axes[j], right, slope, passed, along)
            if displaced:
                add_product(slope, low[j], passed[:3])
        # from the base up: twists, and the rates that they decide
        twist[:] = 0.0
        lost[0] = 0.0
        for j in range(joints):
            if displaced:
                _add(low[j], twist)
            for k in range(6):
                for c in range(m):
                    rate[j, k, c] = gains[j, k, 6 + c]
            add_product(gains[j, :, :6], twist, rate[j])
            for k in range(6):
                for c in range(m):  # x - x is zero unless x is infinite or no number
                    lost[0] += rate[j, k, c] - rate[j, k, c]
            add_product(axes[j].T, rate[j], twist)
            if displaced:
                _add(high[j], twist)
        scatter(found, first, rates)
        well = _signs(divided, halved, asked, strayed[0], first, signs) and well
    return well


def missing(seen: KinematicsAndLoads, rates: Array, changes: Changes) -> Array:
    """(N, J, 6, m) load that is missing on each axis when the joints move at rates (N, J, 6, m).

    Zero where the rates answer the changes, but on coordinates that are fixed: what holds these has
    to make up for it.
    """
    axes, twists = seen.axes, np.cumsum(seen.axes.swapaxes(2, 3) @ rates, axis=1)
    if changes.lower.shape[3]:
        twists += np.cumsum(changes.lower + changes.upper, axis=1)
    below = np.concatenate([np.zeros_like(twists[:, :1]), twists[:, :-1]], axis=1)
    if changes.lower.shape[3]:
        below += changes.lower
    slopes = seen.slopes.copy()
    slopes[:, :-1] -= seen.slopes[:, 1:]
    wrenches = np.zeros(twists.shape)
    wrenches[:, :, :3] = slopes @ twists
    if changes.pushes.shape[3]:
        wrenches += changes.pushes
    beyond = np.cumsum(wrenches[:, ::-1], axis=1)[:, ::-1]
    found: Array = seen.stiff @ rates - seen.rows @ below - axes @ beyond - changes.sources
    return found


def eliminate(
    seen: KinematicsAndLoads, changes: Changes, asked: bool = False
) -> tuple[Array, Indices]:
    """Rates (N, J, 6, m) that answer the changes, zero where there is no answer; and signs (N,).

    A sign is that of the tangent's determinant, 0 where there is no answer. Where ``asked``, it is
    `POSITIVE` if each joint's own matrix has a positive symmetric part: so has every one of them
    where the whole tangent's is positive (Schur complements), and without constant moments only
    there.
    """
    sources = flat(changes.sources)
    rates, signs = np.empty(sources.shape), np.empty(len(sources), dtype=np.int64)
    free = flat(np.where(seen.fixed, 0.0, 1.0)) if len(seen.fixed) else EMPTY
    pushes, lower, upper = [flat(one) if one.shape[3] else EMPTY for one in changes[1:]]
    well = _solve_chains(seen.numbers, free, (sources, pushes, lower, upper), asked, rates, signs)
    rates = rates.reshape(changes.sources.shape)
    if not well:
        bad = np.flatnonzero(signs == BAD)
        some = Changes(*[one[bad] if len(one) else one for one in changes])
        rates[bad], signs[bad] = _by_whole(seen.part(bad), some, asked)
    return rates, signs


def _by_whole(seen: KinematicsAndLoads, changes: Changes, asked: bool) -> tuple[Array, Indices]:
    """The same by the whole tangents, their rows in the order of their pivots (LAPACK)."""
    with np.errstate(invalid="ignore", over="ignore"):  # of lanes that are lost
        right = -missing(seen, np.zeros_like(changes.sources), changes)
    matrices = tangents_of(seen)
    right = right.reshape(*matrices.shape[:2], right.shape[3])
    if len(seen.fixed):
        free = ~seen.fixed.reshape(len(right), -1)
        both = free[:, :, None] & free[:, None]
        matrices, right = np.where(both, matrices, np.eye(len(free[0]))), right * free[..., None]
    rates, signs = np.zeros(right.shape), np.zeros(len(right), dtype=np.int64)
    finite = np.isfinite(matrices).all(axis=(1, 2)) & np.isfinite(right).all(axis=(1, 2))
    for lane in np.flatnonzero(finite).tolist():
        signs[lane] = np.linalg.slogdet(matrices[lane])[0]
        if signs[lane]:
            rates[lane] = np.linalg.solve(matrices[lane], right[lane])
            whole = matrices[lane] + matrices[lane].T
            if asked and np.linalg.eigvalsh(whole)[0] > 0.0:
                signs[lane] = POSITIVE
    return rates.reshape(changes.sources.shape), signs


def solve_rates(seen: KinematicsAndLoads, changes: Changes) -> tuple[Array, Flags]:
    """Rates (N, J, 6, m) that answer the changes, zero where there is no answer; where there is."""
    rates, signs = eliminate(seen, changes)
    return rates, signs != 0
