"""A search at work: what it may do, what it has looked at so far, and where it ended."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from spinepipe.progress import Progress
from spinepipe.studies.discrepancy.search.baseline import BaselineFit
from spinepipe.studies.discrepancy.search.gaps import Gap
from spinepipe.studies.discrepancy.search.hypothesis import ActiveTerm, Trials
from spinepipe.studies.discrepancy.search.joint_fit import JointFit, joint_fit
from spinepipe.studies.discrepancy.search.lack_of_fit import LackOfFit, lack_of_fit
from spinepipe.studies.discrepancy.search.prediction import SolvedSpecimen
from spinepipe.studies.discrepancy.search.projected import (
    Linearised,
    Products,
    columns_of,
    drawn,
    linearised,
    products,
    signatures_of_each,
    taken_out,
)
from spinepipe.studies.discrepancy.search.refit import STARTS, Refit, refit, refits, weaker
from spinepipe.studies.discrepancy.search.screen import EffectColumns, Screen, screen, screened
from spinepipe.studies.discrepancy.store import PieceRunner


@dataclass(frozen=True)
class Rules:
    """What a search may do. ``draws`` of the null; ``margin`` of log evidence over a rival."""

    trials: tuple[Trials, ...]
    coordinates: tuple[str, ...]
    false_alarm: float
    draws: int
    margin: float
    most_effects: int
    seed: int


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
    log_evidence : beside the others; to second order where these alone have no fit.
    alone : of its effect on the first screen, beside none.
    rivals_known : whether others could be tried in its place.
    over_stiffness : how far its evidence is above that of a stiffness of its own for each joint of
        each specimen, where the form differs between joints as well; None elsewhere.
    """

    supposed: ActiveTerm
    log_evidence: float
    alone: float
    gain: float
    rivals: tuple[Rival, ...]
    over_stiffness: float | None
    rivals_known: bool = True

    @property
    def name(self) -> str:
        """Name of the effect."""
        return self.supposed.form.name


@dataclass(frozen=True)
class SearchStage:
    """One look at the effects, with the refits that followed.

    Attributes
    ----------
    name : number of the round, or whose place all others were tried in.
    in_place : whether they were tried in the place of an effect; else some could enter.
    beside : names of the effects in the model beside which they were tried, one for each form.
    """

    name: str
    screen: Screen
    refits: tuple[Refit, ...]
    in_place: bool
    beside: tuple[str, ...] = ()


@dataclass(frozen=True)
class SearchResult:
    """Where a search ended.

    Attributes
    ----------
    base, final : fits of the base alone and of what stands. standing : what stands.
    lack : the generic basis beside the final model.
    generic_threshold, generic_threshold_at : evidence of the generic basis that the null seldom
        exceeds, as a whole and in any single coordinate.
    base_at, final_at : the gap at each coordinate that was read, by its name.
    base_lack : the generic basis beside the base alone.
    """

    base: BaselineFit
    final: BaselineFit
    standing: tuple[SelectedTerm, ...]
    stages: tuple[SearchStage, ...]
    lack: LackOfFit
    generic_threshold: float
    base_gap: Gap
    final_gap: Gap
    base_at: Mapping[str, Gap]
    final_at: Mapping[str, Gap]
    generic_threshold_at: Mapping[str, float]
    base_lack: LackOfFit


def look(
    baseline: BaselineFit,
    trials: Sequence[Trials],
    draws: int,
    false_alarm: float,
    seed: int,
    threshold: float | None = None,
) -> Screen:
    """Evidence of every effect beside those of the fit, with base and nuisances taken out.

    Parameters
    ----------
    threshold : as known already; then no draws of the null are needed.
    """
    number = draws if threshold is None else 0  # of the null, which the threshold is taken from
    problems = linearised_for(baseline, trials, number, seed)
    found = [
        screened(one, index, problem, tuple(baseline.readings), baseline.tests)
        for one, (index, problem) in zip(trials, problems, strict=True)
    ]
    return screen(found, false_alarm, threshold)


