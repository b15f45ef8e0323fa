"""The strengths of a form as a group in the linearised problem: which columns each one sums."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from spinepipe.discrepancy.evidence import Group
from spinepipe.discrepancy.forms import Form
from spinepipe.discrepancy.projected import Linearised
from spinepipe.discrepancy.signatures import EVERY_TEST, Column
from spinepipe.effects import Spread
from spinepipe.effects.contract import Array

Places = tuple[tuple[str, NDArray[np.int64], NDArray[np.int64]], ...]
"""(specimen, columns (c,), strength (c,) that each column belongs to)."""


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
        self._at: dict[tuple[object, ...], list[int]] = {}
        for number, c in enumerate(columns):
            self._at.setdefault((c.variant, c.sds, c.test, c.joint, c.strength), []).append(number)
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
        for (variant, at, test, joint, strength), numbers in self._at.items():
            if (variant, at) != (form.variant, sds) or test not in wanted:
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

    def signs(self, form: Form, places: Places, count: int) -> Array:
        """(k,) side of off that each strength's bounds allow."""
        parameters = form.variant.create().parameters
        signs = np.zeros(count)
        for _, columns, owners in places:
            for column, owner in zip(columns, owners, strict=True):
                signs[owner] = parameters[self.columns[column].strength].side
        return signs


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
    signs = index.signs(form, places, count)
    return Summed(form, sds, strengths, gram, moments, Group.of(gram, signs))
