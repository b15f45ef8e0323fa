"""How chains of joints answer small changes: one 6 x 6 elimination per joint, in compiled loops.

With rates u_j of joint j the twists (see `survey`) are

    xi_j = xi_(j-1) + a_j + S_j u_j + b_j,

where a_j and b_j are displacements of its lower and upper frame, zero but for derivatives by joint
poses. With w_b a change of the wrench on vertebra b, the loads of joint j balance to first order
where

    D_j u_j - C_j (xi_(j-1) + a_j) - S_j' sum_(b>=j) (L_b xi_b + w_b) = rho_j,

but for coordinates that a rig fixes: these have u = 0 whatever is missing there.

What hangs on the twist below a joint is carried down from the top, as for articulated bodies
(Featherstone 2008, doi 10.1007/978-1-4899-7560-7): time grows with the number of joints, not with
its cube.

Nothing here calls another compiled file: what is kept of a compilation hangs on its own file alone.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from spinepipe.effects.contract import Array, Indices
from spinepipe.statics.many.survey import Plain, Survey, compiled

Flags = NDArray[np.bool_]

NONE = np.zeros((0, 0, 0, 0))

POSITIVE = 2
"""Sign of a tangent that is positive as far as its elimination tells."""


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
def _holds(matrix: Array, lower: Array) -> bool:
    """Whether a matrix (6, 6) has a positive symmetric part: it has a Cholesky factor ``lower``."""
    for k in range(6):
        pivot = matrix[k, k]
        for i in range(k):
            pivot -= lower[k, i] * lower[k, i]
        if not pivot > 0.0:
            return False
        inverse = 1.0 / np.sqrt(pivot)
        for r in range(k + 1, 6):
            value = 0.5 * (matrix[r, k] + matrix[k, r])
            for i in range(k):
                value -= lower[r, i] * lower[k, i]
            lower[r, k] = value * inverse
    return True


@compiled
def _below(
    axes: Array, rows: Array, blocks: Array, slope: Array, matrix: Array, right: Array
) -> None:
    """A joint's matrix (6, 6) of u, and how the twist below enters, (6, 6) of the right side."""
    for k in range(6):
        for c in range(6):
            right[k, c] = 0.0
            for r in range(3):
                right[k, c] += axes[k, r] * slope[r, c]
    for k in range(6):
        for c in range(6):
            value = blocks[k, c]
            if k > 2:
                for i in range(6):
                    value -= right[k, i] * axes[c, i]
            matrix[k, c] = value
    for k in range(6):
        for c in range(6):
            right[k, c] += rows[k, c]


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
    if vectors.shape[1] == 1:  # of Newton's steps: a loop of one turn would cost more than its sum
        for r in range(matrix.shape[0]):
            value = out[r, 0]
            for k in range(matrix.shape[1]):
                value += matrix[r, k] * vectors[k, 0]
            out[r, 0] = value
        return
    for r in range(matrix.shape[0]):
        for k in range(matrix.shape[1]):
            f = matrix[r, k]
            for c in range(vectors.shape[1]):
                out[r, c] += f * vectors[k, c]


@compiled
def _add(values: Array, out: Array) -> None:
    """Add values (r, m) to out (r, m)."""
    for r in range(values.shape[0]):
        for c in range(values.shape[1]):
            out[r, c] += values[r, c]


@compiled
def _hold(fixed: Flags, matrix: Array, right: Array) -> None:
    """Make rows of fixed coordinates (6,) say that these do not move, and others not ask."""
    for k in range(6):
        if fixed[k]:
            matrix[k] = 0.0
            matrix[:, k] = 0.0
            matrix[k, k] = 1.0
            right[k] = 0.0


