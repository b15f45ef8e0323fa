"""A calibration problem: a model, the tests it was measured in, and what may be moved to fit.

Bounds of unknowns are drawn in to what the effects declare for their parameters. Readings that were
zeroed at step 0 share its error: whitening makes them independent again.

With one SD for every reading before zeroing, the n readings of a joint's coordinate in one cycle
have covariance SD^2 (I + 1 1'). The inverse root of I + 1 1' is I - c 1 1' with c = (1 - 1 / sqrt(1
+ n)) / n: along 1 it is 1 + n, across it 1. Least squares on whitened residuals is generalised
least squares (Aitken 1935, doi:10.1017/S0370164600014346).

A normal prior of an unknown is a reading of it: the model's value, with the prior's SD. It is one
more residual in every respect.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from spinepipe.calibration.loss import counted
from spinepipe.calibration.solvers import AtRest, CaseResiduals, Settling, compare_with_record
from spinepipe.effects import EffectKind
from spinepipe.effects.contract import Array
from spinepipe.model import MeasuredCase, RefusedModel, SpineModel
from spinepipe.statics import (
    Course,
    FreeParameter,
    System,
    declared,
    no_settling,
    observe,
    with_parameters,
)
from spinepipe.units import DISPLAY_PER_SI, subtract_baseline
from spinepipe.world import Chain

OF_PRIOR = -1
"""In place of the coordinate of a residual that is no reading's."""

SAME_POSE = 1e-7
"""m and rad: one pose solved from two sides differs by less, two branches of a snap by more."""


@dataclass(frozen=True)
class Problem:
    """What to fit.

    Attributes
    ----------
    weights : (6,) cost weight of each coordinate on mm2 and deg2; zero leaves it out.
    course : how loads come on in time when the pose is read while the spine still settles; None
        for poses at rest.
    lower, upper : (m,) bounds of the unknowns, relative to the model's values (log or absolute).
    correlated : whether the readings of a zeroed case share the error of step 0, and the cost
        allows for it: its residuals are then whitened, each with the SD of one reading before it
        was zeroed, and least squares is generalised least squares.
    along_bounds : whether optima are expected on bounds, as of strengths that may be off: fits then
        go along them.
    prior_sd : (m,) SD of the normal prior of each unknown around the model's value, infinite for
        none; in the unknown's unit, and beside weights that are one over squared SDs. None: no
        unknown has any.
    """

    model: SpineModel
    cases: tuple[MeasuredCase, ...]
    free: tuple[FreeParameter, ...]
    weights: Array
    lower: Array
    upper: Array
    course: Course | None = None
    correlated: bool = False
    along_bounds: bool = False
    prior_sd: Array | None = None

    @cached_property
    def scale(self) -> Array:
        """(m,) size of a typical change of each unknown: 1 for a logarithm, else a prior SD."""
        sizes = [
            1.0 if parameter.logarithmic else declared(self.model, parameter).prior_scale
            for parameter in self.free
        ]
        if self.prior_sd is None:
            return np.array(sizes)
        return np.where(np.isfinite(self.prior_sd), self.prior_sd, sizes)

    @cached_property
    def by_priors(self) -> Array:
        """(P, m) residuals of the P priors by the unknowns."""
        if self.prior_sd is None:
            return np.zeros((0, len(self.free)))
        held = np.isfinite(self.prior_sd)
        rows: Array = np.diag(1.0 / np.where(held, self.prior_sd, 1.0))[held]
        return rows

    def has_prior(self, unknown: int) -> bool:
        """Whether an unknown has a prior."""
        return self.prior_sd is not None and bool(np.isfinite(self.prior_sd[unknown]))


@dataclass(frozen=True)
class Evaluation:
    """Weighted residuals (N,) and Jacobian (N, m) at one point; None where it has no equilibrium.

    Those of readings, then those of priors.

    Attributes
    ----------
    poses : (T, n) of every case.
    coordinate : (N,) which of the six each residual is of; `OF_PRIOR` for a prior.
    sharing : (N,) number of the residuals that share an error of step 0 which the cost takes no
        account of; -1 for none.
    """

    residual: Array | None
    jacobian: Array | None
    poses: tuple[Array, ...]
    coordinate: NDArray[np.int64]
    sharing: NDArray[np.int64]
    message: str = ""


