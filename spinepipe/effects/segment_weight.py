"""Segment weight: weight of vertebrae or of a fixture that the model leaves out."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from spinepipe.effects.contract import Array, EffectKind, Indices, Neutral, Parameter
from spinepipe.effects.dead_load import DeadLoad, Wrenches, WrenchSlopes, centres
from spinepipe.effects.registry import PlaceSpread, TriedValues, register
from spinepipe.units import STANDARD_GRAVITY

WHERE = ("each", "top")


@register("segment_weight")
@dataclass(frozen=True)
class SegmentWeight(DeadLoad):
    """A weight of ``9.81 mass`` N along -y of ground on each vertebra in scope, or the top one.

    It acts at the centre of mass, or midway between its joints on a vertebra without a stated mass.
    One mass for all, off at 0.
    """

    where: str = "each"

    name: ClassVar[str] = "segment_weight"
    kind: ClassVar[EffectKind] = EffectKind.LOAD
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
    trial: ClassVar[TriedValues] = TriedValues(
        variants=({"where": "each"}, {"where": "top"}),
        spreads=(PlaceSpread.SHARED, PlaceSpread.BY_SPECIMEN),
        told_by="postures or motions large enough that the weight's arm changes, "
        "or an unloaded reading against the weightless pose",
    )

    def __post_init__(self) -> None:
        if self.where not in WHERE:
            raise ValueError(f"segment_weight: where {self.where!r}; allowed: {', '.join(WHERE)}")

    def wrenches(
        self, listed: Wrenches, neutral: Neutral, joints: Indices, parameters: Array
    ) -> Wrenches:
        """Weights of the mass."""
        bodies = self._bodies(joints)
        points = centres(neutral)[..., bodies, :]
        forces = np.broadcast_to(parameters[..., None] * STANDARD_GRAVITY, points.shape)
        every = np.broadcast_to(bodies, points.shape[:-1])
        return Wrenches(every, points, forces, np.zeros(points.shape))

    def slopes(
        self, listed: Wrenches, neutral: Neutral, joints: Indices, parameters: Array
    ) -> WrenchSlopes:
        """Linear in the mass."""
        shape = (*parameters.shape[:-1], len(self._bodies(joints)), 3, 1)
        return WrenchSlopes(np.broadcast_to(STANDARD_GRAVITY[:, None], shape), np.zeros(shape))

    def _bodies(self, joints: Indices) -> Indices:
        """The vertebrae that it acts on."""
        return joints if self.where == "each" else joints.max(keepdims=True)
