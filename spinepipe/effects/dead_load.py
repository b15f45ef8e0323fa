"""Dead loads: load effects that are wrenches fixed in ground, whatever the pose.

Such an effect says which wrenches it adds to the listed ones, for one test or for many at once:
arrays have any axes (...) in front.
"""

from abc import ABC, abstractmethod
from dataclasses import dataclass

import numpy as np

from spinepipe.effects.contract import (
    AppliedLoad,
    Array,
    Indices,
    Motion,
    Neutral,
    Wrench,
)

TOP_HEIGHT_M = 0.03
"""Height of the most cranial vertebra above its joint, as nothing above says where it ends."""


@dataclass(frozen=True, eq=False)
class Wrenches:
    """W wrenches fixed in ground, each on a vertebra.

    Attributes
    ----------
    bodies : (..., W) vertebra; -1 where there is none. points : (..., W, 3) m, neutral pose.
    forces, moments : (..., W, 3) N and N m.
    """

    bodies: Indices
    points: Array
    forces: Array
    moments: Array

    @classmethod
    def of(cls, listed: tuple[Wrench, ...]) -> "Wrenches":
        """Those of one step."""
        numbers = np.zeros((3, len(listed), 3))
        for place, one in enumerate(listed):
            numbers[:, place] = one.point, one.force, one.moment
        return cls(np.array([one.body for one in listed], dtype=np.int64), *numbers)


@dataclass(frozen=True, eq=False)
class WrenchSlopes:
    """Derivatives (..., W, 3, P) of forces and moments by the parameters."""

    forces: Array
    moments: Array


class DeadLoad(ABC):
    """A load effect with one row of parameters that adds wrenches to the listed ones."""

    @abstractmethod
    def wrenches(
        self, listed: Wrenches, neutral: Neutral, joints: Indices, parameters: Array
    ) -> Wrenches:
        """What is added, at parameters (..., P); the vertebra a joint carries has its index."""

    @abstractmethod
    def slopes(
        self, listed: Wrenches, neutral: Neutral, joints: Indices, parameters: Array
    ) -> WrenchSlopes:
        """Derivatives of what is added."""

    def apply(
        self, motion: Motion, wrenches: tuple[Wrench, ...], joints: Indices, parameters: Array
    ) -> AppliedLoad:
        """Generalised load of the added wrenches at this pose, and its tangent."""
        n = len(motion.axes)
        load, tangent = np.zeros(n), np.zeros((n, n))
        added = self.wrenches(Wrenches.of(wrenches), motion.neutral, joints, parameters[0])
        for place, body in enumerate(added.bodies.tolist()):
            one = motion.wrench(
                body, added.points[place], added.forces[place], added.moments[place]
            )
            load, tangent = load + one.load, tangent + one.tangent
        return AppliedLoad(load, tangent)

    def by_parameter(
        self, motion: Motion, wrenches: tuple[Wrench, ...], joints: Indices, parameters: Array
    ) -> Array:
        """(n, 1, P) derivative of the applied load by the parameters at fixed pose."""
        listed, at = Wrenches.of(wrenches), parameters[0]
        added = self.wrenches(listed, motion.neutral, joints, at)
        slopes = self.slopes(listed, motion.neutral, joints, at)
        found = np.zeros((len(motion.axes), parameters.shape[1]))
        for place, body in enumerate(added.bodies.tolist()):
            found += motion.velocities(body, added.points[place]) @ slopes.forces[place]
            found += motion.angular(body) @ slopes.moments[place]
        return found[:, None]


def upper_ends(neutral: Neutral) -> Array:
    """(..., J, 3) origin of the joint above each vertebra; of the top one, 30 mm above its own.

    Above means along the joint's superior axis.
    """
    top = neutral.origins[..., -1:, :] + TOP_HEIGHT_M * neutral.rotations[..., -1:, :, 1]
    return np.concatenate([neutral.origins[..., 1:, :], top], axis=-2)


def centres(neutral: Neutral) -> Array:
    """(..., J, 3) centres of mass, or midway between its joints for a vertebra of unstated mass.

    A vertebra without a mass has its centre of mass at the origin of ground in the model.
    """
    stated = neutral.centres_of_mass
    midway = (neutral.origins + upper_ends(neutral)) / 2.0
    return np.where(stated.any(axis=-1, keepdims=True), stated, midway)
