"""Which extra test would show an effect that the cohort's own tests cannot: computed, not asserted.

Additions that would cost a laboratory something stand in a menu, in order of effort; each turns a
plan of tests into a larger one, or into None where the plan has it already. Each is put to the base
model of one specimen, which stands for all. The first that shows an effect clearly is the one to
do; if none does, the first that shows it at all.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from spinepipe.effects.contract import Array, Indices
from spinepipe.model import LoadCase, RefusedModel
from spinepipe.studies.discrepancy.design.fisher_information import candidates, signature_products
from spinepipe.studies.discrepancy.design.plans import (
    HELD_S,
    LARGER,
    PRELOAD_N,
    SLOWER,
    STEP_S,
    Plan,
    at_times,
    has_times,
    peak,
    plan_of_readings,
    scale_loads,
    summed_loads,
    thin_steps,
    times,
    unloads,
    with_hold,
    with_preloads,
    with_unloading,
)
from spinepipe.studies.discrepancy.design.testable import Judgement, judgements
from spinepipe.studies.discrepancy.search.baseline import PER_SPECIMEN, BaselineFit, base_parameters
from spinepipe.studies.discrepancy.search.hypothesis import Trials
from spinepipe.studies.discrepancy.search.nuisance import nuisance_signatures
from spinepipe.studies.discrepancy.search.prediction import NoEquilibrium, SolvedSpecimen
from spinepipe.studies.discrepancy.search.whitening import whitening, with_nuisances
from spinepipe.studies.discrepancy.verdict import NotTestable
from spinepipe.units import COORDINATES

TRANSLATION_SD = 1e-4
"""m, of translations in tests where none were read and none is declared."""

NONE_SHOWS_IT = "no single addition that was tried shows it"
"""Said instead of advice: what an effect takes in general these tests may have already."""

MOST_STEPS = 10
"""Per test before anything is added; fewer readings than in truth err on the safe side."""


@dataclass(frozen=True)
class Addition:
    """Something to add to the tests: in words, and what it makes of a plan."""

    words: str
    to: Callable[[Plan], Plan | None]


@dataclass(frozen=True)
class Bench:
    """Where additions are tried: a specimen's base model and errors of single readings.

    Attributes
    ----------
    sd : (6,) m and rad, of coordinates that were not read as well.
    """

    grounds: BaselineFit
    specimen: str
    sd: Array

    @property
    def plan(self) -> Plan:
        """The specimen's own tests, with fewer load steps where there are many."""
        g = self.grounds
        model, free = g.fit.models[self.specimen], g.start.base[self.specimen]
        alike = all(len(p.rows) == len(model.effects[p.effect].values) for p in free)
        grouping = PER_SPECIMEN if alike else "per_joint"
        own = plan_of_readings(g.readings[self.specimen], g.noise.zeroed, grouping)
        return thin_steps(own, MOST_STEPS)


def not_testable(
    place: Bench, trials: Sequence[Trials], found: Sequence[Judgement], needed: float, seed: int
) -> tuple[NotTestable, ...]:
    """Effects that the tests cannot show, each with the least addition that would.

    Parameters
    ----------
    found : what the tests could tell of each effect of ``trials``. needed : log evidence.
    """
    hidden = {one.effect: one.why for one in found if not one.testable}
    clear: dict[str, str] = {}
    faint: dict[str, str] = {}
    for addition in MENU:
        left = [one for one in trials if one.effect in hidden and one.effect not in clear]
        plan = addition.to(place.plan) if left else None
        for one in [] if plan is None else judge_plan(place, plan, left, needed, seed):
            if one.clear:
                clear[one.effect] = addition.words
            elif one.testable:
                faint.setdefault(one.effect, addition.words)
    told = faint | clear
    return tuple(
        NotTestable(name, why if name in told else f"{why}; {NONE_SHOWS_IT}", told.get(name, ""))
        for name, why in hidden.items()
    )


def bench(grounds: BaselineFit, declared: Array | None) -> Bench:
    """The first specimen, with declared SDs (6,) m and rad of what was not read."""
    specimen = next(iter(grounds.readings))
    usual = np.full(6, TRANSLATION_SD) if declared is None else declared
    sd = np.where(np.isfinite(grounds.noise.sd), grounds.noise.sd, usual)
    return Bench(grounds, specimen, sd)


