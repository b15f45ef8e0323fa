"""Load gain: all applied forces and moments are larger than listed, by one factor."""

from dataclasses import dataclass
from typing import ClassVar

from spinepipe.effects.contract import (
    AppliedLoad,
    Array,
    Indices,
    Kind,
    Motion,
    Parameter,
    Wrench,
)
from spinepipe.effects.registry import register
from spinepipe.effects.vertebra_points import nothing_applied


@register("load_gain")
@dataclass(frozen=True)
class LoadGain:
    """Listed forces and moments act ``1 + gain`` times; weight and other load effects as they are.

    Off at 0. A small imperfection that real cohorts have, not itself looked for.
    """

    name: ClassVar[str] = "load_gain"
    kind: ClassVar[Kind] = Kind.LOAD
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

    def apply(
        self, motion: Motion, wrenches: tuple[Wrench, ...], joints: Indices, parameters: Array
    ) -> AppliedLoad:
        """The gained share of the listed wrenches, and its tangent."""
        listed = _listed(motion, wrenches)
        return AppliedLoad(parameters[0, 0] * listed.load, parameters[0, 0] * listed.tangent)

    def by_parameter(
        self, motion: Motion, wrenches: tuple[Wrench, ...], joints: Indices, parameters: Array
    ) -> Array:
        """(n, 1, 1): linear in the gain."""
        return _listed(motion, wrenches).load[:, None, None]


def _listed(motion: Motion, wrenches: tuple[Wrench, ...]) -> AppliedLoad:
    load, tangent = nothing_applied(motion)
    for listed in wrenches:
        one = motion.wrench(listed.body, listed.point, listed.force, listed.moment)
        load, tangent = load + one.load, tangent + one.tangent
    return AppliedLoad(load, tangent)
