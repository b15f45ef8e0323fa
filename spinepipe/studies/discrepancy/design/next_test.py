"""Which test next: what each run of the menu would add to the evidence, for this very cohort.

To first order at the fit: the log evidence by which a model is expected to fall behind another is
half the noncentrality of what the other predicts beyond it (see `expected`), with the readings that
are there and with one more run of every specimen that shows a difference.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from spinepipe.effects.contract import Array
from spinepipe.model import LoadCase, RefusedModel, SpineModel
from spinepipe.studies.discrepancy.design.expected import (
    ExpectedReadings,
    Key,
    Sums,
    key_of,
    noncentrality,
)
from spinepipe.studies.discrepancy.design.extra_tests import Bench
from spinepipe.studies.discrepancy.design.patterns import Pattern, RivalFits
from spinepipe.studies.discrepancy.design.plans import Plan, as_made, thinned, with_preloads
from spinepipe.studies.discrepancy.design.runs import ExtraCycle, runs
from spinepipe.studies.discrepancy.search.baseline import PER_SPECIMEN, base_parameters
from spinepipe.studies.discrepancy.search.hypothesis import LOG_STIFFNESS_SD
from spinepipe.studies.discrepancy.search.imperfections import labels_of
from spinepipe.studies.discrepancy.search.joint_fit import JointFit, Setting, joint_fit
from spinepipe.studies.discrepancy.search.nuisance import nuisance_labels, nuisance_signatures
from spinepipe.studies.discrepancy.search.prediction import (
    NoEquilibrium,
    Simulated,
    SolvedSpecimen,
    bushing_stiffness,
)
from spinepipe.studies.discrepancy.search.projected import EVERY_TEST
from spinepipe.studies.discrepancy.search.readings import Repeats, SpecimenReadings
from spinepipe.studies.discrepancy.search.refit import standing
from spinepipe.studies.discrepancy.search.whitening import Whitening, joined, whitening
from spinepipe.units import COORDINATES, subtract_baseline

MOST_SPECIMENS = 3
"""Specimens on which runs are tried: those that show most of the difference stand for all."""

MOST_STEPS = 25
"""Of a run; more are thinned, which errs on the safe side."""

SHOWS = 1e-3
"""Of the largest squared difference of a specimen: one with less does not need the run."""


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


def offers(patterns: Sequence[Pattern], place: Bench) -> list[Offer]:
    """Every run of the menu, the most gain per cycle first.

    Parameters
    ----------
    patterns : each model against the other, with equal probability to be true; one pattern where a
        model is asked for what it lacks. place : SDs of readings that were not made.
    """
    tried = [_Tried.of(one, place) for one in patterns]
    menu = dict.fromkeys(words for one in tried for words, _ in one.added)
    found = [_offer(words, tried) for words in menu]
    return sorted(found, key=lambda one: (-one.per_cycle, one.words))


def _offer(words: str, tried: Sequence["_Tried"]) -> Offer:
    cycles = max(len(one.showing) for one in tried)
    gains = [one.gain(words) for one in tried]
    trouble = next((gain for gain in gains if isinstance(gain, str)), None)
    if trouble is not None:
        return Offer(words, cycles, None, trouble)
    return Offer(
        words, cycles, float(np.mean([gain for gain in gains if not isinstance(gain, str)]))
    )


@dataclass(frozen=True)
class _Tried:
    """A pattern with the products of the readings that are there, and of those of each run.

    Attributes
    ----------
    there : by specimen. showing : specimens that show a difference. share : of the squared
        difference, how much larger it is in all of these than in those on which runs are tried.
    added : by words of the run and specimen; why not where it has no pose.
    """

    pattern: Pattern
    there: Mapping[str, Sums]
    showing: tuple[str, ...]
    share: float
    added: Mapping[tuple[str, str], Sums | str]

    @classmethod
    def of(cls, pattern: Pattern, place: Bench) -> "_Tried":
        """Try all runs of the menu."""
        there = {name: Sums.of(_rows(pattern, name)) for name in pattern.grounds.readings}
        sizes = {name: one.without_nuisances[2] for name, one in there.items()}
        least = SHOWS * max(sizes.values())
        showing = sorted((n for n in sizes if sizes[n] >= least), key=lambda name: -sizes[name])
        chosen = showing[:MOST_SPECIMENS]
        whole, tried = (sum(sizes[name] for name in some) for some in (showing, chosen))
        added = {
            (run.words, name): sums
            for name in chosen
            for run, sums in _added(pattern, place, name, _menu(place, name))
        }
        return cls(pattern, there, tuple(showing), whole / tried if tried else 1.0, added)

    def gain(self, words: str) -> float | str:
        """Half the noncentrality that a run adds in all specimens that show a difference, or why
        it has none.
        """
        more = dict(self.there)
        for (run, name), sums in self.added.items():
            if run == words:
                if isinstance(sums, str):
                    return sums
                more[name] = more[name].plus(sums)
        sds = np.array([u.sd for u in self.pattern.fit.hypothesis.unknowns])
        gained = noncentrality(more, sds) - noncentrality(self.there, sds)
        return 0.5 * self.share * max(0.0, gained)


def _rows(pattern: Pattern, name: str) -> ExpectedReadings:
    """The readings of a specimen that are there."""
    g, fit = pattern.grounds, pattern.fit
    white = g.setting.whitenings[name]
    keys = tuple(key_of(label) for label in labels_of(g, name))
    by_unknowns = _among_all(fit, name, white.lengthened(fit.jacobians[name]))
    return ExpectedReadings(pattern.there(name), by_unknowns, white.moves, keys)


def _added(
    pattern: Pattern, place: Bench, name: str, menu: Sequence[ExtraCycle]
) -> Iterator[tuple[ExtraCycle, Sums | str]]:
    """Products of each run; those that change the model and read alike are solved together."""
    groups: dict[tuple[float, bytes], list[ExtraCycle]] = {}
    for run in menu:
        read = run.test.count.any(axis=0).tobytes()
        groups.setdefault((run.test.preload, read), []).append(run)
    for group in groups.values():
        yield from _together(pattern, place, name, group)


def _together(
    pattern: Pattern, place: Bench, name: str, group: Sequence[ExtraCycle]
) -> Iterator[tuple[ExtraCycle, Sums | str]]:
    """Of runs in one stack; where one has no pose, in ever smaller ones."""
    try:
        rows = _solved(pattern, place, name, group)
    except (NoEquilibrium, RefusedModel) as trouble:
        if len(group) == 1:
            yield group[0], str(trouble)
            return
        middle = len(group) // 2
        for part in (group[:middle], group[middle:]):
            yield from _together(pattern, place, name, part)
        return
    yield from ((run, Sums.of(one)) for run, one in zip(group, rows, strict=True))


def _solved(
    pattern: Pattern, place: Bench, name: str, group: Sequence[ExtraCycle]
) -> list[ExpectedReadings]:
    """Readings of runs with one preload that read the same coordinates."""
    fit, free = pattern.fit, pattern.fit.hypothesis.members[name].free
    cases, first = [run.test.case for run in group], group[0].test
    tests = [run.test for run in group]
    model = with_preloads(fit.models[name], tests)
    by_x = Simulated(model, cases, False, free).at(np.zeros(len(free))).by_x
    apart = pattern.under(name, lambda one: with_preloads(one, tests), cases)
    seen_at = np.asarray(first.count.any(axis=0)).tolist()
    read = [n for n, there in zip(COORDINATES, seen_at, strict=True) if there]
    keys, moved = _nuisances(pattern, name, model, cases, read)
    found = []
    for run, difference, slopes, moves in zip(group, apart, by_x, moved, strict=True):
        white = _whitening(place, run)
        seen = [
            white.noise_only([subtract_baseline(rows, run.zeroed)])
            for rows in (difference, slopes, moves)
        ]
        own = [n for n, k in enumerate(keys) if k[-1] in (EVERY_TEST, run.test.case.test)]
        kept = tuple(keys[n] for n in own)
        found.append(
            ExpectedReadings(seen[0], _among_all(fit, name, seen[1]), seen[2][:, own], kept)
        )
    return found


def _nuisances(
    pattern: Pattern, name: str, model: SpineModel, cases: Sequence[LoadCase], read: Sequence[str]
) -> tuple[list[Key], tuple[Array, ...]]:
    """Nuisances of runs; stiffness in a coordinate that was not read before is one more."""
    solved, priors = SolvedSpecimen(model, cases, False), pattern.grounds.priors
    labels = nuisance_labels(priors, bushing_stiffness(model), cases, read)
    keys, moved = [key_of(label) for label in labels], nuisance_signatures(solved, priors, read)
    fresh = [n for n in read if n not in pattern.grounds.readings[name].coordinates]
    if not fresh:
        return keys, moved
    free = base_parameters(model, PER_SPECIMEN, fresh)
    slopes = [LOG_STIFFNESS_SD * one for one in solved.by(model, free)]
    keys += [("stiffness", f"{p.effect} {p.column}", p.rows[0], EVERY_TEST) for p in free]
    return keys, tuple(np.concatenate(pair, axis=-1) for pair in zip(moved, slopes, strict=True))


def _among_all(fit: JointFit, name: str, own: Array) -> Array:
    """(N, m) derivatives by all unknowns of those by a specimen's own."""
    whole = np.zeros((len(own), len(fit.x)))
    np.add.at(whole.T, np.array(fit.hypothesis.members[name].numbers), own.T)
    return whole


