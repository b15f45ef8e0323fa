"""The screen: evidence of every effect in the linearised problem.

Readings are whitened, base and nuisances projected out: residual r, signatures F in prior SDs of
the strengths. A form says which columns each of its strengths sums. With strengths ~ N(0, t^2) the
evidence (log of the ratio of marginal likelihoods) is 1/2 sum [ t^2 b^2 / (1 + t^2 l) -
log(1 + t^2 l) ] over the eigenvalues l of F'F, b the components of F'r; t is averaged over a few
sizes. Strengths of one sign have half a normal as prior. An effect's evidence is averaged over its
variants, shapes and ways to differ, each with an equal share, so that no effect is favoured by its
place or by its number of variants.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import log_ndtr

from spinepipe.decomposition import eigh
from spinepipe.effects import PlaceSpread
from spinepipe.effects.contract import Array, Indices
from spinepipe.studies.discrepancy.search.hypothesis import CandidateForm, Trials, shape_grid
from spinepipe.studies.discrepancy.search.projected import EVERY_TEST, Linearised, VariantColumn

SIZES = np.array([0.1, 0.3, 1.0, 3.0])
"""Sizes of strengths, in declared prior SDs, that are held equally likely."""

Places = tuple[tuple[str, NDArray[np.int64], NDArray[np.int64]], ...]
"""(specimen, columns (c,), strength (c,) that each column belongs to)."""


def log_sum(logs: Array) -> Array:
    """(...) logarithm of the sum of exp(logs) over the first axis; none is infinite."""
    largest = logs.max(axis=0)
    result: Array = largest + np.log(np.sum(np.exp(logs - largest), axis=0))
    return result


@dataclass(frozen=True)
class Group:
    """Strengths that share a size: eigenvalues (..., k) and vectors (..., k, k) of their F'F.

    ``signs`` (k,): the side of off that bounds allow, 0 for both. Axes before k are a stack's.
    """

    eigenvalues: Array
    vectors: Array
    signs: Array

    @classmethod
    def of(cls, gram: Array, signs: Array) -> "Group":
        """The group with F'F (..., k, k)."""
        values, vectors = eigh(gram)
        return cls(np.maximum(values, 0.0), vectors, signs)

    def log_evidence(self, moments: Array) -> Array:
        """(...) evidence for F'r, (..., k)."""
        # Bayesian linear regression in the eigenbasis of F'F, where strengths are independent:
        # (..., S, k) posterior variance of each direction at each prior size t
        components = (moments[..., None, :] @ self.vectors)[..., 0, :]
        of_sizes = self.eigenvalues[..., None, :]
        variance = 1.0 / (SIZES[:, None] ** -2.0 + of_sizes)
        gain = 0.5 * np.sum(variance * components[..., None, :] ** 2, axis=-1)
        cost = 0.5 * np.sum(np.log1p(SIZES[:, None] ** 2 * of_sizes), axis=-1)
        found = gain - cost + self._one_sided(variance, components)
        return log_sum(np.moveaxis(found, -1, 0)) - float(np.log(len(SIZES)))

    def _one_sided(self, variance: Array, components: Array) -> Array:
        """(..., S) log evidence of half-normal priors over that of whole ones.

        Half a normal is the whole one, twice as high on the side that is allowed, so the evidence
        is multiplied by the share of the posterior on that side over the share of the prior, 1/2
        (encompassing prior, Klugkist and Hoijtink 2007): log 2 + log Phi(mean / sd) for each
        signed strength. Marginals are taken, as if posteriors of strengths were independent.

        Parameters
        ----------
        variance : (..., S, k) at each size. components : (..., k).
        """
        there = self.signs != 0.0
        if not there.any():
            return np.zeros(variance.shape[:-1])
        back = np.swapaxes(self.vectors[..., there, :], -1, -2)
        # posterior mean and SD of each signed strength, back from the eigenbasis
        mean = (variance * components[..., None, :]) @ back
        sides = self.signs[there] * mean / np.sqrt(variance @ back**2)
        return np.asarray(np.sum(np.log(2.0) + log_ndtr(sides), axis=-1))

    def estimate(self, moments: Array) -> Array:
        """(..., k) strengths, in prior SDs, that explain most; shrunk a little where nothing tells.

        ``moments`` (..., k) F'r.
        """
        inverse = 1.0 / (SIZES[-1] ** -2.0 + self.eigenvalues)  # ridge: the widest prior
        components = (moments[..., None, :] @ self.vectors)[..., 0, :]
        found: Array = (self.vectors @ (inverse * components)[..., None])[..., 0]
        return np.where(self.signs * found < 0.0, 0.0, found)