def linearised_for(
    baseline: BaselineFit, trials: Sequence[Trials], draws: int, seed: int
) -> list[tuple[EffectColumns, Linearised]]:
    """The products of each effect's signatures; draws of the null are the same for all effects."""
    joints = next(iter(baseline.fit.models.values())).n_joints
    indices = [_index(one, joints, tuple(baseline.tests)) for one in trials]
    columns = [one.columns for one in indices]
    taken = taken_out(baseline.fit)
    parts: list[dict[str, Products]] = [{} for _ in trials]
    for number, (name, one) in enumerate(baseline.readings.items()):
        solved = SolvedSpecimen(baseline.fit.models[name], one.cases, baseline.noise.zeroed)
        errors = drawn(taken[name], draws, np.random.default_rng([seed, number]))
        for place, moved in zip(parts, signatures_of_each(solved, columns), strict=True):
            plain = baseline.plain[name].noise_only(moved)
            white = baseline.setting.whitenings[name].shortened(plain)
            place[name] = products(taken[name], white, np.sum(plain**2, axis=0), errors)
    return [(index, linearised(place)) for index, place in zip(indices, parts, strict=True)]


@lru_cache(maxsize=256)
def _index(trials: Trials, joints: int, tests: tuple[str, ...]) -> EffectColumns:
    """Columns of one effect; looks at the same cohort, and at others like it, share them."""
    return EffectColumns(columns_of(trials, joints, tests))


class SearchState:
    """Looks, refits and fits by the rules, from the base alone on; ``stages`` is the log."""

    def __init__(
        self, base: BaselineFit, rules: Rules, run: PieceRunner, progress: Progress
    ) -> None:
        self.base, self.rules, self.run, self.progress = base, rules, run, progress
        self.stages: list[SearchStage] = []
        self._base_lack: LackOfFit | None = None

    @property
    def first(self) -> SearchStage:
        """The first look, beside the base alone."""
        return self.stages[0]

    def stage(self, baseline: BaselineFit, in_place_of: str = "") -> SearchStage:
        """A look at all effects beside the baseline's fit, refits of those that lead, an entry.

        Parameters
        ----------
        in_place_of : whose place all are tried in. Without it they may enter, and none is refitted
            where none is evident.
        """
        place = bool(in_place_of)
        if place and baseline is self.base:
            screen, tried = self.first.screen, self.first.refits
        else:
            # the null's draws are those of the first look, beside the base alone
            threshold = self.first.screen.threshold if self.stages else None
            draws = (self.rules.draws, self.rules.false_alarm, self.rules.seed)
            screen = self.run(look, baseline, self.rules.trials, *draws, threshold)
            best = screen.effects[0]
            self.progress.round(
                f"round {len(self.stages) + 1}: {best.effect} leads {len(screen.effects)} effects "
                f"with log evidence {best.log_evidence:.1f}, {screen.threshold:.1f} are needed"
            )
            evident = not best.log_evidence <= screen.threshold
            tried = ()
            if place or evident:
                tried = refits(baseline, screen, self.rules.trials, self.run, self.progress)
        # rounds of entry and trials in a place are counted apart
        number = 1 + sum(one.in_place == place for one in self.stages)
        name = f"in place of {in_place_of} ({number})" if place else str(number)
        beside = tuple(one.form.name for one in baseline.fit.hypothesis.supposed)
        self.stages.append(SearchStage(name, screen, tried, place, beside))
        return self.stages[-1]

    def lack(self, baseline: BaselineFit) -> LackOfFit:
        """The generic basis beside the baseline's fit; that of the base is asked for again."""
        of_base = baseline is self.base
        if of_base and self._base_lack:
            return self._base_lack
        asked = (self.rules.coordinates, self.rules.draws, self.rules.seed)
        found: LackOfFit = self.run(lack_of_fit, baseline, *asked)
        self._base_lack = found if of_base else self._base_lack
        return found

    def refit(self, baseline: BaselineFit, one: ActiveTerm) -> Refit:
        """One form beside those of the baseline's fit."""
        trials = next(t for t in self.rules.trials if t.effect == one.form.name)
        return self.run(refit, baseline, one, trials)

    def beside(self, current: BaselineFit, others: tuple[ActiveTerm, ...]) -> BaselineFit | None:
        """Baseline with these of the current effects alone; None where they have no fit.

        Looked for near where all stand, then from the neutral pose, then from the base as it stands
        alone, which is stiffer where what was taken away has stiffened it.
        """
        if not others:
            return self.base
        near = current.fit.poses
        starts = (
            (current, 1.0, near),
            (current, 1.0, None),
            *((self.base, share, None) for share in STARTS),
        )
        for baseline, share, poses in starts:
            start = baseline.suppose(tuple(weaker(one, share) for one in others))
            fit: JointFit = self.run(joint_fit, start, self.base.setting, poses)
            if fit.usable:
                return self.base.at(fit)
        return None