def left_apart(pattern: RivalFits, place: Bench, words: str | None) -> float | None:
    """chi2 and priors that stay between the models, the fitted one refitted to the other.

    A model of many shapes bends further than its tangent.

    Parameters
    ----------
    words : of a run that is made besides, or none. Without such a fit there is no result.
    """
    g = pattern.grounds
    added = {
        name: next((run for run in _menu(place, name) if run.words == words), None)
        for name in (g.readings if words is not None else ())
    }
    readings, whitenings = {}, {}
    for name, one in g.readings.items():
        tests = [_as_predicted(t, q) for t, q in _pairs(one, pattern.other.predicted[name])]
        white, run = g.setting.whitenings[name], added.get(name)
        if run is not None:
            if run.zeroed != g.noise.zeroed or run.test.preload:
                return None
            tests.append(_run_as_predicted(pattern, name, run))
            white = _white_with(pattern, place, name, run, white)
        readings[name] = replace(one, tests=tuple(tests))
        whitenings[name] = white
    setting = Setting(readings, whitenings, g.noise.zeroed)
    fit = joint_fit(g.suppose(standing(pattern.fit)), setting)
    if not fit.usable:
        return None
    away = [(x - u.mean) / u.sd for x, u in zip(fit.x, fit.hypothesis.unknowns, strict=True)]
    return fit.chi2 + float(np.sum(np.square(away)))


