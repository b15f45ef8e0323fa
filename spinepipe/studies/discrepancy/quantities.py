"""Fitted parameters as the field gives them: N/mm, N m/°, ratios of two sides, doubling distances.

Results keep the parameters of the laws. What 17.7 1/rad² means nobody sees; that stiffness has
doubled at 10.7° everybody does.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from math import inf, isfinite, log, nan, pi, sqrt
from typing import Any

from spinepipe.report.words import number, plain
from spinepipe.studies.discrepancy.verdict import Estimate, Missing
from spinepipe.studies.discrepancy.words import ASYMMETRY, TOWARDS
from spinepipe.units import DEG_PER_RAD, MM_PER_M

STIFFENING, PRELOAD = "nonlinear_stiffening", "preload_stiffening"

_UNITS: Mapping[str, tuple[str, float]] = {
    "1": ("", 1.0),
    "deg": ("°", 1.0),
    "mm/deg": ("mm/°", 1.0),
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
    """A number to be read, with its 95 % interval.

    Attributes
    ----------
    place : joint, specimen or test it is of.
    low, high : infinite where that end is open; there the readings do not tell the value.
    at_bound : whether the fit ended at a bound, so that it says no more than that.
    """

    name: str
    place: str
    value: float
    unit: str
    low: float
    high: float
    at_bound: bool = False

    @property
    def words(self) -> str:
        """``half width 3.1° (95 % interval 2.8 to 3.4)``, ``half width: at least 2.8° (95 %, no
        upper end)``, ``half width: not told by these tests``.
        """
        told = f"{self.name} ({self.place})" if self.place else self.name
        if isfinite(self.low) and isfinite(self.high):
            between = f"(95 % interval {number(self.low)} to {number(self.high)})"
            return f"{told} {self._sized(self.value)}" + (
                _BOUND if self.at_bound else f" {between}"
            )
        if isfinite(self.low):
            return f"{told}: at least {self._sized(self.low)} (95 %, no upper end)"
        if isfinite(self.high):
            return f"{told}: at most {self._sized(self.high)} (95 %, no lower end)"
        return f"{told}: {_UNTOLD}"

    @property
    def in_brackets(self) -> str:
        """``3.1 [2.8, 3.4]``, ``at least 2.8, no upper end``."""
        if isfinite(self.low) and isfinite(self.high):
            between = f" [{number(self.low)}, {number(self.high)}]"
            return number(self.value) + (_BOUND if self.at_bound else between)
        if isfinite(self.low):
            return f"at least {number(self.low)}, no upper end"
        if isfinite(self.high):
            return f"at most {number(self.high)}, no lower end"
        return _UNTOLD

    def _sized(self, value: float) -> str:
        """With its unit: ``3.1°``, ``14 N/mm``."""
        return number(value) + (self.unit if self.unit == "°" else f" {self.unit}".rstrip())


_BOUND, _UNTOLD = ", at its bound", "not told by these tests"


@dataclass(frozen=True)
class _Way:
    """What a parameter is told as: a name, a unit, and the value there; it rises, or it falls."""

    name: str
    unit: str
    of: Callable[[float], float]
    falls: bool = False

    def ends(self, low: float | None, high: float | None) -> tuple[float, float]:
        """Lower and upper end as they are told, infinite where one is open."""
        below, above = (None if end is None else self.of(end) for end in (low, high))
        if self.falls:
            below, above = above, below
        return -inf if below is None else below, inf if above is None else above


def quantities(effect: Missing) -> tuple[Quantity, ...]:
    """The parameters of an effect as they are read."""
    return tuple(quantity(effect.name, effect.variant, one) for one in effect.parameters)


def quantity(effect: str, variant: Mapping[str, Any], parameter: Estimate) -> Quantity:
    """One parameter of an effect as it is read; results write ``width@L4L5@s01``."""
    name, *place = parameter.name.split("@")
    way = _way(effect, variant, name, parameter.unit)
    low, high = way.ends(*parameter.ci95)
    where = ", ".join(map(plain, place))
    return Quantity(
        way.name, where, way.of(parameter.value), way.unit, low, high, parameter.at_bound
    )


def estimate(effect: str, variant: Mapping[str, Any], value: float, unit: str) -> tuple[float, str]:
    """An effect's strength as it is read, and its unit with what it is; NaN stays.

    Parameters
    ----------
    value, unit : as the table candidates has them.
    """
    names = {STIFFENING: "growth", ASYMMETRY: "asymmetry", PRELOAD: "rise"}
    way = _way(effect, variant, names.get(effect, ""), unit)
    told = way.of(value) if isfinite(value) else value
    named = way.name if effect in names and way.name != names[effect] else ""
    return (told if isfinite(told) else nan), f"{way.unit} ({named})".strip() if named else way.unit


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
    printed, factor = _UNITS.get(unit, (unit, 1.0))
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

    return _Way("stiffness doubles at", length, reached, falls=True)
