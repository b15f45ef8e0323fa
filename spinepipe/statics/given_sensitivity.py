"""Sensitivities of a solved step to what was given: its loads, and the joint poses.

Those to the joint poses tell what palpation errors do to the motion. Moving joint j's frame by a
small twist xi in the neutral pose, with vertebrae and load points staying where they are, moves the
loaded chain like two extra coordinates: the twist as carried by the vertebra below joint j, in
front of its six coordinates, and minus the twist as carried by the vertebra above, behind them.
"""

from dataclasses import dataclass

import numpy as np

from spinepipe.effects.contract import Array
from spinepipe.frames import Pose
from spinepipe.statics.motion import ChainMotion
from spinepipe.statics.path import SolvedStep
from spinepipe.statics.system import System

ROTATION_AXES = (2, 0, 1)
"""Frame axis of extension, right bending and left rotation."""


@dataclass(frozen=True)
class LoadSensitivity:
    """Derivatives (n, 3) of the pose by a slot's force (N), moment (N m) and point (m)."""

    by_force: Array
    by_moment: Array
    by_point: Array


def by_load(system: System, step: SolvedStep, slot: int) -> LoadSensitivity:
    """Sensitivities to the wrench at one slot of the case; the point moves with its vertebra.

    Raises
    ------
    ValueError
        When the step has no equilibrium, or the model has effects that may themselves depend on
        the listed loads: load effects, and path effects through earlier steps.
    """
    factored = step.factored
    if system.load_effects or system.paths:
        raise ValueError("load sensitivities do not cover load effects and path effects")
    motion = ChainMotion(system.chain, step.equilibrium.q)
    body, place = system.slots.places[slot]
    point, force = np.array(place), step.loading.forces[slot]
    velocities = motion.velocities(body, point)
    # A point's velocity is linear in the point: unit shifts give the exact derivative.
    shifted = [motion.velocities(body, point + shift) - velocities for shift in np.eye(3)]
    return LoadSensitivity(
        by_force=factored.solve(_unfixed(system, velocities)),
        by_moment=factored.solve(_unfixed(system, motion.angular(body))),
        by_point=factored.solve(_unfixed(system, np.stack([v @ force for v in shifted], axis=1))),
    )


def _unfixed(system: System, change: Array) -> Array:
    """(n, m) changes of load, which move no coordinate that a rig fixes."""
    found = change.copy()
    found[system.fixed] = 0.0
    return found


def by_joint_pose(system: System, step: SolvedStep) -> Array:
    """(n, J, 6) derivative of the pose by small displacements of each joint frame.

    The six components are displacements of the joint frame in its own neutral axes: anterior,
    superior, right (m), then rotations about z, x, y (rad).

    Raises
    ------
    ValueError
        When the step has no equilibrium, or the model has effects whose own dependence on the
        joint poses is not known here: load effects and path effects.
    """
    factored = step.factored
    if system.load_effects or system.paths:
        raise ValueError("joint-pose sensitivities do not cover load effects and path effects")
    motion = ChainMotion(system.chain, step.equilibrium.q)
    loads = _point_loads(system, step, motion)
    n, n_joints = system.chain.n, system.model.n_joints
    change = np.zeros((n, n_joints, 6))
    for joint, frame in enumerate(system.model.frames):
        beyond = [load for load in loads if load.body >= joint]
        for component, (turn, shift) in enumerate(_twists(frame)):
            for carrier, sign in ((joint - 1, 1.0), (joint, -1.0)):
                carried = motion.displacement(carrier)
                omega = carried.rotation @ turn
                base = carried.rotation @ shift - np.cross(omega, carried.origin)
                for load in beyond:
                    moved = _load_change(motion.axes, load, 6 * (carrier + 1), omega, base)
                    change[:, joint, component] += sign * moved
    # The residual is holding less applied load, so dr/dxi = -change and dq/dxi = K^-1 change.
    return factored.solve(_unfixed(system, change.reshape(n, -1))).reshape(n, n_joints, 6)


def _twists(frame: Pose) -> list[tuple[Array, Array]]:
    """Angular velocity and velocity of the ground origin for unit displacements of a frame."""
    axes = frame.rotation.T
    shifts = [(np.zeros(3), axis) for axis in axes]
    turns = [(axes[k], -np.cross(axes[k], frame.origin)) for k in ROTATION_AXES]
    return shifts + turns


@dataclass(frozen=True)
class _PointLoad:
    """A ground-fixed wrench: where it is now (3,), and its point's velocities (n, 3) by rate."""

    body: int
    force: Array
    moment: Array
    place: Array
    velocities: Array


def _point_loads(system: System, step: SolvedStep, motion: ChainMotion) -> list[_PointLoad]:
    """The listed wrenches and the vertebrae's weights."""
    listed = [
        (body, np.array(point), force, moment)
        for (body, point), force, moment in zip(
            system.slots.places, step.loading.forces, step.loading.moments, strict=True
        )
    ]
    weights = [
        (index, body.com, step.loading.share * body.mass * system.model.gravity, np.zeros(3))
        for index, body in enumerate(system.model.bodies)
        if np.any(system.model.gravity)
    ]
    return [
        _PointLoad(
            body,
            force,
            moment,
            motion.displacement(body).apply(point),
            motion.velocities(body, point),
        )
        for body, point, force, moment in listed + weights
    ]


def _load_change(axes: Array, load: _PointLoad, first: int, omega: Array, base: Array) -> Array:
    """(n,) change of a wrench's generalised load when all from coordinate ``first`` up moves.

    ``omega`` and ``base`` are the angular velocity and the velocity at the ground origin.
    """
    change = np.zeros(len(axes))
    velocity = base + np.cross(omega, load.place)
    change[:first] = axes[:first] @ np.cross(velocity, load.force)
    carried = slice(first, 6 * (load.body + 1))
    change[carried] = load.velocities[carried] @ np.cross(load.force, omega)
    change[carried] += axes[carried] @ np.cross(load.moment, omega)
    return change