@compiled
def _carry(
    seen: Plain, fixed: Flags, changes: Plain, asked: bool, rates: Array, signs: Indices
) -> None:
    """Fill rates (N, J, 6, m) and the signs (N,), see `eliminated`."""
    every_axes, _, rows, blocks, every_slopes, _, _ = seen
    sources, pushes, lower, upper = changes
    joints, m = sources.shape[1], sources.shape[3]
    pushed, displaced, held = pushes.shape[3] > 0, lower.shape[3] > 0, len(fixed) > 0
    matrix, gains = np.empty((6, 6)), np.empty((joints, 6, 6 + m))  # u = gains (xi, 1)
    slope, passed, twist = np.empty((3, 6)), np.empty((6, m)), np.empty((6, m))
    root = np.empty((6, 6))
    for lane in range(len(sources)):
        axes, slopes = every_axes[lane], every_slopes[lane]
        slope[:] = 0.0
        passed[:] = 0.0
        sign, positive = 1, asked
        for j in range(joints - 1, -1, -1):
            right = gains[j]
            for r in range(3):
                for i in range(6):
                    slope[r, i] += slopes[j, r, i]
                    if j + 1 < joints:
                        slope[r, i] -= slopes[j + 1, r, i]
            if pushed:
                _add(pushes[lane, j], passed)
            if displaced:
                _add_product(slope, upper[lane, j], passed)
            _below(axes[j], rows[lane, j], blocks[lane, j], slope, matrix, right)
            for k in range(6):
                for c in range(m):
                    right[k, 6 + c] = sources[lane, j, k, c]
            _add_product(axes[j], passed, right[:, 6:])
            if held:
                _hold(fixed[lane, j], matrix, right)
            positive = positive and _holds(matrix, root)
            sign *= _eliminate(matrix, right)
            if sign == 0:
                break
            _hand_down(axes[j], right, slope, passed)
            if displaced:
                _add_product(slope, lower[lane, j], passed)
        signs[lane] = POSITIVE if positive else sign
        rates[lane] = 0.0
        if sign == 0:
            continue
        twist[:] = 0.0
        for j in range(joints):
            if displaced:
                _add(lower[lane, j], twist)
            for k in range(6):
                for c in range(m):
                    rates[lane, j, k, c] = gains[j, k, 6 + c]
            _add_product(gains[j, :, :6], twist, rates[lane, j])
            _add_product(axes[j].T, rates[lane, j], twist)
            if displaced:
                _add(upper[lane, j], twist)


def missing(seen: Survey, rates: Array, pushes: Array = NONE) -> Array:
    """(N, J, 6, m) load that is missing on each axis when the joints move at rates (N, J, 6, m).

    What `answers` takes for its sources, found from the rates: on coordinates that are fixed, what
    holds them has to make up for it. ``pushes`` (N, J, 6, m) w, or none.
    """
    twists = np.cumsum(seen.axes.swapaxes(2, 3) @ rates, axis=1)
    below = np.concatenate([np.zeros_like(twists[:, :1]), twists[:, :-1]], axis=1)
    slopes = seen.slopes.copy()
    slopes[:, :-1] -= seen.slopes[:, 1:]
    changes = np.zeros(twists.shape)
    changes[:, :, :3] = slopes @ twists
    if pushes.shape[3]:
        changes += pushes
    beyond = np.cumsum(changes[:, ::-1], axis=1)[:, ::-1]
    found: Array = seen.blocks @ rates - seen.rows @ below - seen.axes @ beyond
    return found


def eliminated(seen: Survey, changes: Changes, asked: bool = False) -> tuple[Array, Indices]:
    """Rates (N, J, 6, m) that answer the changes, zero where there is no answer; and signs (N,).

    A sign is that of the tangent's determinant, 0 where there is no answer. Where ``asked``, it is
    `POSITIVE` if each joint's own matrix has a positive symmetric part: so has every one of them
    where the whole tangent's is positive (Schur complements), and without constant moments only
    there.
    """
    rates, signs = np.empty(changes.sources.shape), np.empty(len(changes.sources), dtype=np.int64)
    _carry(seen.numbers, seen.fixed, tuple(changes), asked, rates, signs)
    lost = (signs == 0) | ~np.isfinite(rates).all(axis=(1, 2, 3))
    if lost.any():
        rates[lost], signs[lost] = 0.0, 0
    return rates, signs


def answers(seen: Survey, changes: Changes) -> tuple[Array, Flags]:
    """Rates (N, J, 6, m) that answer the changes, zero where there is no answer; where there is."""
    rates, signs = eliminated(seen, changes)
    return rates, signs != 0
