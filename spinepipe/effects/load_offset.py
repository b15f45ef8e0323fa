"""Load offset: a constant moment on the top vertebra that is not listed (sensor bias, cable)."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from spinepipe.effects.contract import (
    AppliedLoad,
    Array,
    Indices,
    Kind,
    Motion,
    Parameter,
    Wrench,
)
from spinepipe.effects.registry import Spread, Trial, register

TYPICAL_NM = 0.3


def _moment(axis: str) -> Parameter:
    return Parameter(
        name=f"moment_{axis}",
        unit="N m",
        low=-10.0,
        high=10.0,
        default=TYPICAL_NM,
        prior_scale=TYPICAL_NM,
        logarithmic=False,
        meaning=f"extra moment about {axis} of ground",
        off=0.0,
    )


@register("load_offset")
@dataclass(frozen=True)
class LoadOffset:
    """A moment fixed in ground on the most cranial vertebra in scope, in every step; off at 0.

    It acts in unloaded steps too: all motion is from the pose without it.
    """

    name: ClassVar[str] = "load_offset"
    kind: ClassVar[Kind] = Kind.LOAD
    per_joint: ClassVar[bool] = False
    parameters: ClassVar[tuple[Parameter, ...]] = tuple(map(_moment, "xyz"))
    trial: ClassVar[Trial] = Trial(
        variants=({},),
        spreads=(Spread.SHARED, Spread.BY_SPECIMEN, Spread.BY_TEST),
        told_by="readings not zeroed at the unloaded step; if zeroed, a joint that is not linear, "
        "or loads large enough to turn the vertebrae in the moment",
    )

    def apply(
        self, motion: Motion, wrenches: tuple[Wrench, ...], joints: Indices, parameters: Array
    ) -> AppliedLoad:
        """Load of the moment and its tangent."""
        return motion.wrench(int(joints.max()), np.zeros(3), np.zeros(3), parameters[0])

    def by_parameter(
        self, motion: Motion, wrenches: tuple[Wrench, ...], joints: Indices, parameters: Array
    ) -> Array:
        """(n, 1, 3): angular velocity of the vertebra about each ground axis."""
        return motion.angular(int(joints.max()))[:, None, :]
