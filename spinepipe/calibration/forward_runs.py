"""Fits in the published way: forward runs, difference quotients, an interior-point optimiser.

Gould 2024a fitted with MATLAB's fmincon (interior point) to OpenSim runs of 1.5 s; bounds,
tolerances, difference step and scaling are not stated. Taken here: scipy's trust-constr, whose way
with bounds is a barrier too, with its own tolerances and a quasi-Newton (BFGS) Hessian, and
fmincon's rule for steps: a share of the unknown, by default the root of the machine precision.
The barrier starts at its end: bounds are far from every start, and each further barrier would cost
a search of its own. trust-constr also differentiates at points that it refuses, which fmincon does
not: fmincon needs about half the runs.

A forward run is made as users of multibody tools make it, by a general-purpose implicit
integrator. It stands beside `spinepipe.statics.settle`, whose end is a smoother function of the
stiffness than that of any of these tools; that smoothness is what a fit by difference quotients
lives on. The cost by such runs is all that a published optimiser was given; its exact derivative
stands beside, to check it.

The integrator is LSODA (scipy's; variable order, variable step, its own difference Jacobian): of
what scipy has, its noise is nearest to that of OpenSim's CPodes, of the same family. Relative
error of the cost's derivative (difference step 1.5e-8 of the stiffness, 12 stiffness sets, the
L1-L4 segment, accuracy 1e-5), median and largest:

    OpenSim 4.6 CPodes                  0.5     7
    LSODA, difference Jacobian          0.06    0.3     <- here
    scipy's BDF, difference Jacobian    2e-4    2e-3
    LSODA, exact Jacobian               7e-6    1e-2
    scipy's BDF, exact Jacobian         8e-8    2e-7
    `settle`                            6e-8    3e-7

At a step of 1e-3 all have 1.7e-3, the curvature of the cost. So the noise is that of iterating
with a rough Jacobian, and what follows from it is understated here. OpenSim's default integrator,
explicit Runge-Kutta-Merson, has 1e-3 (one stiffness set), at 29 s per run. scipy's VODE, nearest
kin of CPodes, transposes the Jacobian in release 1.17 (scipy issue 24933) and cannot be used.
"""

import warnings
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.differentiate import jacobian
from scipy.integrate import ode
from scipy.optimize import Bounds, OptimizeResult, approx_fprime, minimize

from spinepipe.calibration.fit import values
from spinepipe.calibration.problem import Evaluator, Problem
from spinepipe.calibration.solvers import steps_alone
from spinepipe.effects.contract import Array
from spinepipe.model import LoadCase, RefusedModel, SpineModel
from spinepipe.statics import Course, no_settling, observe, with_parameters
from spinepipe.statics.batched import Moving, Stack, forward_kinematics
from spinepipe.status import Status

ABSOLUTE_SHARE = 0.1
"""Absolute tolerance (m, rad, m/s, rad/s) per relative one: that of Simbody's CPodes integrator."""

MOST_STEPS = 5000
"""A run to rest takes some 200; one that needs so many is lost."""


def forward_run(
    model: SpineModel, case: LoadCase, duration_s: float, accuracy: float
) -> Array | None:
    """(n,) pose after a time under constant load, from rest in the neutral pose; None if lost.

    The caller sees to it that the chain has inertia and no path effects.

    Parameters
    ----------
    case : of one load step.
    """
    motion = _Motion(Stack.of([model], [(0, case)]))
    integrator = ode(motion.rate).set_integrator(
        "lsoda",
        rtol=accuracy,
        atol=ABSOLUTE_SHARE * accuracy,
        nsteps=MOST_STEPS,
        with_jacobian=True,  # its own, by differences: no user of these tools has an exact one
    )
    integrator.set_initial_value(np.zeros(2 * motion.n), 0.0)
    with warnings.catch_warnings(), np.errstate(all="ignore"):
        warnings.simplefilter("ignore")  # why a run is lost: the caller learns that it is
        end: Array = integrator.integrate(duration_s)
    pose = end[: motion.n]
    return pose if integrator.successful() and np.isfinite(pose).all() else None


class _Motion:
    """The damped equations of motion of a stack's one lane, as a first-order system."""

    def __init__(self, stack: Stack) -> None:
        self.stack, self.n = stack, 6 * stack.joints
        self.bound = stack.bound(np.zeros(1, dtype=np.int64), {})
        self.damping = stack.chains.damping.reshape(1, -1, 6)
        self._pose = b""

    def rate(self, _time: float, state: Array) -> Array:
        """(2n,) rate of change of pose and rate."""
        q, rate = state.reshape(2, 1, -1, 6)
        # what depends on the pose alone stays where only rates have been varied
        if q.tobytes() != self._pose:
            held = self.bound.joint_forces(q)
            seen = forward_kinematics(self.stack.chains, self.stack.loads, q, held.tangent)
            self._missing = seen.applied - held.load
            self._moving = Moving.of(self.stack.chains, self.stack.loads.chain, seen)
            self._pose = q.tobytes()
        force = self._missing - self._moving.velocity_product_forces(rate) - self.damping * rate
        acceleration = self._moving.accelerations(force.reshape(1, -1))
        return np.concatenate([state[self.n :], acceleration[0]])


