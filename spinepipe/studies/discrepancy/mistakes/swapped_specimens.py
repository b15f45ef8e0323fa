"""Exchanged specimens: the files fit better with the motion of two of them changed about.

A real effect may hide an exchange, and one that differs in each specimen, marker bias first of all,
imitates it. So the exchange, which has no unknowns of its own, is tried three ways, and needs

- beside all effects that stand: half the drop of chi2,
- in the place of one of several: half the drop of chi2, less that effect's log evidence,
- in the place of all: the same, and the evidence of the best single effect is added on both sides.

With pure moments on joints of like orientation an exchange cannot be told: stiffness, free for each
specimen, then changes places too, and all fits as well as before. What tells are axes, masses and
load points of their own.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from spinepipe.decomposition import lstsq
from spinepipe.model import SpineModel
from spinepipe.studies.discrepancy.search.baseline import BaselineFit
from spinepipe.studies.discrepancy.search.hypothesis import (
    ActiveTerm,
    Hypothesis,
    Trials,
    hypothesis,
)
from spinepipe.studies.discrepancy.search.joint_fit import JointFit, Setting, joint_fit
from spinepipe.studies.discrepancy.search.nuisance import nuisance_signatures
from spinepipe.studies.discrepancy.search.prediction import NoEquilibrium, Simulated, SolvedSpecimen
from spinepipe.studies.discrepancy.search.readings import SpecimenReadings
from spinepipe.studies.discrepancy.search.refit import standing
from spinepipe.studies.discrepancy.search.search_state import SearchResult, look
from spinepipe.studies.discrepancy.search.whitening import with_nuisances
from spinepipe.studies.discrepancy.store import PieceRunner
from spinepipe.studies.discrepancy.verdict import SuspectedError

NEEDED = 8.0
"""Log evidence for an exchange: one cohort in a hundred has one, and a false charge costs more.

Without an exchange the likelihoods have a ratio above exp(8) in less than one pair of 2,900.
"""

HIDDEN = 0.05
"""Share of the base's excess chi2 that an exchange may seem to cost while an effect hides it."""

MOST_TRIED = 4
"""Pairs that are fitted: those that promise most."""


@dataclass(frozen=True, eq=False)
class _Exchange:
    """A pair, chi2 of the cohort both ways, and the log evidence for the exchange."""

    pair: tuple[str, str]
    before: float
    after: float
    evidence: float


def swapped_pairs(
    baseline: BaselineFit,
    run: PieceRunner,
    trials: Sequence[Trials] = (),
    found: SearchResult | None = None,
) -> list[SuspectedError]:
    """Pairs that evidently changed places, best first, each specimen in one pair at most.

    Parameters
    ----------
    baseline : of the base. trials : effects that may be missing. found : where the search ended.
    """
    pairs, every = _promising(baseline), tuple(trials)
    as_read = 0.0
    if pairs and every:  # log evidence of the effects that explain what the base leaves as it is
        first = found.stages[0].screen if found else run(look, baseline, every)
        of_standing = sum(one.log_evidence for one in found.standing) if found else 0.0
        as_read = max(0.0, first.effects[0].log_evidence, of_standing)
    ways = tuple(_ways(baseline, run, found)) if pairs else ()
    tried = run.map(_exchange, [(baseline, pair, every, as_read, ways) for pair in pairs])
    strong = [one for one in tried if one is not None and one.evidence > NEEDED]
    taken: set[str] = set()
    errors = []
    for one in sorted(strong, key=lambda e: -e.evidence):
        if taken & set(one.pair):
            continue
        taken |= set(one.pair)
        evidence = (
            f"chi2 {one.before:.0f} as read and {one.after:.0f} exchanged; log evidence for the "
            f"exchange {one.evidence:.0f}, missing effects allowed for"
        )
        errors.append(SuspectedError(" and ".join(one.pair), "motion exchanged", evidence))
    return errors


def _promising(baseline: BaselineFit) -> list[tuple[str, str]]:
    """Pairs worth a fit, by one linear step of the base; best first."""
    residuals = baseline.fit.residuals
    chi2 = {name: float(r @ r) for name, r in residuals.items()}
    hidden = HIDDEN * max(_chi2(baseline) - sum(len(r) for r in residuals.values()), 0.0)
    found = []
    for pair in combinations(chi2, 2):
        readings = _readings(baseline.readings[pair[0]], baseline.readings[pair[1]])
        if readings is None:
            continue
        models = _models(baseline.fit.models, pair)
        supposed = hypothesis(models, baseline.start.base, (), baseline.tests, baseline.start.bound)
        white = {n: baseline.setting.whitenings[m] for n, m in zip(pair, pair[::-1], strict=True)}
        setting = Setting(readings, white, baseline.noise.zeroed)
        after = sum(_one_step(supposed, setting, name) for name in pair)
        gain = sum(chi2[name] for name in pair) - after
        if gain > -hidden:
            found.append((gain, pair))
    return [pair for _, pair in sorted(found, reverse=True)[:MOST_TRIED]]


