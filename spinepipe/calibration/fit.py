"""Bounded least squares with the exact Jacobian, from several starts, with honest status.

An optimum counts only where the cost is level, or held by a bound, and where the loads lead to its
poses from the neutral pose.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import islice

import numpy as np
from numpy.typing import NDArray
from scipy.stats import qmc

from spinepipe.calibration.descent import OFF_THE_PATH, DescentTolerances, descend, descend_along
from spinepipe.calibration.lockstep import in_lockstep
from spinepipe.calibration.problem import Evaluation, Evaluator, Problem, among, lead
from spinepipe.calibration.profile import Profile, RegionEnds, profiles
from spinepipe.calibration.solvers import by_record
from spinepipe.calibration.uncertainty import Uncertainty, refuse_correlated, uncertainty
from spinepipe.effects.contract import Array
from spinepipe.model import MeasuredCase
from spinepipe.statics import with_parameters
from spinepipe.status import Status

At = Callable[[Array], Evaluation]
"""What there is with the unknowns at x (m,)."""

STIFFENING = 2.0
"""Factor by which a start without a stable equilibrium is stiffened, again and again."""

TIPPED = "no stable equilibrium up to the upper bounds: the loads tip the segment over"
AT_THE_BRINK = "the cost still falls where the loads begin to tip the segment over: no optimum"
BETTER = "beside the optimum there is a lower cost: more starts are needed"

AT_BOUND = 1e-6
"""An unknown so near a bound, in its typical changes, is told to be at it."""

ROUNDING = 1e-12
"""And one so near is put on it."""

TOLERANCES = DescentTolerances(cost=1e-11, step=1e-7, slope=1e-14, evaluations=200)
"""When a fit at rest has arrived."""

LAST_SETTLING_STEP = 1e-3
"""Relative step at which a fit of settling runs has arrived: they cost a hundred times as much."""

START_SPREAD = 30.0
"""Further starts are drawn within this factor of the first, inside the bounds."""

SAME_OPTIMUM = 1e-3
"""Optima whose identifiable unknowns agree to this (logarithms, or prior SDs) are one."""

CLOSE = 10.0
"""An optimum this many last steps away, by slope and curvature, is reached."""

LEVEL = 1e-2
"""Slope of the cost at an optimum, as a share of it per unknown's unit (logarithm or prior SD)."""

COST_TIE = 1e-6
"""Costs that differ by less than this share are equal."""


@dataclass(frozen=True)
class Optimum:
    """Where one start ended.

    Attributes
    ----------
    x : (m,) unknowns relative to the model's values. at_bound : (m,) -1 lower, 0 none, 1 upper.
    stiffened : doublings of stiffness the start needed before it had a stable equilibrium.
    """

    x: Array
    at_bound: Array
    cost: float
    evaluation: Evaluation
    status: Status
    message: str
    iterations: int
    stiffened: int


@dataclass(frozen=True)
class Fit:
    """The best optimum of all starts and what can be said of it.

    Attributes
    ----------
    x, at_bound : (m,) see `Optimum`. values : (m,) value of each unknown's first row, SI.
    cost : sum of weight times squared error, mm2 and deg2; of whitened errors for zeroed cases
        of a problem that allows for their correlation; with the squares of priors.
    cost_of_priors : these squares alone.
    n_optima : distinct optima found; several of equal cost mean that the answer is not unique.
    cases : the measured cases with the load steps that were needed. poses : (T, n) of each,
        nothing where there is no usable pose.
    profile : region of each unknown without a prior, if asked for and if there is an optimum.
    """

    x: Array
    values: Array
    at_bound: Array
    uncertainty: Uncertainty
    cost: float
    status: Status
    message: str
    iterations: int
    evaluations: int
    n_optima: int
    stiffened: int
    cases: tuple[MeasuredCase, ...]
    poses: tuple[Array, ...]
    profile: Profile | None = None
    cost_of_priors: float = 0.0

    def identifiable(self, unknown: int) -> bool:
        """Whether both ends of an unknown's region are known and its standard error is small."""
        closed = self.profile is not None and self.profile.closed[unknown]
        return bool(closed and self.uncertainty.identifiable[unknown])

    def reach(self, unknown: int, value: float) -> RegionEnds | None:
        """Region of a value that a logarithmic unknown moves; none where none was looked for.

        Parameters
        ----------
        value : what the fit has of it, such as one joint's stiffness (SI); ends are in its unit.
        """
        found = self.profile
        if found is None:
            return None
        ends = value * np.exp(np.array([found.low[unknown], found.high[unknown]]) - self.x[unknown])
        below, above = bool(found.open_below[unknown]), bool(found.open_above[unknown])
        low, high = None if below else float(ends[0]), None if above else float(ends[1])
        return RegionEnds(low, high, below, above)


