"""Solved tasks: fixed points, mirrors, statuses; when rounds end and how far they step, by hand."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from trunk_person import CLOSELY, SETTINGS, held_task, made_up, tasks, volunteer

from spinepipe.muscles import muscle_equilibrium
from spinepipe.muscles.forces import Forces
from spinepipe.muscles.muscle_equilibrium import (
    SolverOptions,
    SolverRound,
    solve_task,
    solve_with_forces,
)
from spinepipe.muscles.person import Person
from spinepipe.muscles.task import Exertion, Hands, Task
from spinepipe.muscles.trunk import LEVELS
from spinepipe.status import Balanced
from spinepipe.studies.trunk_loads.persons import solver_options

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
    there, here = solve_task(person, mirrored(task), CLOSELY), solve_task(person, task, CLOSELY)
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
    here, there = held_task(name), solve_task(person, mirrored(tasks()[name]), CLOSELY)
    assert there.compression == pytest.approx(here.compression, rel=1e-3)


@pytest.mark.parametrize("name", ["standing", "flexion_50", "load_close"])
def test_the_end_is_a_fixed_point(name: str) -> None:
    """Left to the forces that were found, the spine stays where it is."""
    found = held_task(name)
    there = solve_with_forces(volunteer(), tasks()[name], found.found.forces)
    assert there.pushes == pytest.approx(found.pushes, rel=1e-3, abs=1.0)


def test_another_start_ends_at_the_same_forces() -> None:
    found = solve_task(volunteer(), tasks()["flexion_50"], solver_options(SETTINGS, twice=True))
    assert found.status is Balanced.CONVERGED


def test_beyond_strength_says_how_much_is_missing_and_where() -> None:
    found = solve_task(volunteer(), tasks()["exertion_extension"])
    assert found.status is Balanced.BEYOND_STRENGTH
    short = np.abs(found.found.slack).max()
    assert found.message == f"{short:.1f} N m too much for the muscles at L5S1"
    assert not found.found.enough


def test_too_few_rounds_are_told() -> None:
    found = solve_task(volunteer(), tasks()["side_10"], SolverOptions(change=1e-9, most=3))
    assert found.status in (Balanced.NOT_CONVERGED, Balanced.CYCLING)
    assert found.message.startswith("after 3 rounds forces still change by")


def test_a_load_out_of_reach_is_refused_with_how_far() -> None:
    far = replace(tasks()["load_away"], hands=Hands(5.0, np.array([0.9, 0.2, 0.0])))
    with pytest.raises(ValueError, match=r"mm farther from the shoulder than the arm is long"):
        solve_task(volunteer(), far)


def test_wrong_simplifications_leave_the_whole_model_out_of_balance() -> None:
    person, task = volunteer(), tasks()["flexion_50"]
    whole = solve_task(person, task)
    assert np.abs(solve_with_forces(person, task, whole.found.forces).found.slack).max() < 1.0
    alone = solve_task(person, task, SolverOptions(lowest_alone=True))
    assert np.abs(alone.found.slack[:3]).max() < 0.1
    assert np.abs(solve_with_forces(person, task, alone.found.forces).found.slack).max() > 5.0


NOBODY: Any = None


def at_rest(forces: list[float], status: Balanced = Balanced.CONVERGED) -> Any:
    found = Forces(np.array(forces), np.zeros(21), True)
    return muscle_equilibrium.SolvedTask(status, "", *[NOBODY] * 4, found, *[NOBODY] * 4)


class Rounds:
    """Ends of rounds that are chosen beforehand, and what they were asked for."""

    def __init__(self, *ends: Any) -> None:
        self.ends, self.starts, self.tones = list(ends), list[Any](), list[float]()

    def __call__(
        self, _person: Any, _task: Any, _how: Any, tone: float, start: Any, *_: Any
    ) -> Any:
        self.starts.append(start)
        self.tones.append(tone)
        return self.ends.pop(0)


def asked_twice(
    monkeypatch: pytest.MonkeyPatch, how: SolverOptions, *ends: Any
) -> tuple[muscle_equilibrium.SolvedTask, Rounds]:
    rounds = Rounds(*ends)
    monkeypatch.setattr(muscle_equilibrium, "_iterate", rounds)
    task: Any = SimpleNamespace(tone_share=0.03, tone="least")
    return solve_task(NOBODY, task, how), rounds


@pytest.mark.parametrize(
    ("apart", "status", "message"),
    [
        (0.0, Balanced.CONVERGED, ""),
        (0.019, Balanced.CONVERGED, ""),
        (0.021, Balanced.TWO_ANSWERS, "another start ends 2.1 % away"),
    ],
)
def test_a_second_answer_is_one_more_than_twice_the_change_away(
    apart: float, status: Balanced, message: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of forces whose size is that of the second answer; begun again pressed by 3 kN."""
    ends = at_rest([3.0, 4.0 - 5.0 * apart]), at_rest([3.0, 4.0])
    found, rounds = asked_twice(monkeypatch, SolverOptions(twice=True), *ends)
    assert (found.status, found.message) == (status, message)
    np.testing.assert_array_equal(found.found.forces, ends[0].found.forces)
    pressed = np.array([np.zeros(7), np.full(7, -3000.0)])[:, :, None] * [0.0, 1.0, 0.0]
    np.testing.assert_array_equal(rounds.starts, pressed)


