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
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import Bounds, approx_fprime, minimize

from spinepipe.calibrate.forward_run import forward_run
from spinepipe.calibrate.problem import Evaluator, Problem
from spinepipe.effects.contract import Array
from spinepipe.model import RefusedModel
from spinepipe.statics import Program, Status, moved, settle

DEFAULT_STEP = float(np.sqrt(np.finfo(float).eps))
"""Difference step of an optimiser that is told none, relative to the unknown."""

MOST_EVALUATIONS = 300
LAST_BARRIER = 1e-8

LOST = 1e6
"""Cost (mm2, deg2) of a point whose run is lost: any optimiser turns back there."""

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

    Raises
    ------
    RefusedModel
        When nothing that was measured has a weight, or the model cannot move in time.
    ValueError
        For an unknown that is not logarithmic.
    """
    if not all(parameter.logarithmic for parameter in problem.free):
        raise ValueError("forward runs fit stiffness, not parameters that may be negative")
    runs = _Runs(problem, duration_s, accuracy)
    start = np.array([_first_value(problem, index) for index in range(len(problem.free))])
    search = _Search(runs, start if raw_units else np.ones_like(start), relative_step)
    if runs.cost(np.zeros_like(start)) >= LOST:
        message = "the forward run with the start's stiffness is lost"
        return _ended(search, start, False, Status.UNSTABLE, message, None)
    gradient = search.gradient(search.unit) * search.unit
    runs.most = most_evaluations
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


class _OutOfRuns(Exception):
    """The optimiser has had all the runs it may have."""


class _Runs(Evaluator):
    """The cost of a problem by forward runs; each point is run once."""

    def __init__(self, problem: Problem, duration_s: float, accuracy: float) -> None:
        super().__init__(replace(problem, course=None))
        self._duration_s, self._accuracy = duration_s, accuracy
        self.costs: dict[bytes, float] = {}
        self.most = MOST_EVALUATIONS
        for system in self._systems:  # a run of no time tells whether the chain can move at all
            nothing = Program.constant(system.slots.unloaded())
            end = settle(system, nothing, 0.0)
            if end.status is Status.REFUSED:
                raise RefusedModel(end.message)

    def cost(self, x: Array) -> float:
        """Sum of weight times squared error with the unknowns at x (m,)."""
        point = x.tobytes()
        if point not in self.costs:
            if len(self.costs) >= self.most:
                raise _OutOfRuns
            self.costs[point] = self._run(x)
        return self.costs[point]

    def _run(self, x: Array) -> float:
        model = moved(self.problem.model, self.problem.free, x)
        total = 0.0
        for number, system in enumerate(self._systems):
            there = system.with_model(model)
            ends = [
                forward_run(there, loading, self._duration_s, self._accuracy)
                for loading in (there.slots.loading(s.wrenches) for s in there.case.steps)
            ]
            poses = [end for end in ends if end is not None]
            if len(poses) < len(ends):
                return LOST
            residual = self._residual(number, there, np.stack(poses))
            total += float(residual @ residual)
        return min(total, LOST)


class _Search:
    """The optimiser on unknowns that are ``unit`` (m,) at the start."""

    def __init__(self, runs: _Runs, unit: Array, relative_step: float) -> None:
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
                    callback=self._arrive,
                    options={
                        "initial_barrier_parameter": LAST_BARRIER,
                        "initial_barrier_tolerance": LAST_BARRIER,
                    },
                )
            except _OutOfRuns:
                message = f"no optimum within {self.runs.most} runs of the model"
                return False, Status.NOT_CONVERGED, message
        self.last = result.x
        return self._verdict(bool(result.success), str(result.message), notes)

    def _arrive(self, unknowns: Array, *_state: object) -> None:
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
