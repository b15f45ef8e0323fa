"""Evidence for an effect of a nonlinear fit, by Laplace's method."""

import numpy as np
from numpy.typing import NDArray
from scipy.special import log_ndtr, logsumexp

from spinepipe.discrepancy.evidence import SIZES
from spinepipe.discrepancy.hypothesis import STRENGTH_SDS
from spinepipe.discrepancy.joint_fit import JointFit
from spinepipe.effects.contract import Array


def laplace(fit: JointFit, number: int, gain: float) -> float:
    """Log evidence for one supposed effect of a fit, whose unknowns lower chi2 by ``gain``.

    The likelihood is taken for normal around the fit; strengths are N(off, t^2), averaged over the
    sizes t of the screen, shapes as their priors.
    """
    unknowns = fit.hypothesis.unknowns
    own = np.array([u.supposed == number for u in unknowns])
    curvature = curvature_of(fit, own)
    chosen = [u for u in unknowns if u.supposed == number]
    away = fit.x[own] - np.array([u.mean for u in chosen])
    is_strength = np.array([u.is_strength for u in chosen])
    declared = np.array([u.sd / STRENGTH_SDS if u.is_strength else u.sd for u in chosen])
    parameters = fit.hypothesis.supposed[number].form.variant.create().parameters
    sides = np.array([parameters[u.column].side for u in chosen])
    found = []
    for size in SIZES:
        sd = np.where(is_strength, size, 1.0) * declared
        spread = np.eye(len(sd)) + curvature * sd**2
        _, logdet = np.linalg.slogdet(spread)
        fit_to_prior = away @ np.linalg.solve(spread, curvature @ away)
        posterior = np.linalg.inv(curvature + np.diag(sd**-2.0))
        mean = posterior @ (curvature @ away)
        inside = sides * mean / np.sqrt(np.diagonal(posterior))
        half = np.where(sides != 0.0, np.log(2.0) + log_ndtr(inside), 0.0)
        found.append(-0.5 * (logdet + fit_to_prior) + float(half.sum()))
    return 0.5 * gain + float(logsumexp(found)) - float(np.log(len(SIZES)))


def curvature_of(fit: JointFit, own: NDArray[np.bool_]) -> Array:
    """(k, k) curvature of half chi2 by some unknowns, all others free (and weakly held)."""
    jacobian = fit.whole_jacobian()
    priors = np.diag([1.0 / u.sd for u in fit.hypothesis.unknowns])
    others = np.vstack([jacobian[:, ~own], priors[np.ix_(~own, ~own)]])
    mine = np.vstack([jacobian[:, own], np.zeros((int((~own).sum()), int(own.sum())))])
    basis, _ = np.linalg.qr(others)
    left = mine - basis @ (basis.T @ mine)
    result: Array = left.T @ left
    return result
