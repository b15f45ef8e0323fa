"""What one model predicts beyond another: on the readings that are there and in runs to come.

A pattern belongs to a fit of the other model. It is the difference of two fits, or signatures of an
effect or of generic terms times the strengths that the readings suggest, less what noise makes.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from spinepipe.effects import PlaceSpread
from spinepipe.effects.contract import Array
from spinepipe.model import LoadCase, SpineModel
from spinepipe.studies.discrepancy.search.baseline import BaselineFit
from spinepipe.studies.discrepancy.search.hypothesis import CandidateForm, Trials
from spinepipe.studies.discrepancy.search.joint_fit import JointFit
from spinepipe.studies.discrepancy.search.lack_of_fit import LackOfFitTest, Term, generic_columns
from spinepipe.studies.discrepancy.search.prediction import Simulated, SolvedSpecimen
from spinepipe.studies.discrepancy.search.projected import (
    linearised,
    products,
    signatures,
    taken_out,
)
from spinepipe.studies.discrepancy.search.screen import Group, summed
from spinepipe.studies.discrepancy.search.search_state import linearised_for

ModelChange = Callable[[SpineModel], SpineModel]
"""What a run does to a model, such as a preload."""


class Pattern(Protocol):
    """What another model predicts beyond that of ``fit``."""

    @property
    def grounds(self) -> BaselineFit: ...
    @property
    def fit(self) -> JointFit: ...

    def there(self, specimen: str) -> Array:
        """(N,) on the specimen's readings, in noise SD."""
        ...

    def under(
        self, specimen: str, changed: ModelChange, cases: Sequence[LoadCase]
    ) -> Sequence[Array]:
        """(T, J, 6) m and rad in each run, not zeroed, of the specimen's models as changed.

        Raises
        ------
        NoEquilibrium
            When a load step has no stable pose.
        """
        ...


@dataclass(frozen=True)
class RivalFits:
    """Two fits of the same readings; ``other`` would be true."""

    grounds: BaselineFit
    fit: JointFit
    other: JointFit

    def there(self, specimen: str) -> Array:
        """Difference of what they predict."""
        pairs = zip(self.other.predicted[specimen], self.fit.predicted[specimen], strict=True)
        return self.grounds.plain[specimen].noise_only([np.nan_to_num(a - b) for a, b in pairs])

    def under(
        self, specimen: str, changed: ModelChange, cases: Sequence[LoadCase]
    ) -> Sequence[Array]:
        """Difference of what they predict."""
        first, second = (
            Simulated(changed(one.models[specimen]), cases, False, ()).at(np.zeros(0)).readings
            for one in (self.other, self.fit)
        )
        return [a - b for a, b in zip(first, second, strict=True)]


@dataclass(frozen=True)
class TangentPattern:
    """Terms beside the grounds' fit, to first order.

    Attributes
    ----------
    columns : (T, J, 6, m) per test by the terms, of a specimen's model: on its own cases as they
        were read, or, with a change of the model, in cases that are not zeroed.
    weights : (m,) by specimen.
    """

    grounds: BaselineFit
    columns: Callable[[str, ModelChange | None, Sequence[LoadCase]], Sequence[Array]]
    weights: Mapping[str, Array]

    @property
    def fit(self) -> JointFit:
        """Of the model that lacks the terms."""
        return self.grounds.fit

    def there(self, specimen: str) -> Array:
        """The terms on the readings."""
        g, weights = self.grounds, self.weights[specimen]
        moved = self.columns(specimen, None, g.readings[specimen].cases)
        return g.plain[specimen].noise_only([one @ weights for one in moved])

    def under(
        self, specimen: str, changed: ModelChange, cases: Sequence[LoadCase]
    ) -> Sequence[Array]:
        """The terms in each run."""
        weights = self.weights[specimen]
        return [one @ weights for one in self.columns(specimen, changed, cases)]


