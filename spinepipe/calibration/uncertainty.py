"""How sure a fit is of each unknown: covariance, standard errors, identifiability, rank."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import qr

from spinepipe.calibration.problem import OF_PRIOR, Evaluation, Evaluator, Problem, shared_sums
from spinepipe.decomposition import svd
from spinepipe.effects.contract import Array
from spinepipe.units import DISPLAY_PER_SI

RANK_TOLERANCE = 1e-8
"""Directions whose singular value is this far below the largest leave no trace in the data."""

UNSEEN_SHARE = 1e-6
"""An unknown with more of its axis than this in such directions is not determined."""


@dataclass(frozen=True)
class Uncertainty:
    """Standard errors of the unknowns, of their logarithm where they are logarithmic.

    Attributes
    ----------
    covariance : (m, m); infinite for unknowns at a bound or without a trace in the data.
    standard_error : (m,); infinite where the data do not constrain the unknown.
    identifiable : (m,) bool.
    degrees_of_freedom : readings and priors less unknowns; the scatter comes from them.
    held_by_priors : how many unknowns the priors decide about: what these hold of the fit (their
        leverage). The others are decided by readings.
    silent : (m,) bool, unknowns on which no reading depends: what the fit has of them is where it
        started.
    """

    covariance: Array
    standard_error: Array
    identifiable: NDArray[np.bool_]
    degrees_of_freedom: int
    silent: NDArray[np.bool_]
    held_by_priors: float = 0.0


def refuse_correlated(problem: Problem) -> None:
    """Refuse to take readings for independent that are not.

    Raises
    ------
    ValueError
        With a zeroed case, unless the problem allows for its correlated errors.
    """
    if any(case.zeroed for case in problem.cases) and not problem.correlated:
        raise ValueError(
            "zeroed readings have correlated errors: noise cannot be given for them"
            " unless the problem is told so (correlated=True)"
        )


def declared_deviation(problem: Problem, coordinate: NDArray[np.int64], noise: Array) -> Array:
    """SD (N,) of the weighted residuals of these coordinates (N,), from ``noise`` (6,).

    That of a prior is 1: it is in SDs as it is.
    """
    scale = np.sqrt(problem.weights) * DISPLAY_PER_SI * noise
    deviation: Array = np.where(coordinate == OF_PRIOR, 1.0, scale[coordinate])
    return deviation


def uncertainty(
    problem: Problem,
    evaluation: Evaluation,
    at_bound: Array,
    identifiable_below: float,
    noise: Array | None,
) -> Uncertainty:
    """Uncertainty of a fit from its Jacobian; unknowns at a bound are held there.

    Where residuals share the error of step 0 and least squares took no account of it, the
    covariance does: (J'J)^-1 J' (I + S) J (J'J)^-1, and the scatter is that before zeroing.

    Parameters
    ----------
    noise : (6,) m and rad, of one reading (before zeroing); with None the scatter of the weighted
        residuals is used, and with no degree of freedom left nothing is identifiable.
    """
    m = len(problem.free)
    infinite = np.full((m, m), np.inf)
    nothing = np.zeros(m, dtype=bool)
    if evaluation.residual is None or evaluation.jacobian is None:
        return Uncertainty(infinite, np.full(m, np.inf), nothing, 0, nothing)
    inside = at_bound == 0
    freedom = len(evaluation.residual) - int(inside.sum())
    covariance, error = infinite, np.full(m, np.inf)
    deviation = _deviation(problem, evaluation, inside, freedom, noise)
    if deviation is not None:
        inner, known = _covariance(evaluation, inside, deviation)
        covariance = infinite.copy()
        covariance[np.ix_(inside, inside)] = inner
        error[inside] = np.where(known, np.sqrt(np.diagonal(inner)), np.inf)
    known = error < identifiable_below * problem.scale
    # leverage of the priors: their part of the trace of the hat matrix, left left'
    of_priors, by_priors = evaluation.coordinate == OF_PRIOR, 0.0
    if of_priors.any():
        left, _, _ = _visible(evaluation.jacobian[:, inside])
        by_priors = float(np.sum(left[of_priors] ** 2))
    moved = evaluation.jacobian[~of_priors] * problem.scale
    size = np.linalg.norm(moved, axis=0)
    silent = size <= RANK_TOLERANCE * size.max(initial=0.0)
    return Uncertainty(covariance, error, known, freedom, silent, by_priors)


def _deviation(
    problem: Problem,
    evaluation: Evaluation,
    inside: NDArray[np.bool_],
    freedom: int,
    noise: Array | None,
) -> Array | None:
    """(N,) SD of each weighted residual: declared, or one scatter for all, or None if unknown.

    Of residuals that share the error of step 0 it is the SD before zeroing.
    """
    residual, jacobian = evaluation.residual, evaluation.jacobian
    assert residual is not None
    assert jacobian is not None
    if noise is not None:
        return declared_deviation(problem, evaluation.coordinate, noise)
    if freedom <= 0:
        return None
    # expected sum of squares in units of the scatter: trace of (I + S) less what is fitted of it,
    # trace of left' (I + S) left
    left, _, _ = _visible(jacobian[:, inside])
    everything = len(residual) + np.count_nonzero(evaluation.sharing >= 0)
    fitted = np.sum(left**2) + np.sum(shared_sums(left, evaluation.sharing) ** 2)
    return np.full(len(residual), np.sqrt(residual @ residual / (everything - fitted)))


def _visible(jacobian: Array) -> tuple[Array, Array, Array]:
    """Directions that leave a trace: left vectors (N, k), singular values (k,), right (k, m)."""
    left, singular, right = svd(jacobian)
    seen = singular > RANK_TOLERANCE * max(singular.max(initial=0.0), np.finfo(float).tiny)
    return left[:, seen], singular[seen], right[seen]


def _covariance(
    evaluation: Evaluation, inside: NDArray[np.bool_], deviation: Array
) -> tuple[Array, NDArray[np.bool_]]:
    """Covariance (m, m) of the unknowns and which of them (m,) the data determine at all."""
    assert evaluation.jacobian is not None
    # pseudo-inverse of J times the readings' SDs: G G' + (G s)(G s)' for errors that are shared
    left, singular, right = _visible(evaluation.jacobian[:, inside])
    gain = (right.T / singular) @ left.T * deviation
    shared = shared_sums(gain.T, evaluation.sharing)
    covariance = gain @ gain.T + shared.T @ shared
    unseen = np.linalg.norm(np.eye(right.shape[1]) - right.T @ right, axis=0)
    known = unseen < UNSEEN_SHARE
    covariance[~known], covariance[:, ~known] = np.inf, np.inf
    return covariance, known


@dataclass(frozen=True)
class Rank:
    """What the data tell of the unknowns at the start of a fit.

    Attributes
    ----------
    rank : number of independent combinations that are told; None where the start has no pose.
    silent : (m,) which unknowns to leave out so that as many stay as are told, the best told ones.
    message : why there is no rank.
    """

    rank: int | None
    silent: tuple[bool, ...]
    message: str = ""


def rank_at_start(problem: Problem, noise: Array | None, told_below: float) -> Rank:
    """The rank of the Jacobian at the start, in the noise of the readings.

    A combination is told where its standard error is below ``told_below`` typical changes of an
    unknown (of the natural logarithm of a stiffness: 1 is a factor of 2.7). Errors that zeroed
    readings share are left out: they lower a rank nowhere but at its edge.

    Parameters
    ----------
    noise : (6,) m and rad, SD of one reading; None: whatever leaves a trace is told.

    Raises
    ------
    RefusedModel
        Where nothing that was measured has a weight, or the engine refuses the model.
    """
    found = Evaluator(problem).at(np.zeros(len(problem.free)))
    if found.jacobian is None:
        return Rank(None, (False,) * len(problem.free), found.message)
    seen = found.jacobian * problem.scale
    if noise is None:
        least = RANK_TOLERANCE * max(float(np.abs(seen).max(initial=0.0)), np.finfo(float).tiny)
    else:
        seen = seen / declared_deviation(problem, found.coordinate, noise)[:, None]
        least = 1.0 / told_below
    rank = int((svd(seen)[1] > least).sum())
    order = qr(seen, mode="r", pivoting=True)[1]  # the best told first, each beside those before
    silent = np.isin(np.arange(len(order)), order[rank:])
    return Rank(rank, tuple(map(bool, silent)))
