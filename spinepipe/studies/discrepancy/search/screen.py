"""The screen: evidence of every effect in the linearised problem, and what the null would show.

Readings are whitened, base and nuisances projected out: residual r, signatures F in prior SDs of
the strengths. A form says which columns each of its strengths sums. With strengths ~ N(0, t^2) the
evidence (log of the ratio of marginal likelihoods) is 1/2 sum [ t^2 b^2 / (1 + t^2 l) -
log(1 + t^2 l) ] over the eigenvalues l of F'F, b the components of F'r; t is averaged over a few
sizes. Strengths of one sign have half a normal as prior. An effect's evidence is averaged over its
variants, shapes and ways to differ, each with an equal share, so that no effect is favoured by its
place or by its number of variants.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import log_ndtr

from spinepipe.decomposition import eigh
from spinepipe.effects import Spread
from spinepipe.effects.contract import Array
from spinepipe.studies.discrepancy.search.hypothesis import Form, Trials, shape_grid
from spinepipe.studies.discrepancy.search.projected import EVERY_TEST, Column, Linearised

SIZES = np.array([0.1, 0.3, 1.0, 3.0])
"""Sizes of strengths, in declared prior SDs, that are held equally likely."""

Places = tuple[tuple[str, NDArray[np.int64], NDArray[np.int64]], ...]
"""(specimen, columns (c,), strength (c,) that each column belongs to)."""

LEAST_THRESHOLD = 5.0
"""Less is not very strong (Kass and Raftery 1995, doi 10.2307/2291091), whatever the draws say."""


def log_sum(logs: Array) -> Array:
    """(...) logarithm of the sum of exp(logs) over the first axis; none is infinite."""
    largest = logs.max(axis=0)
    result: Array = largest + np.log(np.sum(np.exp(logs - largest), axis=0))
    return result


@dataclass(frozen=True)
class Group:
    """Strengths that share a size: eigenvalues (k,) and vectors (k, k) of their F'F.

    ``signs`` (k,): the side of off that bounds allow, 0 for both.
    """

    eigenvalues: Array
    vectors: Array
    signs: Array

    @classmethod
    def of(cls, gram: Array, signs: Array) -> "Group":
        """The group with F'F (k, k)."""
        values, vectors = eigh(gram)
        return cls(np.maximum(values, 0.0), vectors, signs)

    def log_evidence(self, moments: Array) -> Array:
        """(D,) evidence for F'r of each draw, (k, D)."""
        components = self.vectors.T @ moments
        variance = 1.0 / (SIZES[:, None] ** -2.0 + self.eigenvalues)
        gain = 0.5 * variance @ components**2
        cost = 0.5 * np.sum(np.log1p(SIZES[:, None] ** 2 * self.eigenvalues), axis=1)
        found = gain - cost[:, None] + self._one_sided(variance, components)
        return log_sum(found) - float(np.log(len(SIZES)))

    def _one_sided(self, variance: Array, components: Array) -> Array:
        """(S, D) what the signs add: twice the posterior's share on the allowed side, each.

        Parameters
        ----------
        variance : (S, k) at each size. components : (k, D).
        """
        there = self.signs != 0.0
        if not there.any():
            return np.zeros((len(variance), components.shape[1]))
        vectors = self.vectors[there]
        mean = vectors @ (variance[:, :, None] * components)
        sd = np.sqrt(variance @ (vectors**2).T)
        sides = self.signs[there, None] * mean / sd[:, :, None]
        return np.asarray(np.sum(np.log(2.0) + log_ndtr(sides), axis=1))

    def estimate(self, moments: Array) -> Array:
        """(k,) strengths, in prior SDs, that explain most, shrunk a little where nothing tells."""
        inverse = 1.0 / (SIZES[-1] ** -2.0 + self.eigenvalues)
        found: Array = self.vectors @ (inverse * (self.vectors.T @ moments))
        return np.where(self.signs * found < 0.0, 0.0, found)


@dataclass(frozen=True)
class Summed:
    """A form at one shape: its strengths' Gram matrix (k, k), moments (k, D + 1) and signs (k,).

    Attributes
    ----------
    strengths : (k,) column of the effect's values that each strength is of.
    """

    form: Form
    sds: tuple[float, ...]
    strengths: tuple[int, ...]
    gram: Array
    moments: Array
    group: Group


class Index:
    """Columns of one effect by variant, shape, test and joint."""

    def __init__(self, columns: Sequence[Column]) -> None:
        self._at: dict[tuple[object, ...], dict[tuple[object, ...], list[int]]] = {}
        for number, c in enumerate(columns):
            places = self._at.setdefault((c.variant, c.sds), {})
            places.setdefault((c.test, c.joint, c.strength), []).append(number)
        self.columns = tuple(columns)

    def places(
        self, form: Form, sds: tuple[float, ...], specimens: Sequence[str], tests: Sequence[str]
    ) -> tuple[Places, tuple[int, ...]]:
        """Columns of a form in each specimen, and for each strength the value's column."""
        keys: dict[tuple[object, ...], int] = {}
        found = []
        for specimen in specimens:
            if form.acts_in(specimen):
                columns, owners = [], []
                for number, key in self._of(form, sds, specimen, tests):
                    columns.append(number)
                    owners.append(keys.setdefault(key, len(keys)))
                found.append((specimen, np.array(columns), np.array(owners)))
        return tuple(found), tuple(int(key[0]) for key in keys)  # type: ignore[call-overload]

    def _of(
        self, form: Form, sds: tuple[float, ...], specimen: str, tests: Sequence[str]
    ) -> list[tuple[int, tuple[object, ...]]]:
        """Columns and which strength each belongs to."""
        spread = form.spread
        by_specimen = spread in (Spread.BY_SPECIMEN, Spread.EACH)
        by_joint = spread in (Spread.BY_JOINT, Spread.EACH)
        wanted = tests if spread is Spread.BY_TEST else (EVERY_TEST,)
        found: list[tuple[int, tuple[object, ...]]] = []
        for (test, joint, strength), numbers in self._at.get((form.variant, sds), {}).items():
            if test not in wanted:
                continue
            if form.joint is None or joint == form.joint:
                key = (
                    strength,
                    specimen if by_specimen else None,
                    joint if by_joint else None,
                    test if spread is Spread.BY_TEST else None,
                )
                found += [(number, key) for number in numbers]
        return found