def strengths(
    grounds: BaselineFit, trials: Trials, form: CandidateForm, sds: tuple[float, ...]
) -> TangentPattern:
    """A form at one shape, as strong as the readings suggest."""
    alone = Trials(trials.effect, (form.variant,), (form,))
    ((index, problem),) = linearised_for(grounds, [alone])
    specimens = tuple(grounds.readings)
    one = summed(index, problem, form, sds, specimens, grounds.tests)
    estimate = _beyond_noise(one.group, one.gram, one.moments)
    weights = {name: np.zeros(len(index.columns)) for name in specimens}
    for name, columns, owners in index.places(form, sds, specimens, grounds.tests)[0]:
        np.add.at(weights[name], columns, estimate[owners])

    def signatures_of(
        specimen: str, changed: ModelChange | None, cases: Sequence[LoadCase]
    ) -> Sequence[Array]:
        model = grounds.fit.models[specimen]
        if changed is None:
            return signatures(SolvedSpecimen(model, cases, grounds.noise.zeroed), index.columns)
        return signatures(SolvedSpecimen(changed(model), cases, False), index.columns)

    return TangentPattern(grounds, signatures_of, weights)


def _beyond_noise(group: Group, gram: Array, moments: Array) -> Array:
    """(k,) strengths that explain most, less the share that so many explain of noise alone.

    Each free strength explains one unit of chi2 by chance, so that much is taken off its square.
    """
    estimate = group.estimate(moments)
    explained = float(2.0 * estimate @ moments - estimate @ gram @ estimate)
    free = float(np.sum(group.eigenvalues > 1.0))
    result: Array = estimate * np.sqrt(max(0.0, 1.0 - free / max(explained, 1e-12)))
    return result


def generic(
    grounds: BaselineFit, coordinates: tuple[str, ...], lack: LackOfFitTest
) -> TangentPattern:
    """The generic terms that explain most, as strong as the readings suggest."""

    def terms_of(
        specimen: str, changed: ModelChange | None, cases: Sequence[LoadCase]
    ) -> Sequence[Array]:
        model = grounds.fit.models[specimen]
        if changed is None:
            return generic_columns(model, cases, grounds.noise.zeroed, coordinates).moved
        # in units of the motion there was: more goes on as it began
        reached = [q.reshape(len(q), -1, 6) for q in grounds.fit.poses[specimen]]
        return generic_columns(changed(model), cases, False, coordinates, reached).moved

    parts, taken = {}, taken_out(grounds.fit)
    terms: tuple[Term, ...] = ()
    for name, one in grounds.readings.items():
        model = grounds.fit.models[name]
        found = generic_columns(model, one.cases, grounds.noise.zeroed, coordinates)
        plain, terms = grounds.plain[name].noise_only(found.moved), found.terms
        white = grounds.setting.whitenings[name].shortened(plain)
        parts[name] = products(taken[name], white, np.sum(plain**2, axis=0))
    onto = _onto(terms, lack, tuple(parts))
    if not len(next(iter(onto.values()))):  # shifts of these tests say nothing of others
        return TangentPattern(grounds, terms_of, {name: np.zeros(len(terms)) for name in onto})
    # normal equations of the strengths, what is common to all specimens eliminated
    problem, count = linearised(parts), len(next(iter(onto.values())))
    gram, moments = np.zeros((count, count)), np.zeros(count)
    coupled = np.zeros((count, len(problem.gram_shared)))
    for name, part in parts.items():
        gram += onto[name] @ part.gram @ onto[name].T
        moments += onto[name] @ part.moments
        coupled += onto[name] @ part.shared
    gram, moments = problem.without_shared(gram, moments, coupled)
    estimate = _beyond_noise(Group.of(gram, np.zeros(count)), gram, moments)
    return TangentPattern(grounds, terms_of, {name: estimate @ one for name, one in onto.items()})


def _onto(terms: Sequence[Term], lack: LackOfFitTest, specimens: Sequence[str]) -> dict[str, Array]:
    """(k, M) which strength each term of a specimen has; none where it is of another family."""
    keys: dict[tuple[object, ...], int] = {}
    owners: dict[str, list[tuple[int, int]]] = {name: [] for name in specimens}
    for name in specimens:
        for column, term in enumerate(terms):
            if (term.family, term.coordinate) == (lack.family, lack.coordinate):
                joint = None if lack.spread is PlaceSpread.SHARED else term.joint
                own = name if lack.spread is PlaceSpread.EACH else None
                row = keys.setdefault((term.number, joint, own), len(keys))
                owners[name].append((row, column))
    found = {}
    for name, pairs in owners.items():
        found[name] = np.zeros((len(keys), len(terms)))
        for row, column in pairs:
            found[name][row, column] = 1.0
    return found