def judge_plan(
    place: Bench, plan: Plan, trials: Sequence[Trials], needed: float, seed: int
) -> tuple[Judgement, ...]:
    """What a plan could tell of effects, done on all specimens; empty where it has no pose."""
    grounds = place.grounds
    tests = tuple(dict.fromkeys(one.case.test for one in plan.tests))
    read = np.any([one.count.any(axis=0) for one in plan.tests], axis=0)
    names = [name for name, there in zip(COORDINATES, read, strict=True) if there]
    sd = np.where(read, place.sd, np.nan)
    plain = whitening(plan.repeats(), replace(grounds.noise, sd=sd, zeroed=plan.zeroed))
    try:
        model = with_preloads(grounds.fit.models[place.specimen], plan.tests)
        solved = SolvedSpecimen(model, [one.case for one in plan.tests], plan.zeroed)
        white = with_nuisances(plain, nuisance_signatures(solved, grounds.priors, names))
        free = base_parameters(model, plan.grouping, names)
        those = candidates(trials, model.n_joints, tests)
        one = signature_products(solved, free, plain, white, those)
    except (NoEquilibrium, RefusedModel):
        return ()
    of = dict.fromkeys(grounds.readings, one)
    return judgements(trials, of, model.n_joints, tests, needed, seed)


def _translations_too(plan: Plan) -> Plan | None:
    if all(one.count[:, :3].any() for one in plan.tests):
        return None
    tests = []
    for one in plan.tests:
        count: Indices = one.count.copy()
        count[:, :3] = one.count.max(axis=1, keepdims=True)
        tests.append(replace(one, count=count))
    return replace(plan, tests=tuple(tests))


def _each(
    change: Callable[[LoadCase], LoadCase], unless: Callable[[LoadCase], bool] | None = None
) -> Callable[[Plan], Plan | None]:
    """A change of every test of a plan, unless all of them have it."""

    def to(plan: Plan) -> Plan | None:
        if unless is not None and all(unless(one.case) for one in plan.tests):
            return None
        tests = tuple(replace(one, case=change(one.case)) for one in plan.tests)
        return replace(plan, tests=tests)

    return to


def _opposite(plan: Plan) -> Plan | None:
    loads = [load for one in plan.tests for load in summed_loads(one.case)]
    missing = []
    for one in plan.tests:
        # opposite: a load (6,) with at least half of the largest one, turned round
        largest = peak(one.case)
        if not any(-(load @ largest) >= 0.5 * (largest @ largest) > 0.0 for load in loads):
            case = replace(scale_loads(one.case, -1.0), test=f"{one.case.test}, opposite")
            missing.append(one.renamed(case))
    return replace(plan, tests=(*plan.tests, *missing)) if missing else None


def _preloaded(plan: Plan) -> Plan | None:
    again = [
        replace(one.renamed(replace(one.case, test=f"{name}, preloaded")), preload=PRELOAD_N)
        for name, one in ((one.case.test, one) for one in plan.tests)
    ]
    return replace(plan, tests=(*plan.tests, *again))


MENU = (
    Addition("translations read as well", _translations_too),
    Addition(
        "readings kept as they are, not zeroed at step 0",
        lambda plan: replace(plan, zeroed=False) if plan.zeroed else None,
    ),
    Addition(
        f"times recorded, {STEP_S:g} s from load step to load step",
        _each(lambda case: at_times(case, times(case)), unless=has_times),
    ),
    Addition(
        "unloading steps added: the same loads back down", _each(with_unloading, unless=unloads)
    ),
    Addition("the same loads in the opposite direction as well", _opposite),
    Addition(
        f"loads {LARGER:g} times as large",
        _each(lambda case: scale_loads(case, LARGER)),
    ),
    Addition(f"every test once more under a follower load of {PRELOAD_N:g} N", _preloaded),
    Addition(
        f"the largest load held for {HELD_S[-1] / 60:g} min, read along the way",
        _each(with_hold),
    ),
    Addition(
        f"{SLOWER:g} times as long between load steps, times recorded",
        _each(lambda case: at_times(case, [SLOWER * time for time in times(case)])),
    ),
    Addition(
        "no other test, but a base that shares stiffness: per_specimen",
        lambda plan: (
            replace(plan, grouping=PER_SPECIMEN) if plan.grouping != PER_SPECIMEN else None
        ),
    ),
)
"""In order of effort."""
