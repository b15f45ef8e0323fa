"""Loads that are in the truth and not in the files. Each is asked with the spine's pose."""

from dataclasses import dataclass

import numpy as np

from .anatomy import Bones
from .design import Test
from .rigid import Pose, Wrenches
from .world import weights


@dataclass(frozen=True)
class Weight:
    """Mass (kg) left out of every segment in ``joints`` (mask), at its centre of mass."""

    bones: Bones
    joints: np.ndarray
    mass: float

    def __call__(self, pose: Pose, test: Test, step: int) -> Wrenches:
        return weights(pose, self.bones.centres, self.mass * self.joints)


@dataclass(frozen=True)
class Constant:
    """A constant moment (3,) N m in ground on the uppermost body, at every step of every test."""

    moment: np.ndarray

    def __call__(self, pose: Pose, test: Test, step: int) -> Wrenches:
        top = np.array([len(pose.places) - 1])
        return Wrenches(top, pose.places[top], np.zeros((1, 3)), self.moment[None])


@dataclass(frozen=True)
class Follower:
    """A cable of tension N through the segments' centres of mass, from the top to the ground.

    Centres are midway between joints here. The ground's own guide lies as far below the lowest
    joint as the lowest segment's centre lies above it. The force follows the spine as it bends.
    """

    bones: Bones
    tension: float

    def __call__(self, pose: Pose, test: Test, step: int) -> Wrenches:
        bodies = np.arange(len(pose.places))
        points = pose.point(bodies, self.bones.centres)
        anchor = 2.0 * self.bones.origins[0] - self.bones.centres[0]
        down = np.vstack([anchor, points[:-1]]) - points
        lengths = np.linalg.norm(down, axis=1)
        along = down / lengths[:, None]
        v = np.swapaxes(pose.velocities(bodies, points), 1, 2)
        below = np.concatenate([np.zeros_like(v[:1]), v[:-1]])
        across = np.eye(3) - along[:, :, None] * along[:, None, :]
        turning = across @ (below - v) / lengths[:, None, None]
        forces, by_q = along.copy(), turning.copy()
        forces[:-1] -= along[1:]
        by_q[:-1] -= turning[1:]
        pulls = self.tension * forces
        return Wrenches(bodies, points, pulls, np.zeros_like(pulls), self.tension * by_q)
