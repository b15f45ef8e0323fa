"""Each frame by itself: inverse kinematics, with and without ratios, springs or loads.

Levenberg-Marquardt on all frames at once, each with its own damping. What no marker tells about
stays where it was, since steps are as short as can be (a small damping); ratios between joints are
a linear map of fewer numbers to all coordinates (Christophy 2012, Bruno 2015). A frame may have
several least costs: each is sought from the postures of both its neighbours as well, and the least
is taken.
"""

from dataclasses import dataclass, replace

import numpy as np
from numba import njit
from numpy.typing import NDArray

from spinepipe.effects.contract import Array
from spinepipe.motion.objective import SHAPE, MotionObjective, SampledTrial
from spinepipe.motion.points import COUNT, forward_kinematics, joints_of, marker_places
from spinepipe.motion.residual_terms import Markers, MuscleDemand, range_excess
from spinepipe.motion.skeleton import PELVIS

MOST_STEPS = 400
SHORTEST = 1e-7
"""rad and m, largest step of the last round, or"""

SMALL = 1e-10
"""share of the cost by which it changed that."""

LOWER = 1e-6
"""share of a frame's cost by which another posture has to be better: what no marker tells, which
costs nothing, stays as it was found."""

_RIDGE = 1e-8
"""Of the largest diagonal: what is not seen does not move."""

_FIRST_DAMPING, _LEAST_DAMPING, _MOST_DAMPING = 1e-4, 1e-12, 1e8
_EASED, _GROWN = 0.2, 10.0
"""By what damping is multiplied after a step downhill, and after one uphill, which is not taken."""

_AXES = 6
"""Coordinates of a joint, and numbers of a twist."""

_AT_REST = np.array([[1.0], [0.0], [0.0]])
"""Weights of a posture alone: its place, no velocity, no acceleration."""


@dataclass(frozen=True, eq=False)
class Postures:
    """Postures of frames.

    Attributes
    ----------
    q : (F, 18, 6) m and rad. settled : (F,) whether steps became short. steps : rounds.
    """

    q: Array
    settled: Array
    steps: int


def postures(
    ask: MotionObjective,
    watched: SampledTrial,
    ratios: Array | None = None,
    most_steps: int = MOST_STEPS,
) -> Postures:
    """Postures of all nodes of a trial.

    Parameters
    ----------
    ratios : (108, n) what each of fewer numbers makes of all coordinates; None for the free
        coordinates themselves.
    """
    # the pelvis where its markers ask for it, of the others where it is out of sight, as if the
    # trunk stood as in the neutral posture
    seen = watched.weight > 0.0
    neutral = marker_places(watched.skeleton, watched.markers, np.zeros((1, *SHAPE)))[0]
    count = seen & (np.asarray(watched.markers.body) == PELVIS)
    count = np.where(count.any(axis=1)[:, None], count, seen)
    apart = (watched.places - neutral) * count[..., None]
    q = np.zeros((len(watched.places), *SHAPE))
    q[:, PELVIS, :3] = apart.sum(axis=1) / np.maximum(count.sum(axis=1), 1)[:, None]
    # the trunk as a whole first, then its joints
    alone = np.zeros(SHAPE, dtype=bool)
    alone[PELVIS] = True
    stiff = replace(ask, free=alone, loads=False, passive=None)
    q = _rounds(stiff, watched, q, None, most_steps).q
    found = _rounds(ask, watched, q, ratios, most_steps)
    return _from_neighbours(ask, watched, found, ratios, most_steps)


