"""Held-out proof of a formula: its terms, fitted to the training, on readings left out."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from spinepipe.effects.contract import Array
from spinepipe.studies.discrepancy.proof import folds
from spinepipe.studies.discrepancy.proof.fold_linear import LinearFolds, LinearModel, tangent
from spinepipe.studies.discrepancy.proof.fold_models import FoldModels, nuisance_size
from spinepipe.studies.discrepancy.proof.held_out import Asked, HeldOut, proven
from spinepipe.studies.discrepancy.search.baseline import BaselineFit
from spinepipe.studies.discrepancy.store import at_once


@dataclass(frozen=True)
class ChosenTerm:
    """A term of a formula.

    Attributes
    ----------
    moved : per test (T, J, 6) by one unit of its coefficient, of the specimens that have it.
    sd : prior of the coefficient: as large as makes the term a joint's whole load.
    """

    moved: Mapping[str, tuple[Array, ...]]
    sd: float


def proof_of_terms(
    before: BaselineFit, after: BaselineFit, terms: Sequence[ChosenTerm] = ()
) -> HeldOut:
    """Two fits, the second one with terms besides, on each test and specimen left out.

    Which terms was found with all readings; their coefficients are fitted without those left out.
    """
    models = _WithTerms(before, after, terms)
    return proven(models, before.readings, before.tests, Asked())


class _WithTerms(FoldModels):
    """One fit as the base, another and terms besides as the model with effects."""

    def __init__(
        self, before: BaselineFit, after: BaselineFit, terms: Sequence[ChosenTerm]
    ) -> None:
        self.grounds = (before, after)
        self.refit, self.run, self.named = False, at_once, True
        self.chosen = folds.ChosenSteps(before.readings, before.noise)
        size = nuisance_size(after)
        self.base = LinearFolds(tangent(before, size), self.chosen)
        self.final = LinearFolds(with_terms(tangent(after, size), terms), self.chosen)
        self.surrogate, self.why_none = None, ""


def with_terms(plain: LinearModel, terms: Sequence[ChosenTerm]) -> LinearModel:
    """A linear model with a coefficient more for each term, in prior SDs."""
    known = len(plain.mean)
    members = {}
    for name, one in plain.members.items():
        own = [number for number, term in enumerate(terms) if name in term.moved]
        columns = tuple(
            np.concatenate([by_x, *(_scaled(terms[number], name, test) for number in own)], axis=-1)
            for test, by_x in enumerate(one.by_x)
        )
        numbers = np.concatenate([one.numbers, known + np.array(own, dtype=np.int64)])
        members[name] = replace(one, by_x=columns, numbers=numbers)
    count = len(terms)
    return LinearModel(
        members,
        np.concatenate([plain.mean, np.zeros(count)]),
        np.concatenate([plain.sd, np.ones(count)]),
        np.concatenate([plain.low, np.full(count, -np.inf)]),
        np.concatenate([plain.high, np.full(count, np.inf)]),
    )


def _scaled(term: ChosenTerm, specimen: str, test: int) -> Array:
    """(T, J, 6, 1) by one prior SD."""
    return term.sd * term.moved[specimen][test][..., None]
