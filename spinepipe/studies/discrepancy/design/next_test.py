"""Which test next: what each run of the menu would add to the evidence, for this very cohort.

Were another model true, the readings would differ by d from what a fitted model says. The fitted
one may move its unknowns and nuisances towards them. What stays is the noncentrality of its chi2:
twice the log evidence by which it is expected to fall behind, to first order at the fit. A run's
gain is what its readings, put below those that are there, add to that half; every specimen that
shows a difference makes it.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from spinepipe.effects.contract import Array, Indices
from spinepipe.model import LoadCase
from spinepipe.studies.discrepancy.design.information import (
    Bench,
    Information,
    ModelChange,
    added,
    noncentrality,
    rows_added,
    rows_there,
    whitening_of,
)
from spinepipe.studies.discrepancy.design.plans import PlannedTest, repeats_of
from spinepipe.studies.discrepancy.design.signatures import menu_of
from spinepipe.studies.discrepancy.search.baseline import BaselineFit
from spinepipe.studies.discrepancy.search.joint_fit import JointFit, Setting, joint_fit
from spinepipe.studies.discrepancy.search.prediction import Simulated
from spinepipe.studies.discrepancy.search.readings import Repeats
from spinepipe.studies.discrepancy.search.refit import standing
from spinepipe.studies.discrepancy.search.whitening import Whitening, joined

MOST_SPECIMENS = 3
"""Specimens on which runs are tried: those that show most of the difference stand for all."""

SHOWS = 1e-3
"""Of the largest squared difference of a specimen: one with less does not need the run."""


@dataclass(frozen=True)
class RivalFits:
    """Two fits of the same readings; ``other`` would be true."""

    grounds: BaselineFit
    fit: JointFit
    other: JointFit

    def there(self, specimen: str) -> list[Array]:
        """(T, J, 6, 1) per test, difference of what they predict of the readings."""
        pairs = zip(self.other.predicted[specimen], self.fit.predicted[specimen], strict=True)
        return [np.nan_to_num(a - b)[..., None] for a, b in pairs]

    def under(self, specimen: str, changed: ModelChange, cases: Sequence[LoadCase]) -> list[Array]:
        """(T, J, 6, 1) m and rad, difference of what they predict in runs, not zeroed.

        Raises
        ------
        NoEquilibrium
            When a load step has no stable pose.
        """
        first, second = (
            Simulated(changed(one.models[specimen]), cases, False, ()).at(np.zeros(0)).readings
            for one in (self.other, self.fit)
        )
        return [(a - b)[..., None] for a, b in zip(first, second, strict=True)]


@dataclass(frozen=True)
class Offer:
    """A run and what it is expected to add.

    Attributes
    ----------
    cycles : to be made, all specimens together. gain : log evidence; None where there is no pose.
    """

    words: str
    cycles: int
    gain: float | None
    message: str = ""

    @property
    def per_cycle(self) -> float:
        """Gain of one cycle; none where there is no pose."""
        return 0.0 if self.gain is None else self.gain / self.cycles


def offers(patterns: Sequence[RivalFits], place: Bench) -> list[Offer]:
    """Every run of the menu, the most gain per cycle first.

    Parameters
    ----------
    patterns : each model against the other, with equal probability to be true; one pattern where a
        model is asked for what it lacks. place : SDs of readings that were not made.
    """
    tried = [TriedRuns.of(one, place) for one in patterns]
    cycles = max((len(one.showing) for one in tried), default=0)
    found = []
    for words in dict.fromkeys(words for one in tried for words, _ in one.added):
        gains, trouble = [], ""
        for one in tried:
            try:
                gains.append(one.gain(words))
            except NoPose as why:
                trouble = trouble or str(why)
        gain = None if trouble else float(np.mean(gains))
        found.append(Offer(words, cycles, gain, trouble))
    return sorted(found, key=lambda one: (-one.per_cycle, one.words))


class NoPose(RuntimeError):
    """A run in which a model has no pose; the message says why."""


@dataclass(frozen=True)
class TriedRuns:
    """A pattern with the products of the readings that are there, and of those of each run.

    Attributes
    ----------
    there : by specimen. showing : specimens that show a difference. share : of the squared
        difference, how much larger it is in all of these than in those on which runs are tried.
    added : by words of the run and specimen; why not where it has no pose.
    """

    pattern: RivalFits
    there: Mapping[str, Information]
    showing: tuple[str, ...]
    share: float
    added: Mapping[tuple[str, str], Information | str]

    @classmethod
    def of(cls, pattern: RivalFits, place: Bench) -> "TriedRuns":
        """Try all runs of the menu."""
        g, fit = pattern.grounds, pattern.fit
        there = {
            name: Information.of(rows_there(g, fit, name, pattern.there(name)))
            for name in g.readings
        }
        sizes = {name: float(one.without_nuisances[2][0, 0]) for name, one in there.items()}
        least = SHOWS * max(sizes.values())
        showing = sorted((n for n in sizes if sizes[n] >= least), key=lambda name: -sizes[name])
        chosen = showing[:MOST_SPECIMENS]
        whole, tried = (sum(sizes[name] for name in some) for some in (showing, chosen))
        found: dict[tuple[str, str], Information | str] = {}
        for name in chosen:

            def under(
                changed: ModelChange, cases: Sequence[LoadCase], name: str = name
            ) -> Sequence[Array]:
                return pattern.under(name, changed, cases)

            for run, more in added(place, fit, name, menu_of(place.grounds, name), under):
                found[run.words, name] = more
        return cls(pattern, there, tuple(showing), whole / tried if tried else 1.0, found)

    def gain(self, words: str) -> float:
        """Half the noncentrality that a run adds in all specimens that show a difference.

        Raises
        ------
        NoPose
            Where a specimen has none in it.
        """
        more = dict(self.there)
        for (run, name), one in self.added.items():
            if run == words:
                if isinstance(one, str):
                    raise NoPose(one)
                more[name] = more[name].plus(one)
        gained = self._noncentrality(more) - self._now
        return 0.5 * self.share * max(0.0, gained)

    @cached_property
    def _now(self) -> float:
        """The noncentrality without any run."""
        return self._noncentrality(self.there)

    def _noncentrality(self, of: Mapping[str, Information]) -> float:
        hypothesis = self.pattern.fit.hypothesis
        sds = np.array([u.sd for u in hypothesis.unknowns])
        numbers: dict[str, Indices] = {
            name: np.array(member.numbers, dtype=np.int64)
            for name, member in hypothesis.members.items()
        }
        return noncentrality(of, numbers, sds)


def remaining_chi2(pattern: RivalFits, place: Bench, words: str | None) -> float | None:
    """chi2 and priors that stay between the models, the fitted one refitted to the other.

    A model of many shapes bends further than its tangent.

    Parameters
    ----------
    words : of a run that is made besides, or none. Without such a fit there is no result.
    """
    g = pattern.grounds
    runs = {
        name: next((run for run in menu_of(place.grounds, name) if run.words == words), None)
        for name in (g.readings if words is not None else ())
    }
    # the other model's predictions take the place of the readings, without noise
    readings, whitenings = {}, {}
    for name, one in g.readings.items():
        pairs = zip(one.tests, pattern.other.predicted[name], strict=True)
        tests = [_as_predicted(test, predicted) for test, predicted in pairs]
        white, run = g.setting.whitenings[name], runs.get(name)
        if run is not None:
            if run.zeroed != g.noise.zeroed or run.preload:
                return None
            model = pattern.other.models[name]
            predicted = Simulated(model, [run.case], run.zeroed, ()).at(np.zeros(0)).readings[0]
            tests.append(_as_predicted(repeats_of(run), predicted))
            white = _white_with(pattern, place, name, run, white)
        readings[name] = replace(one, tests=tuple(tests))
        whitenings[name] = white
    setting = Setting(readings, whitenings, g.noise.zeroed)
    fit = joint_fit(g.suppose(standing(pattern.fit)), setting)
    if not fit.usable:
        return None
    away = [(x - u.mean) / u.sd for x, u in zip(fit.x, fit.hypothesis.unknowns, strict=True)]
    return fit.chi2 + float(np.sum(np.square(away)))


def _as_predicted(test: Repeats, predicted: Array) -> Repeats:
    return replace(test, cycles=np.where(np.isfinite(test.cycles), predicted, np.nan))


def _white_with(
    pattern: RivalFits, place: Bench, name: str, run: PlannedTest, white: Whitening
) -> Whitening:
    """The whitening of a specimen's readings and a run's below them."""
    there = rows_there(pattern.grounds, pattern.fit, name, pattern.there(name))
    (more,) = rows_added(
        place, pattern.fit, name, [run], lambda change, cases: pattern.under(name, change, cases)
    )
    keys = tuple(dict.fromkeys((*there.keys, *more.keys)))
    moves = np.zeros((len(there.moves) + len(more.moves), len(keys)))
    moves[: len(there.moves), [keys.index(key) for key in there.keys]] = there.moves
    moves[len(there.moves) :, [keys.index(key) for key in more.keys]] = more.moves
    return joined(white, whitening_of(place, run), moves)
