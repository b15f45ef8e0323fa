"""One step of a pursuit: how far each term, at each place, would bring chi2 down, and noise alone.

Readings of all specimens one under the other, whitened, with base, nuisances and all that stands in
the fit taken out. Terms that are linear already are taken out too.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from spinepipe.decomposition import svd
from spinepipe.effects.contract import Array
from spinepipe.studies.discrepancy.search.baseline import BaselineFit
from spinepipe.studies.discrepancy.search.law_terms import LawTerm, TermColumns
from spinepipe.studies.discrepancy.search.projected import SEEN, ProjectedOut, drawn, taken_out
from spinepipe.studies.discrepancy.search.screen import exceeded

LEAST_LEFT = 1e-4
"""Share of its square that a term must keep beside all that is taken out, to be a term at all."""

EVERYWHERE = -1
"""In the place of a joint or a specimen: all."""

MOST_RANKED = 20


@dataclass(frozen=True)
class TermAtPlace:
    """A term at a place: number of the term, joint and specimen, or `EVERYWHERE`."""

    term: int
    joint: int
    specimen: int


@dataclass(frozen=True)
class Ranked:
    """The candidates that lead, best first: drop of chi2 and coefficient in SI, each alone.

    ``threshold`` : drop that noise alone seldom shows for the best of all candidates.
    """

    best: tuple[TermAtPlace, ...]
    drops: tuple[float, ...]
    values: tuple[float, ...]
    threshold: float


@dataclass(frozen=True)
class _WhitenedColumns:
    """A specimen: whitened columns (N, C), own unknowns taken out; raw squared norms (C,)."""

    columns: Array
    raw: Array


@dataclass(frozen=True)
class PursuitProblem:
    """What the steps of a pursuit about one fit share.

    Attributes
    ----------
    rows : (S + 1,) where each specimen's rows begin. shared : (N, b) orthonormal, what shared
        unknowns move. errors : (N, 1 + D) the data's residual and draws of the null.
    freedom : readings less unknowns.
    """

    terms: tuple[LawTerm, ...]
    joints: int
    parts: tuple[_WhitenedColumns, ...]
    rows: tuple[int, ...]
    shared: Array
    errors: Array
    freedom: float

    @property
    def excess(self) -> float:
        """Chi2 above what noise makes."""
        return float(self.errors[:, 0] @ self.errors[:, 0]) - self.freedom

    def candidates(self) -> list[TermAtPlace]:
        """Every term at each joint and at all, in all specimens and, where several, in each."""
        places = [EVERYWHERE, *range(self.joints)] if self.joints > 1 else [0]
        several = len(self.parts) > 1
        specimens = [EVERYWHERE, *range(len(self.parts))] if several else [EVERYWHERE]
        return [
            TermAtPlace(term, joint, specimen)
            for specimen in specimens
            for term in range(len(self.terms))
            for joint in places
        ]

    def column(self, one: TermAtPlace) -> Array:
        """(N,) of a candidate."""
        found = np.zeros(self.rows[-1])
        width, place = (self.joints + 1, one.joint + 1) if self.joints > 1 else (1, 0)
        for number, part in enumerate(self.parts):
            if one.specimen in (EVERYWHERE, number):
                rows = slice(self.rows[number], self.rows[number + 1])
                found[rows] = part.columns[:, one.term * width + place]
        return found

    def ranked(self, linear: Sequence[TermAtPlace], false_alarm: float) -> Ranked:
        """The candidates that lead beside terms that are there already."""
        basis, errors = self._beside(linear)
        values, drops = self._drops(basis, errors)
        threshold = exceeded(drops[:, 1:].max(axis=0), false_alarm)
        order = np.argsort(-drops[:, 0], kind="stable")[:MOST_RANKED]
        every = self.candidates()
        return Ranked(
            tuple(every[k] for k in order),
            tuple(drops[order, 0].tolist()),
            tuple(values[order].tolist()),
            float(threshold),
        )

    def fitted(self, linear: Sequence[TermAtPlace]) -> tuple[Array, Array]:
        """Coefficients of terms together, SI, and their SDs."""
        if not linear:
            return np.zeros(0), np.zeros(0)
        columns = np.column_stack([self.column(one) for one in linear])
        columns = columns - self.shared @ (self.shared.T @ columns)
        sizes = np.linalg.norm(columns, axis=0)
        scaled = columns / sizes
        covariance = np.linalg.inv(scaled.T @ scaled)
        values = covariance @ (scaled.T @ self.errors[:, 0]) / sizes
        return values, np.sqrt(np.diagonal(covariance)) / sizes

    def _beside(self, linear: Sequence[TermAtPlace]) -> tuple[Array, Array]:
        """Basis of all that is taken out, and the errors without it."""
        basis, errors = self.shared, self.errors
        for one in linear:
            column = self.column(one)
            for _ in range(2):  # once more against rounding
                column = column - basis @ (basis.T @ column)
            column = column / np.linalg.norm(column)
            basis = np.column_stack([basis, column])
            errors = errors - np.outer(column, column @ errors)
        return basis, errors

    def _drops(self, basis: Array, errors: Array) -> tuple[Array, Array]:
        """Coefficients (K,) and drops of chi2 (K, 1 + D) of all candidates, in their order."""
        moments, norms, inside, raws = [], [], [], []
        for number, part in enumerate(self.parts):
            rows = slice(self.rows[number], self.rows[number + 1])
            moments.append(part.columns.T @ errors[rows])
            norms.append(np.sum(part.columns**2, axis=0))
            inside.append(part.columns.T @ basis[rows])
            raws.append(part.raw)
        groups = [tuple(np.sum(of, axis=0) for of in (moments, norms, inside, raws))]
        if len(self.parts) > 1:
            groups += list(zip(moments, norms, inside, raws, strict=True))
        values, drops = [], []
        for moment, norm, within, raw in groups:
            left = norm - np.sum(within**2, axis=1)
            there = left > LEAST_LEFT * raw
            safe = np.where(there, left, 1.0)
            values.append(np.where(there, moment[:, 0] / safe, 0.0))
            drops.append(np.where(there[:, None], moment**2 / safe[:, None], 0.0))
        return np.concatenate(values), np.concatenate(drops)


def pursuit_problem(
    grounds: BaselineFit, columns: Mapping[str, TermColumns], draws: int, seed: int
) -> PursuitProblem:
    """The problem about the grounds' fit, with draws of the null."""
    taken = taken_out(grounds.fit)
    parts, errors = [], []
    for number, (name, one) in enumerate(columns.items()):
        joints = one.sizes.shape[1]
        parts.append(_part(grounds, name, _with_sums(one, joints), taken[name]))
        drawn_here = drawn(taken[name], draws, np.random.default_rng([seed, number]))
        errors.append(taken[name].out_of(drawn_here))
    shared = _orthonormal(np.concatenate([taken[name].shared for name in columns]))
    every = np.concatenate(errors)
    every = every - shared @ (shared.T @ every)
    fitted = sum(one.own.shape[1] for one in taken.values()) + shared.shape[1]
    rows = tuple(np.cumsum([0, *(len(one) for one in errors)]).tolist())
    first = next(iter(columns.values()))
    joints = first.sizes.shape[1]
    return PursuitProblem(first.terms, joints, tuple(parts), rows, shared, every, rows[-1] - fitted)


def _with_sums(one: TermColumns, joints: int) -> list[Array]:
    """Per test (T, J, 6, C): of each term the column of all joints, then that of each."""
    if joints == 1:
        return list(one.moved)
    found = []
    for moved in one.moved:
        each = moved.reshape(*moved.shape[:-1], -1, joints)
        whole = np.concatenate([each.sum(axis=-1, keepdims=True), each], axis=-1)
        found.append(whole.reshape(*moved.shape[:-1], -1))
    return found


def _part(
    grounds: BaselineFit, name: str, moved: Sequence[Array], taken: ProjectedOut
) -> _WhitenedColumns:
    plain = grounds.plain[name].noise_only(moved)
    white = grounds.setting.whitenings[name].shortened(plain)
    return _WhitenedColumns(taken.out_of(white), np.sum(plain**2, axis=0))


def _orthonormal(columns: Array) -> Array:
    """(N, b) of what columns (N, a) span."""
    lengths = np.linalg.norm(columns, axis=0)
    scaled = columns[:, lengths > 0.0] / lengths[lengths > 0.0]
    left, sizes, _ = svd(scaled)
    basis: Array = left[:, sizes > SEEN * sizes.max(initial=0.0)]
    return basis
