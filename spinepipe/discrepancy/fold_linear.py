"""Folds in the linear model of a fit: what the training says of unknowns and nuisances.

All readings enter as normal equations, made once for each test and choice of load steps; a fold
sums those of its training.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.linalg import cho_factor, cho_solve, solve_triangular
from scipy.optimize import lsq_linear

from spinepipe.discrepancy.chosen import Chosen
from spinepipe.discrepancy.folds import Part
from spinepipe.discrepancy.tangent import LinearModel
from spinepipe.effects.contract import Array


@dataclass(frozen=True)
class Placed:
    """A model's prediction of a part's scored specimens, from its training.

    Attributes
    ----------
    motion : per test (T, J, 6) of the model alone. nuisances : what nuisances, as found in
        training, add to it. se : standard error of the prediction, nuisances held.
    """

    motion: Mapping[str, tuple[Array, ...]]
    nuisances: Mapping[str, tuple[Array, ...]]
    se: Mapping[str, tuple[Array, ...]]


@dataclass(frozen=True)
class _Normal:
    """Normal equations of one specimen.

    Attributes
    ----------
    held : (m, m) of the unknowns with nuisances held. matrix, moment : (m, m), (m,) with nuisances
        free under their prior. inner, outer, drive : (k, k), (k, m), (k,) of the nuisances.
    """

    held: Array
    matrix: Array
    moment: Array
    inner: Array
    outer: Array
    drive: Array

    def nuisances(self, x: Array) -> Array:
        """(k,) most likely values beside unknowns x (m,)."""
        found: Array = np.linalg.solve(self.inner, self.drive - self.outer @ x)
        return found


class LinearFolds:
    """Predictions of any part by one linear model."""

    def __init__(self, model: LinearModel, chosen: Chosen) -> None:
        self.model, self.chosen = model, chosen
        self._grams: dict[tuple[str, int, bytes], Array] = {}

    def placed(self, part: Part) -> Placed:
        """The scored specimens as the training has them."""
        model = self.model
        normals = {name: self._normal(name, part) for name in model.members}
        everyone = np.arange(len(model.mean))
        others = {name: one for name, one in normals.items() if name != part.apart}
        x, covariance = self._solved(others, everyone, np.zeros(len(everyone)))
        if part.apart is not None:
            own = self._own(part.apart)
            alone = {part.apart: normals[part.apart]}
            x[own], covariance[np.ix_(own, own)] = self._solved(alone, own, x)
        motion, nuisances, se = {}, {}, {}
        for name in part.scored:
            one = model.members[name]
            move = x[one.numbers]
            z = normals[name].nuisances(move)
            own_covariance = covariance[np.ix_(one.numbers, one.numbers)]
            motion[name] = tuple(
                p + b @ move for p, b in zip(one.predicted, one.by_x, strict=True)
            )
            nuisances[name] = tuple(moved @ z for moved in one.nuisances)
            se[name] = tuple(_se(by_x, own_covariance) for by_x in one.by_x)
        return Placed(motion, nuisances, se)

    def _own(self, specimen: str) -> Array:
        """Unknowns of no other specimen."""
        members = self.model.members
        others = [one.numbers for name, one in members.items() if name != specimen]
        return np.setdiff1d(members[specimen].numbers, np.concatenate(others))

    def _solved(
        self, normals: Mapping[str, _Normal], free: Array, x: Array
    ) -> tuple[Array, Array]:
        """Most likely values of the free unknowns (others as in x), and their covariance.

        The covariance holds the nuisances: it says what the training tells of the unknowns.
        """
        model, count = self.model, len(x)
        matrix, held, moment = np.zeros((count, count)), np.zeros((count, count)), np.zeros(count)
        for name, one in normals.items():
            at = np.ix_(model.members[name].numbers, model.members[name].numbers)
            np.add.at(matrix, at, one.matrix)
            np.add.at(held, at, one.held)
            np.add.at(moment, model.members[name].numbers, one.moment)
        fixed = np.setdiff1d(np.arange(count), free)
        precision = np.diag(model.sd[free] ** -2.0)
        drive = moment[free] - matrix[np.ix_(free, fixed)] @ x[fixed]
        drive = drive + model.mean[free] * model.sd[free] ** -2.0
        inside = np.ix_(free, free)
        found = _bounded(matrix[inside] + precision, drive, model.low[free], model.high[free])
        return found, np.linalg.inv(held[inside] + precision)

    def _normal(self, specimen: str, part: Part) -> _Normal:
        one = self.model.members[specimen]
        m, k = len(one.numbers), one.nuisances[0].shape[-1]
        gram = np.zeros((m + k + 1, m + k + 1))
        for test, steps in enumerate(part.training[specimen]):
            if steps.any():
                gram += self._gram(specimen, test, steps)
        x, z = slice(0, m), slice(m, m + k)
        inner = np.eye(k) + gram[z, z]
        outer, drive = gram[z, x], gram[z, -1]
        gain = np.linalg.solve(inner, outer).T
        matrix = gram[x, x] - gain @ outer
        return _Normal(gram[x, x], matrix, gram[x, -1] - gain @ drive, inner, outer, drive)

    def _gram(self, specimen: str, test: int, steps: Array) -> Array:
        """Products of unknowns' and nuisances' columns and the misfit, whitened."""
        key = (specimen, test, steps.tobytes())
        if key not in self._grams:
            one = self.model.members[specimen]
            misfit = self.chosen.mean(specimen, test) - one.predicted[test]
            rows = [one.by_x[test], one.nuisances[test], misfit[..., None]]
            white = self.chosen.whitening(specimen, test, steps)
            whole = white.noise_only([np.concatenate(rows, axis=-1)])
            self._grams[key] = whole.T @ whole
        return self._grams[key]


def _bounded(matrix: Array, drive: Array, low: Array, high: Array) -> Array:
    """Minimum of ``x' matrix x / 2 - drive' x`` inside bounds."""
    factor = cho_factor(matrix, lower=True)
    found: Array = cho_solve(factor, drive)
    if np.all((low <= found) & (found <= high)):
        return found
    lower = np.tril(factor[0])
    target = solve_triangular(lower, drive, lower=True)
    bounded: Array = lsq_linear(lower.T, target, bounds=(low, high)).x
    return bounded


def _se(by_x: Array, covariance: Array) -> Array:
    """(T, J, 6) standard error by the unknowns' covariance (m, m)."""
    found: Array = np.sqrt(np.maximum(np.sum((by_x @ covariance) * by_x, axis=-1), 0.0))
    return found
