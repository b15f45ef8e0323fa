"""What a search may do, what it looks at, and where it ends."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from math import log

import numpy as np

from spinepipe.studies.discrepancy.search.baseline import BaselineFit
from spinepipe.studies.discrepancy.search.gaps import Gap
from spinepipe.studies.discrepancy.search.hypothesis import ActiveTerm, Trials
from spinepipe.studies.discrepancy.search.lack_of_fit import LackOfFit
from spinepipe.studies.discrepancy.search.prediction import SolvedSpecimen
from spinepipe.studies.discrepancy.search.projected import (
    Linearised,
    Products,
    columns_of,
    linearised,
    products,
    signatures_of_each,
    taken_out,
)
from spinepipe.studies.discrepancy.search.refit import Refit
from spinepipe.studies.discrepancy.search.screen import EffectColumns, Screen, screened
from spinepipe.studies.discrepancy.verdict import SURE, SearchExtent

PRIOR = (0.35, 0.45, 0.15, 0.05)
"""Probabilities before any reading that no, one, two or three effects are missing."""

ELSE = 0.05
"""Probability before any reading that something else is missing, whatever else is."""


@dataclass(frozen=True)
class Rules:
    """What a search may do.

    ``most_fits`` : after which it ends with what it has.
    """

    trials: tuple[Trials, ...]
    coordinates: tuple[str, ...]
    most_effects: int
    most_fits: int = 10

    @property
    def needed(self) -> float:
        """Log evidence from which a single effect is sure beside nothing else."""
        return needed_of(len(self.trials))


def needed_of(effects: int) -> float:
    """Log evidence from which one of so many effects is sure beside nothing else."""
    odds = PRIOR[0] * effects / PRIOR[1]
    return log(SURE / (1.0 - SURE)) + log(max(odds, 1.0))


@dataclass(frozen=True)
class Rival:
    """Another effect in the place of a named one, and by how much evidence it is behind.

    ``on`` : the coordinates that its best form loads; none where it names none.
    """

    name: str
    margin: float
    on: tuple[str, ...] = ()


@dataclass(frozen=True)
class SelectedTerm:
    """A form that stands in the final model.

    Attributes
    ----------
    probability : that its effect is missing. log_evidence : of all that stand, less that of the
        others alone. gain : drop of chi2 in the same way. rivals : nearest first.
    """

    supposed: ActiveTerm
    probability: float
    log_evidence: float
    gain: float
    rivals: tuple[Rival, ...]

    @property
    def name(self) -> str:
        """Name of the effect."""
        return self.supposed.form.name


@dataclass(frozen=True)
class SearchStage:
    """A look beside a set of effects, and the fits of what was added to it.

    Attributes
    ----------
    name : its number. beside : names of the effects of the set, one for each form.
    refits : each with the log evidence that it adds to the set's.
    behind : of each, log odds by which it is behind the most probable set.
    """

    name: str
    screen: Screen
    refits: tuple[Refit, ...]
    behind: tuple[float, ...] = ()
    beside: tuple[str, ...] = ()


@dataclass(frozen=True)
class SearchResult:
    """Where a search ended.

    Attributes
    ----------
    base, final : fits of the base alone and of what stands. standing : what stands, in the order
        of the fit. probabilities : of each effect, of `SOMETHING_ELSE` and of `NOTHING`.
    sets : names that may be missing together, most probable first, each with its probability,
        with and without something else.
    with_tables : the final model with what stands for something else; None where that has no fit.
    lack : the generic basis beside the final model. unfitted : probability that rests on looks.
    extent : how far the search came.
    base_at, final_at : the gap at each coordinate that was read, by its name.
    """

    base: BaselineFit
    final: BaselineFit
    standing: tuple[SelectedTerm, ...]
    stages: tuple[SearchStage, ...]
    probabilities: Mapping[str, float]
    sets: tuple[tuple[frozenset[str], bool, float], ...]
    with_tables: BaselineFit | None
    lack: LackOfFit
    unfitted: float
    base_gap: Gap
    final_gap: Gap
    base_at: Mapping[str, Gap]
    final_at: Mapping[str, Gap]
    extent: SearchExtent = field(default_factory=SearchExtent)


def look(baseline: BaselineFit, trials: Sequence[Trials]) -> Screen:
    """Evidence of every effect beside those of the fit, with base and nuisances taken out."""
    problems = linearised_for(baseline, trials)
    found = [
        screened(one, index, problem, tuple(baseline.readings), baseline.tests)
        for one, (index, problem) in zip(trials, problems, strict=True)
    ]
    return Screen(tuple(sorted(found, key=lambda one: (-one.log_evidence, one.effect))))


def linearised_for(
    baseline: BaselineFit, trials: Sequence[Trials]
) -> list[tuple[EffectColumns, Linearised]]:
    """The products of each effect's signatures."""
    joints = next(iter(baseline.fit.models.values())).n_joints
    indices = [_index(one, joints, tuple(baseline.tests)) for one in trials]
    columns = [one.columns for one in indices]
    taken = taken_out(baseline.fit)
    parts: list[dict[str, Products]] = [{} for _ in trials]
    for name, one in baseline.readings.items():
        solved = SolvedSpecimen(baseline.fit.models[name], one.cases, baseline.noise.zeroed)
        for place, moved in zip(parts, signatures_of_each(solved, columns), strict=True):
            plain = baseline.plain[name].noise_only(moved)
            white = baseline.setting.whitenings[name].shortened(plain)
            place[name] = products(taken[name], white, np.sum(plain**2, axis=0))
    return [(index, linearised(place)) for index, place in zip(indices, parts, strict=True)]


@lru_cache(maxsize=256)
def _index(trials: Trials, joints: int, tests: tuple[str, ...]) -> EffectColumns:
    """Columns of one effect; looks at the same cohort, and at others like it, share them."""
    return EffectColumns(columns_of(trials, joints, tests))
