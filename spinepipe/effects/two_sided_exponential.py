"""Two-sided exponential: resistance grows on each side at a rate of its own."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from spinepipe.effects.carried_share import require
from spinepipe.effects.contract import Array, EffectKind, JointResponse, Parameter
from spinepipe.effects.nonlinear_stiffening import exponential_rise
from spinepipe.effects.registry import register
from spinepipe.effects.rounding import STRAIGHT
from spinepipe.units import COORDINATES, TRANSLATIONS

# A lumbar joint: 27 N m/rad at rest, 103 in flexion and 149 in extension at 7.5 N m (see
# `spinepipe/motion/passive.csv`); translations of some 100 N/mm that hardly stiffen.
_STIFFNESS, _RATE = 27.0, 10.0
_STIFFNESS_N_PER_M, _RATE_PER_M = 1e5, 100.0


@register("two_sided_exponential")
@dataclass(frozen=True)
class TwoSidedExponential:
    """Adds ``A+ (exp(B+ q) - 1)`` for positive q, ``-A- (exp(-B- q) - 1)`` for negative q.

    The slope at zero is the same on both sides, so A+ = k / B+ and A- = k / B- with the stiffness
    k at rest; k = 0 is off, B = 0 is a spring on that side. The law goes on straight beyond
    B |q| = 5. Wang 2021 eq. 3, ``A (exp(B q) - 1)``, on each side
    (DOI 10.1007/s10439-021-02774-3).
    """

    coordinate: str = "extension"
    name: ClassVar[str] = "two_sided_exponential"
    kind: ClassVar[EffectKind] = EffectKind.JOINT_LAW
    per_joint: ClassVar[bool] = True

    def __post_init__(self) -> None:
        require(self.name, "coordinate", self.coordinate, COORDINATES)

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """The stiffness at rest, and the rates of both sides."""
        shift = self.coordinate in TRANSLATIONS
        size, rate = (_STIFFNESS_N_PER_M, _RATE_PER_M) if shift else (_STIFFNESS, _RATE)
        unit, per, most = ("N/m", "1/m", 1e5) if shift else ("N m/rad", "1/rad", 1e3)
        rest = f"stiffness in {self.coordinate} at zero"
        rises = [f"how fast it grows with {side} {self.coordinate}" for side in _SIDES]
        return (
            Parameter("stiffness", unit, 0.0, 1e9, size, size, False, rest, off=0.0),
            *(
                Parameter(f"{side}_rate", per, 0.0, most, rate, rate, False, rise)
                for side, rise in zip(_SIDES, rises, strict=True)
            ),
        )

    def respond(self, q: Array, parameters: Array, carried: Array) -> JointResponse:
        """Load (J, 6) and tangent (J, 6, 6)."""
        at = COORDINATES.index(self.coordinate)
        load, tangent = np.zeros_like(q), np.zeros((*q.shape, 6))
        stiffness, rates = parameters[:, 0], parameters[:, 1:]
        along = q[:, at]
        v = _rate(along, rates) * np.abs(along)
        rise, slope = exponential_rise(v, STRAIGHT)
        load[:, at] = stiffness * along * (1.0 + rise)
        tangent[:, at, at] = stiffness * (1.0 + rise + v * slope)
        return JointResponse(load, tangent)

    def by_parameter(self, q: Array, parameters: Array, carried: Array) -> Array:
        """(J, 6, 3) by the stiffness and the two rates."""
        at = COORDINATES.index(self.coordinate)
        derivative = np.zeros((*q.shape, 3))
        stiffness, rates = parameters[:, 0], parameters[:, 1:]
        along = q[:, at]
        rise, slope = exponential_rise(_rate(along, rates) * np.abs(along), STRAIGHT)
        by_rate = stiffness * along * np.abs(along) * slope
        positive = along >= 0.0
        derivative[:, at, 0] = along * (1.0 + rise)
        derivative[:, at, 1] = np.where(positive, by_rate, 0.0)
        derivative[:, at, 2] = np.where(positive, 0.0, by_rate)
        return derivative


_SIDES = ("positive", "negative")


def _rate(q: Array, rates: Array) -> Array:
    """(J,) rate of the side that each q is on."""
    return np.where(q >= 0.0, rates[:, 0], rates[:, 1])