def _from_neighbours(
    ask: MotionObjective,
    watched: SampledTrial,
    found: Postures,
    ratios: Array | None,
    most_steps: int,
) -> Postures:
    """Each frame sought anew from where its neighbours settled, until none is better there."""
    cost, q, settled = _cost(ask, watched, found.q), found.q.copy(), found.settled.copy()
    moved = np.flatnonzero(settled)
    while len(moved):
        frames, start = np.concatenate([moved - 1, moved + 1]), np.tile(moved, 2)
        inside = (frames >= 0) & (frames < len(q))
        frames, start = frames[inside], start[inside]
        if not len(frames):
            break
        seen = watched.at(frames)
        other = _rounds(ask, seen, q[start], ratios, most_steps)
        there = _cost(ask, seen, other.q)
        better = np.flatnonzero(other.settled & (there < (1.0 - LOWER) * cost[frames]))
        better = better[np.argsort(-there[better])]  # of two, the lower one is written last
        moved = np.unique(frames[better])
        q[frames[better]], cost[frames[better]] = other.q[better], there[better]
        settled[moved] = True
    return Postures(q, settled, found.steps)


def _rounds(
    ask: MotionObjective, watched: SampledTrial, q: Array, ratios: Array | None, most_steps: int
) -> Postures:
    """Steps of each frame until they are short; each frame has its own damping."""
    damping, q = np.full(len(q), _FIRST_DAMPING), q.copy()
    cost, settled = _cost(ask, watched, q), np.zeros(len(q), dtype=bool)
    steps = 0
    while steps < most_steps and not settled.all():
        steps += 1
        left = np.flatnonzero(~settled)
        seen = watched.at(left)
        if ratios is None and not ask.loads and watched.shares is None:
            # nothing ties joints or markers together: a recursion over the joints finds the step
            move = _steps_of_joints(ask, seen, q[left], damping[left])
            there = q[left] + move.reshape(-1, *SHAPE)
        else:
            whole = np.eye(COUNT)[:, ask.free.reshape(-1)] if ratios is None else ratios
            square, down = _normal(ask, seen, q[left], whole)
            diagonal = np.einsum("fii->fi", square)
            ridge = np.maximum(_RIDGE * diagonal.max(axis=1, keepdims=True), _RIDGE)
            diagonal += damping[left, None] * diagonal + ridge
            move = np.asarray(-np.linalg.solve(square, down[..., None])[..., 0], dtype=float)
            there = q[left] + (move @ whole.T).reshape(-1, *SHAPE)
        found = _cost(ask, seen, there)
        better = found <= cost[left]
        short = np.abs(move).max(axis=1) < SHORTEST
        settled[left] = short | (better & (cost[left] - found <= SMALL * cost[left]))
        q[left[better]], cost[left[better]] = there[better], found[better]
        by = np.where(better, _EASED, _GROWN) * damping[left]
        damping[left] = np.clip(by, _LEAST_DAMPING, _MOST_DAMPING)
    return Postures(q, settled, steps)


def _cost(ask: MotionObjective, watched: SampledTrial, q: Array) -> Array:
    """(F,) of postures at rest."""
    found = np.sum(Markers(watched, ask).residuals(q) ** 2, axis=1)
    found += np.sum(range_excess(ask, q)[0] ** 2, axis=(1, 2))
    if ask.loads:
        rest = np.zeros_like(q)
        off = MuscleDemand.of(watched, ask).residuals(ask.passive, (q, rest, rest))
        return np.asarray(found + np.sum(off**2, axis=1))
    if ask.passive is not None:
        found += np.sum(_spring_loads(ask, q)[0] ** 2, axis=1)
    return np.asarray(found)


def _own_costs(ask: MotionObjective, q: Array) -> tuple[Array, Array]:
    """(F, 108) each: curvature and slope of what each coordinate costs by itself."""
    over, steep = (one.reshape(len(q), COUNT) for one in range_excess(ask, q))
    curved, pulled = steep**2, over * steep
    if ask.passive is not None and not ask.loads:
        stretched, stiff = _spring_loads(ask, q)
        curved[:, PELVIS + 6 :] += stiff**2
        pulled[:, PELVIS + 6 :] += stretched * stiff
    return curved, pulled


