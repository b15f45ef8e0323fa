"""Evidence for all effects of a fit together, against the base alone.

Laplace's method (Kass and Raftery 1995, doi 10.2307/2291091): chi2 / 2 of the effects' parameters,
everything else fitted anew, is taken for a parabola about the fit: curvature A, slope g (what the
fit's own prior holds in balance). With the prior N(off, S), off at a distance a,

    log evidence = gain / 2 - log det(I + A S) / 2 - a' S^-1 a / 2 + h' (A + S^-1)^-1 h / 2,

h = g + S^-1 a. Where bounds cut a strength's prior, the evidence is multiplied by the posterior's
mass between them over the prior's (encompassing prior, Klugkist and Hoijtink 2007), by marginals.
A parameter that ended at its bound has half a parabola, inwards from there, the others as they are.
A strength's SD is its declared prior SD times one of a few sizes, over which evidence is averaged.

No formula is that of nature: each effect may be off by a share of what it does, a smooth function
of how far a joint has moved and of how far a test has gone, another in each specimen (a Gaussian
process, to first order at the fit).
"""

from collections.abc import Sequence
from functools import cache

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import block_diag
from scipy.special import log_ndtr, logsumexp

from spinepipe.decomposition import eigh, pinvh
from spinepipe.effects.contract import Array
from spinepipe.studies.discrepancy.search.baseline import BaselineFit
from spinepipe.studies.discrepancy.search.hypothesis import STRENGTH_SDS
from spinepipe.studies.discrepancy.search.joint_fit import JointFit
from spinepipe.studies.discrepancy.search.prediction import (
    JointPrediction,
    NoEquilibrium,
    PredictedSpecimen,
)
from spinepipe.studies.discrepancy.search.projected import taken_out
from spinepipe.studies.discrepancy.search.screen import SIZES
from spinepipe.studies.discrepancy.search.something_else import TABLE

FORMULA_SDS = np.array([0.0, 0.05, 0.1, 0.2])
"""Shares of what an effect does by which its formula may be off, held equally likely."""

ALONG_MOTION, ALONG_TEST = 0.4, 0.3
"""Lengths over which that changes, as shares of the largest motion and of a test."""

SWEEPS = 2
"""Times that the best size of each effect is looked for."""

KNOTS = np.array([(m, t) for m in (-1.0, -0.5, 0.0, 0.5, 1.0) for t in (0.0, 0.5, 1.0)])
"""Where the process is free: shares of the largest motion, and of the test."""


def joint_log_evidence(base: JointFit, fit: JointFit) -> float:
    """For all supposed effects of a fit, against the base; formulas are taken for exact."""
    unknowns = fit.hypothesis.unknowns
    own = np.array([u.supposed is not None for u in unknowns])
    if not own.any():
        return 0.0
    curvature = curvature_of(fit, own)
    chosen = [u for u in unknowns if u.supposed is not None]
    of = np.array([u.supposed for u in chosen])
    strength = np.array([u.is_strength for u in chosen])
    away = fit.x[own] - np.array([u.mean for u in chosen])
    # the fit itself has a wider prior on strengths, by STRENGTH_SDS
    declared = np.array([u.sd / STRENGTH_SDS if u.is_strength else u.sd for u in chosen])
    ends = np.array([(u.low - u.mean, u.high - u.mean) for u in chosen])
    # at a bound chi2 / 2 rises inwards, with that slope; the others are free where these stand
    held = fit.at_bound[own]
    free = ~held
    inwards = np.where(away - ends[:, 0] < ends[:, 1] - away, 1.0, -1.0)
    slope = _slope(fit)[own]
    rise = np.maximum(inwards * slope, 0.0)

    @cache
    def at(sizes: tuple[float, ...]) -> float:
        size = np.array(sizes)[of]
        sd = np.where(strength, size, 1.0) * declared
        narrow, a = sd[free], away[free]
        covariance = np.linalg.inv(curvature[np.ix_(free, free)] + np.diag(narrow**-2.0))
        pull = slope[free] + a / narrow**2
        _, logdet = np.linalg.slogdet(np.eye(len(a)) + curvature[np.ix_(free, free)] * narrow**2)
        parabola = 0.5 * (pull @ covariance @ pull - np.sum((a / narrow) ** 2) - logdet)
        mean, spread = a - covariance @ pull, np.sqrt(np.diagonal(covariance))
        inside = _log_mass(ends[free], mean, spread)
        prior_mass = _log_mass(ends, 0.0 * away, sd)
        counted = float(inside[strength[free]].sum() - prior_mass[strength | held].sum())
        # half a parabola at the bound: its prior density there, times what is left inwards
        c = np.diagonal(curvature)[held] + sd[held] ** -2.0
        h = rise[held] + inwards[held] * away[held] / sd[held] ** 2
        density = -0.5 * (away[held] / sd[held]) ** 2 - np.log(sd[held])
        inner = 0.5 * h**2 / c - 0.5 * np.log(c) + log_ndtr(-h / np.sqrt(c))
        return float(parabola + counted + (density + inner).sum())

    # sizes of several effects hardly hang on each other: each is averaged where the others are best
    best = [1.0] * len(fit.hypothesis.supposed)
    for number in [*range(len(best))] * SWEEPS:
        tried = {at(_with(best, number, one)): one for one in SIZES.tolist()}
        best[number] = tried[max(tried)]
    most = at(tuple(best))
    spread_of_sizes = sum(
        float(logsumexp([at(_with(best, n, one)) - most for one in SIZES.tolist()]))
        for n in range(len(best))
    )
    averaged = most + spread_of_sizes - len(best) * float(np.log(len(SIZES)))
    return 0.5 * (base.chi2 - fit.chi2) + averaged


