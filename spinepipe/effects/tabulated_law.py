"""Tabulated law: load over a motion of the joint, as a table says, for what has no formula."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from spinepipe.effects.carried_share import require
from spinepipe.effects.contract import Array, JointResponse, Kind, Parameter
from spinepipe.effects.registry import register
from spinepipe.effects.rounding import ramp
from spinepipe.units import COORDINATES, TRANSLATIONS

KNOTS = np.array([-1.0, -0.75, -0.5, -0.25, 0.25, 0.5, 0.75, 1.0])
"""Shares of the reach at which a load is given; at zero it is zero."""

ITSELF = "itself"
"""The table is over the coordinate that it loads."""

ROUNDED = 0.05
"""Share of the reach, to each side of a knot, over which the corner is rounded."""

FURTHEST = 10.0
"""Times the usual reach at most."""

# A lumbar joint: 50 N m/rad over 6 deg, 100 N/mm over 1 mm.
_REACH_RAD, _REACH_M = 0.1, 1e-3
_STIFFNESS, _STIFFNESS_N_PER_M = 50.0, 1e5


@register("tabulated_law")
@dataclass(frozen=True)
class TabulatedLaw:
    """Adds a load on one coordinate that is a table over it, or over another coordinate.

    The table has straight pieces between zero, where the load is zero, and eight knots at quarters
    of the reach to both sides; it goes on straight beyond. The reach is in rad or m, 0 stands for
    0.1 rad or 1 mm. Corners are rounded over 5 % of the reach to each side, so that at a knot the
    load is off by 1.25 % of the reach times the change of slope there. The load rises wherever the
    values rise. It is linear in the values; all zero is off. A table over another coordinate has no
    potential.
    """

    coordinate: str = "extension"
    over: str = ITSELF
    reach: float = 0.0
    name: ClassVar[str] = "tabulated_law"
    kind: ClassVar[Kind] = Kind.JOINT_LAW
    per_joint: ClassVar[bool] = True

    def __post_init__(self) -> None:
        require(self.name, "coordinate", self.coordinate, COORDINATES)
        require(self.name, "over", self.over, (ITSELF, *COORDINATES))
        most = FURTHEST * self._usual
        if not 0.0 <= self.reach <= most:
            unit = "m" if self.along in TRANSLATIONS else "rad"
            raise ValueError(
                f"{self.name}: reach {self.reach!r} is not within 0 to {most:g} {unit} "
                f"(0 stands for {self._usual:g} {unit})"
            )

    @property
    def along(self) -> str:
        """The coordinate that the table is over."""
        return self.coordinate if self.over == ITSELF else self.over

    @property
    def _usual(self) -> float:
        return _REACH_M if self.along in TRANSLATIONS else _REACH_RAD

    @property
    def furthest(self) -> float:
        """The reach, m or rad."""
        return self.reach or self._usual

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """The load at each knot."""
        shift = self.coordinate in TRANSLATIONS
        unit, most = ("N", 1e6) if shift else ("N m", 1e4)
        share = self.furthest / self._usual
        size = share * (_STIFFNESS_N_PER_M * _REACH_M if shift else _STIFFNESS * _REACH_RAD)
        along, to = self.along, self.coordinate
        return tuple(
            Parameter(
                name_of(knot),
                unit,
                -most,
                most,
                0.0,
                size,
                False,
                f"load in {to} where {along} is {100.0 * knot:+g} % of the reach",
                off=0.0,
            )
            for knot in KNOTS
        )

    def respond(self, q: Array, parameters: Array, carried: Array) -> JointResponse:
        """Load (J, 6) and tangent (J, 6, 6)."""
        at, along = COORDINATES.index(self.coordinate), COORDINATES.index(self.along)
        load, tangent = np.zeros_like(q), np.zeros((*q.shape, 6))
        weights, slopes = table(q[:, along] / self.furthest)
        load[:, at] = np.sum(weights * parameters, axis=1)
        tangent[:, at, along] = np.sum(slopes * parameters, axis=1) / self.furthest
        return JointResponse(load, tangent)

    def by_parameter(self, q: Array, parameters: Array, carried: Array) -> Array:
        """(J, 6, 8) by the load at each knot: it is linear in them."""
        at, along = COORDINATES.index(self.coordinate), COORDINATES.index(self.along)
        derivative = np.zeros((*q.shape, len(KNOTS)))
        derivative[:, at], _ = table(q[:, along] / self.furthest)
        return derivative


def name_of(knot: float) -> str:
    """The name of the load at a knot."""
    side = "plus" if knot > 0.0 else "minus"
    return f"load_at_{side}_{100.0 * abs(knot):.0f}"


def table(u: Array) -> tuple[Array, Array]:
    """(J, 8) share that the load at each knot has at u (J,) of the reach, and its slope by u."""
    every = np.array([*KNOTS[KNOTS < 0.0], 0.0, *KNOTS[KNOTS > 0.0]])
    (value, slope), (rest, _) = _rounded(u, every), _rounded(np.zeros(1), every)
    known = every != 0.0
    return (value - rest)[:, known], slope[:, known]


def _rounded(u: Array, knots: Array) -> tuple[Array, Array]:
    """(J, K) hats of straight pieces through knots (K,), corners rounded, and their slopes.

    A piece from one knot to the next is the line of the first piece plus a ramp at every inner knot
    by as much as the slope changes there.
    """
    gaps = np.diff(knots)
    rises = (np.eye(len(knots))[1:] - np.eye(len(knots))[:-1]) / gaps[:, None]  # (K - 1, K)
    change = np.diff(rises, axis=0)  # (K - 2, K) at each inner knot
    over, slope = ramp(u[:, None] - knots[None, 1:-1], ROUNDED)
    first = np.eye(len(knots))[0] + (u[:, None] - knots[0]) * rises[0]
    return first + over @ change, rises[0] + slope @ change
