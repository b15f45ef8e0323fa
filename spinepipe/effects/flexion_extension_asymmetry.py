"""Asymmetry: a joint resists more to one side than to the other."""

from dataclasses import dataclass
from typing import ClassVar

from spinepipe.effects.carried_share import CarriedFraction, CarriedShare, require
from spinepipe.effects.contract import Array, EffectKind, Parameter
from spinepipe.effects.registry import PER_JOINT, TriedValues, register
from spinepipe.effects.rounding import sign
from spinepipe.units import COORDINATES, TRANSLATIONS

ROUNDED_RAD, ROUNDED_M = 1.7e-3, 1e-5
"""Width of the smooth sign: 0.1 deg, or 0.01 mm."""


@register("flexion_extension_asymmetry")
@dataclass(frozen=True)
class FlexionExtensionAsymmetry(CarriedShare):
    """Adds ``asymmetry carried tanh(q / width)`` on one coordinate; zero is off.

    Stiffness is ``1 + asymmetry`` times what it was for positive q and ``1 - asymmetry`` times for
    negative q; the width of 0.1 deg (0.01 mm) makes the change smooth. Lumbar joints move about
    1.5 times as far in flexion as in extension under the same moment (Yamamoto 1989,
    Spine 14:1256), an asymmetry of 0.2 in extension.
    """

    coordinate: str = "extension"
    name: ClassVar[str] = "flexion_extension_asymmetry"
    kind: ClassVar[EffectKind] = EffectKind.JOINT_LAW
    per_joint: ClassVar[bool] = True
    trial: ClassVar[TriedValues] = TriedValues(
        variants=tuple({"coordinate": c} for c in COORDINATES),
        spreads=PER_JOINT,
        told_by="the same load in both directions",
    )

    def __post_init__(self) -> None:
        require(self.name, "coordinate", self.coordinate, COORDINATES)

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """The asymmetry alone."""
        meaning = f"stiffness gained for positive and lost for negative {self.coordinate}"
        return (Parameter("asymmetry", "1", -0.9, 0.9, 0.2, 0.2, False, meaning, off=0.0),)

    def share(self, q: Array, parameters: Array) -> CarriedFraction:
        """``asymmetry * tanh(q / width)``."""
        width = ROUNDED_M if self.coordinate in TRANSLATIONS else ROUNDED_RAD
        side, slope = sign(q, width)
        return CarriedFraction(parameters * side, parameters * slope, side[:, :, None])