@pytest.mark.parametrize(
    ("how", "status"),
    [
        (SolverOptions(), Balanced.CONVERGED),
        (SolverOptions(twice=True, feedback=False), Balanced.CONVERGED),
        (SolverOptions(twice=True), Balanced.BEYOND_STRENGTH),
        (SolverOptions(twice=True), Balanced.NOT_CONVERGED),
    ],
)
def test_once_is_enough_where_no_other_answer_is_looked_for(
    how: SolverOptions, status: Balanced, monkeypatch: pytest.MonkeyPatch
) -> None:
    found, rounds = asked_twice(monkeypatch, how, at_rest([1.0], status))
    assert found.status is status
    assert len(rounds.starts) == 1


@pytest.mark.parametrize(
    ("tone", "kind", "least"),
    [(None, "stated", 0.03), (None, "least", 0.0), (0.1, "stated", 0.1), (0.0, "stated", 0.0)],
)
def test_the_tone_that_is_asked_for_comes_before_the_task_s(
    tone: float | None, kind: str, least: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    rounds = Rounds(at_rest([1.0]))
    monkeypatch.setattr(muscle_equilibrium, "_iterate", rounds)
    task: Any = SimpleNamespace(tone_share=0.03, tone=kind)
    solve_task(NOBODY, task, SolverOptions(), tone)
    assert rounds.tones == [least]


def test_rounds_end_as_the_documentation_says_where_nothing_is_asked() -> None:
    assert SolverOptions() == SolverOptions(0.01, 0.1, 0.5, 60, True, True, False, False)


@pytest.mark.parametrize(
    ("off", "last", "step"),
    [
        ([1.0, 0.0], [2.0, 0.0], 1.0),  # half of the way: as far again brings it to nought
        ([-1.0, 0.0], [2.0, 0.0], 1.0 / 3.0),  # swings: two thirds less
        ([1.9, 0.0], [2.0, 0.0], 5.0),  # creeps: 10 times, but 5 at most
        ([-9.0, 0.0], [1.0, 0.0], 0.1),
        ([-38.0, 0.0], [2.0, 0.0], 0.1),  # a twentieth, but a tenth at least
        ([3.0, 0.0], [2.0, 0.0], 0.1),  # away from it
        ([2.0, 1.0], [2.0, 1.0], 1.0),  # nothing is known of the way
        ([0.0, 0.0], [3.0, 4.0], 0.5),
    ],
)
def test_steps_follow_aitkens_rule(off: list[float], last: list[float], step: float) -> None:
    """The last step of 0.5: -0.5 last (off - last) / (off - last)^2."""
    assert muscle_equilibrium._aitken_step(0.5, np.array(off), np.array(last)) == pytest.approx(
        step
    )


def test_changes_are_told_over_the_size_of_what_is() -> None:
    now = np.array([3.0, 4.0])
    assert muscle_equilibrium._change(now, np.array([3.0, 3.0])) == pytest.approx(0.2)
    assert muscle_equilibrium._change(now, now) == 0.0
    assert muscle_equilibrium._change(np.zeros(2), now) == 0.0


def demanded(required: list[float], forces: list[float], enough: bool) -> Any:
    """Rows of one muscle each, arms 2 m."""
    demand = SimpleNamespace(required=np.array(required), arms=2.0 * np.eye(len(required)))
    return SimpleNamespace(
        demand=demand, found=SimpleNamespace(forces=np.array(forces), enough=enough)
    )


@pytest.mark.parametrize(
    ("enough", "alone", "residual"),
    [(True, False, 7.0), (True, True, 2.0), (False, False, 12.0), (False, True, 4.0)],
)
def test_what_the_round_before_misses(enough: bool, alone: bool, residual: float) -> None:
    """Of moments asked for; beyond strength of those of this round. L5S1 has three rows."""
    now = demanded([3.0, 2.0, 4.0, 9.0], [0.0, 0.0, 3.0, 7.0], enough)
    before = np.array([1.0, 2.0, 1.0, 1.0])
    assert muscle_equilibrium._residual(now, before, SolverOptions(lowest_alone=alone)) == residual


def trail(*sizes: float) -> list[np.ndarray]:
    return [np.array([size, 0.0]) for size in sizes]


@pytest.mark.parametrize(
    ("sizes", "change", "status"),
    [
        ((1.0, 2.0, 1.0, 2.0), 0.5, Balanced.CYCLING),
        ((1.0, 2.0, 1.06, 2.0), 0.5, Balanced.CYCLING),
        ((1.0, 1.91, 1.0, 2.0), 0.5, Balanced.CYCLING),  # 4.5 % since the last but one, of 5
        ((1.0, 1.89, 1.0, 2.0), 0.5, Balanced.NOT_CONVERGED),  # 5.5 %
        ((1.0, 2.0), 0.5, Balanced.NOT_CONVERGED),
        ((2.0,), None, Balanced.NOT_CONVERGED),
    ],
)
def test_rounds_that_go_to_and_fro_are_told(
    sizes: tuple[float, ...], change: float | None, status: Balanced
) -> None:
    rounds = [SolverRound(change, 1.0, 500.0)] * len(sizes)
    found, told = muscle_equilibrium._outcome(
        NOBODY, SolverOptions(), rounds, trail(*sizes), settled=False
    )
    shown = "50.0" if change else "0.0"
    assert found is status
    assert told.startswith(f"after {len(sizes)} rounds forces still change by {shown} %")
    assert told.endswith(", to and fro") is (status is Balanced.CYCLING)


@pytest.mark.parametrize(
    ("slack", "status", "told"),
    [
        (0.51, Balanced.BEYOND_STRENGTH, "0.5 N m too much for the muscles at L3L4"),
        (-12.34, Balanced.BEYOND_STRENGTH, "12.3 N m too much for the muscles at L3L4"),
        (0.5, Balanced.CONVERGED, "0.50 N m left over at L3L4"),
        (-0.26, Balanced.CONVERGED, "0.26 N m left over at L3L4"),
    ],
)
def test_what_muscles_leave_over_is_told_where_it_is_most(
    slack: float, status: Balanced, told: str
) -> None:
    left = np.zeros((len(LEVELS), 3))
    left[4], left[LEVELS.index("L3L4"), 1] = 0.05, slack
    now: Any = SimpleNamespace(found=SimpleNamespace(enough=False, slack=left.ravel()))
    assert muscle_equilibrium._outcome(now, SolverOptions(), [], [], settled=True) == (status, told)
    now.found.enough = True
    assert muscle_equilibrium._outcome(now, SolverOptions(), [], [], settled=True) == (
        Balanced.CONVERGED,
        "",
    )
