"""Follower load: compression along the spine, carried by a cable, that the model leaves out."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from spinepipe.effects.contract import (
    AppliedLoad,
    Array,
    EffectKind,
    Indices,
    JointResponse,
    Motion,
    Neutral,
    Parameter,
    Wrench,
)
from spinepipe.effects.dead_load import centres, upper_ends
from spinepipe.effects.registry import PlaceSpread, TriedValues, register
from spinepipe.effects.turning import turning


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

    Each lies ``anterior`` further along the anterior axis of its joint, of ground the lowest's: no
    cable runs exactly through the joints' centres.
    """

    guides: str = "joints"
    name: ClassVar[str] = "follower_load"
    kind: ClassVar[EffectKind] = EffectKind.LOAD
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
        Parameter(
            name="anterior",
            unit="m",
            low=-0.05,
            high=0.05,
            default=0.0,
            prior_scale=0.005,
            logarithmic=False,
            meaning="how far before its guides the cable runs; behind them below 0",
        ),
    )
    trial: ClassVar[TriedValues] = TriedValues(
        variants=({"guides": "joints"}, {"guides": "centres"}),
        spreads=(PlaceSpread.SHARED, PlaceSpread.BY_SPECIMEN),
        told_by="measured translations: a compression through the joints' centres turns nothing",
    )

    def __post_init__(self) -> None:
        if self.guides not in GUIDES:
            raise ValueError(f"{self.name}: guides {self.guides!r}, allowed: {', '.join(GUIDES)}")

    def apply(
        self, motion: Motion, wrenches: tuple[Wrench, ...], joints: Indices, parameters: Array
    ) -> AppliedLoad:
        """Load of the cable and its tangent."""
        n, (tension, anterior) = len(motion.axes), parameters[0]
        load, tangent = np.zeros(n), np.zeros((n, n))
        guides = self._guides(motion.neutral, anterior)
        for joint in joints.tolist():
            pull = _Ends(motion, joint, guides[joint + 1], guides[joint]).pull()
            load, tangent = load + pull.load, tangent + pull.tangent
        return AppliedLoad(tension * load, tension * tangent)

    def by_parameter(
        self, motion: Motion, wrenches: tuple[Wrench, ...], joints: Indices, parameters: Array
    ) -> Array:
        """(n, 1, 2) derivative of the load by tension and guides."""
        tension, anterior = parameters[0]
        guides, ahead = self._guides(motion.neutral, anterior), _ahead(motion.neutral)
        found = np.zeros((len(motion.axes), 1, 2))
        for joint in joints.tolist():
            ends = _Ends(motion, joint, guides[joint + 1], guides[joint])
            found[:, 0, 0] += ends.closing @ ends.along
            found[:, 0, 1] += tension * ends.pull_moved(ahead[joint + 1], ahead[joint])
        return found

    def across(self, q: Array, neutral: Neutral, parameters: Array) -> JointResponse:
        """What holds each joint at q (..., J, 6) against the cable, and its tangent.

        The cable's load on a joint hangs on the joint's own coordinates alone: it is the tension
        times the slope of the length between the guides of the two vertebrae.
        """
        span = self._span(q, neutral, parameters)
        tension = parameters[..., :1]
        return JointResponse(tension[..., None] * span.slope, tension[..., None, None] * span.bend)

    def across_by_parameter(self, q: Array, neutral: Neutral, parameters: Array) -> Array:
        """(..., J, 6, 2) derivative of what holds each joint, by tension and guides."""
        span = self._span(q, neutral, parameters)
        by_guides = span.slope_moved(*_in_joints(_ahead(neutral), neutral.rotations))
        return np.stack([span.slope, parameters[..., :1, None] * by_guides], axis=-1)

    def _guides(self, neutral: Neutral, anterior: Array) -> Array:
        """(..., 1 + J, 3) guides of ground and of each vertebra; ``anterior`` (...), m."""
        return GUIDES[self.guides](neutral) + anterior[..., None, None] * _ahead(neutral)

    def _span(self, q: Array, neutral: Neutral, parameters: Array) -> "_Span":
        guides = self._guides(neutral, parameters[..., 1])
        return _Span(q, *_in_joints(guides, neutral.rotations, neutral.origins))


def _ahead(neutral: Neutral) -> Array:
    """(..., 1 + J, 3) anterior direction at the guides of ground and of each vertebra."""
    ahead = neutral.rotations[..., :, 0]
    return np.concatenate([ahead[..., :1, :], ahead], axis=-2)


