"""Stability: second derivatives of energy, a column that falls at its known load, least tone."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from trunk_person import CLOSELY, SETTINGS, tasks, volunteers

from spinepipe.muscles import stability
from spinepipe.muscles.muscle_equilibrium import SolvedTask, solve_task
from spinepipe.muscles.pose import BodyPoses, rotation_of_vector
from spinepipe.muscles.stability import (
    CoContraction,
    joint_stiffness,
    least_stable,
    smallest_eigenvalue,
    stiffness,
)
from spinepipe.muscles.trunk import LEVELS
from spinepipe.status import Balanced
from spinepipe.studies.trunk_loads.persons import UprightPerson

GAIN = 5.0


def straight():
    """The volunteer whose muscles run straight and stretch without force."""
    soft = SETTINGS.model_copy(
        update={"passive": SETTINGS.passive.model_copy(update={"muscle_factor": 0.0})}
    )
    return UprightPerson.of_cohort(soft, volunteers(), "volunteer").varied({}, wrapping=False)


def moved(poses: BodyPoses, q: np.ndarray) -> BodyPoses:
    """All above each joint turned and moved by q (42,), from below upwards, each about its joint as
    the ones below have moved it."""
    turn, shift = np.eye(3), np.zeros(3)
    rotations, places = [poses.rotations[0]], [poses.places[0]]
    for level, by in enumerate(q.reshape(-1, 6)):
        own, centre = rotation_of_vector(by[:3]), poses.centres[level]
        shift = turn @ (centre + by[3:] - own @ centre) + shift
        turn = turn @ own
        rotations.append(turn @ poses.rotations[level + 1])
        places.append(turn @ poses.places[level + 1] + shift)
    return replace(poses, rotations=np.array(rotations), places=np.array(places))


def energy(person, found: SolvedTask, q: np.ndarray) -> float:
    """J, of fascicles that stiffen and of loads that are fixed to the bodies."""
    poses = moved(found.poses, q)
    longer = person.lines.pulls(poses).lengths - found.pulls.lengths
    forces = found.found.forces
    held_by = (forces * longer + 0.5 * GAIN * forces / found.pulls.lengths * longer**2).sum()
    body = found.applied.bodies
    turn = np.einsum("bij,bkj->bik", poses.rotations, found.poses.rotations)[body]
    arm = found.applied.at - found.poses.places[body]
    at = poses.places[body] + np.einsum("kij,kj->ki", turn, arm)
    return float(held_by - (found.applied.pushes * (at - found.applied.at)).sum())


@pytest.mark.parametrize("name", ["standing", "flexion_50"])
def test_stiffness_is_the_second_derivative_of_energy(name: str) -> None:
    person = straight()
    found = solve_task(person, replace(tasks()[name], stress_pa=2e6), CLOSELY)
    sheath = person.lines.trunk.muscles.in_sheath
    free = np.where(sheath, 0.0, found.found.forces)
    found = replace(found, found=replace(found.found, forces=free))
    matrix = stiffness(person, found, GAIN) - joint_stiffness(person, found)
    rng, step = np.random.default_rng(1), 3e-4
    for _ in range(6):
        v = rng.normal(size=6 * len(LEVELS)) * np.tile([1.0] * 3 + [0.02] * 3, len(LEVELS))
        ends = energy(person, found, step * v) + energy(person, found, -step * v)
        second = (ends - 2.0 * energy(person, found, 0.0 * v)) / step**2
        assert second == pytest.approx(v @ matrix @ v, rel=2e-4, abs=0.05)


def test_a_column_falls_when_weight_outdoes_its_joint() -> None:
    """One soft joint under a weight W at height h falls when its stiffness is below W h."""
    person = straight()
    nobody = np.zeros_like(person.upright)
    found = solve_task(person, replace(tasks()["standing"], turned=nobody, stress_pa=5e6), CLOSELY)
    still = replace(found, found=replace(found.found, forces=np.zeros(len(found.found.forces))))
    above = still.applied.bodies > 0
    lean = float(
        -(
            still.applied.pushes[above, 1]
            * (still.applied.at[above] - still.poses.centres[0])[:, 1]
        ).sum()
    )
    stiff = np.full((len(LEVELS), 3), 1e4)
    for factor, stands in ((1.02, True), (0.98, False)):
        soft = stiff.copy()
        curve = person.laws.curves[2].slope(still.poses.turned[:1, 2])[0]
        soft[0, 2] = factor * lean / curve
        laws = replace(person.laws, angular=soft, stiffens=False, axial=np.full(7, 1e12))
        laws = replace(laws, shear=np.full((7, 2), 1e12))
        column = replace(person, laws=laws)
        assert (smallest_eigenvalue(column, still, GAIN) > 0.0) == stands


class Tried:
    """Postures that stand from a tone on, and are beyond strength from another on."""

    def __init__(self, stands_from: float, held_below: float = 1.0) -> None:
        self.stands_from, self.held_below = stands_from, held_below
        self.tones: list[float] = []

    def toned(self, person: Any, task: Any, how: Any, gain: float, share: float) -> CoContraction:
        assert (person, task, how, gain) == ("person", "task", "how", 10.0)
        self.tones.append(share)
        holds = share < self.held_below
        status = Balanced.CONVERGED if holds else Balanced.BEYOND_STRENGTH
        solved: Any = SimpleNamespace(status=status)
        return CoContraction(solved, share, share - self.stands_from)


def found(monkeypatch: pytest.MonkeyPatch, tried: Tried) -> CoContraction | None:
    monkeypatch.setattr(stability, "solve_with_tone", tried.toned)
    names: Any = ("person", "task", "how")
    return least_stable(*names, 10.0)


@pytest.mark.parametrize("least", [0.0004, 0.00126, 0.0071, 0.0499, 0.0501, 0.1, 0.159, 0.161, 0.2])
def test_the_least_tone_is_found_to_a_sixtieth(
    monkeypatch: pytest.MonkeyPatch, least: float
) -> None:
    tried = Tried(least)
    best = found(monkeypatch, tried)
    assert best is not None
    assert best.stands
    assert least <= best.tone <= least + max(least, 0.00125) / 64.0 * (1.0 + 1e-12)
    # doubled from 0.125 %, then halved six times: each posture costs seconds
    doubled = [0.0, 0.00125]
    while doubled[-1] < least:
        doubled.append(min(2.0 * doubled[-1], 0.2))
    assert tried.tones[: len(doubled)] == pytest.approx(doubled)
    assert len(tried.tones) == len(doubled) + 6


def test_what_stands_by_itself_needs_none(monkeypatch: pytest.MonkeyPatch) -> None:
    tried = Tried(0.0)  # an eigenvalue of nought does not fall over
    best = found(monkeypatch, tried)
    assert best is not None
    assert (best.tone, tried.tones) == (0.0, [0.0])


def test_beyond_a_fifth_it_is_not_looked_for(monkeypatch: pytest.MonkeyPatch) -> None:
    tried = Tried(0.2001)
    assert found(monkeypatch, tried) is None
    assert max(tried.tones) == 0.2


@pytest.mark.parametrize("held_below", [0.001, 0.01])
def test_a_tone_that_strength_has_not_left_ends_the_search(
    monkeypatch: pytest.MonkeyPatch, held_below: float
) -> None:
    tried = Tried(0.05, held_below)
    assert found(monkeypatch, tried) is None
    assert tried.tones[-2] < held_below <= tried.tones[-1] + 0.00125


@pytest.mark.parametrize(
    ("status", "eigenvalue", "stands"),
    [("BEYOND_STRENGTH", 1.0, False), ("CONVERGED", 0.0, True), ("CONVERGED", -1e-9, False)],
)
def test_a_posture_that_cannot_be_held_does_not_stand(
    status: str, eigenvalue: float, stands: bool
) -> None:
    solved: Any = SimpleNamespace(status=Balanced[status])
    assert CoContraction(solved, 0.1, eigenvalue).stands is stands