def _exchange(
    baseline: BaselineFit,
    pair: tuple[str, str],
    trials: Sequence[Trials],
    as_read: float,
    ways: Sequence[tuple[BaselineFit, float]],
) -> _Exchange | None:
    """The best of the ways; None where the base has no fit with the pair exchanged.

    Parameters
    ----------
    as_read : log evidence of the effects that explain what the base leaves without an exchange.
    ways : fits with effects, see `_ways`.
    """
    setting = _setting(baseline, pair)
    if setting is None:
        return None
    there = _fitted(baseline, setting, pair, ())
    if there is None:
        return None
    effects = max(0.0, look(there, trials).effects[0].log_evidence) if trials else 0.0
    best = [_compared(baseline, there, pair, effects - as_read, effects)]
    for others, left_out in ways:
        beside = _fitted(others, setting, pair, standing(others.fit))
        if beside is not None:
            best.append(_compared(others, beside, pair, -left_out, 0.0))
    return max(best, key=lambda one: one.evidence)


def _ways(
    baseline: BaselineFit, run: PieceRunner, found: SearchResult | None
) -> Iterator[tuple[BaselineFit, float]]:
    """Fits with effects that stand: all, and all but one with the evidence of that one."""
    if found is None or not found.standing:
        return
    yield found.final, 0.0
    supposed = standing(found.final.fit)
    if len(supposed) < 2:
        return
    for number, one in enumerate(found.standing):
        others = tuple(s for place, s in enumerate(supposed) if place != number)
        start = found.final.suppose(others)
        fit: JointFit = run(joint_fit, start, found.final.setting, found.final.fit.poses)
        if fit.usable:
            yield found.final.at(fit), one.log_evidence


def _compared(
    before: BaselineFit, after: BaselineFit, pair: tuple[str, str], more: float, effects: float
) -> _Exchange:
    """Two fits with as many unknowns; what no effect explains makes both less believable.

    Parameters
    ----------
    more : evidence besides. effects : log evidence of those that explain what ``after`` leaves.
    """
    # the ratio of likelihoods at equal numbers of unknowns, its error SDs as large as what stays
    chi2 = _chi2(before), _chi2(after)
    count = sum(len(r) for r in after.fit.residuals.values())
    unexplained = max(1.0, (chi2[1] - 2.0 * effects) / count)
    return _Exchange(pair, *chi2, (0.5 * (chi2[0] - chi2[1]) + more) / unexplained)


def _chi2(baseline: BaselineFit) -> float:
    return sum(float(r @ r) for r in baseline.fit.residuals.values())


def _setting(baseline: BaselineFit, pair: tuple[str, str]) -> Setting | None:
    """The readings of a pair exchanged: noise goes with them, nuisances stay with the specimen.

    These are linearised where the base of each then stands; None where it does not.
    """
    readings = _readings(baseline.readings[pair[0]], baseline.readings[pair[1]])
    assert readings is not None
    models, whitenings = _models(baseline.fit.models, pair), dict(baseline.setting.whitenings)
    for name, other in zip(pair, pair[::-1], strict=True):
        one = readings[name]
        try:
            solved = SolvedSpecimen(models[name], one.cases, baseline.noise.zeroed)
        except NoEquilibrium:
            return None
        moved = nuisance_signatures(solved, baseline.priors, one.coordinates)
        whitenings[name] = with_nuisances(baseline.plain[other], moved)
    return Setting({**baseline.readings, **readings}, whitenings, baseline.noise.zeroed)


def _fitted(
    baseline: BaselineFit,
    setting: Setting,
    pair: tuple[str, str],
    supposed: Sequence[ActiveTerm],
) -> BaselineFit | None:
    """The baseline with a pair exchanged, base and effects fitted anew; None without a fit."""
    start = baseline.start
    models = {**start.models, **_models(start.models, pair)}
    again = hypothesis(models, start.base, supposed, baseline.tests, start.bound)
    fit = joint_fit(again, setting)
    if not fit.usable:
        return None
    plain = {**baseline.plain, pair[0]: baseline.plain[pair[1]], pair[1]: baseline.plain[pair[0]]}
    return replace(baseline, readings=setting.readings, plain=plain, setting=setting).at(fit)


def _readings(a: SpecimenReadings, b: SpecimenReadings) -> dict[str, SpecimenReadings] | None:
    """Each with its own frames and loads and the other's readings; None if tests do not match."""
    shapes = [[(t.case.test, t.cycles.shape) for t in one.tests] for one in (a, b)]
    if shapes[0] != shapes[1]:
        return None
    found = {}
    for mine, other in ((a, b), (b, a)):
        pairs = zip(mine.tests, other.tests, strict=True)
        tests = tuple(replace(test, cycles=of_other.cycles) for test, of_other in pairs)
        found[mine.specimen] = replace(mine, tests=tests)
    return found


def _models(models: Mapping[str, SpineModel], pair: tuple[str, str]) -> dict[str, SpineModel]:
    """Both models, each with the stiffness that the other's readings gave."""
    one, other = pair
    return {
        one: models[one].with_effects(models[other].effects),
        other: models[other].with_effects(models[one].effects),
    }


def _one_step(supposed: Hypothesis, setting: Setting, name: str) -> float:
    """The chi2 of a specimen that one linear step from the start reaches; a cheap first look."""
    member, one = supposed.members[name], setting.readings[name]
    simulated = Simulated(member.model, one.cases, setting.zeroed, member.free)
    try:
        predicted = simulated.at(np.zeros(len(member.free)))
    except NoEquilibrium:
        return np.inf
    white = setting.whitenings[name]
    residual, jacobian = white(one.errors(predicted.readings)), white(predicted.by_x)
    step, _ = lstsq(jacobian, residual)
    left = residual - jacobian @ step
    return float(left @ left)
