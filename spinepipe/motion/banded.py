"""Normal equations of a trajectory: a band of blocks, with a border of what is shared.

A node touches three neighbouring coefficients of 108 numbers each, so that the matrix of all nodes
is a band; parameters that all nodes share border it and are eliminated last (Schur complement).
"""

from dataclasses import dataclass, field

import numpy as np
from numba import njit
from scipy.linalg import cho_solve_banded, cholesky_banded

from spinepipe.effects.contract import Array
from spinepipe.motion.points import COUNT

WIDE = 3 * COUNT
"""Unknowns that one node touches."""


@dataclass
class Band:
    """Sums over nodes: matrix of the coefficients, border, and gradients.

    Attributes
    ----------
    coefficients : how many, each of 108 numbers. shared : how many parameters are shared.
    lower : (324, n) the band below the diagonal, as LAPACK has it. border : (n, P).
    slope : (n,) gradient.
    """

    coefficients: int
    shared: int
    lower: Array = field(init=False)
    border: Array = field(init=False)
    slope: Array = field(init=False)

    def __post_init__(self) -> None:
        size = self.coefficients * COUNT
        self.lower = np.zeros((WIDE, size), order="F")
        self.border = np.zeros((size, self.shared))
        self.slope = np.zeros(size)

    def add(self, node: int, square: Array, slope: Array, border: Array | None) -> None:
        """What a node asks of its three coefficients: (324, 324), of which the lower triangle is
        looked at, (324,) and (324, P)."""
        first = node * COUNT
        _added(self.lower, square, first)
        self.slope[first : first + WIDE] += slope
        if border is not None:
            self.border[first : first + WIDE] += border

    def add_diagonal(self, weights: Array, slope: Array) -> None:
        """(n,) both."""
        self.lower[0] += weights
        self.slope += slope


@njit(cache=True)
def _added(lower: Array, square: Array, first: int) -> None:
    for column in range(len(square)):
        for row in range(column, len(square)):
            lower[row - column, first + column] += square[row, column]


@dataclass(frozen=True, eq=False)
class Factor:
    """A damped band, factored."""

    lower: Array

    @classmethod
    def of(cls, band: Band, damping: float, least: Array) -> "Factor":
        """Each diagonal grown by a share of itself and by `least` (n,)."""
        damped = band.lower.copy(order="F")
        damped[0] += damping * band.lower[0] + least
        return cls(cholesky_banded(damped, overwrite_ab=True, lower=True, check_finite=False))

    def solve(self, right: Array) -> Array:
        """(n, ...) of (n, ...)."""
        found: Array = cho_solve_banded((self.lower, True), right, check_finite=False)
        return found


def bordered_step(
    bands: list[Band], factors: list[Factor], square: Array, slope: Array
) -> tuple[list[Array], Array]:
    """Newton step of each trial's coefficients (n,), and of what they share (P,).

    Parameters
    ----------
    square, slope : (P, P) and (P,) of the shared parameters alone, damped.
    """
    apart = [factor.solve(band.slope) for band, factor in zip(bands, factors, strict=True)]
    if not len(slope):
        return [-one for one in apart], slope
    carried = [factor.solve(band.border) for band, factor in zip(bands, factors, strict=True)]
    left = square - sum(b.border.T @ c for b, c in zip(bands, carried, strict=True))
    right = slope - sum(b.border.T @ a for b, a in zip(bands, apart, strict=True))
    step: Array = -np.asarray(np.linalg.solve(left, right))
    return [-(a + c @ step) for a, c in zip(apart, carried, strict=True)], step