Point = tuple[CandidateForm, tuple[float, ...]]
"""A form, and the prior SDs of its shapes."""


@dataclass(frozen=True, eq=False)
class IndistinctVariants:
    """Points whose columns are summed to strengths in the same way.

    Attributes
    ----------
    numbers : (B,) which of all points. strengths : (k,) column of the effect's values of each.
    signs : (k,) sides of off that bounds allow.
    places : specimen, its columns (B, c), and (k, c) which of these each strength sums.
    """

    numbers: NDArray[np.int64]
    strengths: tuple[int, ...]
    signs: Array
    places: tuple[tuple[str, NDArray[np.int64], Array], ...]

    def summed(self, problem: Linearised) -> tuple[Array, Array]:
        """Gram matrices (B, k, k) and moments (B, k) of the points' strengths."""
        points, k = len(self.numbers), len(self.strengths)
        gram, moments = np.zeros((points, k, k)), np.zeros((points, k))
        coupled = np.zeros((points, k, len(problem.moments_shared)))
        for specimen, columns, onto in self.places:
            part = problem.of[specimen]
            gram += onto @ part.gram[columns[:, :, None], columns[:, None, :]] @ onto.T
            moments += part.moments[columns] @ onto.T
            coupled += onto @ part.shared[columns]
        return problem.without_shared(gram, moments, coupled)


def summation(owners: Indices | Sequence[int], count: int) -> Array:
    """(k, c) sums columns onto the strengths that own them."""
    onto = np.zeros((count, len(owners)))
    onto[owners, np.arange(len(owners))] = 1.0
    return onto


class EffectColumns:
    """Columns of one effect by variant, shape, test and joint."""

    def __init__(self, columns: Sequence[VariantColumn]) -> None:
        self._at: dict[tuple[object, ...], dict[tuple[object, ...], list[int]]] = {}
        for number, c in enumerate(columns):
            places = self._at.setdefault((c.variant, c.sds), {})
            places.setdefault((c.test, c.joint, c.strength), []).append(number)
        self.columns = tuple(columns)
        self._batches: dict[tuple[object, ...], tuple[IndistinctVariants, ...]] = {}

    def batches(
        self, points: Sequence[Point], specimens: Sequence[str], tests: Sequence[str]
    ) -> tuple[IndistinctVariants, ...]:
        """Points that are summed alike, together; known already where asked before."""
        key = (tuple(points), tuple(specimens), tuple(tests))
        if key not in self._batches:
            self._batches[key] = tuple(self._grouped(*key))
        return self._batches[key]

    def _grouped(
        self, points: Sequence[Point], specimens: Sequence[str], tests: Sequence[str]
    ) -> Iterator[IndistinctVariants]:
        found = [self.places(form, sds, specimens, tests) for form, sds in points]
        members: dict[tuple[object, ...], list[int]] = {}
        for number, (places, strengths) in enumerate(found):
            signs = tuple(sides(points[number][0], strengths))
            summed_by = tuple((specimen, tuple(of.tolist())) for specimen, _, of in places)
            members.setdefault((strengths, signs, summed_by), []).append(number)
        for some in members.values():
            places, strengths = found[some[0]]
            every = []
            for place, (specimen, _, owners) in enumerate(places):
                onto = summation(owners, len(strengths))
                columns = np.stack([found[number][0][place][1] for number in some])
                every.append((specimen, columns, onto))
            signs_of = sides(points[some[0]][0], strengths)
            yield IndistinctVariants(np.array(some), strengths, signs_of, tuple(every))

    def places(
        self,
        form: CandidateForm,
        sds: tuple[float, ...],
        specimens: Sequence[str],
        tests: Sequence[str],
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
        self, form: CandidateForm, sds: tuple[float, ...], specimen: str, tests: Sequence[str]
    ) -> list[tuple[int, tuple[object, ...]]]:
        """Columns and which strength each belongs to."""
        spread = form.spread
        by_specimen = spread in (PlaceSpread.BY_SPECIMEN, PlaceSpread.EACH)
        by_joint = spread in (PlaceSpread.BY_JOINT, PlaceSpread.EACH)
        wanted = tests if spread is PlaceSpread.BY_TEST else (EVERY_TEST,)
        found: list[tuple[int, tuple[object, ...]]] = []
        for (test, joint, strength), numbers in self._at.get((form.variant, sds), {}).items():
            if test not in wanted:
                continue
            if form.joint is None or joint == form.joint:
                key = (
                    strength,
                    specimen if by_specimen else None,
                    joint if by_joint else None,
                    test,
                )
                found += [(number, key) for number in numbers]
        return found


