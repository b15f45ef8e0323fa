"""Fitted parameters as the field gives them: N/mm, N m/°, ratios of two sides, doubling distances.

Results keep the parameters of the laws. What 17.7 1/rad² means nobody sees; that stiffness has
doubled at 10.7° everybody does.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from math import inf, isfinite, log, pi, sqrt
from typing import Any

from spinepipe.report.conclusions import Value
from spinepipe.report.words import plain
from spinepipe.studies.discrepancy.verdict import Estimate, Missing
from spinepipe.studies.discrepancy.words import ASYMMETRY, TOWARDS
from spinepipe.units import DEG_PER_RAD, MM_PER_M

DOUBLING = "motion that doubles the stiffness"
STIFFENING, PRELOAD = "nonlinear_stiffening", "preload_stiffening"

UNITS: Mapping[str, tuple[str, float]] = {
    "1": ("", 1.0),
    "deg": ("°", 1.0),
    "mm/deg": ("mm/°", 1.0),
    "N m/deg": ("N m/°", 1.0),
    "N/m": ("N/mm", 1.0 / MM_PER_M),
    "N m/rad": ("N m/°", 1.0 / DEG_PER_RAD),
    "N/rad": ("N/°", 1.0 / DEG_PER_RAD),
    "1/m": ("1/mm", 1.0 / MM_PER_M),
    "1/m^2": ("1/mm²", MM_PER_M**-2.0),
    "1/rad": ("1/°", 1.0 / DEG_PER_RAD),
    "1/rad^2": ("1/°²", DEG_PER_RAD**-2.0),
}
"""Unit of results to that of the page, and the factor."""

_NAMES = {
    ("neutral_zone", "width"): "half width",
    ("hysteresis", "moment"): "half loop height",
    ("hysteresis", "force"): "half loop height",
}


@dataclass(frozen=True)
class Quantity:
    """A parameter to be read.

    Attributes
    ----------
    place : joint, specimen or test it is of; empty where it is of all.
    value : with its 95 % interval, an end that is open left out; None where it has no number.
    at_bound : whether the fit ended at a bound, so that it says no more than that.
    """

    name: str
    place: str
    value: Value | None
    at_bound: bool = False

    @property
    def identifiable(self) -> bool:
        """Whether the data bound it on both sides."""
        ends = self.value is not None and None not in (self.value.low, self.value.high)
        return ends and not self.at_bound


@dataclass(frozen=True)
class _Way:
    """What a parameter is told as: a name, a unit, and the value there; it rises, or it falls."""

    name: str
    unit: str
    of: Callable[[float], float]
    falls: bool = False

    def told(self, one: Estimate) -> Value | None:
        value, told = (
            self.of(one.value),
            [None if end is None else self.of(end) for end in one.ci95],
        )
        low, high = (end if end is not None and isfinite(end) else None for end in told)
        low, high = (high, low) if self.falls else (low, high)
        how = "verdict: effects, by profile likelihood"
        return Value(value, self.unit, low, high, source=how) if isfinite(value) else None


def quantities(effect: Missing) -> list[Quantity]:
    """The parameters of an effect as they are read; results write ``width@L4L5@s01``."""
    found = []
    for one in effect.parameters:
        name, *place = one.name.split("@")
        way = _way(effect.name, effect.variant, name, one.unit)
        where = ", ".join(map(plain, place))
        found.append(Quantity(way.name, where, way.told(one), one.at_bound))
    return found


def _way(effect: str, variant: Mapping[str, Any], name: str, unit: str) -> _Way:
    doubling = _doubling(variant.get("shape"), unit) if effect == STIFFENING else None
    if doubling is not None:
        return doubling
    if effect == ASYMMETRY and name == "asymmetry" and variant.get("coordinate") in TOWARDS:
        positive, negative = TOWARDS[variant["coordinate"]]
        return _Way(f"stiffness in {positive} over that in {negative}", "", _ratio)
    if effect == STIFFENING and name == "gain":
        return _Way("stiffness beyond the break over that within", "", lambda gain: 1.0 + gain)
    if effect == PRELOAD and unit == "1/N":
        return _Way("stiffness gained by compression", "% per 100 N", lambda rise: 1e4 * rise)
    printed, factor = UNITS.get(unit, (unit, 1.0))
    return _Way(_NAMES.get((effect, name), plain(name)), printed, lambda value: factor * value)


def _ratio(asymmetry: float) -> float:
    """Stiffness to the positive side over that to the negative one."""
    return (1.0 + asymmetry) / (1.0 - asymmetry) if asymmetry < 1.0 else inf


def _doubling(shape: Any, unit: str) -> _Way | None:
    """Where the slope of load over motion is twice that at zero; None for a parameter without it.

    Exponential, slope k exp(b q): ln 2 / b. Tangent, k / cos²(√g q): π / (4 √g). Cubic,
    k (1 + 3 g q²): 1 / √(3 g).
    """
    ways: Mapping[Any, tuple[tuple[str, ...], Callable[[float], float]]] = {
        "exponential": (("1/rad", "1/m"), lambda rate: log(2.0) / rate),
        "tangent": (("1/rad^2", "1/m^2"), lambda growth: pi / (4.0 * sqrt(growth))),
        "cubic": (("1/rad^2", "1/m^2"), lambda growth: 1.0 / sqrt(3.0 * growth)),
    }
    units, of = ways.get(shape, ((), None))
    if of is None or unit not in units:
        return None
    length, factor = ("mm", MM_PER_M) if "/m" in unit else ("°", DEG_PER_RAD)
    at = of

    def reached(rise: float) -> float:
        return factor * at(rise) if rise > 0.0 else inf

    return _Way(DOUBLING, length, reached, falls=True)
