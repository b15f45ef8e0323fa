"""Motions as uniform cubic B-splines: what three neighbouring coefficients make of a node.

Knots are the nodes. At a node the curve is (1, 4, 1) / 6 of the coefficients before, at and after
it, so that what is asked of a node touches three coefficients (de Boor 2001, chapter 9).
"""

from dataclasses import dataclass

import numpy as np
from scipy.linalg import solve_banded

from spinepipe.effects.contract import Array

_DEGREE = 3


@dataclass(frozen=True)
class KnotGrid:
    """Nodes of a motion, equally far apart.

    Attributes
    ----------
    start_s, step_s : time of the first node, and from one to the next. intervals : between nodes.
    """

    start_s: float
    step_s: float
    intervals: int

    @classmethod
    def over(cls, start_s: float, end_s: float, intervals: int) -> "KnotGrid":
        """Nodes from one time to another."""
        return cls(start_s, (end_s - start_s) / intervals, intervals)

    @property
    def times_s(self) -> Array:
        """(N + 1,) of the nodes."""
        return np.asarray(self.start_s + self.step_s * np.arange(self.intervals + 1), dtype=float)

    @property
    def coefficients(self) -> int:
        """N + 3, how many a curve has."""
        return self.intervals + _DEGREE

    @property
    def weights(self) -> Array:
        """(3, 3) of the coefficients before, at and after a node: place, velocity, acceleration."""
        return np.array(
            [
                np.array([1.0, 4.0, 1.0]) / 6.0,
                np.array([-1.0, 0.0, 1.0]) / (2.0 * self.step_s),
                np.array([1.0, -2.0, 1.0]) / self.step_s**2,
            ]
        )

    def at_nodes(self, coefficients: Array) -> tuple[Array, Array, Array]:
        """Places, velocities and accelerations (N + 1, ...) of a curve (N + 3, ...)."""
        before, at, after = coefficients[:-2], coefficients[1:-1], coefficients[2:]
        place, velocity, acceleration = (
            first * before + second * at + third * after for first, second, third in self.weights
        )
        return place, velocity, acceleration

    def through(self, places: Array) -> Array:
        """Coefficients (N + 3, ...) of the curve through places (N + 1, ...), straight at its ends.

        The natural spline: with no acceleration at the first and last node.
        """
        count = self.coefficients
        # a matrix of five diagonals: 1 4 1 in each row, second differences in the first and last
        bands = np.zeros((5, count))
        bands[2, 1:-1], bands[1, 2:], bands[3, :-2] = 4.0 / 6.0, 1.0 / 6.0, 1.0 / 6.0
        bands[2, 0], bands[1, 1], bands[0, 2] = 1.0, -2.0, 1.0
        bands[2, -1], bands[3, -2], bands[4, -3] = 1.0, -2.0, 1.0
        flat = np.zeros((count, int(np.prod(places.shape[1:]))))
        flat[1:-1] = places.reshape(len(places), -1)
        solved: Array = solve_banded((2, 2), bands, flat)
        return solved.reshape(count, *places.shape[1:])
