"""What pushes at the thorax from outside: a force, a pure moment, a force that makes the moment."""

import numpy as np
import pytest
from trunk_person import made_up

from spinepipe.muscles.applied import Applied, applied
from spinepipe.muscles.pose import BodyPoses, posed, rotations_of
from spinepipe.muscles.task import Exertion, Task
from spinepipe.muscles.trunk import BODIES, LEVELS, SLICES, THORAX
from spinepipe.muscles.upright import turned

FORCE, MOMENT = np.array([10.0, -20.0, 5.0]), np.array([3.0, -2.0, -8.0])


def acting(exertion: Exertion) -> tuple[Applied, BodyPoses]:
    """On a person who leans forward a little."""
    person = made_up()
    angles = np.full(len(BODIES), -0.1)
    task = Task("push", None, turned(angles), exertion=exertion, from_upright=False)
    rotations = rotations_of(person.chain, task.turned)
    poses = posed(person.chain, rotations, np.zeros((len(LEVELS), 3)))
    return applied(person, task, poses), poses


def place(poses: BodyPoses, vertebra: str) -> np.ndarray:
    trunk = made_up().lines.trunk
    return poses.of(np.array(THORAX), trunk.vertebrae[SLICES.index(vertebra)])


@pytest.mark.parametrize("vertebra", ["T5", "T9"])
def test_a_force_acts_at_its_vertebra_and_a_moment_anywhere(vertebra: str) -> None:
    found, poses = acting(Exertion(FORCE, MOMENT, vertebra))
    idle, _ = acting(Exertion())
    forces = np.zeros((len(BODIES), 3))
    forces[THORAX] = FORCE
    np.testing.assert_allclose(found.forces - idle.forces, forces, rtol=0, atol=1e-11)
    moments = np.zeros((len(BODIES), 3))
    moments[THORAX] = MOMENT + np.cross(place(poses, vertebra), FORCE)
    np.testing.assert_allclose(found.moments - idle.moments, moments, rtol=0, atol=1e-11)


@pytest.mark.parametrize("vertebra", ["T5", "T9"])
def test_a_horizontal_force_makes_the_moment_about_l5s1(vertebra: str) -> None:
    """That about the vertical stays a pure moment."""
    found, poses = acting(Exertion(np.zeros(3), MOMENT, vertebra, as_force=True))
    idle, _ = acting(Exertion())
    force = (found.forces - idle.forces)[THORAX]
    arm = place(poses, vertebra) - poses.centres[0]
    assert force[1] == pytest.approx(0.0, abs=1e-11)
    assert np.cross(arm, force)[[0, 2]] == pytest.approx(MOMENT[[0, 2]], rel=1e-9)
    assert found.turning.tolist() == np.outer(np.eye(8)[THORAX], [0.0, MOMENT[1], 0.0]).tolist()