def _steps_of_joints(
    ask: MotionObjective, watched: SampledTrial, q: Array, damping: Array
) -> Array:
    """(F, 108) damped steps where each coordinate moves by itself, and no load costs."""
    markers, found = watched.markers, np.empty(q.shape)
    curved, pulled = _own_costs(ask, q)
    turned, apart = joints_of(watched.skeleton)
    damped_steps(
        q,
        turned,
        apart,
        markers.body,
        np.ascontiguousarray(markers.at),
        watched.places,
        watched.weight / ask.sizes.marker_m**2,
        ask.free,
        curved.reshape(q.shape),
        pulled.reshape(q.shape),
        damping,
        _RIDGE,
        found,
    )
    return found.reshape(len(q), COUNT)


def _normal(
    ask: MotionObjective, watched: SampledTrial, q: Array, whole: Array
) -> tuple[Array, Array]:
    """Gauss and Newton's matrix (F, n, n) and slope (F, n), of the numbers that `whole` maps."""
    off, slopes = Markers(watched, ask).with_slopes(q)
    curved, pulled = _own_costs(ask, q)
    slope = slopes @ whole
    square = whole.T @ (curved[..., None] * whole) + np.swapaxes(slope, 1, 2) @ slope
    down = pulled @ whole + (off[:, None] @ slope)[:, 0]
    if ask.loads:
        rest = np.zeros_like(q)
        at_rest = MuscleDemand.of(watched, ask).by_node(ask.passive, (q, rest, rest), _AT_REST)
        for k, node in enumerate(at_rest):
            weighed = node.weighed[0] @ whole
            square[k] += weighed.T @ (node.each[0] @ whole)
            down[k] += node.active @ weighed
    return square, down


def _spring_loads(ask: MotionObjective, q: Array) -> tuple[Array, Array]:
    """(F, 102) loads of passive elements over their size, as springs at rest, and their slopes."""
    assert ask.passive is not None
    force, stiffness, _ = ask.passive.with_slopes(q[:, 1:])
    size = ask.sizes.of_loads
    return (force / size).reshape(len(q), -1), (stiffness / size).reshape(len(q), -1)


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

    The articulated-body algorithm (Featherstone 2008, chapter 7), in a time that grows with the
    number of joints. Markers are to a step what point masses are to accelerations: the sum of their
    squared distances after it is a quadratic form of the bodies' twists, and each coordinate's own
    cost is a rotor's inertia at its joint. So it finds the step that the normal equations of all
    108 coordinates have, which need not be made. Spatial vectors are [angular; linear], at the
    origin of ground.

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
        forward_kinematics(q[f], turned, apart, turns, origins, axes)
        for b in range(bodies):
            o = origins[b]
            for j in range(_AXES):
                force[b, j] = 0.0
                for r in range(_AXES):
                    inertia[b, j, r] = twists[b, j, r] = 0.0
            for j in range(3):
                w = axes[b, 3 + j]
                # motion subspace S: a translation's axis; a rotation's axis w, with o x w
                for i in range(3):
                    if free[b, j]:
                        twists[b, j, 3 + i] = axes[b, j, i]
                    if free[b, 3 + j]:
                        y, z = (i + 1) % 3, (i + 2) % 3
                        twists[b, 3 + j, i] = w[i]
                        twists[b, 3 + j, 3 + i] = o[y] * w[z] - o[z] * w[y]
        # spatial inertia and bias force of each body: every marker a point mass on it, off its
        # place by as much
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
        # diagonal of the normal equations, S' I S with composite inertias from the top down (CRBA)
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
        # articulated inertia and bias from the top down: what all above a joint does to it once it
        # has given way at its best
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
            # Cholesky factor of the joint's own matrix D = S' I S + cost + damping (locked: 1), and
            # its inverse times S' I and the joint's slope
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
            # to the body below: I - I S D^-1 S' I, and the bias likewise
            for r in range(_AXES):
                force[b - 1, r] += force[b, r]
                for j in range(_AXES):
                    force[b - 1, r] -= half[j, r] * rest[b, j]
                for s in range(_AXES):
                    inertia[b - 1, r, s] += own[r, s]
                    for j in range(_AXES):
                        inertia[b - 1, r, s] -= half[j, r] * half[j, s]
        # from the pelvis up: each joint moves as it gives way to what moves below it, by backward
        # substitution in the factor
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
