"""Forces on a held trunk, added up anew: every joint carries what is above it."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest
from trunk_person import held_task, volunteer

from spinepipe.muscles.settle import Held, held
from spinepipe.muscles.subject import Subject
from spinepipe.muscles.task import Task
from spinepipe.muscles.trunk import LEVELS, THORAX

TASKS = ["standing", "flexion_50", "side_10", "exertion_torsion", "load_close"]


def pulls(found: Held) -> Iterator[tuple[int, np.ndarray, np.ndarray]]:
    """Body, point and force of every end of every leg of every fascicle on a bone."""
    in_sheath = volunteer().lines.trunk.muscles.in_sheath
    for m, force in enumerate(found.found.forces):
        if in_sheath[m]:
            for body in range(THORAX + 1):
                yield body, np.zeros(3), force * found.pulls.forces[m, body]
            continue
        trace = found.pulls.trace[m, : found.pulls.traced[m]]
        for k in range(len(trace) - 1):
            line = (trace[k + 1] - trace[k]) / np.linalg.norm(trace[k + 1] - trace[k])
            yield int(found.pulls.on[m, k]), trace[k], force * line
            yield int(found.pulls.on[m, k + 1]), trace[k + 1], -force * line


@pytest.mark.parametrize("task", TASKS)
def test_joint_forces_are_those_of_all_that_is_above(task: str) -> None:
    found = held_task(task)
    for level in range(len(LEVELS)):
        total = np.zeros(3)
        for body, push in zip(found.applied.bodies, found.applied.pushes, strict=True):
            total += push if body > level else 0.0
        for body, _, pull in pulls(found):
            total += pull if body > level else 0.0
        told = found.poses.discs[level] @ found.pushes[level]
        assert told == pytest.approx(total, abs=1e-8 * np.abs(total).max())


@pytest.mark.parametrize("task", TASKS)
def test_moments_about_every_joint_sum_to_the_slack(task: str) -> None:
    found, muscles = held_task(task), volunteer().lines.trunk.muscles
    for level, centre in enumerate(found.poses.centres):
        total = found.poses.discs[level] @ found.joint_moments[level]
        for body, at, push in zip(
            found.applied.bodies, found.applied.at, found.applied.pushes, strict=True
        ):
            total = total + (np.cross(at - centre, push) if body > level else 0.0)
        total = total + found.applied.turning[level + 1 :].sum(axis=0)
        for body, at, pull in pulls(found):
            total = total + (np.cross(at - centre, pull) if body > level else 0.0)
        # What hangs in the sheath acts at two points of the ribs: its moment is told, not drawn.
        for m in np.flatnonzero(muscles.in_sheath):
            moment = found.found.forces[m] * found.pulls.moments[m, level + 1 :].sum(axis=0)
            total = total + moment
        slack = found.found.slack.reshape(-1, 3)[level]
        assert total == pytest.approx(-slack, abs=1e-7)


@pytest.mark.parametrize("task", TASKS)
def test_equilibrium_of_vertebrae_is_that_of_cuts(task: str) -> None:
    """Eq 1 as printed: muscles attached to a vertebra make what it lacks."""
    found = held_task(task)
    forces, centres = found.found.forces, found.poses.centres
    cut = (found.demand.arms @ forces).reshape(-1, 3)
    for level in range(len(LEVELS)):
        body = level + 1
        own_force = np.einsum("m,mi->i", forces, found.pulls.forces[:, body])
        own = np.einsum("m,mi->i", forces, found.pulls.moments[:, body])
        attached = own - np.cross(centres[level], own_force)
        passed_on = np.zeros(3)
        if level + 1 < len(LEVELS):
            above = np.einsum("m,mi->i", forces, found.pulls.forces[:, body + 1 :].sum(axis=1))
            passed_on = cut[level + 1] + np.cross(centres[level + 1] - centres[level], above)
        assert attached + passed_on == pytest.approx(cut[level], abs=1e-9)


def test_no_weight_and_no_load_give_no_force() -> None:
    nobody = replace(volunteer(), masses=(), subject=Subject("male", 45.0, 1.739, 1e-12))
    nobody = nobody.standing(np.zeros((8, 3)))
    found = held(nobody, Task("nothing", None, np.zeros((8, 3)), from_upright=False))
    assert np.abs(found.found.forces).max() < 1e-6
    assert np.abs(found.pushes).max() < 1e-6