class Evaluator:
    """Evaluates a problem; the chain is loaded once, neighbouring solutions are reused."""

    def __init__(self, problem: Problem, beside: "Evaluator | None" = None) -> None:
        """Load the chain.

        Parameters
        ----------
        beside : one whose problem has the same cases, unknowns and course, and a model that differs
            in numbers alone: they are solved in one stack, see `side_by_side`.

        Raises
        ------
        RefusedModel
            When nothing that was measured has a weight, or the engine refuses the model, or a
            course is asked of a model that cannot move in time.
        """
        problem = replace(problem, cases=needed(problem))
        bounds = within_declared(problem.model, problem.free, problem.lower, problem.upper)
        self.problem = problem = replace(problem, lower=bounds[0], upper=bounds[1])
        # of others in a stack the chain's shape is all that is asked for here
        chain = Chain(problem.model) if beside is None else beside._systems[0].chain
        loads = [case.case for case in problem.cases]
        self._systems: list[System] = [System(chain, problem.model, case) for case in loads]
        refusal = no_settling(self._systems[0]) if problem.course else None
        if refusal:
            raise RefusedModel(refusal)
        self._used = [_used(m, problem.weights) for m in problem.cases]
        of_readings = [np.nonzero(used)[2] for used in self._used]
        priors = np.full(len(problem.by_priors), OF_PRIOR)
        self.coordinate = np.concatenate([*of_readings, priors])
        alone = np.full(len(priors), -1)
        shared = sharing(problem.cases, self._used, problem.correlated)
        self.sharing = np.concatenate([shared, alone])
        self._scale = np.sqrt(problem.weights) * DISPLAY_PER_SI
        self._solver: AtRest | Settling
        if beside is not None:
            self._solver = beside._solver
        elif problem.course:
            self._solver = Settling(problem.model, loads, problem.free, problem.course)
        else:
            self._solver = AtRest(problem.model, loads, problem.free, problem.scale)
        self._known: dict[bytes, Evaluation] = {}
        self.evaluations = 0

    def forget(self) -> None:
        """Solve the next point from the neutral pose, not from its neighbour, nor recall it."""
        self._solver.forget()
        self._known.clear()

    def start_at(self, x: Array) -> None:
        """Begin the next searches at x (m,), wherever others have been; nothing is recalled."""
        self._solver.start_at(self.problem.model, x)
        self._known.clear()

    def at(self, x: Array) -> Evaluation:
        """Residuals and Jacobian with the unknowns moved by x (m,); known points are recalled."""
        return self.together([(0, x)])[0]

    def together(self, points: Sequence[tuple[int, Array]]) -> list[Evaluation]:
        """The same at x (m,) of several searches, each with its number."""
        return side_by_side([(number, self, x) for number, x in points])

    def _evaluation(self, x: Array, seen: CaseResiduals | str) -> Evaluation:
        if isinstance(seen, str):
            return Evaluation(None, None, (), self.coordinate, self.sharing, seen)
        told = [counted(self._errors(number, one)) for number, one in enumerate(seen.readings)]
        priors = self.problem.by_priors
        residual = np.concatenate([*(one for one, _ in told), priors @ x])
        by_x = [
            slopes[:, None] * self._jacobian(number, by_x)
            for number, ((_, slopes), by_x) in enumerate(zip(told, seen.by_x, strict=True))
        ]
        jacobian = np.concatenate([*by_x, priors])
        return Evaluation(residual, jacobian, seen.poses, self.coordinate, self.sharing)

    def on_record(self, x: Array) -> Evaluation | None:
        """The point as the engine of record has it; None where the loads lead elsewhere.

        Raises
        ------
        Disagreement
            Where the engine differs by more than rounding.
        """
        found, problem = self.at(x), self.problem
        model, cases = (
            with_parameters(problem.model, problem.free, x),
            [c.case for c in problem.cases],
        )
        poses = compare_with_record(
            self._solver.record(x, problem.model), model, cases, found.poses, SAME_POSE
        )
        if poses is None:
            return None
        chain = self._systems[0].chain
        seen = [
            np.stack([observe(System(chain, model, case), q, k) for k, q in enumerate(ends)])
            for case, ends in zip(cases, poses, strict=True)
        ]
        return replace(found, residual=self._residuals(x, seen), poses=poses)

    def _residuals(self, x: Array, readings: Sequence[Array]) -> Array:
        """(N,) of the readings (T, J, 6) of every case, and of the priors of x (m,)."""
        of_readings = [self._residual(number, one) for number, one in enumerate(readings)]
        return np.concatenate([*of_readings, self.problem.by_priors @ x])

    def _residual(self, number: int, seen: Array) -> Array:
        """(N,) what counts of the readings (T, J, 6) of one case, see `counted`."""
        return counted(self._errors(number, seen))[0]

    def _errors(self, number: int, seen: Array) -> Array:
        """(N,) weighted errors of the readings (T, J, 6) of one case that enter the cost."""
        measured = self.problem.cases[number]
        errors = subtract_baseline(seen, measured.zeroed) - measured.measured
        return self._entering(number, errors * self._scale)

    def _jacobian(self, number: int, by_x: Array) -> Array:
        """(N, m) derivative of the errors of one case, from that of its readings."""
        seen = subtract_baseline(by_x, self.problem.cases[number].zeroed)
        return self._entering(number, seen * self._scale[:, None])

    def _entering(self, number: int, errors: Array) -> Array:
        """(N, …) what enters the cost of errors (T, J, 6, …) of one case."""
        used = self._used[number]
        if self.problem.correlated and self.problem.cases[number].zeroed:
            errors = whitened(errors, used)
        return errors[used]


