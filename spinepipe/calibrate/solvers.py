"""Where the loads bring the chain and how that depends on the unknowns: at rest, or settling."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from spinepipe.effects.contract import Array
from spinepipe.statics import (
    END_ONLY,
    Course,
    FreeParameter,
    Loading,
    System,
    by_parameters,
    follow,
    move,
    settled_by_parameters,
)


@dataclass(frozen=True)
class Solution:
    """Poses (T, n) of every case and their derivatives (T, n, m) by the unknowns."""

    poses: tuple[Array, ...]
    by_x: tuple[Array, ...]


class AtRest:
    """Stable equilibria; each point starts from the last one, corrected to first order."""

    def __init__(self, free: Sequence[FreeParameter], reach: Array) -> None:
        """``reach`` (m,): how far from a point first order is trusted."""
        self._free, self._reach = free, reach
        self._last: tuple[Array, Solution] | None = None

    def forget(self) -> None:
        """Start the next point from the neutral pose."""
        self._last = None

    def solve(self, x: Array, systems: Sequence[System]) -> Solution | str:
        """The solution with the unknowns at x (m,), or why there is none."""
        guesses = self._guesses(x) if self._last else [None] * len(systems)
        solved = [follow(system, guess) for system, guess in zip(systems, guesses, strict=True)]
        failed = [step for case in solved for step in case if not step.usable]
        if failed:
            return failed[0].equilibrium.message
        solution = Solution(
            tuple(np.stack([step.equilibrium.q for step in case]) for case in solved),
            tuple(
                np.stack(by_parameters(system, case, self._free))
                for system, case in zip(systems, solved, strict=True)
            ),
        )
        self._last = (x.copy(), solution)
        return solution

    def _guesses(self, x: Array) -> list[list[Array] | None]:
        """Poses to start from at another point, to first order."""
        assert self._last is not None
        there, known = self._last
        change = np.clip(x - there, -self._reach, self._reach)
        return [
            list(poses + by_x @ change) for poses, by_x in zip(known.poses, known.by_x, strict=True)
        ]


class Settling:
    """Poses a time after each load step came on, from rest in the neutral pose."""

    def __init__(self, free: Sequence[FreeParameter], course: Course) -> None:
        """``course``: how each step's load comes on and when the pose is read."""
        self._free, self._course = free, course

    def forget(self) -> None:
        """Nothing: each run starts from the neutral pose."""

    def solve(self, x: Array, systems: Sequence[System]) -> Solution | str:
        """The solution with the unknowns at x (m,), or why there is none."""
        known: dict[tuple[object, ...], tuple[Array, Array]] = {}  # cycles repeat their loads
        poses, by_x = [], []
        for system in systems:
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
            poses.append(np.stack([end for end, _ in ends]))
            by_x.append(np.stack([derivative for _, derivative in ends]))
        return Solution(tuple(poses), tuple(by_x))

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
