"""Neutral zone: little resistance near the neutral pose, the joint's own beyond."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from spinepipe.effects.carried_share import CarriedFraction, CarriedShare, require
from spinepipe.effects.contract import Array, EffectKind, Parameter
from spinepipe.effects.registry import PER_JOINT, TriedValues, register
from spinepipe.facts import numbers
from spinepipe.units import COORDINATES, TRANSLATIONS

ZONES = ("centred", "off_centre")

WIDEST = 5.0
"""Times the usual width at most, of rotations: beyond, all motion lies inside."""

AS_BEFORE = 30.0
"""Sharpness of files that do not name it: the corner was then rounded over a tenth of the width to
each side, and the law is the same to 0.3 % of the width times the stiffness lost in the zone."""

SHARPNESS, SHARPNESS_SD = 12.0, 0.6
"""Prior of the sharpness, its SD of the logarithm: from 4 to 40 by two SDs. Smoother zones, 3 at
2.3 SDs, hardly differ from a joint that stiffens exponentially all the way."""

_HALF_WIDTH = numbers(__name__, "neutral_zone_half_width")
"""deg or mm."""

NEAR = 3e-3
"""Chords shorter than this are taken as a mean of slopes: differences would lose their digits."""

_POINTS, _WEIGHTS = np.polynomial.legendre.leggauss(5)
_POINTS, _WEIGHTS = 0.5 * (_POINTS + 1.0), 0.5 * _WEIGHTS

_LEAST = 1e-150
"""In place of zero where a logarithm is taken: what it is a factor of vanishes there."""


@register("neutral_zone")
@dataclass(frozen=True)
class NeutralZone(CarriedShare):
    """Load ``carried (1 - (1 - ratio) g(q / width))`` on one coordinate; a ratio of 1 is off.

    ``g(u) = (1 + |u|^n)^(-1/n)`` with the sharpness n: a linear spring has ``ratio`` times its
    stiffness inside the zone and runs parallel to its old line outside. A small n is a smooth
    change (2.7 follows ``k q - (1 - ratio) k w tanh(q / w)`` to 0.6 % of what the zone takes off),
    a large one a corner. Neutral zone: Panjabi 1992 (J Spinal Disord 5:390).

    A zone that is ``off_centre`` has its centre at ``offset`` widths from the neutral pose, and g
    is the mean slope of u g(u) from the neutral pose on: there the load is zero still. With the
    neutral pose at an end of the zone it would be an asymmetry by another name.
    """

    coordinate: str = "extension"
    zone: str = "centred"
    name: ClassVar[str] = "neutral_zone"
    kind: ClassVar[EffectKind] = EffectKind.JOINT_LAW
    per_joint: ClassVar[bool] = True
    trial: ClassVar[TriedValues] = TriedValues(
        variants=tuple(
            {"coordinate": c, **zone} for zone in ({}, {"zone": "off_centre"}) for c in COORDINATES
        ),
        spreads=PER_JOINT,
        told_by="load steps small enough to stay near the neutral pose, and large ones",
    )

    def __post_init__(self) -> None:
        require(self.name, "coordinate", self.coordinate, COORDINATES)
        require(self.name, "zone", self.zone, ZONES)

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """The stiffness ratio inside the zone, its half width, its sharpness, and its offset."""
        inside_it = f"stiffness in {self.coordinate} inside the zone over that outside"
        ratio = Parameter("stiffness_ratio", "1", 0.0, 1.0, 0.3, 0.5, False, inside_it, off=1.0)
        sharp = "how sharp the ends of the zone are: 3 smooth, 30 a corner"
        sharpness = Parameter(
            "sharpness",
            "1",
            2.0,
            50.0,
            SHARPNESS,
            SHARPNESS_SD,
            True,
            sharp,
            family=True,
            tried=(0.0,),
            unsaid=AS_BEFORE,
        )
        if self.zone == "centred":
            return ratio, self._width, sharpness
        beside = "where the zone's centre is, in half widths from the neutral pose"
        offset = Parameter("offset", "1", -0.8, 0.8, 0.0, 0.4, False, beside, tried=(-1.0, 1.0))
        return ratio, self._width, sharpness, offset

    @property
    def _width(self) -> Parameter:
        meaning = f"half width of the neutral zone in {self.coordinate}"
        tried = (-1.0, 0.0, 1.0) if self.zone == "centred" else (0.0,)
        if self.coordinate in TRANSLATIONS:
            unit, width, low, high = "m", _HALF_WIDTH[self.coordinate] / 1e3, 1e-6, 0.02
        else:
            unit, width, low = "rad", float(np.deg2rad(_HALF_WIDTH[self.coordinate])), 1e-4
            high = WIDEST * width
        return Parameter("width", unit, low, high, width, 0.7, True, meaning, tried=tried)

    def share(self, q: Array, parameters: Array) -> CarriedFraction:
        """``(ratio - 1) g``; derivatives by ratio, width, sharpness and offset."""
        ratio, width, n = parameters[:, :1], parameters[:, 1:2], parameters[:, 2:3]
        softer, u = ratio - 1.0, q / width
        if self.zone == "centred":
            g, by_u, by_n = inside(u, n)
            columns = [g, -softer * by_u * u / width, softer * by_n]
        else:
            g, by_u, by_n, by_offset = chord(u, n, parameters[:, 3:4])
            columns = [g, -softer * by_u * u / width, softer * by_n, softer * by_offset]
        return CarriedFraction(softer * g, softer * by_u / width, np.stack(columns, axis=2))


def inside(u: Array, n: Array) -> tuple[Array, Array, Array]:
    """``g(u) = G(u) / u`` and its derivatives by u and n.

    ``G(u) = u (1 + |u|^n)^(-1/n)`` goes from -1 to 1 with slope 1 at zero: by a corner at ±1 where
    n is large, as ``u / sqrt(1 + u^2)`` for n = 2, and near tanh(u) for n = 2.7.
    """
    log, steep, whole = _powers(u, n)
    g = np.exp(-whole / n)
    size = np.maximum(np.abs(u), _LEAST)
    return g, -np.sign(u) * g * steep / size, g * (whole / n - steep * log) / n


def _powers(u: Array, n: Array) -> tuple[Array, Array, Array]:
    """``log|u|``, ``|u|^n / (1 + |u|^n)`` and ``log(1 + |u|^n)``; none is infinite."""
    log = np.log(np.maximum(np.abs(u), _LEAST))
    whole = np.logaddexp(0.0, n * log)
    return log, np.exp(n * log - whole), whole


def _slope(u: Array, n: Array) -> tuple[Array, Array, Array]:
    """``G'(u) = (1 + |u|^n)^(-1/n - 1)`` and its derivatives by u and n."""
    log, steep, whole = _powers(u, n)
    slope = np.exp(-(1.0 / n + 1.0) * whole)
    size = np.maximum(np.abs(u), _LEAST)
    by_u = -np.sign(u) * slope * (n + 1.0) * steep / size
    return slope, by_u, slope * (whole / n**2 - (1.0 / n + 1.0) * steep * log)


