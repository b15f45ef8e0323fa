"""Additions to a plan of tests that would cost a laboratory something, in order of effort.

An addition turns a plan into a larger one, or into None where the plan has it already.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

from spinepipe.discrepancy.design.load_changes import (
    HELD_S,
    STEP_S,
    at_times,
    back_down,
    comes_back,
    has_times,
    largest_held,
    peak,
    scaled,
    summed_loads,
    times,
)
from spinepipe.discrepancy.design.plans import PER_SPECIMEN, Plan, Planned
from spinepipe.effects.contract import Array, Indices
from spinepipe.model import LoadCase

SLOWER = 10.0
LARGER = 1.5
PRELOAD_N = 400.0


@dataclass(frozen=True)
class Addition:
    """Something to add to the tests: in words, and what it makes of a plan."""

    words: str
    to: Callable[[Plan], Plan | None]


def _translations_too(plan: Plan) -> Plan | None:
    if all(one.count[:, :3].any() for one in plan.tests):
        return None
    return replace(plan, tests=tuple(map(_with_translations, plan.tests)))


def _with_translations(one: Planned) -> Planned:
    count: Indices = one.count.copy()
    count[:, :3] = one.count.max(axis=1, keepdims=True)
    return replace(one, count=count)


def _not_zeroed(plan: Plan) -> Plan | None:
    return replace(plan, zeroed=False) if plan.zeroed else None


def _timed(plan: Plan) -> Plan | None:
    if all(has_times(one.case) for one in plan.tests):
        return None
    return _each(plan, lambda case: at_times(case, times(case)))


def _unloaded(plan: Plan) -> Plan | None:
    if all(comes_back(one.case) for one in plan.tests):
        return None
    return _each(plan, back_down)


def _opposite(plan: Plan) -> Plan | None:
    loads = [load for one in plan.tests for load in summed_loads(one.case)]
    missing = [
        replace(one, case=replace(scaled(one.case, -1.0), test=f"{one.case.test}, opposite"))
        for one in plan.tests
        if not any(_is_opposite(load, peak(one.case)) for load in loads)
    ]
    return replace(plan, tests=(*plan.tests, *missing)) if missing else None


def _is_opposite(load: Array, largest: Array) -> bool:
    """Whether a load (6,) has at least half of the largest one, turned round."""
    return bool(-(load @ largest) >= 0.5 * (largest @ largest) > 0.0)


def _larger(plan: Plan) -> Plan | None:
    return _each(plan, lambda case: scaled(case, LARGER))


def _preloaded(plan: Plan) -> Plan | None:
    again = [
        replace(one, case=replace(one.case, test=f"{one.case.test}, preloaded"), preload=PRELOAD_N)
        for one in plan.tests
    ]
    return replace(plan, tests=(*plan.tests, *again))


def _held(plan: Plan) -> Plan | None:
    return _each(plan, largest_held)


def _slower(plan: Plan) -> Plan | None:
    return _each(plan, lambda case: at_times(case, [SLOWER * time for time in times(case)]))


def _shared_base(plan: Plan) -> Plan | None:
    return None if plan.grouping == PER_SPECIMEN else replace(plan, grouping=PER_SPECIMEN)


MENU = (
    Addition("translations read as well", _translations_too),
    Addition("readings kept as they are, not zeroed at step 0", _not_zeroed),
    Addition(f"times recorded, {STEP_S:g} s from load step to load step", _timed),
    Addition("unloading steps added: the same loads back down", _unloaded),
    Addition("the same loads in the opposite direction as well", _opposite),
    Addition(f"loads {LARGER:g} times as large", _larger),
    Addition(f"every test once more under a follower load of {PRELOAD_N:g} N", _preloaded),
    Addition(f"the largest load held for {HELD_S[-1] / 60:g} min, read along the way", _held),
    Addition(f"{SLOWER:g} times as long between load steps, times recorded", _slower),
    Addition("no other test, but a base that shares stiffness: per_specimen", _shared_base),
)
"""In order of effort."""


def _each(plan: Plan, change: Callable[[LoadCase], LoadCase]) -> Plan:
    tests = tuple(replace(one, case=change(one.case)) for one in plan.tests)
    return replace(plan, tests=tests)
