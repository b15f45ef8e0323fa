"""Folds in the linear model of a fit: what the training says of unknowns and nuisances.

All readings enter as normal equations, made once for each test and choice of load steps; a fold
sums those of its training.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.linalg import cholesky, solve, solve_triangular
from scipy.optimize import lsq_linear

from spinepipe.discrepancy.proof.chosen import Chosen, Flags
from spinepipe.discrepancy.proof.folds import Part
from spinepipe.discrepancy.proof.tangent import LinearModel
from spinepipe.effects.contract import Array, Indices


@dataclass(frozen=True)
class Placed:
    """A model's prediction of a part's scored specimens, from its training.

    Attributes
    ----------
    motion : per test (T, J, 6) of the model alone. nuisances : what nuisances, as found in
        training, add to it.
    """

    motion: Mapping[str, tuple[Array, ...]]
    nuisances: Mapping[str, tuple[Array, ...]]


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
        found: Array = solve(self.inner, self.drive - self.outer @ x, assume_a="pos")
        return found


class LinearFolds:
    """Predictions of any part by one linear model."""

    def __init__(self, model: LinearModel, chosen: Chosen) -> None:
        self.model, self.chosen = model, chosen
        self._grams: dict[tuple[str, int, bytes], Array] = {}

    def placed(self, part: Part) -> Placed:
        """The scored specimens as the training has them."""
        members = self.model.members
        normals = {name: self._normal(name, part) for name in members}
        x = self._fitted(part, normals)
        motion, nuisances = {}, {}
        for name in part.scored:
            one, move = members[name], x[members[name].numbers]
            z = normals[name].nuisances(move)
            motion[name] = tuple(
                p + by_x @ move for p, by_x in zip(one.predicted, one.by_x, strict=True)
            )
            nuisances[name] = tuple(moved @ z for moved in one.nuisances)
        return Placed(motion, nuisances)

    def standard_errors(self, part: Part) -> dict[str, tuple[Array, ...]]:
        """Per test (T, J, 6) standard error of what the training predicts, nuisances held."""
        members, count = self.model.members, len(self.model.mean)
        precision = np.diag(self.model.sd**-2.0)
        for name, one in members.items():
            np.add.at(precision, np.ix_(one.numbers, one.numbers), self._normal(name, part).held)
        covariance: Array = solve(precision, np.eye(count), assume_a="pos")
        found = {}
        for name in part.scored:
            own = covariance[np.ix_(members[name].numbers, members[name].numbers)]
            found[name] = tuple(_se(by_x, own) for by_x in members[name].by_x)
        return found

    def left_open(self, part: Part) -> dict[str, Array]:
        """(k, k) covariance of each scored specimen's nuisances after training, unknowns held."""
        found = {}
        for name in part.scored:
            inner = self._normal(name, part).inner
            found[name] = solve(inner, np.eye(len(inner)), assume_a="pos")
        return found

    def _fitted(self, part: Part, normals: Mapping[str, _Normal]) -> Array:
        """(M,) most likely values."""
        others = {name: one for name, one in normals.items() if name != part.apart}
        x = np.zeros(len(self.model.mean))
        x = self._solved(others, np.arange(len(x)), x)
        if part.apart is not None:
            own = own_unknowns({n: m.numbers for n, m in self.model.members.items()}, part.apart)
            x[own] = self._solved({part.apart: normals[part.apart]}, own, x)
        return x

    def _solved(self, normals: Mapping[str, _Normal], free: Indices, x: Array) -> Array:
        """Most likely values of the free unknowns, others as in x."""
        model, count = self.model, len(x)
        matrix, moment = np.diag(model.sd**-2.0), model.mean * model.sd**-2.0
        for name, one in normals.items():
            numbers = model.members[name].numbers
            np.add.at(matrix, np.ix_(numbers, numbers), one.matrix)
            np.add.at(moment, numbers, one.moment)
        fixed = np.setdiff1d(np.arange(count), free)
        drive = moment[free] - matrix[np.ix_(free, fixed)] @ x[fixed]
        return _bounded(matrix[np.ix_(free, free)], drive, model.low[free], model.high[free])

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
        gain = solve(inner, outer, assume_a="pos").T
        matrix = gram[x, x] - gain @ outer
        return _Normal(gram[x, x], matrix, gram[x, -1] - gain @ drive, inner, outer, drive)

    def _gram(self, specimen: str, test: int, steps: Flags) -> Array:
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


def own_unknowns(numbers: Mapping[str, Indices], specimen: str) -> Indices:
    """Unknowns of no other specimen."""
    others = [own for name, own in numbers.items() if name != specimen]
    return np.setdiff1d(numbers[specimen], np.concatenate(others))


def _bounded(matrix: Array, drive: Array, low: Array, high: Array) -> Array:
    """Minimum of ``x' matrix x / 2 - drive' x`` inside bounds."""
    scale = 1.0 / np.sqrt(np.diagonal(matrix))  # unknowns of different units become alike
    lower = cholesky(matrix * np.outer(scale, scale), lower=True)
    target = solve_triangular(lower, scale * drive, lower=True)
    found: Array = scale * solve_triangular(lower.T, target)
    if np.all((low <= found) & (found <= high)):
        return found
    inside = lsq_linear(lower.T, target, bounds=(low / scale, high / scale), method="bvls")
    bounded: Array = scale * inside.x
    return bounded


def _se(by_x: Array, covariance: Array) -> Array:
    """(T, J, 6) standard error by the unknowns' covariance (m, m)."""
    found: Array = np.sqrt(np.maximum(np.sum((by_x @ covariance) * by_x, axis=-1), 0.0))
    return found
