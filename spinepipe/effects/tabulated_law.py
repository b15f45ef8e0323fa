"""Tabulated law: load over a motion of the joint, as a table says, for what has no formula."""

from dataclasses import dataclass
from itertools import pairwise
from typing import ClassVar

import numpy as np

from spinepipe.effects.carried_share import require
from spinepipe.effects.contract import Array, EffectKind, JointResponse, Parameter
from spinepipe.effects.registry import register
from spinepipe.effects.rounding import ramp
from spinepipe.facts import several
from spinepipe.units import COORDINATES, TRANSLATIONS

KNOTS = np.array([-1.0, -0.75, -0.5, -0.25, 0.0, 0.25, 0.5, 0.75, 1.0])
"""Shares of the reach between which the load goes straight; at zero it is zero."""

ITSELF = "itself"
"""The table is over the coordinate that it loads."""

ROUNDED = 0.05
"""Share of the reach, to each side of a knot, over which the corner is rounded."""

SEEN = 0.1
"""Share of the reach within which the tangent is looked at along a step: no stretch is shorter."""

FURTHEST = 10.0
"""Times the usual reach at most."""

SIZE = 0.2
"""Prior size of a stretch, as a share of a usual stiffness."""

_USUAL = several(__name__, "usual_motion")
(_REACH_RAD, _LOAD_NM), (_REACH_M, _LOAD_N) = _USUAL["rotation"], _USUAL["translation"]
"""How far a lumbar joint has moved under which load."""


@register("tabulated_law")
@dataclass(frozen=True)
class TabulatedLaw:
    """Adds a load on one coordinate that is a table over it, or over another coordinate.

    The table goes straight between knots at quarters of the reach to both sides; it is zero at zero
    and goes on straight beyond. Its values are the stiffness of the eight stretches, so that the
    load at a knot is the sum of stiffness times length of the stretches up to it, and it rises
    where they are positive. The reach is in rad or m, 0 stands for 0.1 rad or 1 mm. Corners are
    rounded over 5 % of the reach to each side: at a knot the load is off by 1.25 % of the reach
    times the change of stiffness. All zero is off. Over another coordinate it has no potential.
    """

    coordinate: str = "extension"
    over: str = ITSELF
    reach: float = 0.0
    name: ClassVar[str] = "tabulated_law"
    kind: ClassVar[EffectKind] = EffectKind.JOINT_LAW
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
    def straight_over(self) -> float:
        """rad: where it may fall between two knots that is seen."""
        return SEEN * self.furthest * (_REACH_RAD / _REACH_M if self.along in TRANSLATIONS else 1.0)

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """The stiffness of each stretch."""
        shift, along_shift = self.coordinate in TRANSLATIONS, self.along in TRANSLATIONS
        usual = (_LOAD_N if shift else _LOAD_NM) / self._usual
        unit = f"{'N' if shift else 'N m'}/{'m' if along_shift else 'rad'}"
        low, high, along = -1e4 * usual, 1e4 * usual, self.along
        return tuple(
            Parameter(
                name,
                unit,
                low,
                high,
                0.0,
                SIZE * usual,
                False,
                f"rise of the load in {self.coordinate} with {along} {100 * start:g} to "
                f"{100 * end:g} % of the reach",
                off=0.0,
            )
            for name, start, end in zip(NAMES, KNOTS[:-1], KNOTS[1:], strict=True)
        )

    def respond(self, q: Array, parameters: Array, carried: Array) -> JointResponse:
        """Load (J, 6) and tangent (J, 6, 6)."""
        at, along = COORDINATES.index(self.coordinate), COORDINATES.index(self.along)
        load, tangent = np.zeros_like(q), np.zeros((*q.shape, 6))
        passed, inside = stretches(q[:, along] / self.furthest)
        load[:, at] = self.furthest * np.sum(passed * parameters, axis=1)
        tangent[:, at, along] = np.sum(inside * parameters, axis=1)
        return JointResponse(load, tangent)

    def by_parameter(self, q: Array, parameters: Array, carried: Array) -> Array:
        """(J, 6, 8) by the stiffness of each stretch: it is linear in them."""
        at, along = COORDINATES.index(self.coordinate), COORDINATES.index(self.along)
        derivative = np.zeros((*q.shape, len(NAMES)))
        passed, _ = stretches(q[:, along] / self.furthest)
        derivative[:, at] = self.furthest * passed
        return derivative


NAMES = tuple(
    f"stiffness_{'minus' if end <= 0.0 else 'plus'}_{100.0 * max(abs(start), abs(end)):.0f}"
    for start, end in pairwise(KNOTS)
)
"""A stretch goes by the end that is further from zero."""


def stretches(u: Array) -> tuple[Array, Array]:
    """(J, 8) how far each stretch is passed at u (J,) of the reach, from zero on, and its slope."""
    passed, inside = _passed(u)
    return passed - _AT_REST, inside


def _passed(u: Array) -> tuple[Array, Array]:
    """(J, 8) part of each stretch below u, the first and last without an end, and its slope."""
    over, slope = ramp(u[:, None] - KNOTS[1:-1], ROUNDED)
    ones = np.ones((len(u), 1))
    over = np.hstack([u[:, None], over, 0.0 * ones])
    slope = np.hstack([ones, slope, 0.0 * ones])
    return over[:, :-1] - over[:, 1:], slope[:, :-1] - slope[:, 1:]


_AT_REST, _ = _passed(np.zeros(1))
