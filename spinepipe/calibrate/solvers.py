"""Where the loads bring a model, what is read there, and how that depends on the unknowns.

At rest the stack of all load steps is solved; runs that settle are followed one by one.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from spinepipe.effects.contract import Array
from spinepipe.model import LoadCase, SpineModel
from spinepipe.statics import (
    END_ONLY,
    Course,
    FreeParameter,
    Loading,
    System,
    follow,
    move,
    moved,
    observe,
    observed_by_parameters,
    settled_by_parameters,
)
from spinepipe.statics.many import Stack, poses_by, readings, readings_by
from spinepipe.world import Chain


@dataclass(frozen=True)
class Seen:
    """What is seen of every case at one point.

    Attributes
    ----------
    poses : (T, n) of every case. readings : (T, J, 6) likewise.
    by_x : (T, J, 6, m) derivatives of the readings by the unknowns.
    """

    poses: tuple[Array, ...]
    readings: tuple[Array, ...]
    by_x: tuple[Array, ...]


class AtRest:
    """Stable equilibria; each point starts from the last one, corrected to first order."""

    def __init__(
        self,
        model: SpineModel,
        cases: Sequence[LoadCase],
        free: Sequence[FreeParameter],
        reach: Array,
    ) -> None:
        """``reach`` (m,): how far from a point first order is trusted."""
        self._model, self._free, self._reach = model, free, reach
        self._stack = Stack.of([model], [(0, case) for case in cases])
        self._last: tuple[Array, Array, Array] | None = None

    def forget(self) -> None:
        """Start the next point from the neutral pose."""
        self._last = None

    def solve(self, x: Array) -> Seen | str:
        """What is seen with the unknowns at x (m,), or why there is nothing."""
        stack = self._stack.with_models([moved(self._model, self._free, x)])
        found = stack.solve(self._guess(x))
        if found.trouble:
            return found.trouble[1]
        q = found.q
        dq = poses_by(stack, q, [self._free])
        self._last = (x.copy(), q, dq)
        ends = stack.first[1:-1]
        return Seen(
            tuple(np.split(q.reshape(len(q), -1), ends)),
            tuple(np.split(readings(stack, q), ends)),
            tuple(np.split(readings_by(stack, q, dq, [self._free]), ends)),
        )

    def _guess(self, x: Array) -> Array | None:
        """(L, J, 6) poses to start from at another point, to first order."""
        if self._last is None:
            return None
        there, q, dq = self._last
        guess: Array = q + dq @ np.clip(x - there, -self._reach, self._reach)
        return guess


class Settling:
    """Poses a time after each load step came on, from rest in the neutral pose."""

    def __init__(
        self, systems: Sequence[System], free: Sequence[FreeParameter], course: Course
    ) -> None:
        """``course``: how each step's load comes on and when the pose is read."""
        self._systems, self._free, self._course = systems, free, course

    def forget(self) -> None:
        """Nothing: each run starts from the neutral pose."""

    def solve(self, x: Array) -> Seen | str:
        """What is seen with the unknowns at x (m,), or why there is nothing."""
        known: dict[tuple[object, ...], tuple[Array, Array]] = {}  # cycles repeat their loads
        poses, seen, by_x = [], [], []
        for same in self._systems:
            system = same.with_model(moved(same.model, self._free, x))
            ends = []
            for step in system.case.steps:
                loading = system.slots.loading(step.wrenches)
                key = (system.case.test, system.slots, loading.key)
                if key not in known:
                    found = self._end(system, loading)
                    if isinstance(found, str):
                        return found
                    known[key] = found
                ends.append(known[key])
            poses.append(np.stack([q for q, _ in ends]))
            seen.append(np.stack([observe(system, q) for q, _ in ends]))
            slopes = [observed_by_parameters(system, q, dq, self._free) for q, dq in ends]
            by_x.append(np.stack(slopes))
        return Seen(tuple(poses), tuple(seen), tuple(by_x))

    def _end(self, system: System, loading: Loading) -> tuple[Array, Array] | str:
        """End pose (n,) and its derivative (n, m), or why there is none."""
        program = self._course.program(loading)
        end = move(system, program, self._course.duration_s, coarseness=END_ONLY)
        if not end.status.usable:
            return end.message
        derivative = settled_by_parameters(system, program, end, self._free)
        if derivative is None:
            return "the run does not repeat with slightly other stiffness"
        return end.q, derivative


class Disagreement(RuntimeError):
    """The stack and the engine of record do not put a model in the same pose."""


AGREEMENT = 1e-9
"""Of the largest translation and rotation of a model: what the two engines may differ by."""

LEAST_MOTION = np.array([1e-4] * 3 + [1e-3] * 3)
"""m and rad: smaller motion is held against this."""


def by_record(model: SpineModel, cases: Sequence[LoadCase]) -> tuple[Array, ...] | None:
    """(T, n) poses of every case by the engine of record, from the neutral pose; None of none."""
    chain = Chain(model)
    solved = [follow(System(chain, model, case)) for case in cases]
    if not all(step.usable for case in solved for step in case):
        return None
    return tuple(np.stack([step.equilibrium.q for step in case]) for case in solved)


def on_record(
    model: SpineModel, cases: Sequence[LoadCase], poses: Sequence[Array], same: float
) -> tuple[Array, ...] | None:
    """The poses (T, n) of a stack as the engine of record has them, from the neutral pose.

    Parameters
    ----------
    same : m and rad; None is returned where a pose differs by more: the loads lead elsewhere.

    Raises
    ------
    Disagreement
        For a smaller difference that is no rounding error.
    """
    record = by_record(model, cases)
    if record is None:
        return None
    for case, one, other in zip(cases, poses, record, strict=True):
        apart = np.abs(one - other).reshape(len(one), -1, 6)
        if apart.max(initial=0.0) > same:
            return None
        moved_by = np.abs(other).reshape(apart.shape).max(axis=(0, 1))
        largest = np.repeat([moved_by[:3].max(), moved_by[3:].max()], 3)
        allowed = AGREEMENT * np.maximum(largest, LEAST_MOTION)
        if (apart > allowed).any():
            step, joint, at = np.unravel_index(np.argmax(apart / allowed), apart.shape)
            place = 6 * joint + at
            raise Disagreement(
                f"{model.specimen}, test {case.test}, step {case.steps[step].step}, joint "
                f"{model.joints[joint]}: {one[step, place]:.17g} by the stack, "
                f"{other[step, place]:.17g} by the engine of record"
            )
    return record
