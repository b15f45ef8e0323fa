"""Facet contact: a stop that resists beyond a gap, to one side only."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from spinepipe.effects.carried_share import require
from spinepipe.effects.contract import Array, JointResponse, Kind, Parameter
from spinepipe.effects.registry import PER_JOINT, Trial, register
from spinepipe.effects.rounding import ramp
from spinepipe.units import COORDINATES, ROTATIONS, TRANSLATIONS

SIDES = ("positive", "negative")

ROUNDED_RAD, ROUNDED_M = 3.5e-3, 2e-5
"""Width to each side of the gap over which contact sets in: 0.2 deg, or 0.02 mm."""

# Gap (deg) and stiffness (N m/rad). Facets stop axial rotation within 1 to 2 deg (Adams and
# Hutton 1981, Spine 6:241); stiffness as large as that of the joint itself (Gould 2024b Table 2).
_STOPS = {"extension": (2.0, 50.0), "right_bending": (2.0, 70.0), "left_rotation": (1.0, 290.0)}


@register("facet_contact")
@dataclass(frozen=True)
class FacetContact:
    """Adds ``side k ramp(side q - gap)`` on one coordinate; a stiffness k of zero is off.

    The ramp is zero inside the gap and straight beyond; a parabola over 0.2 deg (0.02 mm) to each
    side of the gap joins the two.
    """

    coordinate: str = "extension"
    side: str = "positive"
    name: ClassVar[str] = "facet_contact"
    kind: ClassVar[Kind] = Kind.JOINT_LAW
    per_joint: ClassVar[bool] = True
    trial: ClassVar[Trial] = Trial(
        variants=tuple({"coordinate": c, "side": s} for c in ROTATIONS for s in SIDES),
        spreads=PER_JOINT,
        told_by="several load steps beyond the gap and within it, in both directions",
    )

    def __post_init__(self) -> None:
        require(self.name, "coordinate", self.coordinate, COORDINATES)
        require(self.name, "side", self.side, SIDES)

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """The stop's stiffness, and the gap before it."""
        which = f"the stop to the {self.side} side of {self.coordinate}"
        hard, free = f"stiffness of {which}", f"motion before {which}"
        if self.coordinate in TRANSLATIONS:
            return (
                Parameter("stiffness", "N/m", 0.0, 1e10, 1e5, 1e5, False, hard, off=0.0),
                Parameter("gap", "m", 0.0, 0.02, 5e-4, 5e-4, False, free),
            )
        gap_deg, size = _STOPS[self.coordinate]
        gap = float(np.deg2rad(gap_deg))
        return (
            Parameter("stiffness", "N m/rad", 0.0, 1e6, size, size, False, hard, off=0.0),
            Parameter("gap", "rad", 0.0, 0.5, gap, 0.5 * gap, False, free),
        )

    def respond(self, q: Array, parameters: Array, carried: Array) -> JointResponse:
        """Load (J, 6) and tangent (J, 6, 6) of the stop."""
        at, side, over, slope = self._contact(q, parameters)
        load, tangent = np.zeros_like(q), np.zeros((*q.shape, 6))
        load[:, at] = side * parameters[:, 0] * over
        tangent[:, at, at] = parameters[:, 0] * slope
        return JointResponse(load, tangent)

    def by_parameter(self, q: Array, parameters: Array, carried: Array) -> Array:
        """(J, 6, 2) by stiffness and gap."""
        at, side, over, slope = self._contact(q, parameters)
        derivative = np.zeros((*q.shape, 2))
        derivative[:, at, 0] = side * over
        derivative[:, at, 1] = -side * parameters[:, 0] * slope
        return derivative

    def _contact(self, q: Array, parameters: Array) -> tuple[int, float, Array, Array]:
        """Column, direction of the stop, how far beyond the gap (J,) and its slope (J,)."""
        at, side = COORDINATES.index(self.coordinate), 1.0 if self.side == "positive" else -1.0
        width = ROUNDED_M if self.coordinate in TRANSLATIONS else ROUNDED_RAD
        return at, side, *ramp(side * q[:, at] - parameters[:, 1], width)
