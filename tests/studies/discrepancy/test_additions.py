"""Additions to a plan of tests: loads, times and readings, by hand."""

import numpy as np
from sweeps import sweep
from testable_cases import case_of, spine_of

from spinepipe.cohort.specimen import cables
from spinepipe.model import LoadCase
from spinepipe.studies.discrepancy.design.plans import (
    PRELOAD_N,
    PlannedTest,
    planned_of,
    repeats_of,
    unloads,
    with_preloads,
)
from spinepipe.studies.discrepancy.design.runs import runs
from spinepipe.studies.discrepancy.search.readings import Repeats, SpecimenReadings


def plan_of(*cases: LoadCase, zeroed: bool = True) -> list[PlannedTest]:
    count = np.tile([0, 0, 0, 3, 3, 3], (2, 1))
    return [PlannedTest(case, count, zeroed) for case in cases]


def added(words: str, plan: list[PlannedTest]) -> PlannedTest:
    (run,) = [one for one in runs(plan) if words in one.words]
    return run


def levels(case: LoadCase) -> list[float]:
    return [-float(step.wrenches[0].moment[2]) for step in case.steps]


def test_runs_change_loads_and_times_as_they_say():
    case = case_of("flexion", 2, (0.0, 2.0, 4.0), 5.0)
    plan = plan_of(case)
    back = added("unloading", plan).case
    assert levels(back) == [0.0, 2.0, 4.0, 2.0, 0.0]
    assert [step.time for step in back.steps] == [0.0, 5.0, 10.0, 15.0, 20.0]
    assert unloads(back)
    assert not unloads(case)
    assert levels(added("new test: extension", plan).case) == [0.0, -2.0, -4.0]
    assert levels(added("1.5 times", plan).case) == [0.0, 3.0, 6.0]
    assert [s.time for s in added("10 times", plan).case.steps] == [0.0, 50.0, 100.0]
    held = added("held", plan).case
    assert levels(held)[3:] == [4.0] * (len(held.steps) - 3)
    assert held.steps[-1].time == 610.0
    read = repeats_of(added("translations", plan)).count
    assert (read[1:] == 1).all()
    assert (read[0] == 0).all()
    assert (repeats_of(added("not zeroed", plan)).count[0, :, 3:] == 1).all()


def tensions(plan_or_tests, test: str) -> list[float]:
    """Of the cables that act in a test of a spine whose cohort presses flexion with 100 N."""
    spine = spine_of(2)
    known = spine.with_effects((*spine.effects, *cables({"flexion": 100.0}, 2)))
    found = with_preloads(known, plan_or_tests).effects
    return [float(one.values[0, 0]) for one in found[1:] if one.in_scope(test)]


def test_a_run_under_more_load_is_beside_the_follower_load_of_its_rig():
    run = added("follower load", plan_of(case_of("flexion", 2, (0.0, 2.0, 4.0))))
    assert tensions([run], "flexion") == [100.0, PRELOAD_N]
    assert tensions([run], "turning") == []


def test_a_spine_set_up_anew_or_bent_the_other_way_is_under_its_follower_load():
    menu = runs(plan_of(case_of("flexion", 2, (0.0, 2.0, 4.0))))
    others = [one for one in menu if one.case.test != "flexion"]
    assert {"flexion, set up anew", "added extension"} <= {one.case.test for one in others}
    for one in others:
        assert tensions([one], one.case.test) == [100.0]


def test_a_thinned_test_keeps_first_farthest_and_last_step():
    moments = [*np.linspace(0.0, 7.0, 18), *np.linspace(6.5, 1.0, 23)]
    case = case_of("flexion", 2, moments)
    readings = SpecimenReadings("a", (), (Repeats(case, np.zeros((1, len(moments), 2, 6))),))
    kept = levels(planned_of(readings, True, 10)[0].case)
    assert len(kept) <= 11
    assert [kept[0], max(kept), kept[-1]] == [0.0, 7.0, 1.0]


def test_cycles_whose_loads_differ_a_little_are_one_test():
    cases = [case_of("flexion", 2, (0.0, 2.0, 4.0 + extra)) for extra in (0.0, 0.01, 0.02)]
    read = np.zeros((1, 3, 2, 6))
    read[..., :3] = np.nan
    readings = SpecimenReadings("a", (), tuple(Repeats(case, read) for case in cases))
    (one,) = planned_of(readings, True, 10)
    assert one.case == cases[0]
    assert one.count.tolist() == [[0, 0, 0, 3, 3, 3]] * 2


@sweep(
    "moments, back",
    [
        ((0.0, 2.5, 5.0, 7.5), False),
        ((0.0, 2.5, 5.0, 7.5, 5.0, 2.5, 0.0), True),
        ((0.0, 2.51, 5.02, 7.5, 4.93, 2.44, 0.1), True),  # as a machine gives it
        ((0.0, 3.0, 7.5, 4.0), True),  # thinned: no load twice
        ((0.0, 2.5, 5.0, 7.5, -2.5, -5.0, -7.5), False),  # two ways out, none back
        ((0.0, 2.5, 7.5, 0.0, -7.5), True),
        ((0.0, 5.0, 7.5, 7.3, 7.5), False),  # held, not unloaded
        ((-7.5, -5.0, 0.0, 5.0, 7.5), False),  # from one end to the other, once
    ],
)
def test_unloading_is_seen_in_a_machines_loads(moments, back):
    assert unloads(case_of("flexion", 1, moments, 5.0)) is back
