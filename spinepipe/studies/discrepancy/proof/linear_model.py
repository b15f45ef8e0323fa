"""Readings of all specimens near a fit as a linear model, and what a part of them says of the rest.

Noise-whitened readings r of a specimen are J x + U z and noise of SD one, to first order in the
unknowns x, whose priors are weak, and in nuisances z of prior N(0, 1). A part of the readings says
what both are by normal equations (Bayesian linear regression, nuisances eliminated by the Schur
complement). Fitting each part anew by the simulator would cost as much as a search.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_solve, cholesky, solve_triangular

from spinepipe.decomposition import bounded_lstsq, svd
from spinepipe.effects.contract import Array, Indices
from spinepipe.studies.discrepancy.search.baseline import BaselineFit

SIZES = np.array([0.03, 0.1, 0.2, 0.35, 0.6, 1.0])
"""Of nuisances, in prior SDs, among which the most likely is taken."""

Rows = Mapping[str, NDArray[np.bool_]]
"""Some of the whitened readings (N,) of each specimen."""


@dataclass(frozen=True)
class SpecimenRows:
    """A specimen's noise-whitened readings near a fit.

    Attributes
    ----------
    by_x, by_z : (N, m) and (N, k) derivatives. missed : (N,) measured less predicted.
    numbers : (m,) which of all unknowns its own are.
    """

    by_x: Array
    by_z: Array
    missed: Array
    numbers: Indices


@dataclass(frozen=True)
class LinearModel:
    """All specimens near a fit, and the unknowns' moves from it: priors (M,) and bounds (M,)."""

    members: Mapping[str, SpecimenRows]
    mean: Array
    sd: Array
    low: Array
    high: Array

    @classmethod
    def near(cls, at: BaselineFit, size: float) -> "LinearModel":
        """A fit to first order; nuisances of that many prior SDs."""
        fit, members = at.fit, {}
        for name, member in fit.hypothesis.members.items():
            white = at.setting.whitenings[name]
            members[name] = SpecimenRows(
                white.lengthened(fit.jacobians[name]),
                white.directions * (size * white.sizes),
                -at.plain[name].noise_only(at.readings[name].errors(fit.predicted[name])),
                np.array(member.numbers, dtype=np.int64),
            )
        unknowns = fit.hypothesis.unknowns
        return cls(
            members,
            np.array([u.mean for u in unknowns]) - fit.x,
            np.array([u.sd for u in unknowns]),
            np.minimum(np.array([u.low for u in unknowns]) - fit.x, 0.0),
            np.maximum(np.array([u.high for u in unknowns]) - fit.x, 0.0),
        )


@dataclass(frozen=True)
class _Normal:
    """Normal equations of a specimen's training.

    Attributes
    ----------
    matrix, moment : (m, m), (m,) of the unknowns, nuisances free. half : (k, k) upper triangle R of
        the nuisances' precision R'R. outer, drive : (k, m), (k,) that of both, and of nuisances.
    """

    matrix: Array
    moment: Array
    half: Array
    outer: Array
    drive: Array


class Trained:
    """What the training says: most likely unknowns x (M,), their covariance (M, M), nuisances."""

    def __init__(self, model: LinearModel, training: Rows) -> None:
        self.model = model
        self.normals = {name: _normal(one, training[name]) for name, one in model.members.items()}
        precision, moment = np.diag(model.sd**-2.0), model.mean * model.sd**-2.0
        for name, one in self.normals.items():
            numbers = model.members[name].numbers
            np.add.at(precision, np.ix_(numbers, numbers), one.matrix)
            np.add.at(moment, numbers, one.moment)
        scale = 1.0 / np.sqrt(np.diagonal(precision))  # Jacobi scaling: units become alike
        lower = cholesky(precision * np.outer(scale, scale), lower=True)
        half = solve_triangular(lower, np.diag(scale), lower=True)
        self.covariance = half.T @ half
        self.x = self.covariance @ moment
        low, high = model.low, model.high
        if not np.all((low <= self.x) & (self.x <= high)):
            # with precision L L' least squares |L' x - L^-1 moment| inside bounds
            target = solve_triangular(lower, scale * moment, lower=True)
            self.x = scale * bounded_lstsq(lower.T, target, (low / scale, high / scale))

    def missed(self, name: str, rows: NDArray[np.bool_]) -> Array:
        """(N,) what the training's prediction of some rows of a specimen misses."""
        one, normal = self.model.members[name], self.normals[name]
        x = self.x[one.numbers]
        z = cho_solve((normal.half, False), normal.drive - normal.outer @ x)
        result: Array = one.missed[rows] - one.by_x[rows] @ x - one.by_z[rows] @ z
        return result

    def told(self, name: str, rows: NDArray[np.bool_], *missed: Array) -> tuple[list[Array], int]:
        """Residuals (N,) of some rows by what the training tells of them, and how many it tells.

        They have SD one and are independent where only noise and nuisances are left. What is left
        open of the unknowns must be no misfit, and no explanation either: directions in which these
        make the prediction less sure than a reading is are taken out.
        """
        one, normal = self.model.members[name], self.normals[name]
        # covariance of the prediction: A A' by nuisances, B B' by unknowns, which move these along
        a = solve_triangular(normal.half, one.by_z[rows].T, trans="T").T
        gain = cho_solve((normal.half, False), normal.outer)
        own = cholesky(self.covariance[np.ix_(one.numbers, one.numbers)], lower=True)
        b = (one.by_x[rows] - one.by_z[rows] @ gain) @ own
        directions, sizes, _ = svd(a)
        shorter = 1.0 / np.sqrt(1.0 + sizes**2) - 1.0
        b, *left = (e + directions @ (shorter * (directions.T @ e).T).T for e in (b, *missed))
        directions, sizes, _ = svd(b)
        shorter = np.where(sizes < 1.0, 1.0 / np.sqrt(1.0 + sizes**2), 0.0) - 1.0
        told = [e + directions @ (shorter * (directions.T @ e)) for e in left]
        return told, len(b) - int((sizes >= 1.0).sum())


def _normal(one: SpecimenRows, training: NDArray[np.bool_]) -> _Normal:
    """Sums over the training, nuisances eliminated: A - B' C^-1 B of [[A, B'], [B, C]]."""
    m, k = one.by_x.shape[1], one.by_z.shape[1]
    whole = np.column_stack([one.by_x, one.by_z, one.missed])[training]
    gram = whole.T @ whole
    x, z = slice(0, m), slice(m, m + k)
    half = cholesky(np.eye(k) + gram[z, z])
    outer, drive = gram[z, x], gram[z, -1]
    gain = cho_solve((half, False), outer).T
    return _Normal(gram[x, x] - gain @ outer, gram[x, -1] - gain @ drive, half, outer, drive)


def nuisance_size(at: BaselineFit) -> float:
    """Most likely size of the nuisances beside a fit, in prior SDs (empirical Bayes).

    A search holds them as large as their priors say, so that they never pose as physics; unseen
    motion is predicted with nuisances as large as they are in this cohort. Along each of their
    directions residuals have the variance 1 of noise and that of the nuisance; others say nothing.
    """
    likelihood = np.zeros(len(SIZES))
    for name, one in at.readings.items():
        white = at.setting.whitenings[name]
        missed = at.plain[name].noise_only(one.errors(at.fit.predicted[name]))
        along = white.directions.T @ missed
        variance = 1.0 + np.outer(SIZES, white.sizes) ** 2
        likelihood -= 0.5 * np.sum(np.log(variance) + along**2 / variance, axis=1)
    return float(SIZES[np.argmax(likelihood)])
