"""Facet contact: a stop that resists beyond a gap, to one side only."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from spinepipe.effects.carried_share import require
from spinepipe.effects.contract import Array, EffectKind, JointResponse, Parameter
from spinepipe.effects.registry import PER_JOINT, TriedValues, register
from spinepipe.effects.rounding import ramp
from spinepipe.facts import numbers
from spinepipe.units import COORDINATES, TRANSLATIONS

SIDES = ("positive", "negative")

ROUNDED_RAD, ROUNDED_M = 3.5e-3, 2e-5
"""Width to each side of the gap over which contact sets in: 0.2 deg, or 0.02 mm."""

_GAP, _STIFFNESS = numbers(__name__, "facet_gap"), numbers(__name__, "facet_stiffness")
"""deg or mm, and N m/rad or N/m."""

REFERENCE_RAD, REFERENCE_M = float(np.deg2rad(2.0)), 5e-4
"""How far beyond the gap the stop has the stated stiffness, whatever its exponent."""


@register("facet_contact")
@dataclass(frozen=True)
class FacetContact:
    """Adds ``side k over (over / reference)^(exponent - 1)`` on one coordinate; k of zero is off.

    ``over = ramp(side q - gap)`` is zero inside the gap and straight beyond; a parabola over
    0.2 deg (0.02 mm) to each side of the gap joins the two. An exponent of 1 is a linear stop, 1.5
    the contact of two curved faces (Hertz), and larger ones are near the exponentials that
    cartilage is given in rigid-body models. At the reference of 2 deg (0.5 mm) beyond the gap all
    of them have the stiffness k, as load over motion.
    """

    coordinate: str = "extension"
    side: str = "positive"
    name: ClassVar[str] = "facet_contact"
    kind: ClassVar[EffectKind] = EffectKind.JOINT_LAW
    per_joint: ClassVar[bool] = True
    trial: ClassVar[TriedValues] = TriedValues(
        variants=tuple({"coordinate": c, "side": s} for c in COORDINATES for s in SIDES),
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
        exponent = Parameter(
            "exponent",
            "1",
            1.0,
            4.0,
            1.25,
            0.3,
            True,
            "how the stop hardens: 1 linear, 1.5 two curved faces, more near an exponential",
            family=True,
            tried=(0.0,),
            unsaid=1.0,
        )
        size = _STIFFNESS[self.coordinate]
        if self.coordinate in TRANSLATIONS:
            gap = _GAP[self.coordinate] / 1e3
            return (
                Parameter("stiffness", "N/m", 0.0, 1e10, size, size, False, hard, off=0.0),
                Parameter("gap", "m", 0.0, 0.02, gap, 0.5 * gap, False, free),
                exponent,
            )
        gap = float(np.deg2rad(_GAP[self.coordinate]))
        return (
            Parameter("stiffness", "N m/rad", 0.0, 1e6, size, size, False, hard, off=0.0),
            Parameter("gap", "rad", 0.0, 0.5, gap, 0.5 * gap, False, free),
            exponent,
        )

    def respond(self, q: Array, parameters: Array, carried: Array) -> JointResponse:
        """Load (J, 6) and tangent (J, 6, 6) of the stop."""
        at, touch = self._at, self._contact(q, parameters)
        load, tangent = np.zeros_like(q), np.zeros((*q.shape, 6))
        load[:, at] = self._side * parameters[:, 0] * touch.value
        tangent[:, at, at] = parameters[:, 0] * touch.by_motion
        return JointResponse(load, tangent)

    def by_parameter(self, q: Array, parameters: Array, carried: Array) -> Array:
        """(J, 6, 3) by stiffness, gap and exponent."""
        at, side, touch = self._at, self._side, self._contact(q, parameters)
        derivative = np.zeros((*q.shape, 3))
        derivative[:, at, 0] = side * touch.value
        derivative[:, at, 1] = -side * parameters[:, 0] * touch.by_motion
        derivative[:, at, 2] = side * parameters[:, 0] * touch.by_exponent
        return derivative

    @property
    def _at(self) -> int:
        return COORDINATES.index(self.coordinate)

    @property
    def _side(self) -> float:
        return 1.0 if self.side == "positive" else -1.0

    def _contact(self, q: Array, parameters: Array) -> "_Contact":
        shift = self.coordinate in TRANSLATIONS
        width, reference = (ROUNDED_M, REFERENCE_M) if shift else (ROUNDED_RAD, REFERENCE_RAD)
        over, slope = ramp(self._side * q[:, self._at] - parameters[:, 1], width)
        power = parameters[:, 2] - 1.0
        log = np.log(np.maximum(over / reference, _LEAST))  # what is not over has no load
        hard = np.where(over > 0.0, np.exp(power * log), 0.0)
        return _Contact(over * hard, (1.0 + power) * hard * slope, over * hard * log)


@dataclass(frozen=True)
class _Contact:
    """Load (J,) of a stop of stiffness 1, by motion to its side and by the exponent."""

    value: Array
    by_motion: Array
    by_exponent: Array


_LEAST = 1e-150
