"""The volunteer's trunk as people's are: holds what he held, relaxes in flexion, stands at ease."""

from dataclasses import replace

import numpy as np
import pytest
from trunk_person import tasks, volunteer

from spinepipe.muscles.muscle_equilibrium import SolvedTask, SolverOptions, solve_task
from spinepipe.muscles.pose import place_bodies, rotations_of
from spinepipe.muscles.stability import least_stable
from spinepipe.muscles.strength import load_factor
from spinepipe.muscles.trunk import BODIES, LEVELS, NO_BODY
from spinepipe.status import Balanced

MEASURED = ("standing", "load_close", "load_away", "flexion_50", "full_flexion")
MEASURED += ("flexion_70_with_load", "one_handed", "side_10", "side_20")
"""Tasks whose pressure was measured (Wilke 1999, 2001)."""

LUMBAR = slice(0, LEVELS.index("T12L1"))


def at_one_mpa(task: str) -> SolvedTask:
    return solve_task(volunteer(), replace(tasks()[task], stress_pa=1e6), SolverOptions())


@pytest.mark.parametrize("task", MEASURED)
def test_what_the_volunteer_held_is_held(task: str) -> None:
    assert at_one_mpa(task).status is Balanced.CONVERGED


def passive_share(found: SolvedTask) -> np.ndarray:
    """(7,) of the extension moment at each joint."""
    arms = found.demand.arms.reshape(len(LEVELS), 3, -1)
    along = np.einsum("ki,kim->km", found.poses.discs[:, :, 2], arms)
    passive: np.ndarray = found.joint_moments[:, 2] + along @ found.stretched
    return passive / (found.joint_moments[:, 2] + along @ found.found.forces)


def test_passive_tissue_bears_full_flexion_and_little_halfway() -> None:
    assert passive_share(at_one_mpa("full_flexion"))[LUMBAR].min() > 0.8
    assert passive_share(at_one_mpa("forward_50"))[LUMBAR].max() < 0.35


def test_ligaments_are_slack_upright() -> None:
    person = volunteer()
    still = np.zeros((len(LEVELS), 3))
    poses = place_bodies(person.chain, rotations_of(person.chain, person.upright), still)
    assert np.abs(person.laws.ligament_moments(poses.turned)).max() < 1e-9


def test_standing_takes_little_strength_and_is_stable_at_low_tone() -> None:
    person, standing = volunteer(), tasks()["standing"]
    factor = load_factor(solve_task(person, standing, SolverOptions()))
    assert factor is not None
    assert 1.0 / factor < 0.4
    stable = least_stable(person, standing, SolverOptions(), 5.0)
    assert stable is not None
    assert stable.tone < 0.1


def test_some_muscles_cross_t11t12_alone() -> None:
    muscles = volunteer().lines.trunk.muscles
    lowest = np.where(muscles.body == NO_BODY, len(BODIES), muscles.body).min(axis=1)
    alone = (lowest == BODIES.index("T12")) & (muscles.body.max(axis=1) == BODIES.index("T11"))
    assert 1e6 * muscles.pcsa[alone].sum() > 300.0
