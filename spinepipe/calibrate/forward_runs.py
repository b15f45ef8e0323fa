"""Fits in the published way: forward runs, difference quotients, an interior-point optimiser.

Gould 2024a fitted with MATLAB's fmincon (interior point) to OpenSim runs of 1.5 s; bounds,
tolerances, difference step and scaling are not stated. Taken here: scipy's trust-constr, whose way
with bounds is a barrier too, with its own tolerances and a quasi-Newton (BFGS) Hessian, and
fmincon's rule for steps: a share of the unknown, by default the root of the machine precision.
The barrier starts at its end: bounds are far from every start, and each further barrier would cost
a search of its own. trust-constr also differentiates at points that it refuses, which fmincon does
not: fmincon needs about half the runs.
"""

import warnings
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.optimize import Bounds, OptimizeResult, approx_fprime, minimize

from spinepipe.calibrate.forward_cost import LOST, ForwardCost, OutOfRuns
from spinepipe.calibrate.problem import Problem
from spinepipe.effects.contract import Array
from spinepipe.statics import Status

DEFAULT_STEP = float(np.sqrt(np.finfo(float).eps))
"""Difference step of an optimiser that is told none, relative to the unknown."""

MOST_EVALUATIONS = 300
BARRIER: Any = {"initial_barrier_parameter": 1e-8, "initial_barrier_tolerance": 1e-8}
"""trust-constr's own last barrier, taken as the first too."""

NEAR_BOUND = 1e-2
"""A barrier keeps this far (logarithm) from a bound that it runs into."""


@dataclass(frozen=True)
class ForwardFit:
    """What the published way makes of a problem.

    Attributes
    ----------
    x : (m,) logarithms of the unknowns relative to the start. values : (m,) SI.
    cost : sum of weight times squared error, mm2 and deg2, by a forward run.
    evaluations : runs of the model (each under all load steps of all tests).
    claims_success : what the optimiser says of itself, right or wrong.
    start_gradient : (m,) derivative of the cost at the start by x, by differences; None if lost.
    """

    x: Array
    values: Array
    cost: float
    evaluations: int
    claims_success: bool
    status: Status
    message: str
    start_gradient: Array | None


def fit_by_forward_runs(
    problem: Problem,
    duration_s: float,
    relative_step: float = DEFAULT_STEP,
    accuracy: float = 1e-5,
    raw_units: bool = False,
    most_evaluations: int = MOST_EVALUATIONS,
) -> ForwardFit:
    """Fit a problem from the model's own values, given its cost alone.

    Parameters
    ----------
    relative_step : of the forward differences, as a share of the unknown.
    accuracy : relative accuracy asked of each run.
    raw_units : unknowns are stiffness in SI; else stiffness divided by its start.
    most_evaluations : runs after which the optimiser is stopped; more than there are unknowns.

    Raises
    ------
    RefusedModel
        When nothing that was measured has a weight, or the model cannot move in time.
    ValueError
        For an unknown that is not logarithmic.
    """
    cost = ForwardCost(problem, duration_s, accuracy, most_evaluations)
    return fit_by_cost(cost, relative_step, raw_units)


def fit_by_cost(runs: ForwardCost, relative_step: float, raw_units: bool) -> ForwardFit:
    """The same with any runs; see `fit_by_forward_runs`."""
    problem = runs.problem
    if not all(parameter.logarithmic for parameter in problem.free):
        raise ValueError("forward runs fit stiffness, not parameters that may be negative")
    start = np.array([_first_value(problem, index) for index in range(len(problem.free))])
    search = _Search(runs, start if raw_units else np.ones_like(start), relative_step)
    if runs.cost(np.zeros_like(start)) >= LOST:
        message = "the forward run with the start's stiffness is lost"
        return _ended(search, start, False, Status.UNSTABLE, message, None)
    gradient = search.gradient(search.unit) * search.unit
    claims, status, message = search.run()
    usable = gradient if np.abs(gradient).max() < LOST else None
    return _ended(search, start, claims, status, message, usable)


def _ended(
    search: "_Search",
    start: Array,
    claims: bool,
    status: Status,
    message: str,
    gradient: Array | None,
) -> ForwardFit:
    x = search.x(search.last)
    cost = search.runs.costs[x.tobytes()]
    count = len(search.runs.costs)
    return ForwardFit(x, start * np.exp(x), cost, count, claims, status, message, gradient)


def _first_value(problem: Problem, index: int) -> float:
    parameter = problem.free[index]
    return float(
        problem.model.effects[parameter.effect].values[parameter.rows[0], parameter.column]
    )


class _Search:
    """The optimiser on unknowns that are ``unit`` (m,) at the start."""

    def __init__(self, runs: ForwardCost, unit: Array, relative_step: float) -> None:
        self.runs, self.unit, self.relative_step = runs, unit, relative_step
        self.last = unit

    def x(self, unknowns: Array) -> Array:
        """(m,) logarithms relative to the start."""
        return np.log(unknowns / self.unit)

    def cost(self, unknowns: Array) -> float:
        return self.runs.cost(self.x(unknowns))

    def gradient(self, unknowns: Array) -> Array:
        """(m,) forward differences of the cost."""
        return approx_fprime(unknowns, self.cost, self.relative_step * np.abs(unknowns))

    def run(self) -> tuple[bool, Status, str]:
        """Whether the optimiser claims success, the status and its message."""
        problem = self.runs.problem
        arrive: Any = self._arrive
        low, high = self.unit * np.exp(problem.lower), self.unit * np.exp(problem.upper)
        with warnings.catch_warnings(record=True) as notes:
            warnings.simplefilter("always")
            try:
                result = minimize(
                    self.cost,
                    self.unit,
                    method="trust-constr",
                    jac=self.gradient,
                    bounds=Bounds(low, high, keep_feasible=True),
                    callback=arrive,
                    options=BARRIER,
                )
            except OutOfRuns:
                message = f"no optimum within {self.runs.most} runs of the model"
                return False, Status.NOT_CONVERGED, message
        self.last = result.x
        return self._verdict(bool(result.success), str(result.message), notes)

    def _arrive(self, unknowns: Array, _state: OptimizeResult) -> None:
        self.last = unknowns.copy()

    def _verdict(
        self, success: bool, said: str, notes: list[warnings.WarningMessage]
    ) -> tuple[bool, Status, str]:
        """The optimiser's own words, its warnings among them."""
        message = "; ".join(dict.fromkeys([said, *(str(note.message) for note in notes)]))
        if not success:
            return False, Status.NOT_CONVERGED, message
        x, problem = self.x(self.last), self.runs.problem
        inside = np.all(x > problem.lower + NEAR_BOUND) and np.all(x < problem.upper - NEAR_BOUND)
        return True, Status.CONVERGED if inside else Status.CONVERGED_AT_BOUND, message
