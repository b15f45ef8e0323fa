"""Folds in the linear model of a fit: what the training says of unknowns and nuisances.

A fit is a linear model around where it stands, readings to first order in its unknowns and in the
nuisances. All readings enter as normal equations, made once for each test and choice of load steps;
a fold sums those of its training (Bayesian linear regression with Gaussian priors, nuisances
eliminated by the Schur complement). The surrogate without physics is the base and a ridge on the
generic basis.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import cho_solve, cholesky, solve_triangular

from spinepipe.decomposition import bounded_lstsq
from spinepipe.effects.contract import Array, Indices
from spinepipe.studies.discrepancy.proof.folds import ChosenSteps, Flags, FoldFit
from spinepipe.studies.discrepancy.search.baseline import BaselineFit
from spinepipe.studies.discrepancy.search.hypothesis import Unknown
from spinepipe.studies.discrepancy.search.lack_of_fit import generic_columns
from spinepipe.studies.discrepancy.search.whitening import Whitening
from spinepipe.units import COORDINATES


@dataclass(frozen=True)
class Tangent:
    """One specimen's readings near a fit; zero where nothing was read.

    Attributes
    ----------
    predicted : per test (T, J, 6). by_x : per test (T, J, 6, m), by each of its unknowns.
    numbers : (m,) which of all unknowns these are.
    nuisances : per test (T, J, 6, k), by nuisances of SD one.
    """

    predicted: tuple[Array, ...]
    by_x: tuple[Array, ...]
    numbers: Indices
    nuisances: tuple[Array, ...]


@dataclass(frozen=True)
class LinearModel:
    """All specimens near a fit, and the unknowns' moves from it: priors (M,) and bounds (M,)."""

    members: Mapping[str, Tangent]
    mean: Array
    sd: Array
    low: Array
    high: Array


def tangent(grounds: BaselineFit, nuisance_size: float) -> LinearModel:
    """The grounds' fit to first order; nuisances of that many prior SDs."""
    fit = grounds.fit
    unknowns: tuple[Unknown, ...] = fit.hypothesis.unknowns
    members = {}
    for name, member in fit.hypothesis.members.items():
        plain, full = grounds.plain[name], grounds.setting.whitenings[name]
        members[name] = Tangent(
            fit.predicted[name],
            in_readings(plain, full.lengthened(fit.jacobians[name])),
            np.array(member.numbers, dtype=np.int64),
            in_readings(plain, full.directions * (nuisance_size * full.sizes)),
        )
    return LinearModel(
        members,
        np.array([u.mean for u in unknowns]) - fit.x,
        np.array([u.sd for u in unknowns]),
        np.minimum(np.array([u.low for u in unknowns]) - fit.x, 0.0),
        np.maximum(np.array([u.high for u in unknowns]) - fit.x, 0.0),
    )


def in_readings(plain: Whitening, white: Array) -> tuple[Array, ...]:
    """(T, J, 6, m) per test, of noise-whitened rows (N, m): the inverse of ``noise_only``."""
    found: list[Array] = []
    at = 0
    for root, used in zip(plain.roots, plain.used, strict=True):
        rows = np.zeros((*used.shape, white.shape[1]))
        count = int(used.sum())
        rows[used] = white[at : at + count]
        at += count
        # roots are zero in steps that were not read: ones on their diagonal make them invertible
        empty = ~used.transpose(1, 2, 0)  # (J, 6, T)
        square = root + empty[..., None] * np.eye(used.shape[0])
        raw = np.asarray(np.linalg.solve(square, rows.transpose(1, 2, 0, 3)), dtype=np.float64)
        found.append(raw.transpose(2, 0, 1, 3))
    return tuple(found)


@dataclass(frozen=True)
class FoldPrediction:
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
        return _solve_scaled(self.inner, self.drive - self.outer @ x)


