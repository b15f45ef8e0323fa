"""Partial pooling: levels lean on their specimen's mean, specimens on the cohort.

How strongly is told by the data themselves (empirical Bayes): the motion of every specimen is
linearised where it stands, the spreads are those of largest marginal likelihood there, and all go
to the posterior mean; so on until nobody moves (Gauss-Newton with Laplace's approximation;
Lindstrom & Bates 1990, doi:10.2307/2532087).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from spinepipe.calibration.descent import OFF_THE_PATH
from spinepipe.calibration.fit import (
    AT_THE_BRINK,
    bounds_reached,
    names_at_bound,
    stand_up,
    tipped,
    values,
)
from spinepipe.calibration.hierarchy import (
    Hierarchy,
    condense_readings,
    estimate_spreads,
    interpolate_spreads,
    largest_change,
)
from spinepipe.calibration.problem import Evaluation, Evaluator, Problem
from spinepipe.calibration.uncertainty import declared_deviation, refuse_correlated
from spinepipe.decomposition import bounded_lstsq
from spinepipe.effects.contract import Array, Indices
from spinepipe.model import MeasuredCase, RefusedModel
from spinepipe.status import Status

ARRIVED, ARRIVED_SHARE = 1e-4, 0.01
"""Change of a logarithm, or share of its SD if that is more, below which a specimen has arrived."""

LARGEST_STEP = 1.0
"""Of a logarithm: as far as one linearisation is trusted."""

SMALLEST_SHARE = 1.0 / 1024.0
"""Of a step that lowers the cost; with less there is no way on."""

COST_TIE = 1e-12

ON_THE_MOVE = "still moving after the most iterations allowed"


@dataclass(frozen=True)
class PooledSpecimen:
    """One specimen's unknowns, given its own readings and those of the others.

    Attributes
    ----------
    x, at_bound : (m,) moves from the start as in `Problem`; -1 lower bound, 0 none, 1 upper.
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


class PoolMember:
    """A specimen's problem, where it stands and what it sees there.

    One without readings or without a stable pose tells nothing of the cohort. Its unknowns are
    those of the problem in their own `Problem.scale`: logarithms, or prior SDs.

    Attributes
    ----------
    x : (m,) where it stands. evaluation : what it sees there, None where there is no pose.
    step : (m,) to where it is sent. arrived : whether that is where it was, as far as matters.
    stuck : whether no share of the step was a gain. trial : point last tried, what was seen there.
    """

    def __init__(self, problem: Problem, start: Array, noise: Array | None) -> None:
        """Load the problem and find a point near ``start`` (m,), as in `Problem`, that stands."""
        self.problem, self.noise, self.scale = problem, noise, problem.scale
        self.x = start / self.scale
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
        begin = self.clipped(self.x) * self.scale
        standing, _ = stand_up(self.problem, self.evaluator.at, begin)
        if standing is None:
            self.refusal = tipped(self.problem, self.evaluator.at, begin)
            return
        self.x, self.evaluation = standing / self.scale, self.evaluator.at(standing)
        self.trial = (self.x, self.evaluation)

    @property
    def bounds(self) -> tuple[Array, Array]:
        """Lower and upper (m,) of x."""
        return self.problem.lower / self.scale, self.problem.upper / self.scale

    def clipped(self, x: Array) -> Array:
        """The point x (m,) drawn into the bounds."""
        return np.clip(x, *self.bounds)

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
        jacobian = evaluation.jacobian * self.scale
        if self.noise is None:
            return evaluation.residual, jacobian
        deviation = declared_deviation(self.problem, evaluation.coordinate, self.noise)
        return evaluation.residual / deviation, jacobian / deviation[:, None]

    def plan_step(self, target: Array, deviation: Array, hierarchy: Hierarchy) -> None:
        """Plan a step towards a target (m,) known to an SD (m,), inside bounds and as trusted."""
        if self.evaluation is None:
            return
        low, high = self.bounds
        if not np.all((low <= target) & (target <= high)):
            # where the linearised cost, the prior's among it, is least inside the bounds
            design, aim = self.linearised()
            root = np.linalg.inv(np.linalg.cholesky(hierarchy.own))
            rows = np.vstack([design / hierarchy.spreads.scatter, root])
            aims = np.append(aim / hierarchy.spreads.scatter, root @ hierarchy.common)
            target = self.clipped(bounded_lstsq(rows, aims, (low, high)))
        step = target - self.x
        self.arrived = bool(np.all(np.abs(step) < np.maximum(ARRIVED, ARRIVED_SHARE * deviation)))
        self.step = step * LARGEST_STEP / max(float(np.abs(step).max()), LARGEST_STEP)

    def try_share(self, share: float) -> None:
        """See what there is after a share of the step, or after less where nothing stands there."""
        if self.evaluator is None or self.evaluation is None:
            return
        self.trial = (self.x, self.evaluation)
        while share > SMALLEST_SHARE:
            x = self.clipped(self.x + share * self.step)
            found = self.evaluator.at(x * self.scale)
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

    def result(self, expected: Array, covariance: Array, effective: float) -> PooledSpecimen:
        """Where it has ended; at what is ``expected`` (m,) of it where it has no pose."""
        here, evaluation = self.x, self.evaluation
        if evaluation is None:
            here = self.clipped(expected)
        x = here * self.scale
        at_bound = bounds_reached(self.problem, x)
        # why there is nothing, what keeps it from being an optimum, or which bounds it is at
        status, message = Status.CONVERGED, ""
        if self.evaluator is None or evaluation is None:
            status = Status.REFUSED if self.evaluator is None else Status.UNSTABLE
            message = self.refusal
        elif not self.arrived:
            status, message = Status.NOT_CONVERGED, AT_THE_BRINK if self.stuck else ON_THE_MOVE
        elif self.evaluator.on_record(self.x * self.scale) is None:
            status, message = Status.NOT_CONVERGED, OFF_THE_PATH
        elif at_bound.any():
            status, message = Status.CONVERGED_AT_BOUND, names_at_bound(self.problem, at_bound)
        residual = None if evaluation is None else evaluation.residual
        return PooledSpecimen(
            x=x,
            values=values(self.problem, x),
            at_bound=at_bound,
            covariance=covariance * np.outer(self.scale, self.scale),
            cost=np.inf if residual is None else float(residual @ residual),
            n_readings=0 if self.evaluator is None else len(self.evaluator.coordinate),
            effective_parameters=effective,
            evaluations=0 if self.evaluator is None else self.evaluator.evaluations,
            status=status,
            message=message,
            cases=() if evaluation is None else self.problem.cases,
            poses=() if evaluation is None else evaluation.poses,
        )


