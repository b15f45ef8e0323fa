"""Forms of many equilibria that decide their stability, in compiled loops; see `stability`.

K = S + A is the tangent in its symmetric and skew parts, M the mass matrix, C the damping. The
matrix of a form in the rates of all joints is block tridiagonal once the twists of the vertebrae
stand beside the rates. It is factorised joint by joint from the top, L D L': the least of what the
joints beyond add is a form in the twist (6) above the joint, so that 6 x 6 factors, each with the 6
columns of the twist below (12 in all), decide. No matrix of the chain's size is ever made.

`is_positive_definite` does so for S - v^2 M, which is real, four lanes side by side. `respond` does
it for S - w^2 M + i w C in complex numbers as such, one lane at a time, with two more columns for
the moments to be answered. Both go through `_least_beyond`.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from spinepipe.effects.contract import Array, Indices
from spinepipe.statics.batched.vectors import (
    WIDTH,
    Plain,
    add_product,
    compiled,
    inner,
    vectors,
)

Flags = NDArray[np.bool_]
Entries = NDArray[Any]
"""Real (four lanes) or complex."""


@inner
def _skew(axes: Array, rows: Array, stiff: Array, slope: Array, skew: Plain) -> None:
    """A of a joint: (6, 6) by the twist below, which is that of all earlier axes; and its block.

    ``skew`` : both of these, and (6, 3), moment by the motion along each axis.
    """
    towards, own, pulled = skew
    pulled[:] = 0.0
    add_product(axes, slope.T, pulled)
    for k in range(6):
        for c in range(6):
            value, bend = rows[k, c], stiff[k, c] - stiff[c, k]
            for r in range(3):
                value += axes[k, r] * slope[r, c]
                bend += axes[c, r] * pulled[k, r] - axes[k, r] * pulled[c, r]
            if c < 3:
                value -= pulled[k, c]
            towards[k, c] = -0.5 * value
            own[k, c] = 0.5 * bend


@compiled
def fill_skew_bounds(seen: Plain, damping: Array, found: Array) -> None:
    """Fill blocks (B, 4): no less than |A|^2 where damping is one; damping (B, J, 6, 4).

    Half the squares of A (Frobenius): singular values of a skew matrix come in pairs, so that this
    is |A|^2 itself where there is one pair, as where a single moment is all that A is of.
    """
    every_axes, _, every_rows, every_stiff, every_slopes, _, _ = seen
    work = vectors(np.empty((24, 6, WIDTH)))
    towards, own, gram = work[:6], work[6:12], work[12:18]  # gram: of the axes of earlier joints
    skew, totals = (towards, own, work[18:21].reshape((6, 3))), vectors(found)
    for block in range(len(found)):
        axes, rows = vectors(every_axes[block]), vectors(every_rows[block])
        stiff, slopes = vectors(every_stiff[block]), vectors(every_slopes[block])
        c_of = vectors(damping[block])
        gram[:] = 0.0
        totals[block] = 0.0
        for j in range(len(axes)):
            s = axes[j]
            _skew(s, rows[j], stiff[j], slopes[j], skew)
            # squares of C^-1/2 A C^-1/2 in this joint's rows: with all earlier axes at once through
            # their Gram matrix, sum s s' / c, and with its own
            for k in range(6):
                inverse = 1.0 / c_of[j, k]
                for r in range(6):
                    value = gram[r, 0] * towards[k, 0]
                    for c in range(1, 6):
                        value += gram[r, c] * towards[k, c]
                    totals[block] += towards[k, r] * value * inverse
                for c in range(k):
                    totals[block] += own[k, c] * own[k, c] * inverse / c_of[j, c]
            for k in range(6):
                inverse = 1.0 / c_of[j, k]
                for r in range(6):
                    f = s[k, r] * inverse
                    for c in range(6):
                        gram[r, c] += f * s[k, c]


@inner
def _add_body(least: Entries, slopes: Array, inertia: Array, j: int, square: Array) -> None:
    """Add a vertebra to the form in the twist above its joint: its loads, and its inertia."""
    for r in range(3):
        for c in range(6):
            bend = 0.5 * slopes[j, r, c]
            if j + 1 < len(slopes):
                bend -= 0.5 * slopes[j + 1, r, c]
            least[r, c] -= bend
            least[c, r] -= bend
    for r in range(6):
        for c in range(6):
            least[r, c] -= square * inertia[r, c]


@inner
def _least_beyond(
    pivot: Entries, gains: Entries, least: Entries, passed: Entries, axes: Array, joined: Entries
) -> None:
    """One joint off a symmetric form in all joints' rates, real or complex.

    Parameters
    ----------
    pivot : (6, 6) of the joint's own rates, of which the upper half is made D L' of its factors.
    gains : (6, 6 + m), of these with the twist below, and load on each axis; made L^-1 of that.
    least, passed : (6, 6) the least of the form beyond by the twist above, and load (6, m) on that
        twist, made those of the twist below. joined : (6, 6) work space.
    """
    m = gains.shape[1]
    # the twist above is that below and the joint's own, xi + S' u: what hangs on it (least, passed)
    # becomes part of the joint's matrix, of its coupling to xi, and of its loads
    joined[:] = 0.0
    gains[:, 6:] = 0.0
    add_product(axes, least, joined)
    add_product(axes, passed, gains[:, 6:])
    for k in range(6):
        for r in range(6):
            gains[k, r] += joined[k, r]
        for r in range(k, 6):
            value = pivot[k, r]
            for c in range(6):
                value += joined[k, c] * axes[r, c]
            pivot[k, r] = value
    # L D L' without pivoting; each pivot's row is taken out of the form in the twist below as well
    # (Schur complement): what is left there is the least over the joint's rates
    for k in range(6):
        inverse = 1.0 / pivot[k, k]
        for r in range(k + 1, 6):
            f = pivot[k, r] * inverse
            for c in range(r, 6):
                pivot[r, c] -= f * pivot[k, c]
            for c in range(m):
                gains[r, c] -= f * gains[k, c]
        for r in range(6):
            f = gains[k, r] * inverse
            for c in range(r, 6):
                least[r, c] -= f * gains[k, c]
            for c in range(6, m):
                passed[r, c - 6] -= f * gains[k, c]
    for r in range(6):  # symmetric, not Hermitian, where complex: no conjugates anywhere
        for c in range(r):
            least[r, c] = least[c, r]


@compiled
def is_positive_definite(seen: Plain, inertia: Array, square: Array, proven: Flags) -> None:
    """Fill (N,): whether S - v^2 M is positive definite.

    Parameters
    ----------
    inertia : (B, J, 6, 6, 4) of each vertebra by its twist. square : (B, 4) v^2.
    """
    every_axes, _, every_rows, every_stiff, every_slopes, _, _ = seen
    work, divisors = vectors(np.empty((24, 6, WIDTH))), np.empty((6, WIDTH))
    pivot, gains, least, joined = work[:6], work[6:12], work[12:18], work[18:]
    passed, kept, squares = gains[:, :0], vectors(divisors), vectors(square)
    for block in range(len(every_axes)):
        axes, rows = vectors(every_axes[block]), vectors(every_rows[block])
        stiff, slopes = vectors(every_stiff[block]), vectors(every_slopes[block])
        first, inertias = WIDTH * block, vectors(inertia[block])
        width = min(WIDTH, len(proven) - first)
        proven[first : first + width] = True
        least[:] = 0.0
        for j in range(len(axes) - 1, -1, -1):
            _add_body(least, slopes, inertias[j], j, squares[block])
            for k in range(6):
                for c in range(6):
                    pivot[k, c] = 0.5 * (stiff[j, k, c] + stiff[j, c, k])
                    gains[k, c] = -0.5 * rows[j, k, c]
            _least_beyond(pivot, gains, least, passed, axes[j], joined)
            # positive definite if and only if all pivots are positive
            for k in range(6):
                kept[k] = pivot[k, k]
            for k in range(6):
                for lane in range(width):
                    proven[first + lane] &= divisors[k, lane] > 0.0


@compiled
def respond(
    seen: Plain,
    inertia: Array,
    damping: Array,
    moments: tuple[Indices, Array],
    asked: tuple[Indices, Array],
    found: Array,
    moving: Array,
) -> None:
    """How a vertebra turns under moments that swing at a rate: J H^-1 J', H = S - w^2 M + i w C.

    H has a positive imaginary part, so that its elimination needs no pivoting.

    Parameters
    ----------
    seen : axes, rows, stiff, slopes, lane by lane (N, J, ...). inertia, damping : (N, J, 6, 6) and
        (N, J, 6). moments : vertebra (N,), and two directions (N, 2, 3) of moments on it.
    asked : of K answers the lane, and w. found : (K, 2, 2), complex, filled with the turn about
        each direction by a moment about each. moving : (K,) x* M x of both motions x together.
    """
    (every_axes, every_rows, every_stiff, every_slopes), (bodies, directions) = seen, moments
    (lanes, rates), joints = asked, damping.shape[1]
    pivots, gains = np.empty((joints, 6, 6), np.complex128), np.empty((joints, 6, 8), np.complex128)
    least, joined = np.empty((6, 6), np.complex128), np.empty((6, 6), np.complex128)
    passed, twist = np.empty((6, 2), np.complex128), np.empty((6, 2), np.complex128)
    for n in range(len(lanes)):
        lane, rate = lanes[n], rates[n]
        axes, rows, stiff = every_axes[lane], every_rows[lane], every_stiff[lane]
        least[:] = 0.0
        passed[:] = 0.0
        for j in range(joints - 1, -1, -1):
            _add_body(least, every_slopes[lane], inertia[lane, j], j, rate**2)
            if j == bodies[lane]:
                for c in range(2):
                    for r in range(3):
                        passed[r, c] += directions[lane, c, r]
            for k in range(6):
                for c in range(6):
                    pivots[j, k, c] = 0.5 * (stiff[j, k, c] + stiff[j, c, k])
                    gains[j, k, c] = -0.5 * rows[j, k, c]
                pivots[j, k, k] += 1j * rate * damping[lane, j, k]
            _least_beyond(pivots[j], gains[j], least, passed, axes[j], joined)
        # back substitution from the base up: D L' u = L^-1 (load - coupling xi), then the twist
        twist[:] = 0.0
        moving[n] = 0.0
        for j in range(joints):
            for c in range(2):
                for k in range(5, -1, -1):
                    value = gains[j, k, 6 + c]
                    for i in range(6):
                        value -= gains[j, k, i] * twist[i, c]
                    for i in range(k + 1, 6):
                        value -= pivots[j, k, i] * gains[j, i, 6 + c]
                    gains[j, k, 6 + c] = value / pivots[j, k, k]
                for k in range(6):
                    for i in range(6):
                        twist[i, c] += axes[j, k, i] * gains[j, k, 6 + c]
                for r in range(6):  # x* M x is a sum of xi* I xi over the vertebrae
                    for i in range(6):
                        moving[n] += (
                            inertia[lane, j, r, i] * (twist[r, c].conjugate() * twist[i, c]).real
                        )
                if j == bodies[lane]:
                    for d in range(2):
                        found[n, d, c] = 0.0
                        for r in range(3):
                            found[n, d, c] += directions[lane, d, r] * twist[r, c]
