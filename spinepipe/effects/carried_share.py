"""Laws that scale what a joint already has: they add a share of the load of the laws before them.

``load_i = share(q_i, parameters) carried_i`` on some of the six coordinates. Such a strength is
dimensionless or per newton, so joints of different stiffness can share it.
"""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from functools import cache

import numpy as np

from spinepipe.effects.contract import Array, Indices, JointResponse
from spinepipe.units import COORDINATES, ROTATIONS

ALL_ROTATIONS = "rotations"
"""Name of the three rotations together, where a law takes it for a coordinate."""

ALL = "all"
"""Name of all six coordinates together, likewise."""


@dataclass(frozen=True)
class CarriedFraction:
    """A share of the carried load on C coordinates and its derivatives.

    Attributes
    ----------
    value, by_q : (J, C) share, and its derivative by the coordinate it belongs to.
    by_parameter : (J, C, P)
    """

    value: Array
    by_q: Array
    by_parameter: Array


class CarriedShare(ABC):
    """A joint law that adds ``share * carried`` on one coordinate, all rotations or all."""

    coordinate: str
    """Its name, `ALL_ROTATIONS` or `ALL`."""

    @property
    def columns(self) -> Indices:
        """Places of what is scaled among the six coordinates."""
        return columns_of(self.coordinate)

    @abstractmethod
    def share(self, q: Array, parameters: Array) -> CarriedFraction:
        """Share at the scaled coordinates q (J, C)."""

    def respond(self, q: Array, parameters: Array, carried: Array) -> JointResponse:
        """Load (J, 6), tangent at fixed carried load and derivative by it, both (J, 6, 6)."""
        at = self.columns
        share = self.share(q[:, at], parameters)
        load, (tangent, by_carried) = np.zeros_like(q), np.zeros((2, *q.shape, 6))
        load[:, at] = share.value * carried[:, at]
        tangent[:, at, at] = share.by_q * carried[:, at]
        by_carried[:, at, at] = share.value
        return JointResponse(load, tangent, by_carried)

    def by_parameter(self, q: Array, parameters: Array, carried: Array) -> Array:
        """(J, 6, P) derivative of the load at fixed q and carried load."""
        at = self.columns
        share = self.share(q[:, at], parameters)
        derivative = np.zeros((*q.shape, share.by_parameter.shape[2]))
        derivative[:, at] = share.by_parameter * carried[:, at, None]
        return derivative


def coordinates_of(coordinate: str) -> tuple[str, ...]:
    """The coordinates that a name stands for: one of the six, `ALL_ROTATIONS` or `ALL`."""
    return {ALL_ROTATIONS: ROTATIONS, ALL: COORDINATES}.get(coordinate, (coordinate,))


@cache
def columns_of(coordinate: str) -> Indices:
    """Places of what a name stands for among the six."""
    return np.array([COORDINATES.index(name) for name in coordinates_of(coordinate)])


def require(effect: str, option: str, given: str, allowed: tuple[str, ...]) -> None:
    """Refuse an option that is not among those allowed.

    Raises
    ------
    ValueError
        With what was given and what is allowed.
    """
    if given not in allowed:
        raise ValueError(f"{effect}: {option} {given!r} is not one of {', '.join(allowed)}")