@dataclass(frozen=True)
class CohortSpread:
    """How one degree of freedom spreads: mean and SDs of moves from the start.

    Moves are logarithms, or of what is no logarithm in its own unit.

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
    problems : with the same unknowns and the same values to start from. What is no logarithm is
        pooled in prior SDs.
    noise : (6,) m and rad, SD of one reading (before zeroing): likelihood is then by these SDs and
        weights only choose the readings. None estimates one scatter of all weighted residuals.
    starts : (m,) x of each specimen to start from; zeros by default.

    Raises
    ------
    ValueError
        For unknowns or starting values that differ, unknowns with priors of their own, and
        ``noise`` that is not positive or given for correlated readings that a problem takes for
        independent.
    """
    _check(problems, noise)
    # degree of freedom, column of an effect, that each unknown belongs to
    columns = [(parameter.effect, parameter.column) for parameter in problems[0].free]
    order, scale = list(dict.fromkeys(columns)), problems[0].scale
    dof = np.array([order.index(column) for column in columns])
    starts = starts or [np.zeros(len(dof))] * len(problems)
    members = [PoolMember(p, x, noise) for p, x in zip(problems, starts, strict=True)]
    hierarchy, iterations, unsettled = _gauss_newton(members, dof, None if noise is None else 1.0)
    found = hierarchy.posterior()
    told = zip(found.x, found.covariance, found.effective_parameters.tolist(), strict=True)
    specimens = tuple(m.result(*all_of) for m, all_of in zip(members, told, strict=True))
    # the worst status of the specimens that have poses; in words how many have no usable fit
    lost = sum(not specimen.status.usable for specimen in specimens)
    message = f"{lost} of {len(specimens)} specimens without a usable fit" if lost else ""
    standing = [specimen.status for specimen in specimens if specimen.poses]
    worst_first = (Status.NOT_CONVERGED, Status.CONVERGED_AT_BOUND, Status.CONVERGED)
    status = next((one for one in worst_first if one in standing), specimens[0].status)
    if unsettled:
        costs = [s.cost / s.n_readings if s.poses else 0.0 for s in specimens]
        worst = problems[int(np.argmax(costs))].model.specimen  # of the largest cost per reading
        status, message = Status.NOT_CONVERGED, f"{unsettled}: see {worst}"
    return Pooled(
        specimens=specimens,
        spreads=_cohort_spreads(problems[0], dof, hierarchy),
        newcomer=found.common * scale,
        newcomer_covariance=found.newcomer_covariance * np.outer(scale, scale),
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
    for problem in problems:
        name = problem.model.specimen
        if len(problem.by_priors):
            raise ValueError(f"{name}: a pool has its own prior, and takes no other")
        if problem.free != first.free:
            raise ValueError(f"{name}: unknowns differ from those of {first.model.specimen}")
        if not np.allclose(values(problem, nowhere), values(first, nowhere), rtol=1e-9, atol=0.0):
            raise ValueError(f"{name}: starts from another stiffness than {first.model.specimen}")
        if noise is not None:
            refuse_correlated(problem)
            used = np.nonzero(problem.weights > 0.0)[0]
            if not np.all(declared_deviation(problem, used, noise) > 0.0):
                raise ValueError("noise must be positive for every coordinate with a weight")


def _gauss_newton(
    members: Sequence[PoolMember], dof: Indices, scatter: float | None
) -> tuple[Hierarchy, int, str]:
    """The hierarchy where no specimen moves any more, after how many rounds, and what ails it."""
    hierarchy, rounds, settled, trouble = None, 0, False, ""
    while hierarchy is None or rounds < MOST_ROUNDS:
        designs, targets = zip(*[member.linearised() for member in members], strict=True)
        readings = condense_readings(designs, targets, len(dof))
        before = hierarchy.spreads if hierarchy else None
        # spreads of largest marginal likelihood where all stand now, then a step of all of them
        estimate = estimate_spreads(readings, dof, scatter, before)
        spreads, asked, trouble = estimate.spreads, estimate.spreads, estimate.trouble
        if before is not None:
            settled = largest_change(before, asked) < SETTLED
            spreads = interpolate_spreads(
                before, asked, 1.0 if rounds < FREE_ROUNDS else DAMPED_SHARE
            )
        hierarchy = Hierarchy(readings, dof, spreads)
        _step_together(members, hierarchy)
        rounds += 1
        # another step would change nothing for members that have arrived or are stuck
        if settled and all(m.evaluation is None or m.stuck or m.arrived for m in members):
            break
    return hierarchy, rounds, trouble or ("" if settled else UNSETTLED)


def _step_together(members: Sequence[PoolMember], hierarchy: Hierarchy) -> None:
    """One step of all together that lowers their cost, or else of each by itself."""
    found = hierarchy.posterior()
    deviations = np.sqrt(np.diagonal(found.covariance, axis1=1, axis2=2))
    for member, x, deviation in zip(members, found.x, deviations, strict=True):
        member.plan_step(x, deviation, hierarchy)
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


def _cost(
    places: Sequence[tuple[PoolMember, Array, Evaluation | None]], hierarchy: Hierarchy
) -> float:
    """Squared residuals of all specimens at their points, and distance from the prior."""
    if not places:
        return 0.0
    scatter = hierarchy.spreads.scatter
    squares = [member.squares(seen, scatter) for member, _, seen in places if seen is not None]
    return sum(squares) + hierarchy.distance(np.stack([x for _, x, _ in places]))


def _cohort_spreads(
    problem: Problem, dof: Indices, hierarchy: Hierarchy
) -> tuple[CohortSpread, ...]:
    found, spreads = hierarchy.posterior(), hierarchy.spreads
    places = [int(np.argmax(dof == d)) for d in range(dof.max() + 1)]
    first, scale = [problem.free[place] for place in places], problem.scale[places]
    return tuple(
        CohortSpread(
            name=parameter.label.partition("@")[0],
            effect=parameter.effect,
            column=parameter.column,
            mean=float(found.mean[d] * scale[d]),
            mean_se=float(found.mean_sd[d] * scale[d]),
            level=float(spreads.level[d] * scale[d]),
            specimen=float(spreads.specimen[d] * scale[d]),
            rest=float(spreads.rest[d] * scale[d]),
        )
        for d, parameter in enumerate(first)
    )
