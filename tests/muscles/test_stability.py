"""Stability: second derivatives of energy, and a column that falls at its closed-form load."""

from dataclasses import replace

import numpy as np
import pytest
from trunk_person import CLOSELY, SETTINGS, tasks, volunteers

from spinepipe.muscles.muscle_equilibrium import SolvedTask, held
from spinepipe.muscles.pose import BodyPoses, rotation_of_vector
from spinepipe.muscles.stability import _joints, smallest_eigenvalue, stiffness
from spinepipe.muscles.trunk import LEVELS
from spinepipe.studies.subjects import subject_of
from spinepipe.studies.trunk_loads.persons import regressions_of, source_of, standing

GAIN = 5.0


def straight():
    """The volunteer whose muscles run straight and stretch without force."""
    cohort = volunteers()
    soft = SETTINGS.model_copy(
        update={"passive": SETTINGS.passive.model_copy(update={"muscle_factor": 0.0})}
    )
    source, who = source_of(soft, cohort).trunk, subject_of(cohort, "volunteer")
    return standing(soft, source, who, regressions_of(soft, cohort.folder), wrapping=False).person


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
    found = held(person, replace(tasks()[name], stress_pa=2e6), CLOSELY)
    sheath = person.lines.trunk.muscles.in_sheath
    free = np.where(sheath, 0.0, found.found.forces)
    found = replace(found, found=replace(found.found, forces=free))
    matrix = stiffness(person, found, GAIN) - _joints(person, found)
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
    found = held(person, replace(tasks()["standing"], turned=nobody, stress_pa=5e6), CLOSELY)
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
