"""Static poses of a world along its load paths: Newton on what OpenSim and the laws say."""

from typing import NamedTuple

import numpy as np

from .rigid import Spine, together
from .world import Now, World

TOLERANCE = 1e-11
"""m and rad, last step; the next would be smaller by the tangent's error, 1e-6."""
DIFFERENCE = 1e-7
LARGEST_STEP = 0.15
MOST_ITERATIONS = 40
DAMPED_AFTER = 12
"""Newton may jump to and fro over a corner of a law; half steps end that."""


class NoEquilibriumError(RuntimeError):
    """No static pose was found: a spine near buckling, or an effect far too strong."""


class Solved(NamedTuple):
    """Poses q (T, S, J, 6) and, if asked for, tangents (T, S, n, n)."""

    q: np.ndarray
    tangents: np.ndarray | None


def solve(world: World, spine: Spine, start: np.ndarray, with_tangents: bool = False) -> Solved:
    """All steps of all tests, each from ``start`` (T, S, J, 6) or, if zero, the step before."""
    poses, tangents = np.zeros_like(start), []
    for test, case in enumerate(world.tests):
        memories = tuple(np.zeros((2, *world.stiffness.shape)) for _ in world.laws)
        before = poses[test, 0]
        for step in range(len(case.moments)):
            seconds = case.seconds[step] - case.seconds[step - 1] if step else 0.0
            now = Now(test, step, seconds)
            guess = start[test, step] if start[test, step].any() else before
            before, tangent = equilibrium(world, spine, guess, memories, now)
            memories = _renewed(world, before, memories, now)
            poses[test, step] = before
            tangents.append(tangent)
    stacked = np.array(tangents).reshape(*poses.shape[:2], poses[0, 0].size, -1)
    return Solved(poses, stacked if with_tangents else None)


def equilibrium(
    world: World, spine: Spine, guess: np.ndarray, memories: tuple[np.ndarray, ...], now: Now
) -> tuple[np.ndarray, np.ndarray]:
    """Pose (J, 6) and the tangent (n, n) one Newton step before it.

    Raises
    ------
    NoEquilibriumError
        When the steps do not get small.
    """
    q = guess.copy()
    for iteration in range(MOST_ITERATIONS):
        missing, tangent = residual(world, spine, q, memories, now)
        move = np.linalg.solve(tangent, missing)
        size = np.abs(move).max()
        damping = 0.5 if iteration >= DAMPED_AFTER else 1.0
        q = q - min(damping, LARGEST_STEP / max(size, LARGEST_STEP)) * move.reshape(q.shape)
        if size < TOLERANCE:
            return q, tangent
    raise NoEquilibriumError(f"specimen {world.number}, {now}: last step {size:.1e}")


def residual(
    world: World, spine: Spine, q: np.ndarray, memories: tuple[np.ndarray, ...], now: Now
) -> tuple[np.ndarray, np.ndarray]:
    """Generalised load (n,) missing for equilibrium at q, and its tangent."""
    n = q.size
    moves = DIFFERENCE * np.eye(n).reshape(n, *q.shape)
    held = world.holding(np.concatenate([q[None], q + moves]), memories, now).reshape(n + 1, n)
    missing, tangent = held[0], (held[1:] - held[0]).T / DIFFERENCE
    pose = spine.at(q)
    load, by_q = pose.applied(together(world.wrenches(pose, now.test, now.step)))
    return missing - load, tangent - by_q


def _renewed(
    world: World, q: np.ndarray, memories: tuple[np.ndarray, ...], now: Now
) -> tuple[np.ndarray, ...]:
    seen = world.seen(q)
    return tuple(
        law.renewed(seen, memory, now) if hasattr(law, "renewed") else memory
        for law, memory in zip(world.laws, memories, strict=True)
    )
