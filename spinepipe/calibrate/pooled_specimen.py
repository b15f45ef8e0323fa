"""One specimen of a cohort on its way to the pooled stiffness: where it stands, where it goes."""

from dataclasses import dataclass

import numpy as np

from spinepipe.calibrate.descent import OFF_THE_PATH
from spinepipe.calibrate.fit import (
    AT_THE_BRINK,
    bounds_reached,
    names_at_bound,
    stand_up,
    tipped,
    values,
)
from spinepipe.calibrate.hierarchy import Hierarchy
from spinepipe.calibrate.problem import Evaluation, Evaluator, Problem
from spinepipe.calibrate.uncertainty import declared_deviation
from spinepipe.decomposition import bounded_lstsq
from spinepipe.effects.contract import Array
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
        jacobian = evaluation.jacobian * self.scale
        if self.noise is None:
            return evaluation.residual, jacobian
        deviation = declared_deviation(self.problem, evaluation.coordinate, self.noise)
        return evaluation.residual / deviation, jacobian / deviation[:, None]

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

    def _within_bounds(self, target: Array, hierarchy: Hierarchy) -> Array:
        """The target (m,), or where the linearised cost is least inside the bounds."""
        low, high = self.bounds
        if np.all((low <= target) & (target <= high)):
            return target
        design, aim = self.linearised()
        scatter, prior = hierarchy.spreads.scatter, np.linalg.inv(np.linalg.cholesky(hierarchy.own))
        rows = np.vstack([design / scatter, prior])
        aims = np.append(aim / scatter, prior @ hierarchy.common)
        return self.clipped(bounded_lstsq(rows, aims, (low, high)))

    def result(self, expected: Array, covariance: Array, effective: float) -> PooledSpecimen:
        """Where it has ended; at what is ``expected`` (m,) of it where it has no pose."""
        here, evaluation = self.x, self.evaluation
        if evaluation is None:
            here = self.clipped(expected)
        x = here * self.scale
        at_bound = bounds_reached(self.problem, x)
        status, message = self._ending(at_bound)
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

    def _ending(self, at_bound: Array) -> tuple[Status, str]:
        if self.evaluator is None:
            return Status.REFUSED, self.refusal
        if self.evaluation is None:
            return Status.UNSTABLE, self.refusal
        if not self.arrived:
            return Status.NOT_CONVERGED, AT_THE_BRINK if self.stuck else ON_THE_MOVE
        if self.evaluator.on_record(self.x * self.scale) is None:
            return Status.NOT_CONVERGED, OFF_THE_PATH
        if at_bound.any():
            return Status.CONVERGED_AT_BOUND, names_at_bound(self.problem, at_bound)
        return Status.CONVERGED, ""