@dataclass(frozen=True)
class ScreenedVariant:
    """One form of an effect on the screen, at its best shape.

    Attributes
    ----------
    log_evidence : at that shape, the form's share of its effect taken off.
    estimate : (k,) strengths in prior SDs from off. strengths : (k,) which of the effect's values.
    explained : drop of chi2 with its strengths free.
    """

    form: CandidateForm
    sds: tuple[float, ...]
    strengths: tuple[int, ...]
    log_evidence: float
    estimate: Array
    explained: float


@dataclass(frozen=True)
class Screened:
    """An effect on the screen: its evidence, and its forms, best first."""

    effect: str
    log_evidence: float
    forms: tuple[ScreenedVariant, ...]


@dataclass(frozen=True)
class Screen:
    """All effects, best first."""

    effects: tuple[Screened, ...]


def screened(
    trials: Trials,
    index: EffectColumns,
    problem: Linearised,
    specimens: Sequence[str],
    tests: Sequence[str],
) -> Screened:
    """Evidence of one effect."""
    points = [(form, sds) for form in trials.forms for sds in shape_grid(form.variant)]
    logs = np.zeros(len(points))
    found: dict[int, ScreenedVariant] = {}
    share = {form: trials.log_share(form) for form in trials.forms}
    for some in index.batches(points, specimens, tests):
        gram, moments = some.summed(problem)
        group = Group.of(gram, some.signs)
        logs[some.numbers] = group.log_evidence(moments)
        estimates = group.estimate(moments)
        # (B,) drop of chi2 with these strengths: 2 s'F'r - s'F'F s
        left = 2.0 * moments - (gram @ estimates[..., None])[..., 0]
        explained = np.sum(estimates * left, axis=-1)
        for row, number in enumerate(some.numbers.tolist()):
            (form, sds), gain = points[number], float(explained[row])
            log_evidence = float(logs[number]) + share[form]
            told = (form, sds, some.strengths, log_evidence)
            found[number] = ScreenedVariant(*told, estimates[row], gain)
    # the effect's evidence is the mean over its forms by their shares, and over shapes of each
    totals, tried, end = [], [], 0
    for form in trials.forms:
        start, end = end, end + len(shape_grid(form.variant))
        totals.append(log_sum(logs[start:end]) - np.log(end - start) + share[form])
        tried.append(found[start + int(np.argmax(logs[start:end]))])
    order = sorted(tried, key=lambda one: -one.log_evidence)
    return Screened(trials.effect, float(log_sum(np.stack(totals))), tuple(order))


def sides(form: CandidateForm, strengths: Sequence[int]) -> Array:
    """(k,) side of off that the bounds of each strength allow, a column of the effect's values."""
    parameters = form.variant.create().parameters
    return np.array([parameters[column].side for column in strengths])
