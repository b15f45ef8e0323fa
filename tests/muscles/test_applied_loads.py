"""What acts from outside: a force, a pure moment, a force that makes the moment, and pressure."""

import numpy as np
import pytest
from trunk_person import made_up

from spinepipe.frames import rotation_zxy
from spinepipe.muscles.applied_loads import AppliedLoads, applied_loads, diaphragm_load
from spinepipe.muscles.pose import BodyPoses, place_bodies, rotations_of
from spinepipe.muscles.regressions import packaged
from spinepipe.muscles.scaling import DIAPHRAGM_M2, diaphragm_area
from spinepipe.muscles.subject import REFERENCE, Subject
from spinepipe.muscles.task import Exertion, Task
from spinepipe.muscles.trunk import BODIES, LEVELS, SLICES, THORAX

FORCE, MOMENT = np.array([10.0, -20.0, 5.0]), np.array([3.0, -2.0, -8.0])


def acting(exertion: Exertion) -> tuple[AppliedLoads, BodyPoses]:
    """On a person who leans forward a little."""
    person = made_up()
    angles = np.full(len(BODIES), -0.1)
    task = Task(
        "push", None, np.outer(angles, [1.0, 0.0, 0.0]), exertion=exertion, from_upright=False
    )
    rotations = rotations_of(person.chain, task.turned)
    poses = place_bodies(person.chain, rotations, np.zeros((len(LEVELS), 3)))
    return applied_loads(person, task, poses), poses


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


def test_moment_of_pressure_extends_the_trunk() -> None:
    """10 kPa on 452 cm2 at 5 cm: 452 N and 22.6 N m."""
    t11 = np.array([0.01, 0.3, 0.0])
    load = diaphragm_load(10e3, 0.0452, t11, np.eye(3))
    np.testing.assert_allclose(load.force, [0.0, 452.0, 0.0])
    np.testing.assert_allclose(np.cross(load.at - t11, load.force), [0.0, 0.0, 22.6])


def test_the_lift_turns_with_the_ribs() -> None:
    turned = rotation_zxy(-0.9, 0.2, -0.1)
    t11 = np.array([0.1, 0.25, 0.02])
    upright = diaphragm_load(5e3, 0.03, np.zeros(3), np.eye(3))
    load = diaphragm_load(5e3, 0.03, t11, turned)
    np.testing.assert_allclose(load.force, turned @ upright.force, atol=1e-12)
    np.testing.assert_allclose(load.at - t11, turned @ upright.at, atol=1e-15)


def test_the_area_grows_as_the_rib_cage() -> None:
    known = packaged("constant_density")
    other = Subject("male", 20.0, 1.730, 1.1 * 75.1)
    assert diaphragm_area(REFERENCE, REFERENCE, known) == DIAPHRAGM_M2
    assert diaphragm_area(other, REFERENCE, known) == pytest.approx(1.1 * DIAPHRAGM_M2)
