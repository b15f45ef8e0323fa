"""Level dependence: levels differ in stiffness where the model gives all of them the same."""

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


@register("level_dependence")
@dataclass(frozen=True)
class LevelDependence(CarriedShare):
    """Multiplies the carried load of one coordinate, all rotations or all by ``ratio``; 1 is off.

    Levels T12L1 to L5S1 of Gould 2024b (Table 2) differ by a factor of two to six: the logarithm
    has an SD of 0.45 in extension, 0.7 in bending and 0.4 in rotation.
    """

    coordinate: str = "extension"
    name: ClassVar[str] = "level_dependence"
    kind: ClassVar[EffectKind] = EffectKind.JOINT_LAW
    per_joint: ClassVar[bool] = True
    straight_over: ClassVar[float] = np.inf
    trial: ClassVar[TriedValues] = TriedValues(
        variants=tuple({"coordinate": c} for c in (*COORDINATES, ALL_ROTATIONS, ALL)),
        spreads=(PlaceSpread.BY_JOINT,),
        told_by="motion of every level, with a base that gives all levels the same stiffness",
    )

    def __post_init__(self) -> None:
        require(self.name, "coordinate", self.coordinate, (*COORDINATES, ALL_ROTATIONS, ALL))

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """The ratio alone."""
        meaning = f"stiffness of this level in {self.coordinate} over the model's"
        return (Parameter("ratio", "1", 0.01, 100.0, 1.3, 0.5, True, meaning, off=1.0),)

    def share(self, q: Array, parameters: Array) -> CarriedFraction:
        """``ratio - 1``, wherever the joint is."""
        value = np.broadcast_to(parameters - 1.0, q.shape)
        return CarriedFraction(value, np.zeros_like(q), np.ones((*q.shape, 1)))
