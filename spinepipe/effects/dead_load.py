"""Dead loads: load effects that are wrenches whose direction and size stay, whatever the pose.

A wrench is a force at a point and a moment. Force and moment are fixed in ground; the point moves
with its vertebra. Such an effect says which wrenches it adds to those that the cohort lists, for
one load step or for many at once: arrays have any axes (...) in front. All are in ground axes.
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
"""Height of the most cranial vertebra above the joint below it, as no joint above says where it
ends: a choice, about the height of a lumbar vertebral body."""


@dataclass(frozen=True, eq=False)
class Wrenches:
    """W wrenches fixed in ground, each on a vertebra.

    Attributes
    ----------
    bodies : (..., W) vertebra; -1 fills up steps with fewer wrenches (and is not ground here).
    points : (..., W, 3) m, where each is in the neutral pose, ground.
    forces, moments : (..., W, 3) N and N m, ground; the moment comes besides the force's own.
    """

    bodies: Indices
    points: Array
    forces: Array
    moments: Array

    @classmethod
    def of(cls, listed: tuple[Wrench, ...]) -> "Wrenches":
        """Those of one step, with no axes in front."""
        numbers = np.zeros((3, len(listed), 3))
        for place, one in enumerate(listed):
            numbers[:, place] = one.point, one.force, one.moment
        return cls(np.array([one.body for one in listed], dtype=np.int64), *numbers)


@dataclass(frozen=True, eq=False)
class WrenchSlopes:
    """Derivatives (..., W, 3, P) of forces and moments by the P parameters; points have none."""

    forces: Array
    moments: Array


class DeadLoad(ABC):
    """A load effect that adds wrenches to the listed ones.

    Its parameters are one row for all joints in scope (``per_joint`` is False). Arguments that all
    methods share:

    listed, wrenches : those of the cohort. neutral : the chain in its neutral pose.
    joints : joints in scope; the vertebra that a joint carries has the joint's number.
    """

    @abstractmethod
    def wrenches(
        self, listed: Wrenches, neutral: Neutral, joints: Indices, parameters: Array
    ) -> Wrenches:
        """The added wrenches alone, at parameters (..., P)."""

    @abstractmethod
    def slopes(
        self, listed: Wrenches, neutral: Neutral, joints: Indices, parameters: Array
    ) -> WrenchSlopes:
        """Derivatives of the added wrenches by the parameters, in the same order."""

    def apply(
        self, motion: Motion, wrenches: tuple[Wrench, ...], joints: Indices, parameters: Array
    ) -> AppliedLoad:
        """Generalised load (n,) of the added wrenches at this pose, and its tangent (n, n).

        ``parameters`` (1, P).
        """
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
        """(n, 1, P) derivative of the applied load by the parameters (1, P) at fixed pose."""
        listed, at = Wrenches.of(wrenches), parameters[0]
        added = self.wrenches(listed, motion.neutral, joints, at)
        slopes = self.slopes(listed, motion.neutral, joints, at)
        found = np.zeros((len(motion.axes), parameters.shape[1]))
        # virtual work: velocity of the point by coordinate rate times force, and so for moments
        for place, body in enumerate(added.bodies.tolist()):
            found += motion.velocities(body, added.points[place]) @ slopes.forces[place]
            found += motion.angular(body) @ slopes.moments[place]
        return found[:, None]


def upper_ends(neutral: Neutral) -> Array:
    """(..., J, 3) m, ground: origin of the joint above each vertebra.

    Of the top one, which has none above, the point `TOP_HEIGHT_M` from the origin of the joint
    below it, along that joint's superior axis.
    """
    top = neutral.origins[..., -1:, :] + TOP_HEIGHT_M * neutral.rotations[..., -1:, :, 1]
    return np.concatenate([neutral.origins[..., 1:, :], top], axis=-2)


def centres(neutral: Neutral) -> Array:
    """(..., J, 3) m, ground: centres of mass; without a mass, midway between a vertebra's joints.

    The model puts the centre of mass of a vertebra without mass at the origin of ground, exactly:
    by that it is known here.
    """
    stated = neutral.centres_of_mass
    midway = (neutral.origins + upper_ends(neutral)) / 2.0
    return np.where(stated.any(axis=-1, keepdims=True), stated, midway)
