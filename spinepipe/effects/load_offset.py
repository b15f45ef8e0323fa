"""Load offset: a constant moment on the top vertebra that is not listed (sensor bias, cable)."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from spinepipe.effects.contract import Array, Indices, Kind, Neutral, Parameter
from spinepipe.effects.dead_load import DeadLoad, Wrenches, WrenchSlopes
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
class LoadOffset(DeadLoad):
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

    def wrenches(
        self, listed: Wrenches, neutral: Neutral, joints: Indices, parameters: Array
    ) -> Wrenches:
        """The moment on the most cranial vertebra."""
        moments = parameters[..., None, :]
        bodies = np.full(moments.shape[:-1], int(joints.max()))
        return Wrenches(bodies, np.zeros(moments.shape), np.zeros(moments.shape), moments)

    def slopes(
        self, listed: Wrenches, neutral: Neutral, joints: Indices, parameters: Array
    ) -> WrenchSlopes:
        """The moment itself is what the parameters are."""
        shape = (*parameters.shape[:-1], 1, 3, 3)
        return WrenchSlopes(np.zeros(shape), np.broadcast_to(np.eye(3), shape))
