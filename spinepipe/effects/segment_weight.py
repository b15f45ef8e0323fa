"""Segment weight: weight of vertebrae or of a fixture that the model leaves out."""

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
from spinepipe.effects.vertebra_points import centres, nothing_applied

WHERE = ("each", "top")

WEIGHT_OF_1_KG = np.array([0.0, -9.81, 0.0])
"""N/kg, ground; the gravity of cohorts."""


@register("segment_weight")
@dataclass(frozen=True)
class SegmentWeight:
    """A weight of ``9.81 mass`` N along -y of ground on each vertebra in scope, or the top one.

    It acts at the centre of mass, or midway between its joints on a vertebra without a stated mass.
    One mass for all, off at 0.
    """

    where: str = "each"

    name: ClassVar[str] = "segment_weight"
    kind: ClassVar[Kind] = Kind.LOAD
    per_joint: ClassVar[bool] = False
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(
            name="mass",
            unit="kg",
            low=0.0,
            high=50.0,
            default=1.0,
            prior_scale=1.0,
            logarithmic=False,
            meaning="mass left out at each place",
            off=0.0,
        ),
    )
    trial: ClassVar[Trial] = Trial(
        variants=({"where": "each"}, {"where": "top"}),
        spreads=(Spread.SHARED, Spread.BY_SPECIMEN),
        told_by="postures or motions large enough that the weight's arm changes, "
        "or an unloaded reading against the weightless pose",
    )

    def __post_init__(self) -> None:
        if self.where not in WHERE:
            raise ValueError(f"segment_weight: where {self.where!r}; allowed: {', '.join(WHERE)}")

    def apply(
        self, motion: Motion, wrenches: tuple[Wrench, ...], joints: Indices, parameters: Array
    ) -> AppliedLoad:
        """Weights of the mass and their tangent."""
        one = self._of_1_kg(motion, joints)
        return AppliedLoad(parameters[0, 0] * one.load, parameters[0, 0] * one.tangent)

    def by_parameter(
        self, motion: Motion, wrenches: tuple[Wrench, ...], joints: Indices, parameters: Array
    ) -> Array:
        """(n, 1, 1): the weights are linear in the mass."""
        return self._of_1_kg(motion, joints).load[:, None, None]

    def _of_1_kg(self, motion: Motion, joints: Indices) -> AppliedLoad:
        load, tangent = nothing_applied(motion)
        points = centres(motion)
        for body in joints if self.where == "each" else [joints.max()]:
            one = motion.wrench(int(body), points[body], WEIGHT_OF_1_KG, np.zeros(3))
            load, tangent = load + one.load, tangent + one.tangent
        return AppliedLoad(load, tangent)