class LinearFolds:
    """Predictions of any part by one linear model."""

    def __init__(self, model: LinearModel, chosen: ChosenSteps) -> None:
        self.model, self.chosen = model, chosen
        self._grams: dict[tuple[str, int, bytes], Array] = {}

    def predict(self, part: FoldFit) -> FoldPrediction:
        """The scored specimens as the training has them."""
        members = self.model.members
        normals = {name: self._normal(name, part) for name in members}

        # most likely values (M,): of a specimen apart its own are fitted last, to it alone
        others = {name: one for name, one in normals.items() if name != part.apart}
        x = np.zeros(len(self.model.mean))
        x = self._solve(others, np.arange(len(x)), x)
        if part.apart is not None:
            own = own_unknowns({n: m.numbers for n, m in members.items()}, part.apart)
            x[own] = self._solve({part.apart: normals[part.apart]}, own, x)

        motion, nuisances = {}, {}
        for name in part.scored:
            one, move = members[name], x[members[name].numbers]
            z = normals[name].nuisances(move)
            motion[name] = tuple(
                p + by_x @ move for p, by_x in zip(one.predicted, one.by_x, strict=True)
            )
            nuisances[name] = tuple(moved @ z for moved in one.nuisances)
        return FoldPrediction(motion, nuisances)

    def standard_errors(self, part: FoldFit) -> dict[str, tuple[Array, ...]]:
        """Per test (T, J, 6) standard error of what the training predicts, nuisances held."""
        members, count = self.model.members, len(self.model.mean)
        precision = np.diag(self.model.sd**-2.0)
        for name, one in members.items():
            np.add.at(precision, np.ix_(one.numbers, one.numbers), self._normal(name, part).held)
        covariance = _solve_scaled(precision, np.eye(count))
        found = {}
        for name in part.scored:
            own = covariance[np.ix_(members[name].numbers, members[name].numbers)]
            found[name] = tuple(
                np.sqrt(np.maximum(np.sum((by_x @ own) * by_x, axis=-1), 0.0))
                for by_x in members[name].by_x
            )
        return found

    def left_open(self, part: FoldFit) -> dict[str, Array]:
        """(k, k) covariance of each scored specimen's nuisances after training, unknowns held."""
        found = {}
        for name in part.scored:
            inner = self._normal(name, part).inner
            found[name] = _solve_scaled(inner, np.eye(len(inner)))
        return found

    def _solve(self, normals: Mapping[str, _Normal], free: Indices, x: Array) -> Array:
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

    def _normal(self, specimen: str, part: FoldFit) -> _Normal:
        """Sums over the training, nuisances eliminated: A - B' C^-1 B of [[A, B'], [B, C]]."""
        one = self.model.members[specimen]
        m, k = len(one.numbers), one.nuisances[0].shape[-1]
        gram = np.zeros((m + k + 1, m + k + 1))
        for test, steps in enumerate(part.training[specimen]):
            if steps.any():
                gram += self._gram(specimen, test, steps)
        x, z = slice(0, m), slice(m, m + k)
        inner = np.eye(k) + gram[z, z]
        outer, drive = gram[z, x], gram[z, -1]
        gain = _solve_scaled(inner, outer).T
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


def _solve_scaled(matrix: Array, right: Array) -> Array:
    """``matrix^-1 right`` of a positive matrix whose unknowns have units and sizes of their own.

    Jacobi scaling to a unit diagonal, then Cholesky.
    """
    scale = 1.0 / np.sqrt(np.diagonal(matrix))
    lower = cholesky(matrix * np.outer(scale, scale), lower=True)
    scaled = (scale * right.T).T
    found: Array = (scale * cho_solve((lower, True), scaled).T).T
    return found


def own_unknowns(numbers: Mapping[str, Indices], specimen: str) -> Indices:
    """Unknowns of no other specimen."""
    others = [own for name, own in numbers.items() if name != specimen]
    return np.setdiff1d(numbers[specimen], np.concatenate(others))


def _bounded(matrix: Array, drive: Array, low: Array, high: Array) -> Array:
    """Minimum of ``x' matrix x / 2 - drive' x`` inside bounds.

    With matrix = L L' it is the least squares problem ``|L' x - L^-1 drive|`` inside bounds.
    """
    scale = 1.0 / np.sqrt(np.diagonal(matrix))  # Jacobi scaling: units become alike
    lower = cholesky(matrix * np.outer(scale, scale), lower=True)
    target = solve_triangular(lower, scale * drive, lower=True)
    found: Array = scale * solve_triangular(lower.T, target)
    if np.all((low <= found) & (found <= high)):
        return found
    bounded: Array = scale * bounded_lstsq(lower.T, target, (low / scale, high / scale))
    return bounded


def surrogate(grounds: BaselineFit, nuisance_size: float) -> LinearModel:
    """The base to first order, with generic terms that are the same in all specimens.

    A term's strength is that of all joints together plus a part of each joint's own, both with
    prior SD one in units of the term's size.

    Raises
    ------
    NoEquilibrium
        When a load step has no stable pose.
    """
    base = tangent(grounds, nuisance_size)
    read = np.any([used.any(axis=(0, 1)) for w in grounds.plain.values() for used in w.used], 0)
    coordinates = [name for name, there in zip(COORDINATES, read, strict=True) if there]
    known, added, members = len(base.mean), 0, {}
    for name, one in base.members.items():
        model, cases = grounds.fit.models[name], grounds.readings[name].cases
        found = generic_columns(model, cases, grounds.noise.zeroed, coordinates)
        keys = [(t.family, t.coordinate, t.number) for t in found.terms]
        order = {key: number for number, key in enumerate(dict.fromkeys(keys))}
        together = np.zeros((len(keys), len(order)))
        together[np.arange(len(keys)), [order[key] for key in keys]] = 1.0
        onto = np.hstack([np.eye(len(keys)), together])
        added = onto.shape[1]
        pairs = zip(one.by_x, found.moved, strict=True)
        by_x = tuple(np.concatenate([old, moved @ onto], axis=-1) for old, moved in pairs)
        numbers = np.concatenate([one.numbers, known + np.arange(added)])
        members[name] = replace(one, by_x=by_x, numbers=numbers)
    return LinearModel(
        members,
        np.concatenate([base.mean, np.zeros(added)]),
        np.concatenate([base.sd, np.ones(added)]),
        np.concatenate([base.low, np.full(added, -np.inf)]),
        np.concatenate([base.high, np.full(added, np.inf)]),
    )
