"""Held tasks: fixed points, mirrors, statuses."""

from dataclasses import replace

import numpy as np
import pytest
from trunk_person import CLOSELY, SETTINGS, held_task, made_up, tasks, volunteer

from spinepipe.muscles.muscle_equilibrium import SolverOptions, acted_on, held
from spinepipe.muscles.person import Person
from spinepipe.muscles.task import Exertion, Hands, Task
from spinepipe.status import Balanced
from spinepipe.studies.trunk_loads.persons import how_of

MIRROR = np.array([1.0, 1.0, -1.0])
TURNED_OVER = np.array([1.0, -1.0, -1.0])
"""Extension stays, right bending and left rotation change sign; moments about x, y, z likewise."""


def mirrored(task: Task) -> Task:
    """The task with right and left exchanged."""
    hands, push = task.hands, task.exertion
    other = {"right": "left", "left": "right", "both": "both"}[hands.holding]
    at = None if hands.at is None else hands.at * MIRROR
    return replace(
        task,
        turned=task.turned * TURNED_OVER,
        hands=Hands(hands.kg, at, other),
        exertion=replace(push, force=push.force * MIRROR, moment=push.moment * [-1.0, -1.0, 1.0]),
    )


def other_side(person: Person) -> np.ndarray:
    """(M,) the fascicle of the other side, by where it begins and ends."""
    muscles = person.lines.trunk.muscles
    ends = muscles.point.reshape(len(muscles), -1, 3)
    there = ends * MIRROR
    apart = np.abs(there[:, None] - ends[None]).max(axis=(2, 3))
    different = muscles.body[:, None] != muscles.body[None]
    apart += 1e3 * different.any(axis=2)
    apart += 10.0 * np.abs(muscles.pcsa[:, None] - muscles.pcsa[None]) / muscles.pcsa.max()
    return np.argmin(apart, axis=1)


SIDEWAYS = Task(
    "sideways",
    None,
    np.stack([np.zeros(8), np.deg2rad(np.linspace(0.0, 4.0, 8)), np.zeros(8)], axis=1),
    from_upright=True,
    hands=Hands(2.0, np.array([0.2, 0.1, 0.1]), "right"),
)
TWISTED = Task(
    "twisted",
    None,
    np.zeros((8, 3)),
    from_upright=True,
    exertion=Exertion(moment=np.array([2.0, -4.0, -3.0])),
)


@pytest.mark.parametrize("task", [SIDEWAYS, TWISTED], ids=lambda task: task.name)
def test_mirrored_tasks_are_held_by_mirrored_forces(task: Task) -> None:
    person = made_up()
    there, here = held(person, mirrored(task), CLOSELY), held(person, task, CLOSELY)
    assert here.status is Balanced.CONVERGED
    forces = here.found.forces
    assert there.found.forces[other_side(person)] == pytest.approx(
        forces, abs=1e-6 * np.abs(forces).max()
    )
    assert there.pushes == pytest.approx(here.pushes * MIRROR, abs=1e-4)


@pytest.mark.parametrize("name", ["side_10", "one_handed", "exertion_torsion"])
def test_tasks_of_the_paper_mirror_in_compression(name: str) -> None:
    """The package's points are symmetric to 0.001 mm, so forces are to a thousandth."""
    person = volunteer()
    here, there = held_task(name), held(person, mirrored(tasks()[name]), CLOSELY)
    assert there.compression == pytest.approx(here.compression, rel=1e-3)


@pytest.mark.parametrize("name", ["standing", "flexion_50", "load_close"])
def test_the_end_is_a_fixed_point(name: str) -> None:
    """Left to the forces that were found, the spine stays where it is."""
    found = held_task(name)
    there = acted_on(volunteer(), tasks()[name], found.found.forces)
    assert there.pushes == pytest.approx(found.pushes, rel=1e-3, abs=1.0)


def test_another_start_ends_at_the_same_forces() -> None:
    found = held(volunteer(), tasks()["flexion_50"], how_of(SETTINGS, twice=True))
    assert found.status is Balanced.CONVERGED


def test_beyond_strength_says_how_much_is_missing_and_where() -> None:
    found = held(volunteer(), tasks()["exertion_extension"])
    assert found.status is Balanced.BEYOND_STRENGTH
    short = np.abs(found.found.slack).max()
    assert found.message == f"{short:.1f} N m too much for the muscles at L5S1"
    assert not found.found.enough


def test_too_few_rounds_are_told() -> None:
    found = held(volunteer(), tasks()["side_10"], SolverOptions(change=1e-9, most=3))
    assert found.status in (Balanced.NOT_CONVERGED, Balanced.CYCLING)
    assert found.message.startswith("after 3 rounds forces still change by")


def test_a_load_out_of_reach_is_refused_with_how_far() -> None:
    far = replace(tasks()["load_away"], hands=Hands(5.0, np.array([0.9, 0.2, 0.0])))
    with pytest.raises(ValueError, match=r"mm farther from the shoulder than the arm is long"):
        held(volunteer(), far)


def test_wrong_simplifications_leave_the_whole_model_out_of_balance() -> None:
    person, task = volunteer(), tasks()["flexion_50"]
    whole = held(person, task)
    assert np.abs(acted_on(person, task, whole.found.forces).found.slack).max() < 1.0
    alone = held(person, task, SolverOptions(lowest_alone=True))
    assert np.abs(alone.found.slack[:3]).max() < 0.1
    assert np.abs(acted_on(person, task, alone.found.forces).found.slack).max() > 5.0
