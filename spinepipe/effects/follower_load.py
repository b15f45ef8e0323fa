"""Follower load: compression along the spine, carried by a cable, that the model leaves out."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from spinepipe.effects.contract import (
    AppliedLoad,
    Array,
    Indices,
    JointResponse,
    Kind,
    Motion,
    Neutral,
    Parameter,
    Wrench,
)
from spinepipe.effects.registry import Spread, Trial, register
from spinepipe.effects.turning import turning
from spinepipe.effects.vertebra_points import centres, upper_ends


def _at_joints(neutral: Neutral) -> Array:
    """(..., 1 + J, 3) guides of ground and of each vertebra, m."""
    return np.concatenate([neutral.origins[..., :1, :], upper_ends(neutral)], axis=-2)


def _at_centres(neutral: Neutral) -> Array:
    """(..., 1 + J, 3) guides of ground and of each vertebra, m."""
    points = centres(neutral)
    ground = 2.0 * neutral.origins[..., :1, :] - points[..., :1, :]
    return np.concatenate([ground, points], axis=-2)


GUIDES: dict[str, Callable[[Neutral], Array]] = {"joints": _at_joints, "centres": _at_centres}


@register("follower_load")
@dataclass(frozen=True)
class FollowerLoad:
    """A cable under tension ``force`` from the top vertebra to ground; off at 0.

    It spans the joints in scope: at each it pulls the guide of the upper vertebra towards that of
    the lower one, and the lower one back. Guides are

    - joints: the origin of the joint above each vertebra (of the top one 30 mm above its joint),
      of ground that of the lowest joint. Without translation the cable passes through every
      joint's centre, as a follower load is meant to (Patwardhan 2003,
      doi 10.1016/S0736-0266(02)00202-4);
    - centres: the centre of each vertebra, of ground as far below the lowest joint as the lowest
      vertebra's centre is above it. The cable then passes beside the joints' centres.
    """

    guides: str = "joints"
    name: ClassVar[str] = "follower_load"
    kind: ClassVar[Kind] = Kind.LOAD
    per_joint: ClassVar[bool] = False
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(
            name="force",
            unit="N",
            low=0.0,
            high=2000.0,
            default=100.0,
            prior_scale=100.0,
            logarithmic=False,
            meaning="tension of the cable, which compresses the joints",
            off=0.0,
        ),
    )
    trial: ClassVar[Trial] = Trial(
        variants=({"guides": "joints"}, {"guides": "centres"}),
        spreads=(Spread.SHARED, Spread.BY_SPECIMEN),
        told_by="measured translations: a compression through the joints' centres turns nothing",
    )

    def __post_init__(self) -> None:
        if self.guides not in GUIDES:
            raise ValueError(f"{self.name}: guides {self.guides!r}, allowed: {', '.join(GUIDES)}")

    def apply(
        self, motion: Motion, wrenches: tuple[Wrench, ...], joints: Indices, parameters: Array
    ) -> AppliedLoad:
        """Load of the cable and its tangent."""
        one = self._of_1_n(motion, joints)
        return AppliedLoad(parameters[0, 0] * one.load, parameters[0, 0] * one.tangent)

    def by_parameter(
        self, motion: Motion, wrenches: tuple[Wrench, ...], joints: Indices, parameters: Array
    ) -> Array:
        """(n, 1, 1): the load is linear in the tension."""
        return self._of_1_n(motion, joints).load[:, None, None]

    def across(self, q: Array, neutral: Neutral, parameters: Array) -> JointResponse:
        """What holds each joint at q (..., J, 6) against the cable, and its tangent.

        The cable's load on a joint hangs on the joint's own coordinates alone: it is the tension
        times the slope of the length between the guides of the two vertebrae.
        """
        slope, bend = self._length(q, neutral)
        tension = parameters[..., :1]
        return JointResponse(tension[..., None] * slope, tension[..., None, None] * bend)

    def across_by_parameter(self, q: Array, neutral: Neutral, parameters: Array) -> Array:
        """(..., J, 6, 1) derivative of what holds each joint: linear in the tension."""
        return self._length(q, neutral)[0][..., None]

    def _length(self, q: Array, neutral: Neutral) -> tuple[Array, Array]:
        """Slope (..., J, 6) and bend (..., J, 6, 6) of the length between guides."""
        guides = GUIDES[self.guides](neutral)
        local = neutral.rotations.swapaxes(-1, -2)
        lower, upper = (
            (local @ (points - neutral.origins)[..., None])[..., 0]
            for points in (guides[..., :-1, :], guides[..., 1:, :])
        )
        turned = turning(q[..., 3:].reshape(-1, 3))
        shape, arm = q.shape[:-1], upper.reshape(-1, 3)
        reach = np.einsum("jxy,jy->jx", turned.rotation, arm).reshape(*shape, 3)
        line = q[..., :3] + reach - lower
        length = np.linalg.norm(line, axis=-1)[..., None]
        moved, bent = np.zeros((*shape, 6, 3)), np.zeros((*shape, 6, 6, 3))
        moved[..., :3, :] = np.eye(3)
        moved[..., 3:, :] = np.einsum("jaxy,jy->jax", turned.first, arm).reshape(*shape, 3, 3)
        twice = np.einsum("jabxy,jy->jabx", turned.second, arm)
        bent[..., 3:, 3:, :] = twice.reshape(*shape, 3, 3, 3)
        along = line / length
        slope = (moved @ along[..., None])[..., 0]
        across = moved @ moved.swapaxes(-1, -2) - slope[..., None] * slope[..., None, :]
        return slope, across / length[..., None] + (bent @ along[..., None, :, None])[..., 0]

    def _of_1_n(self, motion: Motion, joints: Indices) -> AppliedLoad:
        n = len(motion.axes)
        load, tangent = np.zeros(n), np.zeros((n, n))
        guides = GUIDES[self.guides](motion.neutral)
        for joint in joints.tolist():
            pull = _segment(motion, joint, guides[joint + 1], guides[joint])
            load, tangent = load + pull.load, tangent + pull.tangent
        return AppliedLoad(load, tangent)


def _segment(motion: Motion, body: int, upper: Array, lower: Array) -> AppliedLoad:
    """Unit tension between guides of a vertebra and the one below (or ground, which is still)."""
    line = motion.displacement(body - 1).apply(lower) - motion.displacement(body).apply(upper)
    length = float(np.linalg.norm(line))
    along = line / length
    pull = motion.wrench(body, upper, along, np.zeros(3))
    load, tangent = pull.load, pull.tangent
    closing = motion.velocities(body, upper)
    if body > 0:
        back = motion.wrench(body - 1, lower, -along, np.zeros(3))
        load, tangent = load + back.load, tangent + back.tangent
        closing = closing - motion.velocities(body - 1, lower)
    across = closing - np.outer(closing @ along, along)
    return AppliedLoad(load, tangent - across @ across.T / length)  # the line turns with the pose
