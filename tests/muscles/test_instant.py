"""An instant of a motion in place of weights and arms: the muscles' free body is the one given."""

from dataclasses import replace

import numpy as np
import pytest
from trunk_person import CLOSELY, held_task, made_up, tasks, volunteer

from spinepipe.frames import rotation_zxy
from spinepipe.muscles.applied_loads import applied_loads
from spinepipe.muscles.muscle_equilibrium import TurnedPose, solve_task
from spinepipe.muscles.passive_tissue import LIGAMENT_ARM_M
from spinepipe.muscles.person import Person
from spinepipe.muscles.pose import rotations_of
from spinepipe.muscles.task import Instant, Task
from spinepipe.muscles.trunk import BODIES, LEVELS, THORAX

ONCE = replace(CLOSELY, translates=False)


def as_instant(person: Person, task: Task) -> Task:
    """The same posture and weights, told as an inverse dynamics tells them."""
    pose = TurnedPose.of(person, task).poses
    loads = applied_loads(person, task, pose)
    standing = rotations_of(person.chain, person.upright)
    turned = pose.rotations @ np.swapaxes(standing, -1, -2)
    at = loads.at - pose.centres[0]
    told = Instant(turned, loads.bodies, at, loads.pushes, np.zeros_like(at))
    return Task(task.name, None, np.zeros((8, 3)), True, stress_pa=task.stress_pa, instant=told)


def swinging() -> Task:
    """Bent forwards and to the side, carried parts pushed any way and turned, made up."""
    rng = np.random.default_rng(3)
    bent = np.linspace(0.1, 0.9, len(BODIES))
    turned = np.array([rotation_zxy(-one, 0.2 * one, 0.1 * one) for one in bent])
    bodies = np.array([0, 1, 2, 3, 4, 5, 6, THORAX, THORAX, THORAX])
    at = np.column_stack([np.linspace(-0.1, 0.4, 10), np.linspace(-0.1, 0.3, 10), 0.02 * bodies])
    forces = np.array([0.0, -30.0, 0.0]) + rng.normal(0.0, 5.0, (10, 3))
    moments = rng.normal(0.0, 2.0, (10, 3))
    return Task(
        "swing", None, np.zeros((8, 3)), True, instant=Instant(turned, bodies, at, forces, moments)
    )


@pytest.mark.parametrize("name", ["standing", "flexion_50", "side_10"])
def test_a_task_told_as_an_instant_is_held_by_the_same_forces(name: str) -> None:
    person, task = volunteer(), tasks()[name]
    whole, told = (solve_task(person, one, ONCE) for one in (task, as_instant(person, task)))
    np.testing.assert_allclose(told.poses.rotations, whole.poses.rotations, atol=1e-12)
    np.testing.assert_allclose(told.found.forces, whole.found.forces, atol=1e-3)
    np.testing.assert_allclose(told.pushes, whole.pushes, atol=1e-2)


def test_muscles_and_joints_hold_exactly_what_the_inverse_dynamics_has() -> None:
    """Moment about L5S1 of all above it, added up anew, whatever moves under load."""
    task = swinging()
    assert task.instant is not None
    found, told = solve_task(made_up(), task, CLOSELY), task.instant
    above = told.bodies > 0
    net = (np.cross(told.at, told.forces) + told.moments)[above].sum(axis=0)
    pose, muscles = found.poses, found.demand.arms[:3] @ found.found.forces
    joint = pose.discs[0] @ found.joint_moments[0]
    np.testing.assert_allclose(net + muscles + joint + found.found.slack[:3], 0.0, atol=1e-6)
    np.testing.assert_allclose(found.demand.required[:3] + joint, -net, atol=1e-9)
    # ligaments behind the joints pull the vertebrae together
    pressed = made_up().laws.ligament_moments(pose.turned) / LIGAMENT_ARM_M
    for level in range(len(LEVELS)):
        drawn = np.einsum("mbi,m->bi", found.pulls.forces, found.found.forces)[level + 1 :]
        on = told.forces[told.bodies > level].sum(axis=0) + drawn.sum(axis=0)
        on = on - pressed[level] * pose.discs[level][:, 1]
        np.testing.assert_allclose(pose.discs[level] @ found.pushes[level], on, atol=1e-6)


def test_pressure_acts_on_an_instant_too() -> None:
    still, task = swinging(), replace(swinging(), pressure_pa=5e3)
    pose = TurnedPose.of(made_up(), task).poses
    with_it, without = (applied_loads(made_up(), one, pose) for one in (task, still))
    lift = 5e3 * made_up().diaphragm_m2 * pose.rotations[THORAX][:, 1]
    np.testing.assert_allclose(with_it.forces[THORAX] - without.forces[THORAX], lift)
    np.testing.assert_allclose(with_it.forces.sum(axis=0), without.forces.sum(axis=0))


@pytest.mark.parametrize("name", ["flexion_50", "load_close", "side_10"])
def test_the_frame_before_shortens_the_way_and_changes_nothing(name: str) -> None:
    """From a posture 2 deg off, to within what rounds settle to."""
    person, task = volunteer(), tasks()[name]
    turned = task.turned.copy()
    turned[:, 0] += np.linspace(0.0, np.deg2rad(2.0), len(BODIES))
    before = solve_task(person, replace(task, turned=turned))
    alone, after = solve_task(person, task), solve_task(person, task, nearby=before)
    assert after.status is alone.status
    assert len(after.rounds) <= len(alone.rounds)
    closely = solve_task(person, task, CLOSELY, nearby=before)
    np.testing.assert_allclose(closely.pushes, held_task(name).pushes, atol=0.1)