@dataclass(frozen=True)
class Tried:
    """One form of an effect on the screen, at its best shape.

    Attributes
    ----------
    log_evidence : at that shape, the form's share of its effect taken off.
    estimate : (k,) strengths in prior SDs from off. strengths : (k,) which of the effect's values.
    explained : drop of chi2 with its strengths free.
    """

    form: Form
    sds: tuple[float, ...]
    strengths: tuple[int, ...]
    log_evidence: float
    estimate: Array
    explained: float


@dataclass(frozen=True)
class Screened:
    """An effect on the screen: its evidence, of each draw of the null too, and its forms.

    ``forms`` : best first.
    """

    effect: str
    log_evidence: float
    null: Array
    forms: tuple[Tried, ...]


@dataclass(frozen=True)
class Screen:
    """All effects, best first, and the evidence that the null exceeds as often as is allowed."""

    effects: tuple[Screened, ...]
    threshold: float
    draws: int


def screen(
    effects: Sequence[Screened], false_alarm: float, threshold: float | None = None
) -> Screen:
    """Effects ranked; the threshold is that of the largest evidence of each draw of the null."""
    largest = np.max(np.stack([one.null for one in effects]), axis=0)
    if threshold is None:
        threshold = max(LEAST_THRESHOLD, exceeded(largest, false_alarm))
    ranked = sorted(effects, key=lambda one: (-one.log_evidence, one.effect))
    return Screen(tuple(ranked), threshold, len(largest))


def screened(
    trials: Trials,
    index: Index,
    problem: Linearised,
    specimens: Sequence[str],
    tests: Sequence[str],
) -> Screened:
    """Evidence of one effect."""
    totals, tried = [], []
    for form in trials.forms:
        grid = shape_grid(form.variant)
        found = [summed(index, problem, form, sds, specimens, tests) for sds in grid]
        logs = np.stack([one.group.log_evidence(one.moments) for one in found])
        share = trials.log_share(form)
        totals.append(log_sum(logs) - np.log(len(grid)) + share)
        best = int(np.argmax(logs[:, 0]))
        tried.append(_tried(found[best], float(logs[best, 0]) + share))
    whole = log_sum(np.stack(totals))
    order = sorted(tried, key=lambda one: -one.log_evidence)
    return Screened(trials.effect, float(whole[0]), whole[1:], tuple(order))


def _tried(one: Summed, log_evidence: float) -> Tried:
    moments = one.moments[:, 0]
    estimate = one.group.estimate(moments)
    explained = float(2.0 * estimate @ moments - estimate @ one.gram @ estimate)
    return Tried(one.form, one.sds, one.strengths, log_evidence, estimate, explained)


def summed(
    index: Index,
    problem: Linearised,
    form: Form,
    sds: tuple[float, ...],
    specimens: Sequence[str],
    tests: Sequence[str],
) -> Summed:
    """A form's strengths at one shape."""
    places, strengths = index.places(form, sds, specimens, tests)
    count = len(strengths)
    draws = problem.moments_shared.shape[1]
    gram, moments = np.zeros((count, count)), np.zeros((count, draws))
    coupled = np.zeros((count, len(problem.gram_shared)))
    for specimen, columns, owners in places:
        onto = np.zeros((count, len(columns)))
        onto[owners, np.arange(len(columns))] = 1.0
        part = problem.of[specimen]
        gram += onto @ part.gram[np.ix_(columns, columns)] @ onto.T
        moments += onto @ part.moments[columns]
        coupled += onto @ part.shared[columns]
    gram, moments = problem.without_shared(gram, moments, coupled)
    group = Group.of(gram, sides(form, strengths))
    return Summed(form, sds, strengths, gram, moments, group)


def sides(form: Form, strengths: Sequence[int]) -> Array:
    """(k,) side of off that the bounds of each strength allow, a column of the effect's values."""
    parameters = form.variant.create().parameters
    return np.array([parameters[column].side for column in strengths])


def exceeded(values: Array, share: float) -> float:
    """The value exceeded by that share: of the draws, or of a Gumbel fit where these are few."""
    if len(values) * share >= 5.0:
        return float(np.quantile(values, 1.0 - share))
    scale = float(np.std(values)) * np.sqrt(6.0) / np.pi
    place = float(np.mean(values)) - np.euler_gamma * scale
    return place - scale * float(np.log(-np.log1p(-share)))
