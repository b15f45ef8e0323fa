"""Partial pooling: levels lean on their specimen's mean, specimens on the cohort.

How strongly is told by the data themselves (empirical Bayes): the motion of every specimen is
linearised where it stands, the spreads are those of largest marginal likelihood there, and all go
to the posterior mean; so on until nobody moves (Gauss-Newton with Laplace's approximation;
Lindstrom & Bates 1990, doi:10.2307/2532087).

What partial pooling finds: specimens, how they spread, and what to expect of another one.

One specimen of a cohort on its way to the pooled stiffness.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from spinepipe.calibrate.descent import OFF_THE_PATH
from spinepipe.calibrate.fit import (
    AT_THE_BRINK,
    TIPPED,
    bounds_reached,
    names_at_bound,
    on_load_path,
    stand_up,
    values,
)
from spinepipe.calibrate.hierarchy import Hierarchy, between, change, condensed, estimated
from spinepipe.calibrate.problem import Evaluation, Evaluator, Problem
from spinepipe.calibrate.uncertainty import declared_deviation, refuse_correlated
from spinepipe.decomposition import bounded_lstsq
from spinepipe.effects.contract import Array, Indices
from spinepipe.model import MeasuredCase, RefusedModel
from spinepipe.status import Status


@dataclass(frozen=True)
class PooledSpecimen:
    """One specimen's unknowns, given its own readings and those of the others.

    Attributes
    ----------
    x, at_bound : (m,) logarithms relative to the start; -1 lower bound, 0 none, 1 upper.
    values : (m,) value of each unknown's first row, SI.
    covariance : (m, m) posterior of x at the pooled spreads, as if there were no bounds.
    cost : sum of squared weighted (and whitened) residuals, mm2 and deg2; infinite without pose.
    effective_parameters : how many of the unknowns its own readings determine.
    cases, poses : the cases with the steps that were needed, (T, n) of each; none without pose.
    """

    x: Array
    values: Array
    at_bound: Array
    covariance: Array
    cost: float
    n_readings: int
    effective_parameters: float
    evaluations: int
    status: Status
    message: str
    cases: tuple[MeasuredCase, ...]
    poses: tuple[Array, ...]


@dataclass(frozen=True)
class CohortSpread:
    """How one degree of freedom spreads: mean and SDs of logarithms relative to the start.

    Attributes
    ----------
    name : of the unknown without its joint. mean_se : standard error of the mean.
    level, specimen, rest : SDs; zero for what the readings cannot tell from the rest.
    """

    name: str
    effect: int
    column: int
    mean: float
    mean_se: float
    level: float
    specimen: float
    rest: float


@dataclass(frozen=True)
class Pooled:
    """A cohort fitted as one.

    Attributes
    ----------
    newcomer, newcomer_covariance : (m,), (m, m) x to expect of a specimen without readings.
    scatter : SD of a weighted residual (mm, deg), or 1 in declared SDs.
    log_likelihood : marginal, of the linearised readings at the spreads; of weighted residuals,
        or of residuals in declared SDs. Comparable for the same readings only.
    effective_parameters : of all specimens together.
    """

    specimens: tuple[PooledSpecimen, ...]
    spreads: tuple[CohortSpread, ...]
    newcomer: Array
    newcomer_covariance: Array
    scatter: float
    effective_parameters: float
    log_likelihood: float
    iterations: int
    evaluations: int
    status: Status
    message: str


ARRIVED, ARRIVED_SHARE = 1e-4, 0.01
"""Change of a logarithm, or share of its SD if that is more, below which a specimen has arrived."""

LARGEST_STEP = 1.0
"""Of a logarithm: as far as one linearisation is trusted."""

SMALLEST_SHARE = 1.0 / 1024.0
"""Of a step that lowers the cost; with less there is no way on."""

COST_TIE = 1e-12

ON_THE_MOVE = "still moving after the most iterations allowed"


class Member:
    """A specimen's problem, where it stands and what it sees there.

    One without readings or without a stable pose tells nothing of the cohort.

    Attributes
    ----------
    x : (m,) where it stands. evaluation : what it sees there, None where there is no pose.
    step : (m,) to where it is sent. arrived : whether that is where it was, as far as matters.
    stuck : whether no share of the step was a gain. trial : point last tried, what was seen there.
    """

    def __init__(self, problem: Problem, start: Array, noise: Array | None) -> None:
        """Load the problem and find a point near ``start`` (m,) that stands."""
        self.problem, self.x, self.noise = problem, start, noise
        self.arrived, self.stuck, self.step = False, False, np.zeros(len(start))
        self.evaluator: Evaluator | None = None
        self.evaluation: Evaluation | None = None
        self.refusal = ""
        try:
            self.evaluator = Evaluator(problem)
        except RefusedModel as refused:
            self.refusal = str(refused)
            return
        self.problem = self.evaluator.problem
        standing, _ = stand_up(self.evaluator, self.clipped(start))
        if standing is not None:
            self.x, self.evaluation = standing, self.evaluator.at(standing)
            self.trial = (self.x, self.evaluation)

    def clipped(self, x: Array) -> Array:
        """The point x (m,) drawn into the bounds."""
        return np.clip(x, self.problem.lower, self.problem.upper)

    @property
    def at_rest(self) -> bool:
        """Whether another step would change nothing."""
        return self.evaluation is None or self.stuck or self.arrived

    def linearised(self) -> tuple[Array, Array]:
        """Design (N, m) and target (N,): design @ x less target are the residuals near here."""
        if self.evaluation is None:
            return np.zeros((0, len(self.x))), np.zeros(0)
        residual, jacobian = self._in_deviations(self.evaluation)
        return jacobian, jacobian @ self.x - residual

    def _in_deviations(self, evaluation: Evaluation) -> tuple[Array, Array]:
        """Residual and Jacobian, in declared SDs where there are such."""
        assert evaluation.residual is not None
        assert evaluation.jacobian is not None
        if self.noise is None:
            return evaluation.residual, evaluation.jacobian
        deviation = declared_deviation(self.problem, evaluation.coordinate, self.noise)
        return evaluation.residual / deviation, evaluation.jacobian / deviation[:, None]

    def aim(self, target: Array, deviation: Array, hierarchy: Hierarchy) -> None:
        """Plan a step towards a target (m,) known to an SD (m,), inside bounds and as trusted."""
        if self.evaluation is None:
            return
        step = self._within_bounds(target, hierarchy) - self.x
        self.arrived = bool(np.all(np.abs(step) < np.maximum(ARRIVED, ARRIVED_SHARE * deviation)))
        self.step = step * LARGEST_STEP / max(float(np.abs(step).max()), LARGEST_STEP)

    def try_share(self, share: float) -> None:
        """See what there is after a share of the step, or after less where nothing stands there."""
        if self.evaluator is None or self.evaluation is None:
            return
        self.evaluator.reload()
        self.trial = (self.x, self.evaluation)
        while share > SMALLEST_SHARE:
            x = self.x + share * self.step
            found = self.evaluator.at(x)
            if found.residual is not None:
                self.trial = (x, found)
                return
            share *= 0.5

    def accept(self) -> None:
        """Go to where it last tried."""
        if self.evaluation is not None:
            self.stuck = self.trial[0] is self.x
            self.x, self.evaluation = self.trial

    def move_alone(self, hierarchy: Hierarchy) -> None:
        """Go as far as lowers its own cost, given what is common to all specimens."""
        if self.evaluation is None:
            return
        here, share = self._cost(self.x, self.evaluation, hierarchy), 1.0
        while share > SMALLEST_SHARE:
            self.try_share(share)
            if self._cost(*self.trial, hierarchy) <= here * (1.0 + COST_TIE):
                return self.accept()
            share *= 0.5
        self.stuck = True

    def squares(self, evaluation: Evaluation, scatter: float) -> float:
        """Sum of squared residuals in SDs of a reading."""
        residual, _ = self._in_deviations(evaluation)
        return float(residual @ residual) / scatter**2

    def _cost(self, x: Array, evaluation: Evaluation, hierarchy: Hierarchy) -> float:
        away = x - hierarchy.common
        prior = float(away @ np.linalg.solve(hierarchy.own, away))
        return self.squares(evaluation, hierarchy.spreads.scatter) + prior

    def _within_bounds(self, target: Array, hierarchy: Hierarchy) -> Array:
        """The target (m,), or where the linearised cost is least inside the bounds."""
        low, high = self.problem.lower, self.problem.upper
        if np.all((low <= target) & (target <= high)):
            return target
        design, aim = self.linearised()
        scatter, prior = hierarchy.spreads.scatter, np.linalg.inv(np.linalg.cholesky(hierarchy.own))
        rows = np.vstack([design / scatter, prior])
        aims = np.append(aim / scatter, prior @ hierarchy.common)
        return self.clipped(bounded_lstsq(rows, aims, (low, high)))

    def result(self, expected: Array, covariance: Array, effective: float) -> PooledSpecimen:
        """Where it has ended; at what is ``expected`` (m,) of it where it has no pose."""
        x, evaluation = self.x, self.evaluation
        if evaluation is None:
            x = self.clipped(expected)
        at_bound = bounds_reached(self.problem, x)
        status, message = self._ending(at_bound)
        residual = None if evaluation is None else evaluation.residual
        return PooledSpecimen(
            x=x,
            values=values(self.problem, x),
            at_bound=at_bound,
            covariance=covariance,
            cost=np.inf if residual is None else float(residual @ residual),
            n_readings=0 if self.evaluator is None else len(self.evaluator.coordinate),
            effective_parameters=effective,
            evaluations=0 if self.evaluator is None else self.evaluator.evaluations,
            status=status,
            message=message,
            cases=() if evaluation is None else self.problem.cases,
            poses=() if evaluation is None else evaluation.poses,
        )

    def _ending(self, at_bound: Array) -> tuple[Status, str]:
        if self.evaluator is None:
            return Status.REFUSED, self.refusal
        if self.evaluation is None:
            return Status.UNSTABLE, TIPPED
        if not self.arrived:
            return Status.NOT_CONVERGED, AT_THE_BRINK if self.stuck else ON_THE_MOVE
        if self.problem.course is None:
            self.evaluator.reload()
            if not on_load_path(self.evaluator, self.x, self.evaluation):
                return Status.NOT_CONVERGED, OFF_THE_PATH
        if at_bound.any():
            return Status.CONVERGED_AT_BOUND, names_at_bound(self.problem, at_bound)
        return Status.CONVERGED, ""


MOST_ROUNDS = 30
FREE_ROUNDS, DAMPED_SHARE = 12, 0.3
"""After so many rounds spreads go only a share of the way to what is asked, lest they swing."""

SETTLED = 0.05
"""Change of the logarithm of a spread that does not matter."""

UNSETTLED = "the spreads do not settle, as where a specimen does not go with the others"


def pool(
    problems: Sequence[Problem],
    noise: Array | None = None,
    starts: Sequence[Array] | None = None,
) -> Pooled:
    """Fit a cohort, one problem per specimen, with what its specimens and levels share.

    A specimen without a reading or a stable pose, and unknowns that nothing tells of, get what is
    to be expected of a newcomer. Each specimen keeps to its bounds by itself; the cohort and the
    covariances are not told of them. One specimen alone cannot tell how specimens differ: its
    newcomer is sure of too much.

    Parameters
    ----------
    problems : with the same logarithmic unknowns and the same stiffness to start from.
    noise : (6,) m and rad, SD of one reading (before zeroing): likelihood is then by these SDs and
        weights only choose the readings. None estimates one scatter of all weighted residuals.
    starts : (m,) x of each specimen to start from; zeros by default.

    Raises
    ------
    ValueError
        For unknowns or starting values that differ, unknowns that are no logarithms, and ``noise``
        that is not positive or given for correlated readings that a problem takes for independent.
    """
    _check(problems, noise)
    dof = _degrees_of_freedom(problems[0])
    starts = starts or [np.zeros(len(dof))] * len(problems)
    members = [Member(p, x, noise) for p, x in zip(problems, starts, strict=True)]
    hierarchy, iterations, unsettled = _travel(members, dof, None if noise is None else 1.0)
    found = hierarchy.posterior()
    told = zip(found.x, found.covariance, found.effective_parameters.tolist(), strict=True)
    specimens = tuple(m.result(*all_of) for m, all_of in zip(members, told, strict=True))
    status, message = _verdict(specimens)
    if unsettled:
        status, message = Status.NOT_CONVERGED, f"{unsettled}: see {_worst(problems, specimens)}"
    return Pooled(
        specimens=specimens,
        spreads=_cohort_spreads(problems[0], dof, hierarchy),
        newcomer=found.common,
        newcomer_covariance=found.newcomer_covariance,
        scatter=hierarchy.spreads.scatter,
        effective_parameters=float(found.effective_parameters.sum()),
        log_likelihood=hierarchy.log_likelihood,
        iterations=iterations,
        evaluations=sum(specimen.evaluations for specimen in specimens),
        status=status,
        message=message,
    )


def _check(problems: Sequence[Problem], noise: Array | None) -> None:
    if not problems:
        raise ValueError("no specimen to pool")
    first = problems[0]
    nowhere = np.zeros(len(first.free))
    if not all(parameter.logarithmic for parameter in first.free):
        raise ValueError("only logarithmic unknowns can be pooled")
    for problem in problems:
        name = problem.model.specimen
        if problem.free != first.free:
            raise ValueError(f"{name}: unknowns differ from those of {first.model.specimen}")
        if not np.allclose(values(problem, nowhere), values(first, nowhere), rtol=1e-9, atol=0.0):
            raise ValueError(f"{name}: starts from another stiffness than {first.model.specimen}")
        if noise is not None:
            _check_noise(problem, noise)


def _check_noise(problem: Problem, noise: Array) -> None:
    refuse_correlated(problem)
    used = np.nonzero(problem.weights > 0.0)[0]
    if not np.all(declared_deviation(problem, used, noise) > 0.0):
        raise ValueError("noise must be positive for every coordinate with a weight")


def _degrees_of_freedom(problem: Problem) -> Indices:
    """(m,) which degree of freedom, column of an effect, each unknown belongs to."""
    columns = [(parameter.effect, parameter.column) for parameter in problem.free]
    order = list(dict.fromkeys(columns))
    return np.array([order.index(column) for column in columns])


def _travel(
    members: Sequence[Member], dof: Indices, scatter: float | None
) -> tuple[Hierarchy, int, str]:
    """The hierarchy where no specimen moves any more, after how many rounds, and what ails it."""
    hierarchy, rounds, settled, trouble = None, 0, False, ""
    while hierarchy is None or rounds < MOST_ROUNDS:
        designs, targets = zip(*[member.linearised() for member in members], strict=True)
        readings = condensed(designs, targets, len(dof))
        before = hierarchy.spreads if hierarchy else None
        estimate = estimated(readings, dof, scatter, before)
        spreads, asked, trouble = estimate.spreads, estimate.spreads, estimate.trouble
        if before is not None:
            settled = change(before, asked) < SETTLED
            spreads = between(before, asked, 1.0 if rounds < FREE_ROUNDS else DAMPED_SHARE)
        hierarchy = Hierarchy(readings, dof, spreads)
        _move(members, hierarchy)
        rounds += 1
        if settled and all(member.at_rest for member in members):
            break
    return hierarchy, rounds, trouble or ("" if settled else UNSETTLED)


def _move(members: Sequence[Member], hierarchy: Hierarchy) -> None:
    """One step of all together that lowers their cost, or else of each by itself."""
    found = hierarchy.posterior()
    deviations = np.sqrt(np.diagonal(found.covariance, axis1=1, axis2=2))
    for member, x, deviation in zip(members, found.x, deviations, strict=True):
        member.aim(x, deviation, hierarchy)
    standing, share = [member for member in members if member.evaluation is not None], 1.0
    here = _cost([(m, m.x, m.evaluation) for m in standing], hierarchy)
    while share > SMALLEST_SHARE:
        for member in standing:
            member.try_share(share)
        if _cost([(m, *m.trial) for m in standing], hierarchy) <= here * (1.0 + COST_TIE):
            for member in standing:
                member.accept()
            return
        share *= 0.5
    for member in standing:
        member.move_alone(hierarchy)


def _cost(places: Sequence[tuple[Member, Array, Evaluation | None]], hierarchy: Hierarchy) -> float:
    """Squared residuals of all specimens at their points, and distance from the prior."""
    if not places:
        return 0.0
    scatter = hierarchy.spreads.scatter
    squares = [member.squares(seen, scatter) for member, _, seen in places if seen is not None]
    return sum(squares) + hierarchy.distance(np.stack([x for _, x, _ in places]))


def _verdict(specimens: Sequence[PooledSpecimen]) -> tuple[Status, str]:
    """The worst of the specimens that have poses; in words how many have no usable fit."""
    lost = sum(not specimen.status.usable for specimen in specimens)
    message = f"{lost} of {len(specimens)} specimens without a usable fit" if lost else ""
    standing = [specimen.status for specimen in specimens if specimen.poses]
    for status in (Status.NOT_CONVERGED, Status.CONVERGED_AT_BOUND, Status.CONVERGED):
        if status in standing:
            return status, message
    return specimens[0].status, message


def _worst(problems: Sequence[Problem], specimens: Sequence[PooledSpecimen]) -> str:
    """Name of the specimen with the largest cost per reading."""
    costs = [s.cost / s.n_readings if s.poses else 0.0 for s in specimens]
    return problems[int(np.argmax(costs))].model.specimen


def _cohort_spreads(
    problem: Problem, dof: Indices, hierarchy: Hierarchy
) -> tuple[CohortSpread, ...]:
    found, spreads = hierarchy.posterior(), hierarchy.spreads
    first = [problem.free[int(np.argmax(dof == d))] for d in range(dof.max() + 1)]
    return tuple(
        CohortSpread(
            name=parameter.label.partition("@")[0],
            effect=parameter.effect,
            column=parameter.column,
            mean=float(found.mean[d]),
            mean_se=float(found.mean_sd[d]),
            level=float(spreads.level[d]),
            specimen=float(spreads.specimen[d]),
            rest=float(spreads.rest[d]),
        )
        for d, parameter in enumerate(first)
    )