def fit(
    problem: Problem,
    starts: int = 1,
    seed: int = 0,
    identifiable_below: float = 1.0,
    noise: Array | None = None,
    profiled: bool = False,
) -> Fit:
    """Fit a problem from the model's own values and ``starts - 1`` further points.

    Parameters
    ----------
    identifiable_below : largest standard error of an unknown at which it still counts as
        identified: of its logarithm where it is logarithmic, else in prior SDs.
    noise : (6,) m and rad, SD of one reading (before zeroing); None takes it from the residuals.
    profiled : whether the region of each unknown without a prior is looked for, a few more fits
        per unknown.

    Raises
    ------
    ValueError
        For ``noise`` with a zeroed case whose correlated errors the problem does not allow for.
    """
    if noise is not None:
        refuse_correlated(problem)
    evaluator = Evaluator(problem)
    points = _start_points(evaluator.problem, starts, seed)
    return _fits([(evaluator, points)], identifiable_below, noise, profiled)[0]


def fit_alike(
    problems: Sequence[Problem],
    starts: int = 1,
    seeds: Sequence[int] = (),
    identifiable_below: float = 1.0,
    profiled: bool = False,
) -> list[Fit]:
    """Fits of problems with the same loads and unknowns, all solved in one stack.

    Their models differ in numbers alone. What comes out of one hangs on no other.

    Parameters
    ----------
    seeds : of each problem's further starts. Others as of `fit`.

    Raises
    ------
    RefusedModel
        As `Evaluator` does.
    """
    tasks: list[_Task] = []
    for problem, seed in zip(problems, seeds or [0] * len(problems), strict=True):
        evaluator = Evaluator(problem, tasks[0][0] if tasks else None)
        tasks.append((evaluator, _start_points(evaluator.problem, starts, seed)))
    return _fits(tasks, identifiable_below, None, profiled)


_Task = tuple[Evaluator, Sequence[Array]]
"""A problem's evaluator and the points (m,) from which it is fitted."""


def _fits(
    tasks: Sequence[_Task], identifiable_below: float, noise: Array | None, profiled: bool
) -> list[Fit]:
    """Fits side by side, each from its starts; parameters as of `fit`."""
    searches = [(one, start) for one, starts in tasks for start in starts]
    evaluators = [one for one, _ in searches]
    descents = [partial(_descend, *search) for search in searches]
    every = iter(in_lockstep(descents, partial(among, evaluators)))
    ends = [(one, list(islice(every, len(starts)))) for one, starts in tasks]
    lead(
        [
            (one, optimum.x)
            for one, optima in ends
            for k, optimum in enumerate(optima)
            if optimum.status.usable and _twin(optima[:k], optimum, one.problem.scale) is None
        ]
    )
    found = [_on_record(one, optima) for one, optima in ends]
    fits = [
        _fitted(one.problem, optima, one.evaluations, identifiable_below, noise)
        for (one, _), optima in zip(tasks, found, strict=True)
    ]
    if not profiled:
        return fits
    usable = [number for number, one in enumerate(fits) if one.status.usable]
    best = [(tasks[k][0], _best(found[k])) for k in usable]
    asked = [(one, end.x, end.evaluation, end.at_bound) for one, end in best]
    for number, region in zip(usable, profiles(asked, noise), strict=True):
        notes = (fits[number].message, BETTER if region.lower_cost else "")
        message = "; ".join(filter(None, notes))
        fits[number] = replace(fits[number], profile=region, message=message)
    return fits


def _fitted(
    problem: Problem,
    optima: Sequence[Optimum],
    evaluations: int,
    identifiable_below: float,
    noise: Array | None,
) -> Fit:
    """The fit of a problem whose descents ended there."""
    best = _best(optima)
    found = uncertainty(problem, best.evaluation, best.at_bound, identifiable_below, noise)
    return Fit(
        x=best.x,
        values=values(problem, best.x),
        at_bound=best.at_bound,
        uncertainty=found,
        cost=best.cost,
        status=best.status,
        message=best.message,
        iterations=best.iterations,
        evaluations=evaluations,
        n_optima=_distinct(optima, found.identifiable, problem.scale),
        stiffened=best.stiffened,
        cases=problem.cases,
        poses=best.evaluation.poses if best.status.usable else (),
        cost_of_priors=float(np.sum((problem.by_priors @ best.x) ** 2)),
    )


