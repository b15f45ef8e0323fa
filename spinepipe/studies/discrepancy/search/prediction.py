"""One specimen under a model: its predicted readings and their derivatives by unknowns."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from spinepipe.effects.contract import Array
from spinepipe.model import LoadCase, SpineModel
from spinepipe.statics import (
    FreeParameter,
    SolvedStep,
    System,
    by_parameters,
    carried_over,
    follow,
    moved,
    observe,
    observed_by_parameters,
)
from spinepipe.units import less_step_0
from spinepipe.world import Chain


class NoEquilibrium(RuntimeError):
    """A test has no stable pose under the model; the message says which and why."""


@dataclass(frozen=True)
class Predicted:
    """Predicted readings of each test, (T, J, 6), and their derivatives, (T, J, 6, m)."""

    readings: tuple[Array, ...]
    by_x: tuple[Array, ...]


class Simulated:
    """A specimen's tests under one model, solved again and again from near poses."""

    def __init__(
        self,
        model: SpineModel,
        cases: Sequence[LoadCase],
        zeroed: bool,
        free: Sequence[FreeParameter],
    ) -> None:
        self.model, self.cases, self.zeroed, self.free = model, tuple(cases), zeroed, tuple(free)
        self._last: tuple[Array, list[list[Array]], list[list[Array]]] | None = None

    def at(self, x: Array) -> Predicted:
        """Prediction with the unknowns moved by x (m,) from the model's values.

        Raises
        ------
        NoEquilibrium
            When a load step has no stable pose.
        """
        model = moved(self.model, self.free, x)
        chain = Chain(model)
        guesses = self._guesses(x)
        poses, slopes, readings, by_x = [], [], [], []
        for number, case in enumerate(self.cases):
            system = System(chain, model, case)
            solved = solved_steps(system, guesses[number])
            dq = by_parameters(system, solved, self.free)
            poses.append([step.equilibrium.q for step in solved])
            slopes.append(dq)
            readings.append(self._seen([observe(system, q) for q in poses[-1]]))
            seen = zip(poses[-1], dq, strict=True)
            by_x.append(
                self._seen([observed_by_parameters(system, q, d, self.free) for q, d in seen])
            )
        self._last = (x.copy(), poses, slopes)
        return Predicted(tuple(readings), tuple(by_x))

    def _guesses(self, x: Array) -> list[list[Array] | None]:
        """Poses to start from, to first order from the last ones."""
        if self._last is None:
            return [None] * len(self.cases)
        there, poses, slopes = self._last
        change = x - there
        return [
            [q + d @ change for q, d in zip(qs, ds, strict=True)]
            for qs, ds in zip(poses, slopes, strict=True)
        ]

    def _seen(self, rows: list[Array]) -> Array:
        """(T, ...) by load step, less step 0 where readings were zeroed."""
        return less_step_0(np.stack(rows), self.zeroed)


class Solved:
    """A specimen's tests solved under one model, for derivatives by effects that it lacks.

    Good for as long as no other model is loaded into the process's engine.
    """

    def __init__(self, model: SpineModel, cases: Sequence[LoadCase], zeroed: bool) -> None:
        """Solve all tests.

        Raises
        ------
        NoEquilibrium
            When a load step has no stable pose.
        """
        self.model, self.cases, self.zeroed = model, tuple(cases), zeroed
        self._chain = Chain(model)
        self.steps = [solved_steps(System(self._chain, model, case), None) for case in cases]

    def by(self, full: SpineModel, free: Sequence[FreeParameter]) -> tuple[Array, ...]:
        """(T, J, 6, m) derivatives of each test's readings by unknowns of idle effects.

        Parameters
        ----------
        full : the solved model with further effects behind its own, all of them off.
        free : unknowns of ``full``.
        """
        found = []
        for case, solved in zip(self.cases, self.steps, strict=True):
            system = System(self._chain, full, case)
            steps = carried_over(system, solved)
            seen = [
                observed_by_parameters(system, step.equilibrium.q, dq, free)
                for step, dq in zip(steps, by_parameters(system, steps, free), strict=True)
            ]
            found.append(less_step_0(np.stack(seen), self.zeroed))
        return tuple(found)


def solved_steps(system: System, guesses: list[Array] | None) -> list[SolvedStep]:
    """All steps of a case, each with an equilibrium.

    Raises
    ------
    NoEquilibrium
        When one has no stable pose.
    """
    solved = follow(system, guesses)
    for step in solved:
        if not step.usable:
            place = f"{system.model.specimen}, test {system.case.test}, step {step.step.step}"
            raise NoEquilibrium(f"{place}: {step.equilibrium.message}")
    return solved
