"""Static poses of a world along its load paths: Newton on what the spine and the laws say."""

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
    """Poses q (T, S, J, 6) and tangents (T, S, n, n)."""

    q: np.ndarray
    tangents: np.ndarray


def solve(world: World, spine: Spine, start: np.ndarray) -> Solved:
    """All steps of all tests from ``start`` (T, S, J, 6).

    Tests are solved side by side, each step from the one before it where the start is zero. A
    world without laws of its own knows no path: from another start all steps are solved at once.
    """
    if start.any() and not world.laws:
        return _at_once(world, spine, start)
    poses = np.zeros_like(start)
    tangents = []
    tests = np.arange(len(world.tests))
    seconds = world.tests[0].seconds
    memories = tuple(np.zeros((getattr(law, "cells", 0), *start[:, 0].shape)) for law in world.laws)
    before = poses[:, 0]
    for step in range(start.shape[1]):
        spent = float(seconds[step] - seconds[step - 1]) if step else 0.0
        now = Now(tests, np.full(len(tests), step), spent)
        guess = np.where(start[:, step].any(axis=(1, 2), keepdims=True), start[:, step], before)
        before, tangent = equilibrium(world, spine, guess, memories, now)
        memories = _renewed(world, before, memories, now)
        poses[:, step] = before
        tangents.append(tangent)
    return Solved(poses, np.stack(tangents, axis=1))


def _at_once(world: World, spine: Spine, start: np.ndarray) -> Solved:
    tests, steps = (grid.ravel() for grid in np.indices(start.shape[:2]))
    flat = start.reshape(-1, *start.shape[2:])
    q, tangents = equilibrium(world, spine, flat, (), Now(tests, steps, 0.0))
    return Solved(q.reshape(start.shape), tangents.reshape(*start.shape[:2], *tangents.shape[1:]))


def equilibrium(
    world: World, spine: Spine, guess: np.ndarray, memories: tuple[np.ndarray, ...], now: Now
) -> tuple[np.ndarray, np.ndarray]:
    """Poses (T, J, 6) and the tangents (T, n, n) one Newton step before them.

    Raises
    ------
    NoEquilibriumError
        When the steps do not get small.
    """
    q = guess.copy()
    moving = np.ones(len(q), dtype=bool)
    for iteration in range(MOST_ITERATIONS):
        missing, tangent = residual(world, spine, q, memories, now)
        move = np.linalg.solve(tangent, missing[..., None])[..., 0]
        size = np.abs(move).max(axis=-1)
        damping = 0.5 if iteration >= DAMPED_AFTER else 1.0
        share = np.minimum(damping, LARGEST_STEP / np.maximum(size, LARGEST_STEP)) * moving
        q = q - share[:, None, None] * move.reshape(q.shape)
        moving &= ~(size < TOLERANCE)
        if not moving.any():
            return q, tangent
        if not np.isfinite(q).all():
            break
    worst = int(np.argmax(np.where(np.isfinite(size), size, np.inf)))
    at = f"specimen {world.number}, test {now.tests[worst]}, step {now.steps[worst]}"
    raise NoEquilibriumError(f"{at}: last step {size[worst]:.1e}")


def residual(
    world: World, spine: Spine, q: np.ndarray, memories: tuple[np.ndarray, ...], now: Now
) -> tuple[np.ndarray, np.ndarray]:
    """Generalised loads (T, n) missing for equilibrium at q (T, J, 6), and tangents (T, n, n)."""
    held, tangent = _held(world, q, memories, now)
    pose = spine.at(q)
    load, by_q = pose.applied(together(world.wrenches(pose, now)))
    return held - load, tangent - by_q


def _held(world, q, memories, now):
    """What the joints hold, and its tangent by differences; springs alone have it at once."""
    count, n = len(q), q[0].size
    if not world.laws and not world.places:
        return (world.stiffness * q).reshape(count, n), np.diag(world.stiffness.ravel())
    moves = DIFFERENCE * np.eye(n).reshape(n, 1, *q.shape[1:])
    held = world.holding(np.concatenate([q[None], q + moves]), memories, now)
    held = held.reshape(n + 1, count, n)
    return held[0], np.moveaxis(held[1:] - held[0], 0, -1) / DIFFERENCE


def _renewed(
    world: World, q: np.ndarray, memories: tuple[np.ndarray, ...], now: Now
) -> tuple[np.ndarray, ...]:
    seen = world.seen(q)
    return tuple(
        law.renewed(seen, memory, now) if hasattr(law, "renewed") else memory
        for law, memory in zip(world.laws, memories, strict=True)
    )
