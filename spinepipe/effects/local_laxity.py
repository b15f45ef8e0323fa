"""Local laxity: one joint has lost part of its stiffness."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from spinepipe.effects.carried_share import (
    ALL,
    ALL_ROTATIONS,
    CarriedFraction,
    CarriedShare,
    require,
)
from spinepipe.effects.contract import Array, EffectKind, Parameter
from spinepipe.effects.registry import PlaceSpread, TriedValues, register
from spinepipe.units import COORDINATES


@register("local_laxity")
@dataclass(frozen=True)
class LocalLaxity(CarriedShare):
    """Takes ``fraction`` of the carried load of one coordinate, all rotations or all; 0 is off.

    A cut ligament or a degenerate disc of one joint of one specimen, of any size up to the loss
    of nearly all resistance.
    """

    coordinate: str = "extension"
    name: ClassVar[str] = "local_laxity"
    kind: ClassVar[EffectKind] = EffectKind.JOINT_LAW
    per_joint: ClassVar[bool] = True
    straight_over: ClassVar[float] = np.inf
    trial: ClassVar[TriedValues] = TriedValues(
        variants=tuple({"coordinate": c} for c in (*COORDINATES, ALL_ROTATIONS, ALL)),
        spreads=(PlaceSpread.ONE,),
        told_by="motion of every level of several specimens, with a base that shares stiffness",
    )

    def __post_init__(self) -> None:
        require(self.name, "coordinate", self.coordinate, (*COORDINATES, ALL_ROTATIONS, ALL))

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """The fraction alone."""
        meaning = f"part of the stiffness in {self.coordinate} that is lost"
        return (Parameter("fraction", "1", 0.0, 0.95, 0.3, 0.3, False, meaning, off=0.0),)

    def share(self, q: Array, parameters: Array) -> CarriedFraction:
        """``-fraction``, wherever the joint is."""
        value = np.broadcast_to(-parameters, q.shape)
        return CarriedFraction(value, np.zeros_like(q), -np.ones((*q.shape, 1)))
