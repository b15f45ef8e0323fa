"""What partial pooling finds: specimens, how they spread, and what to expect of another one."""

from dataclasses import dataclass

from spinepipe.calibrate.problem import MeasuredCase
from spinepipe.effects.contract import Array
from spinepipe.statics import Status


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
