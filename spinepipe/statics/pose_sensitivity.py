"""Sensitivities of a solved step to the joint poses: what palpation errors do to the motion.

Moving joint j's frame by a small twist xi in the neutral pose, with vertebrae and load points
staying where they are, moves the loaded chain like two extra coordinates: the twist as carried by
the vertebra below joint j, in front of its six coordinates, and minus the twist as carried by the
vertebra above, behind them.
"""

import numpy as np

from spinepipe.effects.contract import Array
from spinepipe.frames import Pose, transform_of
from spinepipe.statics.motion import ChainMotion
from spinepipe.statics.path import SolvedStep
from spinepipe.statics.system import System

ROTATION_AXES = (2, 0, 1)
"""Frame axis of extension, right bending and left rotation."""


def by_joint_pose(system: System, step: SolvedStep) -> Array:
    """(n, J, 6) derivative of the pose by small displacements of each joint frame.

    The six components are displacements of the joint frame in its own neutral axes: anterior,
    superior, right (m), then rotations about z, x, y (rad).

    Raises
    ------
    ValueError
        When the step has no equilibrium.
    """
    factored = step.equilibrium.factored
    if factored is None:
        raise ValueError(f"step {step.step.step} has no equilibrium to differentiate")
    motion = ChainMotion(system.chain, step.equilibrium.q)
    points, forces, moments, bodies = _point_loads(system, step)
    velocities = [motion.velocities(b, p) for b, p in zip(bodies, points, strict=True)]
    placed = _displacements(system, step.equilibrium.q)
    now = [placed[b + 1].apply(p) for b, p in zip(bodies, points, strict=True)]
    n, n_joints = system.chain.n, system.model.n_joints
    right = np.zeros((n, n_joints, 6))
    for joint, frame in enumerate(system.model.frames):
        for component, (turn, shift) in enumerate(_twists(frame)):
            for below, sign in ((placed[joint], 1.0), (placed[joint + 1], -1.0)):
                first = 6 * joint if sign > 0 else 6 * joint + 6
                omega = below.rotation @ turn
                base = below.rotation @ shift - np.cross(omega, below.origin)
                right[:, joint, component] += sign * _generalised_load_change(
                    motion.axes, velocities, now, forces, moments, bodies, joint, first, omega, base
                )
    # The residual is holding less applied load, so dr/dxi = -change and dq/dxi = K^-1 change.
    return factored.solve(right.reshape(n, -1)).reshape(n, n_joints, 6)


def _twists(frame: Pose) -> list[tuple[Array, Array]]:
    """Angular velocity and velocity of the ground origin for unit displacements of a frame."""
    axes = frame.rotation.T
    shifts = [(np.zeros(3), axis) for axis in axes]
    turns = [(axes[k], -np.cross(axes[k], frame.origin)) for k in ROTATION_AXES]
    return shifts + turns


def _point_loads(system: System, step: SolvedStep):  # type: ignore[no-untyped-def]
    """All ground-fixed point loads: listed wrenches and the vertebrae's weights."""
    points = [np.array(place) for _, place in system.slots.places]
    bodies = [body for body, _ in system.slots.places]
    forces, moments = list(step.loading.forces), list(step.loading.moments)
    if np.any(system.model.gravity):
        for index, body in enumerate(system.model.bodies):
            bodies.append(index)
            points.append(body.com)
            forces.append(step.loading.share * body.mass * system.model.gravity)
            moments.append(np.zeros(3))
    return points, forces, moments, bodies


def _displacements(system: System, q: Array) -> list[Pose]:
    """Displacement of the ground and of each vertebra from the neutral pose, in ground."""
    placed = [Pose(np.eye(3), np.zeros(3))]
    for frame, coordinates in zip(system.model.frames, q.reshape(-1, 6), strict=True):
        placed.append(placed[-1] @ frame @ transform_of(coordinates) @ frame.inverse())
    return placed


def _generalised_load_change(
    axes: Array,
    velocities: list[Array],
    now: list[Array],
    forces: list[Array],
    moments: list[Array],
    bodies: list[int],
    joint: int,
    first: int,
    omega: Array,
    base: Array,
) -> Array:
    """(n,) change of the applied generalised load when all from coordinate ``first`` up moves.

    ``omega`` and ``base`` are the angular velocity and the velocity at the ground origin.
    """
    change = np.zeros(len(axes))
    for velocity, point, force, moment, body in zip(
        velocities, now, forces, moments, bodies, strict=True
    ):
        if body < joint:
            continue
        carried = axes[first : 6 * (body + 1)]
        change[:first] += axes[:first] @ np.cross(base + np.cross(omega, point), force)
        above = velocity[first : 6 * (body + 1)] @ np.cross(force, omega)
        change[first : 6 * (body + 1)] += above + carried @ np.cross(moment, omega)
    return change
