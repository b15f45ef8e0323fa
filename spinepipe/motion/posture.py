"""Each frame by itself: inverse kinematics, with and without ratios, springs or loads.

Levenberg-Marquardt on all frames at once. What no marker tells about stays where it was, since
steps are as short as can be (a small damping); ratios between joints are a linear map of fewer
numbers to all coordinates (Christophy 2012, Bruno 2015). A frame may have several least costs: each
is sought from the postures of both its neighbours as well, and the least is taken.
"""

from dataclasses import dataclass, replace

import numpy as np

from spinepipe.effects.contract import Array
from spinepipe.motion.articulated import damped_steps
from spinepipe.motion.objective import SHAPE, Ask, Watched
from spinepipe.motion.points import COUNT, joints_of, marker_places
from spinepipe.motion.residual_terms import Markers, MuscleDemand, beyond
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
    ask: Ask, watched: Watched, ratios: Array | None = None, most_steps: int = MOST_STEPS
) -> Postures:
    """Postures of all nodes of a trial.

    Parameters
    ----------
    ratios : (108, n) what each of fewer numbers makes of all coordinates; None for the free
        coordinates themselves.
    """
    q = np.zeros((len(watched.places), *SHAPE))
    q[:, PELVIS, :3] = _first_place(watched)
    # the trunk as a whole first, then its joints
    alone = np.zeros(SHAPE, dtype=bool)
    alone[PELVIS] = True
    stiff = replace(ask, free=alone, loads=False, passive=None)
    q = _rounds(stiff, watched, q, None, most_steps).q
    found = _rounds(ask, watched, q, ratios, most_steps)
    return _from_neighbours(ask, watched, found, ratios, most_steps)


def _from_neighbours(
    ask: Ask, watched: Watched, found: Postures, ratios: Array | None, most_steps: int
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


def _first_place(watched: Watched) -> Array:
    """(F, 3) m, where the pelvis is if it and all above it stand as in the neutral posture."""
    seen = watched.weight > 0.0
    neutral = marker_places(watched.skeleton, watched.markers, np.zeros((1, *SHAPE)))[0]
    on_pelvis = np.asarray(watched.markers.body) == PELVIS
    count = seen & on_pelvis
    count = np.where(count.any(axis=1)[:, None], count, seen)
    apart = (watched.places - neutral) * count[..., None]
    found: Array = apart.sum(axis=1) / np.maximum(count.sum(axis=1), 1)[:, None]
    return found


def _rounds(
    ask: Ask, watched: Watched, q: Array, ratios: Array | None, most_steps: int
) -> Postures:
    """Steps of each frame until they are short; each frame has its own damping."""
    damping, q = np.full(len(q), 1e-4), q.copy()
    cost, settled = _cost(ask, watched, q), np.zeros(len(q), dtype=bool)
    steps = 0
    while steps < most_steps and not settled.all():
        steps += 1
        left = np.flatnonzero(~settled)
        seen = watched.at(left)
        if ratios is None and not ask.loads and watched.shares is None:
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
        by = np.where(better, 0.2, 10.0) * damping[left]
        damping[left] = np.clip(by, 1e-12, 1e8)
    return Postures(q, settled, steps)


def _cost(ask: Ask, watched: Watched, q: Array) -> Array:
    """(F,) of postures at rest."""
    found = np.sum(Markers(watched, ask).residuals(q) ** 2, axis=1)
    found += np.sum(beyond(ask, q)[0] ** 2, axis=(1, 2))
    if ask.loads:
        rest = np.zeros_like(q)
        off = MuscleDemand.of(watched, ask).residuals(ask.passive, (q, rest, rest))
        return np.asarray(found + np.sum(off**2, axis=1))
    if ask.passive is not None:
        found += np.sum(_stretched(ask, q)[0] ** 2, axis=1)
    return np.asarray(found)


def _by_themselves(ask: Ask, q: Array) -> tuple[Array, Array]:
    """(F, 108) each: curvature and slope of what each coordinate costs by itself."""
    over, steep = (one.reshape(len(q), COUNT) for one in beyond(ask, q))
    curved, pulled = steep**2, over * steep
    if ask.passive is not None and not ask.loads:
        stretched, stiff = _stretched(ask, q)
        curved[:, PELVIS + 6 :] += stiff**2
        pulled[:, PELVIS + 6 :] += stretched * stiff
    return curved, pulled


def _steps_of_joints(ask: Ask, watched: Watched, q: Array, damping: Array) -> Array:
    """(F, 108) damped steps where each coordinate moves by itself, and no load costs."""
    markers, found = watched.markers, np.empty(q.shape)
    curved, pulled = _by_themselves(ask, q)
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


def _normal(ask: Ask, watched: Watched, q: Array, whole: Array) -> tuple[Array, Array]:
    """(F, n, n) and (F, n)."""
    off, slopes = Markers(watched, ask).with_slopes(q)
    curved, pulled = _by_themselves(ask, q)
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


def _stretched(ask: Ask, q: Array) -> tuple[Array, Array]:
    """(F, 102) loads of passive elements over their size, as springs at rest, and their slopes."""
    assert ask.passive is not None
    force, stiffness, _ = ask.passive.with_slopes(q[:, 1:])
    size = ask.sizes.of_loads
    return (force / size).reshape(len(q), -1), (stiffness / size).reshape(len(q), -1)