def _pairs(one: SpecimenReadings, predicted: Sequence[Array]) -> Iterator[tuple[Repeats, Array]]:
    return zip(one.tests, predicted, strict=True)


def _as_predicted(test: Repeats, predicted: Array) -> Repeats:
    return replace(test, cycles=np.where(np.isfinite(test.cycles), predicted, np.nan))


def _run_as_predicted(pattern: RivalFits, name: str, run: ExtraCycle) -> Repeats:
    model, case = pattern.other.models[name], run.test.case
    predicted = Simulated(model, [case], run.zeroed, ()).at(np.zeros(0)).readings[0]
    (planned,) = Plan((run.test,), run.zeroed, PER_SPECIMEN).repeats()
    return _as_predicted(planned, predicted)


def _white_with(
    pattern: RivalFits, place: Bench, name: str, run: ExtraCycle, white: Whitening
) -> Whitening:
    """The whitening of a specimen's readings and a run's below them."""
    there = _rows(pattern, name)
    (added,) = _solved(pattern, place, name, [run])
    keys = tuple(dict.fromkeys((*there.keys, *added.keys)))
    moves = np.zeros((len(there.moves) + len(added.moves), len(keys)))
    moves[: len(there.moves), [keys.index(key) for key in there.keys]] = there.moves
    moves[len(there.moves) :, [keys.index(key) for key in added.keys]] = added.moves
    return joined(white, _whitening(place, run), moves)


def _whitening(place: Bench, run: ExtraCycle) -> Whitening:
    """Of the readings of one run, noise alone."""
    read = run.test.count.any(axis=0)
    noise = replace(place.grounds.noise, sd=np.where(read, place.sd, np.nan), zeroed=run.zeroed)
    return whitening(Plan((run.test,), run.zeroed, PER_SPECIMEN).repeats(), noise)


def _menu(place: Bench, name: str) -> list[ExtraCycle]:
    g = place.grounds
    plan = as_made(g.readings[name], g.noise.zeroed, PER_SPECIMEN)
    return runs(thinned(plan, MOST_STEPS).tests, g.noise.zeroed)
