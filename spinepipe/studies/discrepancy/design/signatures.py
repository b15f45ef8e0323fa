"""What tests see of the effects that may be missing: no residual is used.

Signatures are those of effects switched on a little in the base model.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from spinepipe.effects.contract import Array
from spinepipe.model import LoadCase
from spinepipe.studies.discrepancy.design.information import (
    Bench,
    Information,
    ModelChange,
    added,
    rows_there,
)
from spinepipe.studies.discrepancy.design.plans import PlannedTest, planned_of
from spinepipe.studies.discrepancy.design.runs import runs
from spinepipe.studies.discrepancy.search.baseline import BaselineFit
from spinepipe.studies.discrepancy.search.hypothesis import CandidateForm, Trials
from spinepipe.studies.discrepancy.search.prediction import SolvedSpecimen
from spinepipe.studies.discrepancy.search.projected import (
    VariantColumn,
    columns_of,
    signatures,
)
from spinepipe.studies.discrepancy.search.screen import EffectColumns, Places, summation

MOST_STEPS = 25
"""Of a run; more are thinned, which errs on the safe side."""


@dataclass(frozen=True)
class Candidates:
    """Effects that may be missing, all their columns one after the other.

    Attributes
    ----------
    starts : number of each effect's first column, and of all columns at the end.
    """

    trials: tuple[Trials, ...]
    indices: tuple[EffectColumns, ...]
    starts: tuple[int, ...]
    tests: tuple[str, ...]

    @property
    def columns(self) -> tuple[VariantColumn, ...]:
        """Columns of all effects."""
        return tuple(column for index in self.indices for column in index.columns)


def candidates(trials: Sequence[Trials], joints: int, tests: Sequence[str]) -> Candidates:
    """Columns of effects in a chain of that many joints."""
    indices = tuple(EffectColumns(columns_of(one, joints, tests)) for one in trials)
    ends = np.cumsum([0, *(len(index.columns) for index in indices)])
    return Candidates(tuple(trials), indices, tuple(ends.tolist()), tuple(tests))


@dataclass(frozen=True)
class CohortSignatures:
    """What all specimens' tests see of the candidates; specimens may share one `Information`."""

    those: Candidates
    of: Mapping[str, Information]

    @property
    def freedom(self) -> int:
        """Of all specimens."""
        return sum(one.freedom for one in self.of.values())

    @cached_property
    def products(self) -> Mapping[int, tuple[Array, Array, Array]]:
        """(M, M) products in noise SD, with the base refitted, and with nuisances beside it."""
        every = {id(one): one for one in self.of.values()}
        return {key: (one.ff, one.refitted, one.left) for key, one in every.items()}

    def left(self, specimen: str) -> Array:
        """(M, M) products in a specimen with base and nuisances taken out."""
        return self.products[id(self.of[specimen])][2]

    def places(
        self, number: int, form: CandidateForm, sds: tuple[float, ...]
    ) -> tuple[Places, tuple[int, ...]]:
        """Columns of a form of effect ``number`` among all, and the value that each strength is."""
        found, strengths = self.those.indices[number].places(
            form, sds, tuple(self.of), self.those.tests
        )
        start = self.those.starts[number]
        return tuple((name, start + columns, owners) for name, columns, owners in found), strengths

    def summed(self, places: Places, count: int) -> tuple[Array, Array, Array]:
        """(k, k) of the strengths of a form, the three `products` of all its specimens."""
        found = tuple(np.zeros((count, count)) for _ in range(3))
        for specimen, columns, owners in places:
            onto = summation(owners, count)
            for total, one in zip(found, self.products[id(self.of[specimen])], strict=True):
                total += onto @ one[np.ix_(columns, columns)] @ onto.T
        raw, refitted, left = found
        return raw, refitted, left


def specimen_signatures(grounds: BaselineFit, specimen: str, those: Candidates) -> Information:
    """What the tests of a specimen see, at the base fit."""
    model = grounds.fit.models[specimen]
    solved = SolvedSpecimen(model, grounds.readings[specimen].cases, grounds.noise.zeroed)
    seen = signatures(solved, those.columns)
    return Information.of(rows_there(grounds, grounds.fit, specimen, seen))


def cohort_signatures(grounds: BaselineFit, trials: Sequence[Trials]) -> CohortSignatures:
    """What all tests see."""
    joints = next(iter(grounds.fit.models.values())).n_joints
    those = candidates(trials, joints, grounds.tests)
    return CohortSignatures(
        those, {name: specimen_signatures(grounds, name, those) for name in grounds.readings}
    )


def with_each_run(
    place: Bench, trials: Sequence[Trials]
) -> Iterator[tuple[PlannedTest, CohortSignatures]]:
    """What tests see with each run of the menu besides, where it has a pose.

    The run is made on each specimen; the first specimen stands for all.
    """
    grounds = place.grounds
    name = next(iter(grounds.readings))
    model = grounds.fit.models[name]
    those = candidates(trials, model.n_joints, grounds.tests)
    there = specimen_signatures(grounds, name, those)

    def seen(changed: ModelChange, cases: Sequence[LoadCase]) -> Sequence[Array]:
        return signatures(SolvedSpecimen(changed(model), cases, False), those.columns)

    for run, more in added(place, grounds.fit, name, menu_of(grounds, name), seen):
        if not isinstance(more, str):
            of = dict.fromkeys(grounds.readings, there.plus(more))
            yield run, CohortSignatures(those, of)


def menu_of(grounds: BaselineFit, specimen: str) -> list[PlannedTest]:
    """Runs that could be added to the tests of a specimen."""
    return runs(planned_of(grounds.readings[specimen], grounds.noise.zeroed, MOST_STEPS))