def _in_joints(at: Array, rotations: Array, origins: Array | float = 0.0) -> tuple[Array, Array]:
    """What is at the guides (..., 1 + J, 3) below and above each joint, in the joint's axes."""
    local = rotations.swapaxes(-1, -2)
    below, above = at[..., :-1, :] - origins, at[..., 1:, :] - origins
    return (local @ below[..., None])[..., 0], (local @ above[..., None])[..., 0]


class _Span:
    """The line from the guide below each joint to the one above, by the joint's coordinates.

    Attributes
    ----------
    moved, bent : (..., J, 6, 3), (..., J, 6, 6, 3) derivatives of the line.
    slope, bend : (..., J, 6), (..., J, 6, 6) derivatives of its length.
    """

    def __init__(self, q: Array, lower: Array, upper: Array) -> None:
        self._turned = turning(q[..., 3:].reshape(-1, 3))
        line = q[..., :3] + self._carried(upper) - lower
        self._length = np.linalg.norm(line, axis=-1)[..., None]
        self._along = line / self._length
        self.moved = self._moved(upper)
        self.moved[..., :3, :] = np.eye(3)
        self.slope = self._on_line(self.moved)
        # second derivatives of the line along itself, and its turning across itself
        twice = np.einsum("jabxy,jy->jabx", self._turned.second, upper.reshape(-1, 3))
        bent = np.zeros((*self.moved.shape[:-1], 6, 3))
        bent[..., 3:, 3:, :] = twice.reshape(*upper.shape[:-1], 3, 3, 3)
        across = self.moved @ self.moved.swapaxes(-1, -2)
        across -= self.slope[..., None] * self.slope[..., None, :]
        along = (bent @ self._along[..., None, :, None])[..., 0]
        self.bend = across / self._length[..., None] + along

    def slope_moved(self, lower: Array, upper: Array) -> Array:
        """(..., J, 6) rate of ``slope`` as the guides move at rates (..., J, 3) in their bones."""
        line = self._carried(upper) - lower
        beside = line - (line * self._along).sum(axis=-1, keepdims=True) * self._along
        turned = (self.moved @ (beside / self._length)[..., None])[..., 0]
        return self._on_line(self._moved(upper)) + turned

    def _carried(self, arm: Array) -> Array:
        """(..., J, 3) where the turned vertebra has what is at rest at ``arm``."""
        turned = np.einsum("jxy,jy->jx", self._turned.rotation, arm.reshape(-1, 3))
        return turned.reshape(arm.shape)

    def _moved(self, arm: Array) -> Array:
        """(..., J, 6, 3) derivative of that by the joint's angles."""
        turned = np.einsum("jaxy,jy->jax", self._turned.first, arm.reshape(-1, 3))
        moved = np.zeros((*arm.shape[:-1], 6, 3))
        moved[..., 3:, :] = turned.reshape(*arm.shape[:-1], 3, 3)
        return moved

    def _on_line(self, moved: Array) -> Array:
        return np.array((moved @ self._along[..., None])[..., 0], dtype=float)


class _Ends:
    """Guides of a vertebra and the one below (or ground, which is still), as the chain moves."""

    def __init__(self, motion: Motion, body: int, upper: Array, lower: Array) -> None:
        self._motion, self._body, self._upper, self._lower = motion, body, upper, lower
        line = motion.displacement(body - 1).apply(lower) - motion.displacement(body).apply(upper)
        self._length = float(np.linalg.norm(line))
        self.along = line / self._length
        self.closing = self._closing(upper, lower)

    def pull(self) -> AppliedLoad:
        """Of unit tension."""
        up = self._motion.wrench(self._body, self._upper, self.along, np.zeros(3))
        load, tangent = up.load, up.tangent
        if self._body > 0:
            back = self._motion.wrench(self._body - 1, self._lower, -self.along, np.zeros(3))
            load, tangent = load + back.load, tangent + back.tangent
        across = self.closing - np.outer(self.closing @ self.along, self.along)
        turned = across @ across.T / self._length  # the line turns with the pose
        return AppliedLoad(load, tangent - turned)

    def pull_moved(self, upper: Array, lower: Array) -> Array:
        """(n,) rate of the load of unit tension as the guides move at these rates."""
        motion, body = self._motion, self._body
        line = motion.displacement(body - 1).rotation @ lower
        line = line - motion.displacement(body).rotation @ upper
        beside = (line - (line @ self.along) * self.along) / self._length
        moved = self._closing(self._upper + upper, self._lower + lower) - self.closing
        return np.array(moved @ self.along + self.closing @ beside, dtype=float)

    def _closing(self, upper: Array, lower: Array) -> Array:
        """(n, 3) rate at which the upper guide nears the lower one."""
        closing = self._motion.velocities(self._body, upper)
        if self._body == 0:
            return closing
        return closing - self._motion.velocities(self._body - 1, lower)