def _with(sizes: Sequence[float], number: int, one: float) -> tuple[float, ...]:
    return (*sizes[:number], one, *sizes[number + 1 :])


def curvature_of(fit: JointFit, own: NDArray[np.bool_]) -> Array:
    """(k, k) second derivative of chi2 / 2 by k of the unknowns, where all others follow by a fit.

    The others have their weak priors, the k have none: their prior comes in with the evidence.

    Parameters
    ----------
    own : (m,) which of all unknowns.
    """
    # the Schur complement of J'J + P in the others, with P = diag(1 / sd^2) of their priors: F'F of
    # the k columns of J less their projection on the others' [J; P^(1/2)], by QR
    jacobian = fit.whole_jacobian()
    priors = np.diag([1.0 / u.sd for u in fit.hypothesis.unknowns])
    others = np.vstack([jacobian[:, ~own], priors[np.ix_(~own, ~own)]])
    mine = np.vstack([jacobian[:, own], np.zeros((int((~own).sum()), int(own.sum())))])
    basis, _ = np.linalg.qr(others)
    left = mine - basis @ (basis.T @ mine)
    result: Array = left.T @ left
    return result


def _slope(fit: JointFit) -> Array:
    """(m,) slope of chi2 / 2 where the fit ended."""
    slope = np.zeros(len(fit.x))
    for name, member in fit.hypothesis.members.items():
        own = fit.jacobians[name].T @ fit.residuals[name]
        np.add.at(slope, list(member.numbers), own)
    # between its bounds a fit ends where chi2 / 2 and its prior's (x - mean)^2 / 2 sd^2 balance
    unknowns = fit.hypothesis.unknowns
    balance = [(u.mean - x) / u.sd**2 for x, u in zip(fit.x, unknowns, strict=True)]
    return np.where(fit.at_bound, slope, balance)


def _log_mass(ends: Array, mean: Array, sd: Array) -> Array:
    """(k,) log of a normal's mass between two ends (k, 2), also far out."""
    low, high = (ends[:, 0] - mean) / sd, (ends[:, 1] - mean) / sd
    # the smaller tail side: both ends mirrored where they lie above the mean
    mirrored = low > 0.0
    a, b = np.where(mirrored, -high, low), np.where(mirrored, -low, high)
    upper, lower = log_ndtr(b), log_ndtr(a)
    return np.asarray(upper + np.log(-np.expm1(np.minimum(lower - upper, -1e-12))))


