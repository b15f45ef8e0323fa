"""Nonlinear stiffening: resistance grows with how far the joint has moved."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.polynomial.polynomial import polyval

from spinepipe.effects.carried_share import CarriedFraction, CarriedShare, require
from spinepipe.effects.contract import Array, EffectKind, Parameter
from spinepipe.effects.registry import PER_JOINT, TriedValues, register
from spinepipe.effects.rounding import magnitude, ramp
from spinepipe.facts import several
from spinepipe.units import COORDINATES, TRANSLATIONS

SHAPES = ("exponential", "tangent", "cubic", "bilinear")

STEEPEST_EXPONENT = 10.0
"""Exponent beyond which the exponential goes on straight: 22,000 times the stiffness at zero."""

STEEPEST_ANGLE = 1.4
"""Argument of the tangent beyond which it goes on straight, short of the pole at 1.57."""

ROUNDED_RAD, ROUNDED_M = 1e-4, 1e-6
"""Width over which the exponential's |q| is rounded, for laws that carry load at zero."""

ROUNDED = 0.1
"""Share of the break, to each side of it, over which the corner of the bilinear law is rounded."""

# Taylor series about 0 of (exp(v) - 1) / v and of tan(x) / x in v = x^2, from the term in v on,
# and of their derivatives; exact to rounding below the limit.
_EXPONENTIAL = (1 / 2, 1 / 6, 1 / 24, 1 / 120)
_EXPONENTIAL_SLOPE = (1 / 2, 1 / 3, 1 / 8, 1 / 30, 1 / 144)
_TANGENT = (1 / 3, 2 / 15, 17 / 315, 62 / 2835, 1382 / 155925)
_TANGENT_SLOPE = (1 / 3, 4 / 15, 17 / 105, 248 / 2835, 1382 / 31185)
_NEAR_ZERO = 1e-3

# Size of the effect in lumbar joints. Exponential: half a decade more stiffness at 7 deg.
# Tangent: Jalalian puts the pole at 1.2 times the range of motion, here 8.5 deg: 1.57 / 0.18 rad.
# Cubic: twice the resistance at 8 deg. Translations: 1.5 times the resistance at 1 to 2 mm.
_RISE = {
    "exponential": (10.0, 100.0, "1/rad"),
    "tangent": (75.0, 5e3, "1/rad^2"),
    "cubic": (50.0, 1e5, "1/rad^2"),
}
_RISE_OF_TRANSLATION = {
    "exponential": (5e2, 5e4, "1/m"),
    "tangent": (5e5, 5e9, "1/m^2"),
    "cubic": (2e5, 1e10, "1/m^2"),
}

_BREAK = several(__name__, "stiffening_break")
"""deg or mm, the usual break and the least that is one."""

_MOST_RAD, _MOST_M = 0.5, 0.03