LOST = 1e6
"""Cost (mm2, deg2) of a point whose run is lost: any optimiser turns back there."""


class OutOfRuns(Exception):
    """The optimiser has had all the runs it may have."""


class ForwardCost(Evaluator):
    """The cost of a problem by forward runs; each point is run once."""

    def __init__(self, problem: Problem, duration_s: float, accuracy: float, most: int) -> None:
        """Load the chain; ``most`` points may be run.

        Raises
        ------
        RefusedModel
            When nothing that was measured has a weight, or the model cannot move in time.
        """
        super().__init__(replace(problem, course=None))
        self.duration_s, self.accuracy, self.most = duration_s, accuracy, most
        self.costs: dict[bytes, float] = {}
        refusal = no_settling(self._systems[0])
        if refusal:
            raise RefusedModel(refusal)

    def cost(self, x: Array) -> float:
        """Sum of weight times squared error (mm2, deg2) with the unknowns at x (m,).

        Raises
        ------
        OutOfRuns
            For a new point when as many as allowed have been run.
        """
        point = x.tobytes()
        if point not in self.costs:
            if len(self.costs) >= self.most:
                raise OutOfRuns
            self.costs[point] = self._run(x)
        return self.costs[point]

    def end(self, model: SpineModel, case: LoadCase) -> Array | None:
        """(n,) pose at the end of the run under a case's one step; None when the run is lost."""
        return forward_run(model, case, self.duration_s, self.accuracy)

    def _run(self, x: Array) -> float:
        model = with_parameters(self.problem.model, self.problem.free, x)
        known: dict[bytes, Array | None] = {}  # cycles repeat their loads
        total = 0.0
        for number, system in enumerate(self._systems):
            there = system.with_model(model)
            ends = []
            for key, case in steps_alone(system.case):
                if key not in known:
                    known[key] = self.end(model, case)
                ends.append(known[key])
            poses = [end for end in ends if end is not None]
            if len(poses) < len(ends):
                return LOST
            seen = np.stack([observe(there, q, place) for place, q in enumerate(poses)])
            residual = self._residual(number, seen)
            total += float(residual @ residual)
        return min(total, LOST)


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
    start = values(problem, np.zeros(len(problem.free)))
    search = _OptimiserRun(runs, start if raw_units else np.ones_like(start), relative_step)
    if runs.cost(np.zeros_like(start)) >= LOST:
        message = "the forward run with the start's stiffness is lost"
        return _ended(search, start, False, Status.UNSTABLE, message, None)
    gradient = search.gradient(search.unit) * search.unit
    claims, status, message = search.run()
    usable = gradient if np.abs(gradient).max() < LOST else None
    return _ended(search, start, claims, status, message, usable)


def _ended(
    search: "_OptimiserRun",
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


class _OptimiserRun:
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
            except np.linalg.LinAlgError as trouble:
                return False, Status.NOT_CONVERGED, str(trouble)
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


FIRST_STEP = 0.05
"""Of a logarithm: far enough from a pose that snaps, and halved until the error is rounding."""


def exact_gradient(problem: Problem, course: Course | None = None) -> Array | None:
    """(m,) derivative of the cost by the unknowns at the start; None where nothing stands there.

    With a course, that of runs which end after it.
    """
    start = np.zeros(len(problem.free))
    found = Evaluator(replace(problem, course=course)).at(start)
    if found.residual is None or found.jacobian is None:
        return None
    return 2.0 * found.residual @ found.jacobian


def differenced_gradient(problem: Problem) -> Array | None:
    """The same at rest by central differences of high order, with steps that adapt (scipy's)."""
    evaluator = Evaluator(replace(problem, course=None))

    def cost(x: Array) -> float:
        residual = evaluator.at(np.ascontiguousarray(x)).residual
        return np.nan if residual is None else float(residual @ residual)

    found = jacobian(
        lambda points: np.apply_along_axis(cost, 0, points),
        np.zeros(len(problem.free)),
        initial_step=FIRST_STEP,
    )
    gradient: Array = found.df
    return gradient if np.isfinite(gradient).all() else None


def relative_error(gradient: Array | None, exact: Array | None) -> float | None:
    """Size of a gradient's error relative to the exact one's size; None without both."""
    if gradient is None or exact is None:
        return None
    size = float(np.linalg.norm(exact))
    return float(np.linalg.norm(gradient - exact)) / size if size > 0.0 else None
