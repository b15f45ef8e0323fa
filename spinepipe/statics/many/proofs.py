"""Forms of many equilibria that decide their stability, in compiled loops; see `stability`.

K = S + A is the tangent in its symmetric and skew parts, M the mass matrix; where damping is one.
A form in the rates of all joints is a sum over joints. The least of what those beyond a joint add
is a form in the twist above it, so that one small Cholesky factor per joint decides.

Nothing here calls another compiled file: what is kept of a compilation hangs on its own file alone.
"""

import numpy as np
from numpy.typing import NDArray

from spinepipe.effects.contract import Array
from spinepipe.statics.many.survey import Plain, compiled

Flags = NDArray[np.bool_]


@compiled
def _cholesky(matrix: Array) -> bool:
    """Lower factor of a symmetric matrix in place; whether it is positive definite."""
    n = len(matrix)
    for k in range(n):
        pivot = matrix[k, k]
        for i in range(k):
            pivot -= matrix[k, i] * matrix[k, i]
        if not pivot > 0.0:
            return False
        root = np.sqrt(pivot)
        matrix[k, k] = root
        for r in range(k + 1, n):
            value = matrix[r, k]
            for i in range(k):
                value -= matrix[r, i] * matrix[k, i]
            matrix[r, k] = value / root
    return True


@compiled
def _skew(
    axes: Array, rows: Array, blocks: Array, slope: Array, towards: Array, own: Array
) -> None:
    """A of a joint: (6, 6) by the twist below, which is that of all earlier axes; and its block."""
    pulled = np.empty((6, 3))  # moment by the motion along each axis
    for k in range(6):
        for r in range(3):
            value = 0.0
            for i in range(6):
                value += slope[r, i] * axes[k, i]
            pulled[k, r] = value
    for k in range(6):
        for c in range(6):
            value, bend = rows[k, c], blocks[k, c] - blocks[c, k]
            for r in range(3):
                value += axes[k, r] * slope[r, c]
                bend += axes[c, r] * pulled[k, r] - axes[k, r] * pulled[c, r]
            if c < 3:
                value -= pulled[k, c]
            towards[k, c] = -0.5 * value
            own[k, c] = 0.5 * bend


@compiled
def _twist(axes: Array, rows: Array, blocks: Array, slopes: Array, damping: Array) -> float:
    """|A|^2 or more: half the squares of the tangent's skew part, where damping is one."""
    total = 0.0
    gram = np.zeros((6, 6))  # of the axes of earlier joints
    towards, own = np.empty((6, 6)), np.empty((6, 6))
    for j in range(len(axes)):
        s = axes[j]
        _skew(s, rows[j], blocks[j], slopes[j], towards, own)
        for k in range(6):
            square = 0.0
            for r in range(6):
                value = 0.0
                for c in range(6):
                    value += gram[r, c] * towards[k, c]
                square += towards[k, r] * value
            total += square / damping[j, k]
            for c in range(k):
                total += own[k, c] * own[k, c] / (damping[j, k] * damping[j, c])
        for k in range(6):
            for r in range(6):
                f = s[k, r] / damping[j, k]
                for c in range(6):
                    gram[r, c] += f * s[k, c]
    return total


@compiled
def twists(seen: Plain, damping: Array, found: Array) -> None:
    """Fill (N,): no less than |A|^2; damping (N, J, 6)."""
    axes, _, rows, blocks, slopes, _, _ = seen
    for lane in range(len(found)):
        found[lane] = _twist(axes[lane], rows[lane], blocks[lane], slopes[lane], damping[lane])


@compiled
def _add_bodies(
    least: Array, slopes: Array, inertia: Array, j: int, square: float, at: int
) -> None:
    """Add a vertebra to the form in the twist above its joint: its loads, and its inertia."""
    for r in range(3):
        for c in range(6):
            bend = 0.5 * slopes[j, r, c]
            if j + 1 < len(slopes):
                bend -= 0.5 * slopes[j + 1, r, c]
            least[at + r, at + c] -= bend
            least[at + c, at + r] -= bend
    for r in range(6):
        for c in range(6):
            least[at + r, at + c] -= square * inertia[j, r, c]


@compiled
def _least_beyond(pivot: Array, cross: Array, least: Array, axes: Array, joined: Array) -> bool:
    """One joint off a form in all joints' rates; False where that form is not positive.

    Parameters
    ----------
    pivot, cross : (k, k) of the joint's own rates, and of these with the twist below; k is 6, or 12
        for real and imaginary parts.
    least : (k, k) the least of the form beyond by the twist above, made that by the twist below.
    joined : (k, k) work space.
    """
    size = len(pivot)
    for half in range(size // 6):
        for r in range(size):
            for k in range(6):
                value = 0.0
                for c in range(6):
                    value += axes[k, c] * least[6 * half + c, r]
                joined[6 * half + k, r] = value
    for half in range(size // 6):
        for r in range(size):
            for k in range(6):
                value = 0.0
                for c in range(6):
                    value += joined[r, 6 * half + c] * axes[k, c]
                pivot[r, 6 * half + k] += value
    if not _cholesky(pivot):
        return False
    for k in range(size):
        for c in range(size):
            value = cross[k, c] + joined[k, c]
            for i in range(k):
                value -= pivot[k, i] * cross[i, c]
            cross[k, c] = value / pivot[k, k]
    for k in range(size):
        for r in range(size):
            for c in range(size):
                least[r, c] -= cross[k, r] * cross[k, c]
    return True


@compiled
def apart(
    seen: Plain,
    inertia: Array,
    damping: Array,
    low: Array,
    high: Array,
    weight: Array,
    proven: Flags,
) -> None:
    """Fill (N,): whether S - high^2 M + weight (low - i A) is positive definite.

    Parameters
    ----------
    inertia : (N, J, 6, 6) of each vertebra by its twist. damping : (N, J, 6).
    low, high, weight : (N,); without weight the form is real.
    """
    every_axes, _, every_rows, every_blocks, every_slopes, _, _ = seen
    joints = every_axes.shape[1]
    towards, own = np.empty((6, 6)), np.empty((6, 6))
    for lane in range(len(proven)):
        w = weight[lane]
        size = 12 if w > 0.0 else 6
        pivot, cross = np.zeros((size, size)), np.zeros((size, size))
        least, joined = np.zeros((size, size)), np.empty((size, size))
        slopes = every_slopes[lane]
        proven[lane] = True
        for j in range(joints - 1, -1, -1):
            axes, rows, blocks = every_axes[lane, j], every_rows[lane, j], every_blocks[lane, j]
            for at in range(0, size, 6):
                _add_bodies(least, slopes, inertia[lane], j, high[lane] ** 2, at)
                for r in range(6):
                    for c in range(6):
                        pivot[at + r, at + c] = 0.5 * (blocks[r, c] + blocks[c, r])
                        cross[at + r, at + c] = -0.5 * rows[r, c]
                    pivot[at + r, at + r] += w * low[lane] * damping[lane, j, r]
            if size == 12:
                _skew(axes, rows, blocks, slopes[j], towards, own)
                for r in range(6):
                    for c in range(6):
                        pivot[6 + r, c], pivot[r, 6 + c] = w * own[r, c], w * own[c, r]
                        cross[6 + r, c], cross[r, 6 + c] = w * towards[r, c], -w * towards[r, c]
            if not _least_beyond(pivot, cross, least, axes, joined):
                proven[lane] = False
                break