def formula_error(baseline: BaselineFit) -> float:
    """Log evidence gained where the fit's named effects may be off by a share of what they do."""
    fit = baseline.fit
    named = [n for n, one in enumerate(fit.hypothesis.supposed) if one.form.name != TABLE]
    if not named:
        return 0.0
    half = np.linalg.cholesky(_kernel(KNOTS, KNOTS) + 1e-6 * np.eye(len(KNOTS)))
    without = [_without(baseline, number) for number in named]
    taken = taken_out(fit)
    grams, moments, coupled = [], [], []
    of_shared = []
    for name, one in baseline.readings.items():
        rows = []
        # a function of its own for each coordinate that was read
        read = [c for c in range(6) if any(t.count[..., c].any() for t in one.tests)]
        for number in range(len(one.tests)):
            predicted = fit.predicted[name][number]
            steps, joints, _ = predicted.shape
            furthest = np.maximum(np.abs(predicted).max(axis=0), np.finfo(float).tiny)
            gone = np.broadcast_to(np.linspace(0.0, 1.0, steps)[:, None, None], predicted.shape)
            points = np.stack([(predicted / furthest).ravel(), gone.ravel()], axis=1)
            smooth = np.linalg.solve(half, _kernel(KNOTS, points)).T
            smooth = smooth.reshape(steps, joints, 6, 1, len(KNOTS))
            done = [predicted - other[name][number] for other in without]
            effects = np.stack(done, axis=-1)[..., None]  # (T, J, 6, effects, 1)
            moves = (effects * smooth).reshape(steps, joints, 6, -1)
            apart = np.zeros((steps, joints, 6, len(read), moves.shape[-1]))
            for place, coordinate in enumerate(read):
                apart[:, :, coordinate, place] = moves[:, :, coordinate]
            rows.append(apart.reshape(steps, joints, 6, -1))
        left = taken[name].out_of(baseline.setting.whitenings[name](rows))
        grams.append(left.T @ left)
        moments.append(left.T @ taken[name].residual)
        coupled.append(left.T @ taken[name].shared)
        own = taken[name].shared.T
        of_shared.append((own @ taken[name].shared, own @ taken[name].residual))
    # a function of its own for each specimen; what these share couples them
    gram, moment, shared = block_diag(*grams), np.concatenate(moments), np.concatenate(coupled)
    if shared.shape[1]:
        gain = shared @ pinvh(sum(gram for gram, _ in of_shared), rcond=1e-10)
        gram, moment = gram - gain @ shared.T, moment - gain @ sum(m for _, m in of_shared)
    # marginal likelihood of a linear problem for each share, in the eigenbasis of its Gram matrix
    values, vectors = eigh(gram)
    variance, values = FORMULA_SDS[:, None] ** 2, np.maximum(values, 0.0)
    gain = variance * (vectors.T @ moment) ** 2 / (1.0 + variance * values)
    logs = 0.5 * np.sum(gain - np.log1p(variance * values), axis=-1)
    return float(logsumexp(logs) - np.log(len(logs)))


def _kernel(first: Array, second: Array) -> Array:
    lengths = np.array([ALONG_MOTION, ALONG_TEST])
    apart = (first[:, None] - second[None]) / lengths
    return np.asarray(np.exp(-0.5 * np.sum(apart**2, axis=-1)))


def _without(baseline: BaselineFit, number: int) -> dict[str, tuple[Array, ...]]:
    """Predicted readings of all specimens without one of the fit's effects, the rest as it is."""
    fit, subjects = baseline.fit, {}
    for name, model in fit.models.items():
        place = len(baseline.start.models[name].effects)
        keep = list(model.effects[:place])
        for other, one in enumerate(fit.hypothesis.supposed):
            copies = one.copies(name, len(baseline.tests))
            if other != number:
                keep += model.effects[place : place + copies]
            place += copies
        cases = baseline.readings[name].cases
        subjects[name] = PredictedSpecimen(model.with_effects(tuple(keep)), cases, ())
    try:
        found = JointPrediction(subjects, baseline.noise.zeroed, fit.poses).at(
            {name: np.zeros(0) for name in subjects}
        )
    except NoEquilibrium:  # without it the spine does not stand: nothing tells what it does
        return {name: fit.predicted[name] for name in subjects}
    return {name: one.readings for name, one in found.items()}
