"""Partial pooling: levels lean on their specimen's mean, specimens on the cohort.

How strongly is told by the data themselves (empirical Bayes): the motion of every specimen is
linearised where it stands, the spreads are those of largest marginal likelihood there, and all go
to the posterior mean; so on until nobody moves (Gauss-Newton with Laplace's approximation;
Lindstrom & Bates 1990, doi:10.2307/2532087).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from spinepipe.calibrate.fit import values
from spinepipe.calibrate.hierarchy import Hierarchy, between, change, condensed, estimated
from spinepipe.calibrate.pooled_specimen import COST_TIE, SMALLEST_SHARE, PooledSpecimen, PoolMember
from spinepipe.calibrate.problem import Evaluation, Problem
from spinepipe.calibrate.uncertainty import declared_deviation, refuse_correlated
from spinepipe.effects.contract import Array, Indices
from spinepipe.status import Status


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
    dof, scale = _degrees_of_freedom(problems[0]), problems[0].scale
    starts = starts or [np.zeros(len(dof))] * len(problems)
    members = [PoolMember(p, x, noise) for p, x in zip(problems, starts, strict=True)]
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
    members: Sequence[PoolMember], dof: Indices, scatter: float | None
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


def _move(members: Sequence[PoolMember], hierarchy: Hierarchy) -> None:
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


def _cost(
    places: Sequence[tuple[PoolMember, Array, Evaluation | None]], hierarchy: Hierarchy
) -> float:
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
