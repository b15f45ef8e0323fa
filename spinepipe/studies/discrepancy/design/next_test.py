"""Which test next: what each run of the menu would add to the evidence, for this very cohort.

Were another model true, the readings would differ by d from what a fitted model says. The fitted
one may move its unknowns x (J, weak priors) and nuisances z (U, prior SD one) towards them. What
stays, ``min |d - J x - U z|^2 + |z|^2 + priors``, is the noncentrality of its chi2: twice the log
evidence by which it is expected to fall behind, to first order at the fit. A run's gain is what its
readings, put below those that are there, add to that half; every specimen that shows a difference
makes it.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from spinepipe.effects.contract import Array
from spinepipe.model import LoadCase, RefusedModel, SpineModel
from spinepipe.studies.discrepancy.design.extra_tests import Bench
from spinepipe.studies.discrepancy.design.patterns import Pattern, RivalFits
from spinepipe.studies.discrepancy.design.plans import (
    Plan,
    plan_of_readings,
    thin_steps,
    with_preloads,
)
from spinepipe.studies.discrepancy.design.runs import ExtraCycle, runs
from spinepipe.studies.discrepancy.search.baseline import PER_SPECIMEN, base_parameters
from spinepipe.studies.discrepancy.search.hypothesis import LOG_STIFFNESS_SD
from spinepipe.studies.discrepancy.search.imperfections import labels_of
from spinepipe.studies.discrepancy.search.joint_fit import JointFit, Setting, joint_fit
from spinepipe.studies.discrepancy.search.nuisance import (
    Label,
    nuisance_labels,
    nuisance_signatures,
)
from spinepipe.studies.discrepancy.search.prediction import (
    NoEquilibrium,
    Simulated,
    SolvedSpecimen,
    bushing_stiffness,
)
from spinepipe.studies.discrepancy.search.projected import EVERY_TEST
from spinepipe.studies.discrepancy.search.readings import Repeats
from spinepipe.studies.discrepancy.search.refit import standing
from spinepipe.studies.discrepancy.search.whitening import Whitening, joined, whitening
from spinepipe.units import COORDINATES, subtract_baseline

MOST_SPECIMENS = 3
"""Specimens on which runs are tried: those that show most of the difference stand for all."""

MOST_STEPS = 25
"""Of a run; more are thinned, which errs on the safe side."""

SHOWS = 1e-3
"""Of the largest squared difference of a specimen: one with less does not need the run."""


Key = tuple[str, str, int | None, str]
"""What a nuisance is of; the same in all runs of one set-up."""


def key_of(label: Label) -> Key:
    """Kind, component, joint and test."""
    return label.kind, label.component, label.joint, label.test


@dataclass(frozen=True)
class ExpectedReadings:
    """Readings in noise SDs: difference d (N,), by unknowns J (N, m), by nuisances U (N, K).

    ``keys`` (K,): what each nuisance is of.
    """

    difference: Array
    by_unknowns: Array
    moves: Array
    keys: tuple[Key, ...]


@dataclass(frozen=True)
class Sums:
    """Products of a specimen's rows: all that is needed of them.

    Attributes
    ----------
    uu : (K, K) U'U. uj : (K, m) U'J. ud : (K,) U'd. jj, jd, dd : J'J, J'd, d'd.
    """

    keys: tuple[Key, ...]
    uu: Array
    uj: Array
    ud: Array
    jj: Array
    jd: Array
    dd: float

    @classmethod
    def of(cls, rows: ExpectedReadings) -> "Sums":
        """Products of some rows."""
        u, j, d = rows.moves, rows.by_unknowns, rows.difference
        return cls(rows.keys, u.T @ u, u.T @ j, u.T @ d, j.T @ j, j.T @ d, float(d @ d))

    def plus(self, other: "Sums") -> "Sums":
        """Rows of both; nuisances of one key are one."""
        keys = tuple(dict.fromkeys((*self.keys, *other.keys)))
        a, b = self._among(keys), other._among(keys)
        return Sums(
            keys, a.uu + b.uu, a.uj + b.uj, a.ud + b.ud, a.jj + b.jj, a.jd + b.jd, a.dd + b.dd
        )

    def _among(self, keys: Sequence[Key]) -> "Sums":
        """The same by these keys, those of its own among them."""
        onto = np.zeros((len(keys), len(self.keys)))
        place = {key: number for number, key in enumerate(keys)}
        onto[[place[key] for key in self.keys], np.arange(len(self.keys))] = 1.0
        uu, uj, ud = onto @ self.uu @ onto.T, onto @ self.uj, onto @ self.ud
        return Sums(tuple(keys), uu, uj, ud, self.jj, self.jd, self.dd)

    @property
    def without_nuisances(self) -> tuple[Array, Array, float]:
        """J'WJ (m, m), J'Wd (m,) and d'Wd with W the inverse of I + UU' (Woodbury)."""
        inside = np.eye(len(self.keys)) + self.uu
        solved = np.linalg.solve(inside, np.column_stack([self.uj, self.ud]))
        of_j, of_d = solved[:, :-1], solved[:, -1]
        return (
            self.jj - self.uj.T @ of_j,
            self.jd - self.uj.T @ of_d,
            self.dd - float(self.ud @ of_d),
        )


def noncentrality(of: Mapping[str, Sums], prior_sds: Array) -> float:
    """What all specimens together leave between the models; unknowns (m,) are common to all."""
    # generalised least squares: the unknowns' normal equations, summed over specimens
    parts = [one.without_nuisances for one in of.values()]
    jj = np.sum([part[0] for part in parts], axis=0) + np.diag(prior_sds**-2.0)
    jd = np.sum([part[1] for part in parts], axis=0)
    dd = sum(part[2] for part in parts)
    return max(0.0, dd - float(jd @ np.linalg.solve(jj, jd))) if len(jd) else max(0.0, dd)


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

    pattern: Pattern
    there: Mapping[str, Sums]
    showing: tuple[str, ...]
    share: float
    added: Mapping[tuple[str, str], Sums | str]

    @classmethod
    def of(cls, pattern: Pattern, place: Bench) -> "TriedRuns":
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

    def gain(self, words: str) -> float:
        """Half the noncentrality that a run adds in all specimens that show a difference.

        Raises
        ------
        NoPose
            Where a specimen has none in it.
        """
        more = dict(self.there)
        for (run, name), sums in self.added.items():
            if run == words:
                if isinstance(sums, str):
                    raise NoPose(sums)
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
    waiting = list(groups.values())[::-1]
    while waiting:
        group = waiting.pop()
        try:
            rows = _solved(pattern, place, name, group)
        except (NoEquilibrium, RefusedModel) as trouble:
            # where one of a stack has no pose, it is found by halving the stack
            if len(group) == 1:
                yield group[0], str(trouble)
            else:
                middle = len(group) // 2
                waiting += [group[middle:], group[:middle]]
        else:
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
    # added, not set: several of a specimen's own parameters may be one unknown
    np.add.at(whole.T, np.array(fit.hypothesis.members[name].numbers), own.T)
    return whole


def remaining_chi2(pattern: RivalFits, place: Bench, words: str | None) -> float | None:
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
    # the other model's predictions take the place of the readings, without noise
    readings, whitenings = {}, {}
    for name, one in g.readings.items():
        pairs = zip(one.tests, pattern.other.predicted[name], strict=True)
        tests = [_as_predicted(test, predicted) for test, predicted in pairs]
        white, run = g.setting.whitenings[name], added.get(name)
        if run is not None:
            if run.zeroed != g.noise.zeroed or run.test.preload:
                return None
            model, case = pattern.other.models[name], run.test.case
            predicted = Simulated(model, [case], run.zeroed, ()).at(np.zeros(0)).readings[0]
            (planned,) = Plan((run.test,), run.zeroed, PER_SPECIMEN).repeats()
            tests.append(_as_predicted(planned, predicted))
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
    plan = plan_of_readings(g.readings[name], g.noise.zeroed, PER_SPECIMEN)
    return runs(thin_steps(plan, MOST_STEPS).tests, g.noise.zeroed)
