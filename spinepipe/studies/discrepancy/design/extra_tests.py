"""Which extra test would show an effect that the cohort's own tests cannot: computed, not asserted.

Each addition of a menu is put to the base model of one specimen, which stands for all. The first
that shows an effect clearly is the one to do; if none does, the first that shows it at all.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from spinepipe.discrepancy.base import base_parameters
from spinepipe.discrepancy.design.additions import MENU
from spinepipe.discrepancy.design.plans import PER_SPECIMEN, Plan, as_made, thinned
from spinepipe.discrepancy.design.seen import Seen, candidates, seen
from spinepipe.discrepancy.design.testable import Judgement, judgements
from spinepipe.discrepancy.forms import Trials
from spinepipe.discrepancy.grounds import Grounds
from spinepipe.discrepancy.noise import Noise
from spinepipe.discrepancy.nuisance import nuisance_signatures
from spinepipe.discrepancy.prediction import NoEquilibrium, Solved
from spinepipe.discrepancy.whitening import whitening, with_nuisances
from spinepipe.effects import Trial, create, registered
from spinepipe.effects.contract import Array
from spinepipe.model import RefusedModel, ScopedEffect, SpineModel
from spinepipe.units import COORDINATES

TRANSLATION_SD = 1e-4
"""m, of translations in tests where none were read and none is declared."""

PRELOAD = "follower_load"

MOST_STEPS = 10
"""Per test before anything is added; fewer readings than in truth err on the safe side."""


@dataclass(frozen=True)
class NotTestable:
    """An effect that these tests cannot show, why, and the test that would."""

    name: str
    why: str
    test_that_would_tell: str


@dataclass(frozen=True)
class Bench:
    """Where additions are tried: a specimen's base model and errors of single readings.

    Attributes
    ----------
    sd : (6,) m and rad, of coordinates that were not read as well.
    """

    grounds: Grounds
    specimen: str
    sd: Array

    @property
    def plan(self) -> Plan:
        """The specimen's own tests, with fewer load steps where there are many."""
        g = self.grounds
        model, free = g.fit.models[self.specimen], g.start.base[self.specimen]
        alike = all(len(p.rows) == len(model.effects[p.effect].values) for p in free)
        grouping = PER_SPECIMEN if alike else "per_joint"
        own = as_made(g.readings[self.specimen], g.noise.zeroed, grouping)
        return thinned(own, MOST_STEPS)


def bench(grounds: Grounds, declared: Array | None) -> Bench:
    """The first specimen, with declared SDs (6,) m and rad of what was not read."""
    specimen = next(iter(grounds.readings))
    usual = np.full(6, TRANSLATION_SD) if declared is None else declared
    sd = np.where(np.isfinite(grounds.noise.sd), grounds.noise.sd, usual)
    return Bench(grounds, specimen, sd)


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
        for one in [] if plan is None else judged_under(place, plan, left, needed, seed):
            if one.clear:
                clear[one.effect] = addition.words
            elif one.testable:
                faint.setdefault(one.effect, addition.words)
    told = faint | clear
    return tuple(
        NotTestable(name, why, told.get(name) or _declared(name)) for name, why in hidden.items()
    )


def _declared(effect: str) -> str:
    trial: Trial = registered()[effect].trial  # type: ignore[attr-defined]
    return f"no single addition that was tried shows it; it takes {trial.told_by}"


def judged_under(
    place: Bench, plan: Plan, trials: Sequence[Trials], needed: float, seed: int
) -> tuple[Judgement, ...]:
    """What a plan could tell of effects, done on all specimens; empty where it has no pose."""
    tests = tuple(dict.fromkeys(one.case.test for one in plan.tests))
    joints = place.grounds.fit.models[place.specimen].n_joints
    try:
        one = seen_under(place, plan, trials, tests)
    except (NoEquilibrium, RefusedModel):
        return ()
    of: Mapping[str, Seen] = dict.fromkeys(place.grounds.readings, one)
    return judgements(trials, of, joints, tests, needed, seed)


def seen_under(place: Bench, plan: Plan, trials: Sequence[Trials], tests: Sequence[str]) -> Seen:
    """What a plan would see on the bench.

    Raises
    ------
    NoEquilibrium
        When a load step has no stable pose.
    """
    model = _with_preload(place.grounds.fit.models[place.specimen], plan)
    repeats = plan.repeats()
    read = np.any([one.count.any(axis=0) for one in plan.tests], axis=0)
    names = [name for name, there in zip(COORDINATES, read, strict=True) if there]
    solved = Solved(model, [one.case for one in plan.tests], plan.zeroed)
    plain = whitening(repeats, _noise(place, plan, read))
    white = with_nuisances(plain, nuisance_signatures(solved, place.grounds.priors, tests))
    free = base_parameters(model, plan.grouping, names)
    return seen(solved, free, plain, white, candidates(trials, model.n_joints, tests))


def _noise(place: Bench, plan: Plan, read: Array) -> Noise:
    sd = np.where(read, place.sd, np.nan)
    return replace(place.grounds.noise, sd=sd, zeroed=plan.zeroed)


def _with_preload(model: SpineModel, plan: Plan) -> SpineModel:
    """The model with the plan's follower loads, which are known and not fitted."""
    joints = tuple(range(model.n_joints))
    added = [
        ScopedEffect(create(PRELOAD), joints, np.array([[one.preload]]), (one.case.test,))
        for one in plan.tests
        if one.preload > 0.0
    ]
    return model.with_effects((*model.effects, *added))