def _best(optima: Sequence[Optimum]) -> Optimum:
    """The optimum of least cost; of equal ones the first, so that extra starts change nothing."""
    usable = [optimum for optimum in optima if optimum.status.usable] or list(optima)
    least = min(optimum.cost for optimum in usable)
    return next(optimum for optimum in usable if not _worse(optimum, least))


def _start_points(problem: Problem, starts: int, seed: int) -> list[Array]:
    """The model's own values, then a Latin hypercube around them inside the bounds."""
    m = len(problem.free)
    points = [np.zeros(m)]
    if starts > 1:
        spread = np.log(START_SPREAD) * problem.scale
        low, high = np.maximum(problem.lower, -spread), np.minimum(problem.upper, spread)
        unit = qmc.LatinHypercube(m, rng=np.random.default_rng(seed)).random(starts - 1)
        points += list(low + unit * (high - low))
    return points


def _descend(evaluator: Evaluator, start: Array, at: At) -> Optimum:
    """Least squares from one start; the start is stiffened until it has a stable equilibrium."""
    problem = evaluator.problem
    standing, stiffened = stand_up(problem, at, start)
    if standing is None:
        nowhere = Evaluation(None, None, (), evaluator.coordinate, evaluator.sharing)
        x, why = problem.upper.copy(), tipped(problem, at, start)
        at_bound = np.ones(len(x), dtype=int)
        return Optimum(x, at_bound, np.inf, nowhere, Status.UNSTABLE, why, 0, stiffened)
    return _least_squares(evaluator, at, standing, stiffened)


def _least_squares(evaluator: Evaluator, at: At, start: Array, stiffened: int) -> Optimum:
    problem = evaluator.problem

    def point(x: Array) -> tuple[Array, Array] | None:
        found = at(on_bounds(problem, x))
        if found.residual is None or found.jacobian is None:
            return None
        return found.residual, found.jacobian

    begin = np.clip(start, problem.lower + 1e-9, problem.upper - 1e-9)
    bounds, settled = (problem.lower, problem.upper), _tolerances(problem)
    if problem.along_bounds:
        ended = descend_along(point, begin, bounds, problem.scale, settled)
    else:
        size = len(evaluator.coordinate)
        ended = descend(point, begin, bounds, problem.scale, size, settled)
    x = on_bounds(problem, ended.x)
    at_bound, evaluation = bounds_reached(problem, x), at(x)
    level = _stationary(problem, evaluation, at_bound)
    status, message = Status.CONVERGED, ""
    if not (ended.arrived or level):
        status, message = Status.NOT_CONVERGED, settled.given_up
    elif not level:
        status, message = Status.NOT_CONVERGED, AT_THE_BRINK
    elif at_bound.any():
        status, message = Status.CONVERGED_AT_BOUND, names_at_bound(problem, at_bound)
    return Optimum(
        x,
        at_bound,
        2.0 * ended.half_cost,
        evaluation,
        status,
        message,
        ended.evaluations,
        stiffened,
    )


def _on_record(evaluator: Evaluator, optima: Sequence[Optimum]) -> list[Optimum]:
    """The optima as the engine of record has them; one that an earlier one ties with goes by it."""
    found: list[Optimum] = []
    for optimum in optima:
        twin = _twin(found, optimum, evaluator.problem.scale)
        if twin is not None:
            found.append(replace(optimum, status=twin.status, message=twin.message))
            continue
        record = evaluator.on_record(optimum.x) if optimum.status.usable else optimum.evaluation
        if record is None:
            lost = Status.NOT_CONVERGED
            found.append(replace(optimum, status=lost, message=OFF_THE_PATH))
        else:
            found.append(replace(optimum, evaluation=record))
    return found


def _twin(earlier: Sequence[Optimum], optimum: Optimum, scale: Array) -> Optimum | None:
    """The first of earlier optima that would be taken for best in place of one that is usable."""
    near = SAME_OPTIMUM * scale.min(initial=1.0)
    for one in earlier if optimum.status.usable else ():
        close = np.abs(one.x - optimum.x).max(initial=0.0) < near
        if close and not _worse(one, optimum.cost):
            return one
    return None


