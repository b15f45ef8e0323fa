"""A calibration problem: a model, the tests it was measured in, and what may be moved to fit."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from spinepipe.effects.contract import Array
from spinepipe.model import LoadCase, SpineModel
from spinepipe.statics import (
    Chain,
    FreeParameter,
    SolvedStep,
    System,
    by_parameters,
    follow,
    moved,
    observe,
    observed_by_parameters,
)
from spinepipe.units import BORDER_PER_SI


@dataclass(frozen=True)
class MeasuredCase:
    """One cycle of one test with its measured motion.

    Attributes
    ----------
    measured : (T, J, 6) m and rad by load step, NaN where not measured.
    zeroed : whether the step-0 coordinates were subtracted from the measurement.
    """

    case: LoadCase
    measured: Array
    zeroed: bool = False


@dataclass(frozen=True)
class Problem:
    """What to fit.

    Attributes
    ----------
    weights : (6,) cost weight of each coordinate on mm2 and deg2; zero leaves it out.
    lower, upper : (m,) bounds of the unknowns, relative to the model's values (log or absolute).
    """

    model: SpineModel
    cases: tuple[MeasuredCase, ...]
    free: tuple[FreeParameter, ...]
    weights: Array
    lower: Array
    upper: Array


@dataclass(frozen=True)
class Evaluation:
    """Weighted residuals (N,) and Jacobian (N, m) at one point; None where it has no equilibrium.

    ``solved`` holds the steps of every case, ``coordinate`` (N,) which of the six each residual
    is of.
    """

    residual: Array | None
    jacobian: Array | None
    solved: tuple[tuple[SolvedStep, ...], ...]
    coordinate: NDArray[np.int64]
    message: str = ""


class Evaluator:
    """Evaluates a problem; the chain is loaded once, neighbouring solutions are reused."""

    def __init__(self, problem: Problem) -> None:
        self.problem = problem
        chain = Chain(problem.model)
        self._systems = [System(chain, problem.model, m.case) for m in problem.cases]
        self._used = [_used(m.measured, problem.weights) for m in problem.cases]
        self.coordinate = np.concatenate([np.nonzero(used)[2] for used in self._used])
        self._scale = np.sqrt(problem.weights) * BORDER_PER_SI
        self._guesses: list[list[Array]] | None = None
        self.evaluations = 0

    def at(self, x: Array, with_jacobian: bool = True) -> Evaluation:
        """Residuals and Jacobian with the unknowns moved by x (m,)."""
        self.evaluations += 1
        model = moved(self.problem.model, self.problem.free, x)
        systems = [system.with_model(model) for system in self._systems]
        guesses = self._guesses or [None] * len(systems)
        solved = tuple(
            tuple(follow(system, guess)) for system, guess in zip(systems, guesses, strict=True)
        )
        failed = [step for case in solved for step in case if not step.usable]
        if failed:
            return Evaluation(None, None, solved, self.coordinate, failed[0].equilibrium.message)
        self._guesses = [[step.equilibrium.q for step in case] for case in solved]
        parts = [self._case(n, systems[n], solved[n], with_jacobian) for n in range(len(systems))]
        residual = np.concatenate([part[0] for part in parts])
        jacobian = np.concatenate([part[1] for part in parts]) if with_jacobian else None
        return Evaluation(residual, jacobian, solved, self.coordinate)

    def _case(
        self, number: int, system: System, solved: Sequence[SolvedStep], with_jacobian: bool
    ) -> tuple[Array, Array]:
        """Weighted residuals of the used readings of one case, and their Jacobian."""
        measured, used = self.problem.cases[number], self._used[number]
        seen = np.stack([observe(system, step.equilibrium.q)[0] for step in solved])
        seen = seen - seen[0] if measured.zeroed else seen
        error = (seen - np.nan_to_num(measured.measured)) * self._scale
        if not with_jacobian:
            return error[used], np.empty((0, 0))
        free = self.problem.free
        poses = by_parameters(system, solved, free)
        by_x = np.stack(
            [
                observed_by_parameters(system, step.equilibrium.q, dq, free)
                for step, dq in zip(solved, poses, strict=True)
            ]
        )
        by_x = by_x - by_x[0] if measured.zeroed else by_x
        return error[used], (by_x * self._scale[:, None])[used]


def _used(measured: Array, weights: Array) -> Array:
    """(T, J, 6) which readings enter the cost."""
    return np.isfinite(measured) & (weights > 0.0)