@register("nonlinear_stiffening")
@dataclass(frozen=True)
class NonlinearStiffening(CarriedShare):
    """Scales the carried load of one coordinate, so that a linear spring k becomes

    - exponential: ``k sign(q) (exp(b |q|) - 1) / b``, rate b; straight on beyond b |q| = 10;
    - tangent: ``k tan(sqrt(g) q) / sqrt(g)``, growth g; straight on beyond sqrt(g) |q| = 1.4;
    - cubic: ``k q (1 + g q^2)``, growth g;
    - bilinear: ``k q`` up to the break, with a slope of ``(1 + gain) k`` beyond; the corner is
      rounded over a tenth of the break to each side.

    Zero is off. A bilinear law and a corner of a neutral zone are one curve: it has the one name
    where it breaks late, the other within about twice the usual zone. Exponential: Wang 2021 eq. 3,
    ``A (exp(B q) - 1)`` with B = b, A = k / b, here the same on both sides (DOI
    10.1007/s10439-021-02774-3). Tangent: Jalalian 2017 eq. 1, ``A (tan(B r + C) + D)`` with
    B = sqrt(g), A = k / B and equal ranges of motion, C = D = 0 (DOI 10.1007/s11517-016-1576-8).
    """

    coordinate: str = "extension"
    shape: str = "exponential"
    name: ClassVar[str] = "nonlinear_stiffening"
    kind: ClassVar[EffectKind] = EffectKind.JOINT_LAW
    per_joint: ClassVar[bool] = True
    trial: ClassVar[TriedValues] = TriedValues(
        variants=tuple({"coordinate": c, "shape": s} for c in COORDINATES for s in SHAPES),
        spreads=PER_JOINT,
        told_by="several load steps up to a large motion, in both directions",
    )

    def __post_init__(self) -> None:
        require(self.name, "coordinate", self.coordinate, COORDINATES)
        require(self.name, "shape", self.shape, SHAPES)

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """The rate of the exponential, the growth of other shapes, or the gain and its break."""
        if self.shape == "bilinear":
            gained = f"stiffness in {self.coordinate} gained beyond the break, as a share"
            gain = Parameter("gain", "1", 0.0, 1e4, 1.0, 1.0, False, gained, off=0.0)
            where, tried = f"motion in {self.coordinate} at which it stiffens", (-1.0, 1.0)
            if self.coordinate in TRANSLATIONS:
                unit, most = "m", _MOST_M
                at, low = (mm / 1e3 for mm in _BREAK[self.coordinate])
            else:
                unit, most = "rad", _MOST_RAD
                at, low = (float(np.deg2rad(deg)) for deg in _BREAK[self.coordinate])
            return gain, Parameter("break_at", unit, low, most, at, 0.4, True, where, tried=tried)
        sizes = _RISE_OF_TRANSLATION if self.coordinate in TRANSLATIONS else _RISE
        size, most, unit = sizes[self.shape]
        name = "rate" if self.shape == "exponential" else "growth"
        meaning = f"how fast resistance in {self.coordinate} grows with the motion"
        return (Parameter(name, unit, 0.0, most, size, size, False, meaning, off=0.0),)

    def share(self, q: Array, parameters: Array) -> CarriedFraction:
        """``factor(strength * size(q)) - 1`` with size |q| or q^2; of the bilinear, its own."""
        if self.shape == "bilinear":
            return _beyond(q, parameters[:, :1], parameters[:, 1:])
        size, by_q = q**2, 2.0 * q
        if self.shape == "exponential":
            rounded = ROUNDED_M if self.coordinate in TRANSLATIONS else ROUNDED_RAD
            size, by_q = magnitude(q, rounded)
        value, slope = _SHARES[self.shape](parameters * size)
        return CarriedFraction(value, slope * parameters * by_q, (slope * size)[:, :, None])


def exponential_rise(v: Array, steepest: float = STEEPEST_EXPONENT) -> tuple[Array, Array]:
    """``(exp(v) - 1) / v - 1`` and its derivative by v; the exponential goes on straight."""
    at, beyond = np.minimum(v, steepest), np.maximum(v - steepest, 0.0)
    slope = np.exp(at)
    near = np.abs(v) < _NEAR_ZERO
    safe = np.where(near, 1.0, v)
    mean = (np.expm1(at) + beyond * slope) / safe
    value, by_v = mean - 1.0, (slope - mean) / safe
    if near.any():
        few = v[near]
        value[near] = few * polyval(few, _EXPONENTIAL)
        by_v[near] = polyval(few, _EXPONENTIAL_SLOPE)
    return value, by_v


def _tangent(v: Array) -> tuple[Array, Array]:
    """``tan(x) / x - 1`` and its derivative by v = x^2."""
    near = v < _NEAR_ZERO
    x = np.sqrt(np.where(near, 1.0, v))
    at, beyond = np.minimum(x, STEEPEST_ANGLE), np.maximum(x - STEEPEST_ANGLE, 0.0)
    slope = 1.0 / np.cos(at) ** 2
    ratio = (np.tan(at) + beyond * slope) / x
    value = np.where(near, v * polyval(v, _TANGENT), ratio - 1.0)
    by_v = np.where(near, polyval(v, _TANGENT_SLOPE), (slope - ratio) / (2.0 * x**2))
    return value, by_v


def _beyond(q: Array, gain: Array, at: Array) -> CarriedFraction:
    """``gain (|q| - break) / |q|`` beyond the break, by gain and break."""
    u = np.abs(q) / at
    over, slope = ramp(u - 1.0, ROUNDED)
    safe = np.maximum(u, 1.0 - ROUNDED)  # nothing is over nearer to zero
    value, by_u = over / safe, (slope - over / safe) / safe
    columns = [value, -gain * by_u * u / at]
    return CarriedFraction(gain * value, gain * by_u * np.sign(q) / at, np.stack(columns, axis=2))


_SHARES: dict[str, Callable[[Array], tuple[Array, Array]]] = {
    "exponential": exponential_rise,
    "tangent": _tangent,
    "cubic": lambda v: (v, np.ones_like(v)),
}
