"""Forces on a held trunk, added up anew: every joint carries what is above it."""

from dataclasses import dataclass, replace
from functools import cache

import numpy as np
import pytest
from trunk_person import held_task, tasks, volunteer

from spinepipe.muscles.muscle_equilibrium import SolvedTask, solve_task
from spinepipe.muscles.passive_tissue import LIGAMENT_ARM_M
from spinepipe.muscles.subject import Subject
from spinepipe.muscles.task import Task
from spinepipe.muscles.trunk import LEVELS, THORAX

TASKS = pytest.mark.parametrize("task", list(tasks()))
"""All that come along: some are held, some are beyond strength and told with what is left over."""


@dataclass(frozen=True)
class Ends:
    """Forces (K, 3) N on bodies (K,) at points (K, 3) m."""

    bodies: np.ndarray
    at: np.ndarray
    pushes: np.ndarray

    def above(self, level: int) -> np.ndarray:
        """(3,) N on all that is above a joint."""
        return self.pushes[self.bodies > level].sum(axis=0)

    def about(self, level: int, centre: np.ndarray) -> np.ndarray:
        """(3,) N m on all that is above a joint."""
        there = self.bodies > level
        return np.cross(self.at[there] - centre, self.pushes[there]).sum(axis=0)


@cache
def muscle_ends(task: str) -> Ends:
    """Every end of every leg of every fascicle, and what comes of those that hang in the sheath."""
    found, muscles = held_task(task), volunteer().lines.trunk.muscles
    rows: list[tuple[int, np.ndarray, np.ndarray]] = []
    for m, force in enumerate(found.found.forces):
        trace = found.pulls.trace[m, : found.pulls.traced[m]]
        if muscles.in_sheath[m]:
            side = 0 if muscles.sides[m] == "right" else 1
            rows += hanging(found, side, muscles.body[m, 0], force, trace)
            continue
        for k in range(len(trace) - 1):
            line = (trace[k + 1] - trace[k]) / np.linalg.norm(trace[k + 1] - trace[k])
            rows.append((int(found.pulls.on[m, k]), trace[k], force * line))
            rows.append((int(found.pulls.on[m, k + 1]), trace[k + 1], -force * line))
    return Ends(*(np.array(column) for column in zip(*rows, strict=True)))


def sheath(found: SolvedTask, side: int) -> tuple[np.ndarray, np.ndarray]:
    """(3,) m, upper end of a side's sheath, and (3,) which way it runs upwards."""
    low, high = (
        found.poses.of(np.array(body), at)
        for body, at in zip((0, THORAX), volunteer().lines.trunk.sheath[side], strict=True)
    )
    return high, (high - low) / np.linalg.norm(high - low)


def hanging(
    found: SolvedTask, side: int, bone: int, force: float, trace: np.ndarray
) -> list[tuple[int, np.ndarray, np.ndarray]]:
    """What a fascicle that ends in the sheath does: it pulls its bone, and the sheath hands on to
    the ribs at its upper end what runs along it."""
    high, up = sheath(found, side)
    to_sheath = (trace[1] - trace[0]) / np.linalg.norm(trace[1] - trace[0])
    return [
        (int(bone), trace[0], force * to_sheath),
        (THORAX, high, -force * (to_sheath @ up) * up),
    ]


def loads(found: SolvedTask) -> Ends:
    return Ends(found.applied.bodies, found.applied.at, found.applied.pushes)


def ligament_nm(found: SolvedTask) -> np.ndarray:
    """(7,) N m."""
    found_nm: np.ndarray = volunteer().laws.ligament_moments(found.poses.turned)
    return found_nm


@TASKS
def test_joint_forces_are_those_of_all_that_is_above(task: str) -> None:
    found, ends = held_task(task), muscle_ends(task)
    for level in range(len(LEVELS)):
        total = loads(found).above(level) + ends.above(level)
        # what ligaments press is between the two vertebrae: no part of what is carried
        pressed = np.array([0.0, ligament_nm(found)[level] / LIGAMENT_ARM_M, 0.0])
        told = found.poses.discs[level] @ (found.pushes[level] + pressed)
        np.testing.assert_allclose(told, total, rtol=0.0, atol=1e-8 * np.abs(total).max())


@TASKS
def test_moments_about_every_joint_sum_to_the_slack(task: str) -> None:
    """Rounding of hundreds of moments of up to some 100 N m; nothing is left over if held."""
    found, ends = held_task(task), muscle_ends(task)
    left = []
    for level, centre in enumerate(found.poses.centres):
        total = found.poses.discs[level] @ found.joint_moments[level]
        total = total + loads(found).about(level, centre) + ends.about(level, centre)
        left.append(total + found.applied.turning[level + 1 :].sum(axis=0))
    np.testing.assert_allclose(-np.array(left).ravel(), found.found.slack, rtol=0.0, atol=1e-8)
    if found.found.enough:
        assert np.abs(left).max() < 1e-6


@TASKS
def test_a_sheath_is_pulled_and_never_pushed(task: str) -> None:
    """Down at its upper end, on either side: only what draws downwards can hold what draws up."""
    found, muscles = held_task(task), volunteer().lines.trunk.muscles
    for side, name in enumerate(("right", "left")):
        down = -sheath(found, side)[1]
        drawn = 0.0
        for m in np.flatnonzero(muscles.in_sheath):
            if muscles.sides[m] == name:
                _, on_ribs = hanging(found, side, 0, found.found.forces[m], found.pulls.trace[m])
                drawn += on_ribs[2] @ down
        assert drawn > -1e-3  # N; rows of the programme are in 10 kN and good to 1e-8


@TASKS
def test_muscles_stay_between_what_is_stretched_and_their_strength(task: str) -> None:
    found, muscles = held_task(task), volunteer().lines.trunk.muscles
    active = found.found.forces - found.stretched
    assert active.min() > -1e-9
    assert (active / muscles.pcsa).max() < tasks()[task].stress_pa * (1.0 + 1e-12)


@TASKS
def test_equilibrium_of_vertebrae_is_that_of_cuts(task: str) -> None:
    """Eq 1 as printed: muscles attached to a vertebra, and what the joint above passes on, make
    what it lacks."""
    found, ends = held_task(task), muscle_ends(task)
    cut = (found.demand.arms @ found.found.forces).reshape(-1, 3)
    for level, centre in enumerate(found.poses.centres):
        own = ends.bodies == level + 1
        made = np.cross(ends.at[own] - centre, ends.pushes[own]).sum(axis=0)
        if level + 1 < len(LEVELS):
            made += cut[level + 1]
            made += np.cross(found.poses.centres[level + 1] - centre, ends.above(level + 1))
        np.testing.assert_allclose(made, cut[level], rtol=0.0, atol=1e-9)


def test_no_weight_and_no_load_give_no_force() -> None:
    nobody = replace(volunteer(), masses=(), subject=Subject("male", 45.0, 1.739, 1e-12))
    nobody = nobody.with_upright(np.zeros((8, 3)))
    found = solve_task(nobody, Task("nothing", None, np.zeros((8, 3)), from_upright=False))
    assert np.abs(found.found.forces).max() < 1e-6
    assert np.abs(found.pushes).max() < 1e-6