def side_by_side(points: Sequence[tuple[int, Evaluator, Array]]) -> list[Evaluation]:
    """Residuals and Jacobians of evaluators that share a stack; known points are recalled.

    Parameters
    ----------
    points : x (m,) of each of some searches, with the search's number and its evaluator.
    """
    new = [(number, one, x) for number, one, x in points if x.tobytes() not in one._known]
    if new:
        models = [one.problem.model for _, one, _ in new]
        found = new[0][1]._solver.solve([(number, x) for number, _, x in new], models)
        for (_, one, x), seen in zip(new, found, strict=True):
            one.evaluations += 1
            one._known[x.tobytes()] = one._evaluation(x, seen)
    return [one._known[x.tobytes()] for _, one, x in points]


def among(evaluators: Sequence[Evaluator], asked: Sequence[tuple[int, Array]]) -> list[Evaluation]:
    """The same for searches in lockstep, by the number of each among ``evaluators``."""
    return side_by_side([(number, evaluators[number], x) for number, x in asked])


def lead(points: Sequence[tuple[Evaluator, Array]]) -> None:
    """Solve at once where loads lead models at x (m,), of evaluators that share a stack.

    `Evaluator.on_record` and `Evaluator.start_at` then find it.
    """
    if points:
        points[0][0]._solver.lead([(one.problem.model, x) for one, x in points])


def sharing(
    cases: Sequence[MeasuredCase], used: Sequence[NDArray[np.bool_]], correlated: bool
) -> NDArray[np.int64]:
    """(N,) see `Evaluation`: one number for each zeroed case, joint and coordinate."""
    numbers = []
    for first, (case, read) in enumerate(zip(cases, used, strict=True)):
        _, joint, coordinate = np.nonzero(read)
        own = (first * read.shape[1] + joint) * 6 + coordinate
        numbers.append(own if case.zeroed and not correlated else np.full(len(own), -1))
    return np.concatenate(numbers)


def needed(problem: Problem) -> tuple[MeasuredCase, ...]:
    """The cases with readings that enter the cost, and the load steps that these need.

    Raises
    ------
    RefusedModel
        When nothing that was measured has a weight.
    """
    kinds = {scoped.effect.kind for scoped in problem.model.effects}
    pressed = bool(np.any(problem.model.gravity)) or EffectKind.LOAD in kinds
    found = []
    for measured in problem.cases:
        read = np.flatnonzero(np.any(_used(measured, problem.weights), axis=(1, 2))).tolist()
        if not read:
            continue
        # steps go that neither carry a reading nor lead to those that do; of zeroed readings and
        # laws that remember each step counts
        if not (measured.zeroed or EffectKind.PATH in kinds):
            if problem.course is None:  # steps that settle begin from rest, each for itself
                read = measured.case.leading_to(read, pressed)
            case = replace(measured.case, steps=tuple(measured.case.steps[at] for at in read))
            measured = replace(measured, case=case, measured=measured.measured[read])
        found.append(measured)
    if not found:
        raise RefusedModel(f"{problem.model.specimen}: no reading enters the cost")
    return tuple(found)


def _used(measured: MeasuredCase, weights: Array) -> NDArray[np.bool_]:
    """(T, J, 6) which readings enter the cost; the zeros that zeroing makes of step 0 are none."""
    used: NDArray[np.bool_] = np.isfinite(measured.readings) & (weights > 0.0)
    return used


def within_declared(
    model: SpineModel, free: Sequence[FreeParameter], lower: Array, upper: Array
) -> tuple[Array, Array]:
    """Lower and upper bounds (m,) of the unknowns that keep every row they move as declared."""
    lower, upper = lower.copy(), upper.copy()
    for index, parameter in enumerate(free):
        limits = declared(model, parameter)
        values = model.effects[parameter.effect].values
        for value in values[list(parameter.rows), parameter.column]:
            low, high = limits.low - value, limits.high - value
            if parameter.logarithmic:
                low = np.log(limits.low / value) if limits.low > 0.0 else -np.inf
                high = np.log(limits.high / value)
            lower[index], upper[index] = max(lower[index], low), min(upper[index], high)
    return lower, upper


def whitened(errors: Array, used: NDArray[np.bool_]) -> Array:
    """Errors of a zeroed case, or their derivatives, as combinations of equal SD, uncorrelated.

    Parameters
    ----------
    errors : (T, J, 6) or (T, J, 6, m); what is not used may be NaN.
    used : (T, J, 6) which readings enter the cost; the zeros of step 0 are none.

    Returns
    -------
    Of the same shape; each used element has the SD of one reading before it was zeroed.
    """
    there = used.reshape(*used.shape, *[1] * (errors.ndim - used.ndim))
    errors = np.where(there, errors, 0.0)
    # I - c 1 1' along the steps, see the head of this file
    n = np.maximum(there.sum(axis=0), 1)
    shared: Array = (1.0 - 1.0 / np.sqrt(1.0 + n)) / n * errors.sum(axis=0)
    result: Array = errors - shared
    return result


def shared_sums(rows: Array, sharing: NDArray[np.int64]) -> Array:
    """(G, k) sums of rows (N, k) that share an error; those of number -1 are left out."""
    _, group = np.unique(sharing, return_inverse=True)
    sums = np.zeros((group.max(initial=-1) + 1, rows.shape[1]))
    np.add.at(sums, group, rows)
    return sums[1:] if (sharing < 0).any() else sums