def chord(u: Array, n: Array, offset: Array) -> tuple[Array, Array, Array, Array]:
    """``(G(u - offset) + G(offset)) / u`` and its derivatives by u, n and offset.

    That is the mean slope of G from -offset to u - offset.
    """
    u, n, offset = np.broadcast_arrays(u, n, offset)
    near = np.abs(u) < NEAR
    # from G and its slope at both ends of the chord
    way = np.where(near, 1.0, u)
    ends = np.stack([way - offset, offset])
    log, steep, whole = _powers(ends, n)
    g, slope = np.exp(-whole / n), np.exp(-(1.0 / n + 1.0) * whole)
    g_by_n = g * (whole / n - steep * log) / n
    mean, by_n = (ends * g).sum(axis=0) / way, (ends * g_by_n).sum(axis=0) / way
    found = np.stack([mean, (slope[0] - mean) / way, by_n, (slope[1] - slope[0]) / way])
    if near.any():
        found[:, near] = _mean_slope(u[near], n[near], offset[near])
    return found[0], found[1], found[2], found[3]


def _mean_slope(u: Array, n: Array, offset: Array) -> Array:
    """(4, ...) what `chord` tells, by Gauss's rule with five points, for short chords."""
    found = np.zeros((4, *u.shape))
    for point, weight in zip(_POINTS, _WEIGHTS, strict=True):
        slope, by_u, by_n = _slope(point * u - offset, n)
        found += weight * np.stack([slope, point * by_u, by_n, -by_u])
    return found
