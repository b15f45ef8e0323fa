"""Damped steps of inverse kinematics in a time that grows with the number of joints.

Markers are to a step what point masses are to accelerations: the sum of their squared distances
after it is a quadratic form of the bodies' twists, and each coordinate's own cost is a rotor's
inertia at its joint. So Featherstone's articulated-body algorithm (2008, chapter 7) finds the step
that the normal equations of all 108 coordinates have, which need not be made.
"""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from spinepipe.effects.contract import Array
from spinepipe.motion.points import chain

_AXES = 6
"""Coordinates of a joint, and numbers of a twist."""


@njit(cache=True)
def damped_steps(
    q: Array,
    turned: Array,
    apart: Array,
    body: NDArray[np.int64],
    on_body: Array,
    seen: Array,
    worth: Array,
    free: NDArray[np.bool_],
    curved: Array,
    pulled: Array,
    damping: Array,
    ridge: float,
    found: Array,
) -> None:
    """Levenberg and Marquardt's steps (F, 18, 6) of postures q (F, 18, 6), which are written.

    Parameters
    ----------
    turned, apart : joints (`points.joints_of`). body, on_body : (K,) and (K, 3) m of markers.
    seen, worth : (F, K, 3) m where markers were, and (F, K) what a square metre off costs.
    free : (18, 6). curved, pulled : (F, 18, 6) what coordinates cost by themselves: curvature and
        slope. damping : (F,) shares of the diagonal. ridge : what is added to it, as a share of its
        largest and at least.
    """
    bodies = len(turned)
    turns, origins, axes = np.empty((bodies, 3, 3)), np.empty((bodies, 3)), np.empty((bodies, 6, 3))
    twists = np.empty((bodies, _AXES, _AXES))  # of each coordinate: turn, then speed at the origin
    inertia, whole = np.empty((bodies, _AXES, _AXES)), np.empty((_AXES, _AXES))
    force, diagonal = np.empty((bodies, _AXES)), np.empty((bodies, _AXES))
    lower, through = np.empty((bodies, _AXES, _AXES)), np.empty((bodies, _AXES, _AXES))
    rest, moved, p, row = np.empty((bodies, _AXES)), np.empty(_AXES), np.empty(3), np.empty(_AXES)
    for f in range(len(q)):
        chain(q[f], turned, apart, turns, origins, axes)
        for b in range(bodies):
            o = origins[b]
            for j in range(_AXES):
                force[b, j] = 0.0
                for r in range(_AXES):
                    inertia[b, j, r] = twists[b, j, r] = 0.0
            for j in range(3):
                w = axes[b, 3 + j]
                for i in range(3):
                    if free[b, j]:
                        twists[b, j, 3 + i] = axes[b, j, i]
                    if free[b, 3 + j]:
                        y, z = (i + 1) % 3, (i + 2) % 3
                        twists[b, 3 + j, i] = w[i]
                        twists[b, 3 + j, 3 + i] = o[y] * w[z] - o[z] * w[y]
        # each marker a point mass on its body, off its place by as much
        for k in range(len(body)):
            b, mass = body[k], worth[f, k]
            for i in range(3):
                p[i] = origins[b, i]
                for j in range(3):
                    p[i] += turns[b, i, j] * on_body[k, j]
            for i in range(3):
                # row i of the speed at p that a twist (w, v) makes: v + w x p
                for r in range(_AXES):
                    row[r] = 1.0 if r == 3 + i else 0.0
                row[(i + 1) % 3], row[(i + 2) % 3] = p[(i + 2) % 3], -p[(i + 1) % 3]
                off = mass * (p[i] - seen[f, k, i])
                for r in range(_AXES):
                    force[b, r] += row[r] * off
                    for s in range(_AXES):
                        inertia[b, r, s] += mass * row[r] * row[s]
        # diagonal of the normal equations: composite inertias from the top down
        largest = 0.0
        for b in range(bodies - 1, -1, -1):
            for r in range(_AXES):
                for s in range(_AXES):
                    whole[r, s] = inertia[b, r, s] + (whole[r, s] if b < bodies - 1 else 0.0)
            for j in range(_AXES):
                diagonal[b, j] = 0.0
                if free[b, j]:
                    diagonal[b, j] = curved[f, b, j]
                    for r in range(_AXES):
                        for s in range(_AXES):
                            diagonal[b, j] += twists[b, j, r] * whole[r, s] * twists[b, j, s]
                largest = max(largest, diagonal[b, j])
        least = max(ridge * largest, ridge)
        # from the top down: what all above a joint does to it once it has given way at its best
        for b in range(bodies - 1, -1, -1):
            own, low, half = inertia[b], lower[b], through[b]
            for j in range(_AXES):
                for r in range(_AXES):
                    half[j, r] = 0.0
                    for s in range(_AXES):
                        half[j, r] += twists[b, j, s] * own[s, r]
                rest[b, j] = pulled[f, b, j] if free[b, j] else 0.0
                for r in range(_AXES):
                    rest[b, j] += twists[b, j, r] * force[b, r]
            # Cholesky factor of the joint's own matrix, and its inverse times what hangs on it
            for j in range(_AXES):
                for i in range(j + 1):
                    total = 0.0
                    for r in range(_AXES):
                        total += half[j, r] * twists[b, i, r]
                    if i == j:
                        grown = damping[f] * diagonal[b, j] + least
                        total += curved[f, b, j] + grown if free[b, j] else 1.0
                    for r in range(i):
                        total -= low[j, r] * low[i, r]
                    low[j, i] = np.sqrt(total) if i == j else total / low[i, i]
            for j in range(_AXES):
                for i in range(j):
                    rest[b, j] -= low[j, i] * rest[b, i]
                    for r in range(_AXES):
                        half[j, r] -= low[j, i] * half[i, r]
                rest[b, j] /= low[j, j]
                for r in range(_AXES):
                    half[j, r] /= low[j, j]
            if b == 0:
                break
            for r in range(_AXES):
                force[b - 1, r] += force[b, r]
                for j in range(_AXES):
                    force[b - 1, r] -= half[j, r] * rest[b, j]
                for s in range(_AXES):
                    inertia[b - 1, r, s] += own[r, s]
                    for j in range(_AXES):
                        inertia[b - 1, r, s] -= half[j, r] * half[j, s]
        # from the pelvis up: each joint moves as it gives way to what moves below it
        for r in range(_AXES):
            moved[r] = 0.0
        for b in range(bodies):
            step = found[f, b]
            for j in range(_AXES - 1, -1, -1):
                step[j] = -rest[b, j]
                for r in range(_AXES):
                    step[j] -= through[b, j, r] * moved[r]
                for i in range(j + 1, _AXES):
                    step[j] -= lower[b, i, j] * step[i]
                step[j] /= lower[b, j, j]
            for j in range(_AXES):
                for r in range(_AXES):
                    moved[r] += twists[b, j, r] * step[j]
