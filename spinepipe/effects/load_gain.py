"""Load gain: all applied forces and moments are larger than listed, by one factor."""

from dataclasses import dataclass
from typing import ClassVar

from spinepipe.effects.contract import Array, EffectKind, Indices, Neutral, Parameter
from spinepipe.effects.dead_load import DeadLoad, Wrenches, WrenchSlopes
from spinepipe.effects.registry import register


@register("load_gain")
@dataclass(frozen=True)
class LoadGain(DeadLoad):
    """Listed forces and moments act ``1 + gain`` times; weight and other load effects as they are.

    Off at 0. A small imperfection that real cohorts have, not itself looked for.
    """

    name: ClassVar[str] = "load_gain"
    kind: ClassVar[EffectKind] = EffectKind.LOAD
    per_joint: ClassVar[bool] = False
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(
            name="gain",
            unit="1",
            low=-0.5,
            high=0.5,
            default=0.02,
            prior_scale=0.02,
            logarithmic=False,
            meaning="share by which the load exceeds the listed one",
            off=0.0,
        ),
    )

    def wrenches(
        self, listed: Wrenches, neutral: Neutral, joints: Indices, parameters: Array
    ) -> Wrenches:
        """The gained share of the listed wrenches."""
        gain = parameters[..., None]
        return Wrenches(listed.bodies, listed.points, gain * listed.forces, gain * listed.moments)

    def slopes(
        self, listed: Wrenches, neutral: Neutral, joints: Indices, parameters: Array
    ) -> WrenchSlopes:
        """Linear in the gain."""
        return WrenchSlopes(listed.forces[..., None], listed.moments[..., None])