def _worse(optimum: Optimum, least: float) -> bool:
    return optimum.cost > least * (1.0 + COST_TIE) + 1e-12


def _stationary(problem: Problem, evaluation: Evaluation, at_bound: Array) -> bool:
    """Whether the cost is level in the unknowns inside their bounds.

    Steps also shrink to nothing where what lies beyond has no equilibrium: that is no optimum.
    """
    residual, jacobian = evaluation.residual, evaluation.jacobian
    assert residual is not None
    assert jacobian is not None
    # gradient 2 J'r and the diagonal of the Gauss-Newton Hessian 2 J'J, per typical change: near is
    # where a Newton step would be shorter than a few of the last steps that a descent takes
    slope = 2.0 * np.abs(residual @ jacobian * problem.scale)
    bend = 2.0 * np.sum((jacobian * problem.scale) ** 2, axis=0)
    near = (
        slope <= CLOSE * _tolerances(problem).step * bend
    )  # where nothing is left, a slope is no share
    level = near | (slope <= LEVEL * (residual @ residual) + 1e-9)
    return bool(level[at_bound == 0].all())


def _tolerances(problem: Problem) -> DescentTolerances:
    return TOLERANCES if problem.course is None else replace(TOLERANCES, step=LAST_SETTLING_STEP)


def _distinct(optima: Sequence[Optimum], identifiable: NDArray[np.bool_], scale: Array) -> int:
    """Number of different optima among the starts that ended, told by what is identifiable."""
    kept: list[Optimum] = []
    for one in (o for o in optima if o.status.usable):
        for other in kept:
            close = (np.abs(one.x - other.x) / scale)[identifiable] < SAME_OPTIMUM
            tie = abs(one.cost - other.cost) <= COST_TIE * max(one.cost, other.cost, 1e-12)
            if close.all() and tie:
                break
        else:
            kept.append(one)
    return len(kept)


def stand_up(problem: Problem, at: At, start: Array) -> tuple[Array | None, int]:
    """The start, stiffened by factors of two until it stands; None when the bounds do not help."""
    stiffened = 0
    stiffness = np.array([parameter.logarithmic for parameter in problem.free])
    step = np.where(stiffness, np.log(STIFFENING), 0.0)
    while at(start).residual is None:
        if np.all(start[stiffness] >= problem.upper[stiffness]):
            return None, stiffened
        start = np.minimum(start + step, problem.upper)
        stiffened += 1
    return start, stiffened


def tipped(problem: Problem, at: At, start: Array) -> str:
    """Why no stiffness within the bounds helped, and which coordinate gives way with the largest.

    That may be one that is not fitted. At rest the engine of record tells it, a stack does not.
    """
    stiffness = np.array([parameter.logarithmic for parameter in problem.free])
    x = np.where(stiffness, problem.upper, start)
    why: object = at(x).message
    if problem.course is None:
        stiffest = with_parameters(problem.model, problem.free, x)
        why = by_record(stiffest, [measured.case for measured in problem.cases])
    return f"{TIPPED} ({why})" if isinstance(why, str) else TIPPED


def on_bounds(problem: Problem, x: Array) -> Array:
    """The point with unknowns that are at a bound but for rounding put exactly there."""
    x = np.where(x - problem.lower < ROUNDING, problem.lower, x)
    return np.where(problem.upper - x < ROUNDING, problem.upper, x)


def bounds_reached(problem: Problem, x: Array) -> Array:
    """(m,) -1 at the lower, 1 at the upper bound, else 0."""
    near = AT_BOUND * problem.scale
    low, high = x - problem.lower < near, problem.upper - x < near
    return high.astype(int) - low.astype(int)


def values(problem: Problem, x: Array) -> Array:
    """(m,) value of each unknown's first row, SI."""
    effects = with_parameters(problem.model, problem.free, x).effects
    return np.array([effects[p.effect].values[p.rows[0], p.column] for p in problem.free])


def names_at_bound(problem: Problem, at_bound: Array) -> str:
    """Which unknowns are at which of their bounds, in words."""
    return ", ".join(
        f"{parameter.label} at its {'upper' if side > 0 else 'lower'} bound"
        for parameter, side in zip(problem.free, at_bound, strict=True)
        if side
    )
