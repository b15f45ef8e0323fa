"""Stress that tasks take and strength that is left: closed forms, and what some forces can hold and
none can, asked of HiGHS."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import linprog
from test_muscle_equilibrium import SIDEWAYS, mirrored
from trunk_cases import made_up_trunk
from trunk_person import SETTINGS, held_task, made_up, person_of, tasks, volunteer

from spinepipe.muscles.forces import Demand
from spinepipe.muscles.muscle_equilibrium import SolvedTask
from spinepipe.muscles.person import Person
from spinepipe.muscles.strength import (
    HIGHEST_PA,
    LOWEST_PA,
    MEAN_PA,
    Least,
    capacity_left,
    hold_task,
    load_factor,
    stress_needed,
)
from spinepipe.muscles.task import Exertion, Hands, Task
from spinepipe.status import Balanced
from spinepipe.studies.trunk_loads.persons import solver_options

JUST = 1e-5
ASKED = solver_options(SETTINGS)
LEAST: tuple[Least, ...] = ("untold", "of_posture", "sought")


def can_be_held(held: SolvedTask, required: np.ndarray) -> bool:
    """Whether forces within their bounds make the moments (21,) N m, no sheath being pushed."""
    demand = held.demand
    solved = linprog(
        np.zeros(len(demand.pcsa)),
        A_eq=demand.arms,
        b_eq=required,
        A_ub=-demand.sheath,
        b_ub=np.zeros(2),
        bounds=list(zip(demand.least, demand.most, strict=True)),
        method="highs",
    )
    assert solved.status in (0, 2)
    return bool(solved.status == 0)


def of_loads(held: SolvedTask) -> np.ndarray:
    """(7, 3) N m of all loads above each joint about its centre, one by one."""
    loads, found = held.applied, np.zeros((7, 3))
    for level, centre in enumerate(held.poses.centres):
        for body, at, push in zip(loads.bodies, loads.at, loads.pushes, strict=True):
            if body > level:
                found[level] += np.cross(at - centre, push)
        found[level] += loads.turning[level + 1 :].sum(axis=0)
    return found


@pytest.mark.parametrize("task", ["standing", "flexion_70_with_load"])
def test_loads_grow_as_far_as_some_forces_hold_them(task: str) -> None:
    held = held_task(task)
    loads = of_loads(held)
    joints = np.array([d @ m for d, m in zip(held.poses.discs, held.joint_moments, strict=True)])
    np.testing.assert_allclose(held.demand.required, -(loads + joints).ravel(), atol=1e-9)
    factor = load_factor(held)
    assert factor is not None
    assert (factor >= 1.0) == held.found.enough
    assert can_be_held(held, -(factor * (1.0 - JUST) * loads + joints).ravel())
    assert not can_be_held(held, -(factor * (1.0 + JUST) * loads + joints).ravel())


def test_flexion_is_added_at_a_level_as_far_as_some_forces_hold_it() -> None:
    held = held_task("standing")
    capacity = capacity_left(held)
    assert capacity is not None
    made = held.demand.required - held.found.slack
    for level, most in enumerate(capacity):
        assert most > 0.0
        extension = np.zeros((7, 3))
        extension[level] = held.poses.discs[level][:, 2]
        assert can_be_held(held, made + (1.0 - JUST) * most * extension.ravel())
        assert not can_be_held(held, made + (1.0 + JUST) * most * extension.ravel())
    assert capacity_left(held_task("exertion_flexion")) is None


# --- the least stress -----------------------------------------------------------------------------

PA = 0.6e6


def demand_of(
    arms: list[list[float]], required: list[float], mm2: list[float], tone: float = 0.0
) -> Demand:
    """Muscles of a few cross-sections, none of which draws at the sheath."""
    pcsa = 1e-6 * np.array(mm2)
    strength = PA * pcsa
    sheath = np.zeros((2, len(mm2)))
    return Demand(np.array(arms), np.array(required), tone * strength, strength, pcsa, sheath)


NOTHING = np.zeros(1)


def test_one_muscle_takes_the_moment_over_arm_and_cross_section() -> None:
    one = demand_of([[0.05]], [30.0], [400.0])
    assert stress_needed(one, NOTHING) == pytest.approx(30.0 / (0.05 * 400e-6))
    stretched = replace(one, least=one.least + 100.0, most=one.most + 100.0)
    least = stress_needed(stretched, np.array([100.0]))
    assert least == pytest.approx((30.0 - 0.05 * 100.0) / (0.05 * 400e-6)), "tissue holds its share"
    assert stress_needed(demand_of([[0.05]], [0.0], [400.0]), NOTHING) == pytest.approx(
        0.0, abs=1e3
    )


def test_two_muscles_share_and_antagonists_with_tone_add() -> None:
    both = demand_of([[0.05, 0.02]], [30.0], [400.0, 900.0])
    assert stress_needed(both, np.zeros(2)) == pytest.approx(30.0 / (0.05 * 4e-4 + 0.02 * 9e-4))
    against = demand_of([[0.05, -0.05]], [30.0], [400.0, 400.0], tone=0.1)
    assert stress_needed(against, np.zeros(2)) == pytest.approx(30.0 / (0.05 * 400e-6 * 0.9))


def test_no_stress_makes_what_arms_do_not_reach() -> None:
    """One muscle on the wrong side; one over two joints of which the upper asks for more."""
    assert stress_needed(demand_of([[-0.05]], [30.0], [400.0]), NOTHING) is None
    over_both = [[0.05], [0.05]]
    assert stress_needed(demand_of(over_both, [20.0, 30.0], [400.0]), NOTHING) is None
    alike = stress_needed(demand_of(over_both, [30.0, 30.0], [400.0]), NOTHING)
    assert alike == pytest.approx(30.0 / (0.05 * 400e-6))


def test_people_of_the_paper() -> None:
    """Burkhart 2018, abstract: 40 to 130 N/cm2, mean 75.5."""
    assert (LOWEST_PA, MEAN_PA, HIGHEST_PA) == (0.4e6, 0.755e6, 1.3e6)


def test_a_task_beyond_the_stress_asked_for_is_held_at_the_least_that_does() -> None:
    person, task = made_up(), tasks()["side_20"]
    held = hold_task(person, task, ASKED)
    assert held.asked.status is Balanced.BEYOND_STRENGTH
    assert held.solved.status is Balanced.CONVERGED_ABOVE
    assert f"at {1e-6 * held.task.stress_pa:.2f} MPa of muscle stress" in held.solved.message
    assert held.short_of is None
    assert held.least_pa is not None
    assert PA < held.least_pa <= held.task.stress_pa < 1.03 * held.least_pa
    assert held.solves <= 3
    # no forces at a little less, where the spine is
    demand, passive = held.solved.demand, held.solved.stretched
    for share, holds in ((1.0 + JUST, True), (0.97, False)):
        most = passive + share * held.least_pa * demand.pcsa
        there = replace(held.solved, demand=replace(demand, least=passive, most=most))
        assert can_be_held(there, demand.required - held.solved.found.slack) == holds
    # what is stretched pulls as it did
    at_rest = held.person.passive.factor * held.task.stress_pa
    assert at_rest == pytest.approx(person.passive.factor * task.stress_pa)


def test_least_stress_below_what_is_asked_for_changes_no_force() -> None:
    person, task = made_up(), tasks()["standing"]
    untold, quick, sought = (hold_task(person, task, ASKED, how) for how in LEAST)
    assert quick.solved.status is sought.solved.status is Balanced.CONVERGED
    np.testing.assert_array_equal(quick.solved.found.forces, sought.solved.found.forces)
    assert untold.least_pa is None
    assert sought.least_pa is not None
    assert quick.least_pa == pytest.approx(sought.least_pa, rel=0.1)
    again = hold_task(person, replace(task, stress_pa=1.02 * sought.least_pa), ASKED)
    assert again.solved.status is not Balanced.BEYOND_STRENGTH


def test_a_mirrored_task_takes_the_same_stress() -> None:
    heavy = replace(SIDEWAYS, hands=Hands(9.0, np.array([0.3, 0.1, 0.15]), "right"))
    here, there = (hold_task(made_up(), task, ASKED) for task in (heavy, mirrored(heavy)))
    assert here.solved.status is there.solved.status is Balanced.CONVERGED_ABOVE
    assert there.least_pa == pytest.approx(here.least_pa, rel=1e-6)
    assert there.solved.compression == pytest.approx(here.solved.compression, rel=1e-4)


def without_belly() -> Person:
    """A trunk in front of whose spine no muscle pulls to speak of."""
    trunk = made_up_trunk()
    front = ("rectus_abdominis", "external_oblique", "internal_oblique", "psoas")
    gone = np.isin(trunk.muscles.groups, front)
    pcsa = trunk.muscles.pcsa * np.where(gone, 1e-9, 1.0)
    return person_of(replace(trunk, muscles=replace(trunk.muscles, pcsa=pcsa)))


def test_what_is_not_held_says_why_and_where() -> None:
    pushed = Task(
        "pushed", None, np.zeros((8, 3)), True, exertion=Exertion(moment=np.eye(3)[2] * 80)
    )
    arms = hold_task(without_belly(), pushed, ASKED)
    assert (arms.solved.status, arms.short_of) == (Balanced.BEYOND_STRENGTH, "arms")
    assert arms.least_pa is None
    assert f"no muscle forces of any size make what {arms.short_at} asks for" in arms.solved.message
    anything = hold_task(without_belly(), pushed, ASKED, highest_pa=np.inf)
    assert (anything.solved.status, anything.short_of) == (Balanced.BEYOND_STRENGTH, "arms")
    weak = hold_task(volunteer(), tasks()["exertion_extension"], ASKED)
    assert (weak.solved.status, weak.short_of) == (Balanced.BEYOND_STRENGTH, "strength")
    assert weak.least_pa is not None
    assert weak.least_pa > HIGHEST_PA
    assert f"takes {1e-6 * weak.least_pa:.3g} MPa of muscle stress" in weak.solved.message
    np.testing.assert_array_equal(weak.solved.found.forces, weak.asked.found.forces)
    strong = hold_task(volunteer(), replace(tasks()["exertion_extension"], stress_pa=2e6), ASKED)
    assert strong.solves == 1, "who states more than people have is taken at their word"
