"""Loads that are in the truth and not in the files. Each is asked with the spine's poses."""

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from .anatomy import Bones
from .rigid import Pose, Wrenches
from .world import Now, weights


@dataclass(frozen=True)
class Weight:
    """Masses (J,) kg left out of the segments, at their centres of mass."""

    bones: Bones
    masses: np.ndarray

    def __call__(self, pose: Pose, now: Now) -> Wrenches:
        return weights(pose, self.bones.centres, self.masses)


@dataclass(frozen=True)
class Constant:
    """A constant moment and force (3,) in ground on the uppermost body, in every step of all tests.

    The force pulls at a neutral point (3,) m of that body.
    """

    moment: np.ndarray
    force: np.ndarray
    point: np.ndarray

    def __call__(self, pose: Pose, now: Now) -> Wrenches:
        top = np.array([pose.places.shape[-2] - 1])
        at = pose.point(top, self.point[None])
        like = np.zeros_like(at)
        return Wrenches(top, at, like + self.force, like + self.moment)


@dataclass(frozen=True)
class Growing:
    """The load's direction turns as the rig bends: by ``tilt * share^2`` rad about ``axis``.

    moments (T, S, 3) as listed; share of the peak. What is added to the listed moment.
    """

    moments: np.ndarray
    axis: np.ndarray
    tilt: float

    def __call__(self, pose: Pose, now: Now) -> Wrenches:
        listed = self.moments[now.tests, now.steps]
        peak = np.linalg.norm(self.moments, axis=-1).max()
        share = np.linalg.norm(listed, axis=-1, keepdims=True) / max(peak, 1e-12)
        turns = Rotation.from_rotvec(self.tilt * share**2 * self.axis)
        top = np.array([pose.places.shape[-2] - 1])
        moment = (turns.apply(listed) - listed)[..., None, :]
        return Wrenches(top, pose.places[..., top, :], np.zeros_like(moment), moment)


@dataclass(frozen=True)
class Follower:
    """A cable of tension N from the top to the ground, through guides on the segments.

    ``guides`` (J, 3) m and ``anchor`` (3,) m, neutral. The force follows the spine as it bends.
    """

    guides: np.ndarray
    anchor: np.ndarray
    tension: float

    def __call__(self, pose: Pose, now: Now) -> Wrenches:
        bodies = np.arange(len(self.guides))
        points = pose.point(bodies, self.guides)
        ground = np.broadcast_to(self.anchor, points[..., :1, :].shape)
        down = np.concatenate([ground, points[..., :-1, :]], axis=-2) - points
        lengths = np.linalg.norm(down, axis=-1)[..., None]
        along = down / lengths
        v = np.swapaxes(pose.velocities(bodies, points), -1, -2)
        below = np.concatenate([np.zeros_like(v[..., :1, :, :]), v[..., :-1, :, :]], axis=-3)
        across = np.eye(3) - along[..., :, None] * along[..., None, :]
        turning = across @ (below - v) / lengths[..., None]
        forces, by_q = along.copy(), turning.copy()
        forces[..., :-1, :] -= along[..., 1:, :]
        by_q[..., :-1, :, :] -= turning[..., 1:, :, :]
        pulls = self.tension * forces
        return Wrenches(bodies, points, pulls, np.zeros_like(pulls), self.tension * by_q)
