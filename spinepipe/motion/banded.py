"""Normal equations of a trajectory: a band of blocks, with a border of what is shared.

A node touches three neighbouring coefficients of 108 numbers each, so that the matrix of all nodes
is block pentadiagonal; parameters that all nodes share border it and are eliminated last (Schur
complement). Cholesky factors and substitutions go block by block, so that all is matrix times
matrix: LAPACK substitutes into a band column by column, which takes ten times as long.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg.blas import dtrsm

from spinepipe.effects.contract import Array
from spinepipe.motion.points import COUNT

REACH = 3
"""Coefficients that one node touches."""


@dataclass(frozen=True, eq=False)
class Band:
    """Sums over nodes: matrix of the C coefficients, border, and gradient.

    Attributes
    ----------
    blocks : (C, 3, 108, 108) of the coefficient itself, the next and the one after that (rows)
        with the coefficient (columns). border : (C, 108, P). slope : (C, 108).
    """

    blocks: Array
    border: Array
    slope: Array

    @classmethod
    def empty(cls, coefficients: int, shared: int) -> "Band":
        """Of so many coefficients and shared parameters."""
        return cls(
            np.zeros((coefficients, REACH, COUNT, COUNT)),
            np.zeros((coefficients, COUNT, shared)),
            np.zeros((coefficients, COUNT)),
        )

    @property
    def diagonal(self) -> Array:
        """(C, 108), a view that can be written to."""
        return self.blocks[:, 0].reshape(len(self.blocks), -1)[:, :: COUNT + 1]


@dataclass(frozen=True, eq=False)
class Factor:
    """A damped band, factored: (C, 3, 108, 108), below each diagonal block the two under it."""

    blocks: Array

    @classmethod
    def of(cls, band: Band, damping: float, least: float) -> "Factor":
        """Block Cholesky, each diagonal grown by a share of itself and by `least`.

        Raises
        ------
        LinAlgError
            Of a matrix that is not positive definite.
        """
        count = len(band.blocks)
        # two coefficients past the end, with which nothing hangs together, spare the loop its ends
        found = np.zeros((count + REACH - 1, *band.blocks.shape[1:]))
        found[:count] = band.blocks
        found[:count, 0].reshape(count, -1)[:, :: COUNT + 1] += damping * band.diagonal + least
        for k in range(count):
            pivot = found[k, 0] = np.linalg.cholesky(found[k, 0])
            under = found[k, 1:].reshape(-1, COUNT)
            under[:] = _substituted(pivot, under.T).T
            left = under @ under.T
            found[k + 1, 0] -= left[:COUNT, :COUNT]
            found[k + 1, 1] -= left[COUNT:, :COUNT]
            found[k + 2, 0] -= left[COUNT:, COUNT:]
        return cls(found[:count])

    def forwards(self, right: Array) -> Array:
        """(C, 108, n) of (C, 108, n): the lower factor's inverse times it."""
        count = len(right)
        found = np.zeros((count + REACH - 1, *right.shape[1:]))
        found[:count] = right
        for k in range(count):
            found[k] = _substituted(self.blocks[k, 0], found[k])
            found[k + 1 : k + REACH] -= self.blocks[k, 1:] @ found[k]
        return found[:count]

    def backwards(self, right: Array) -> Array:
        """(C, 108, n) of (C, 108, n): the inverse of the lower factor, transposed, times it."""
        found = np.zeros((len(right) + REACH - 1, *right.shape[1:]))
        for k in reversed(range(len(right))):
            under = self.blocks[k, 1:].reshape(-1, COUNT)
            above = right[k] - under.T @ found[k + 1 : k + REACH].reshape(len(under), -1)
            found[k] = _substituted(self.blocks[k, 0], above, turned=True)
        return found[: len(right)]


def _substituted(lower: Array, right: Array, turned: bool = False) -> Array:
    """(108, n): a triangle's inverse, or that of the transposed one, times (108, n).

    The triangle is handed over transposed: rows in memory are the columns that BLAS looks for.
    """
    found: Array = dtrsm(1.0, lower.T, right, lower=0, trans_a=0 if turned else 1)
    return found


def bordered_step(
    bands: Sequence[Band], factors: Sequence[Factor], square: Array, slope: Array
) -> tuple[list[Array], Array]:
    """Newton step of each trial's coefficients (C, 108), and of the P parameters they share.

    Parameters
    ----------
    square, slope : (P, P) and (P,) of the shared parameters alone, damped.
    """
    halves, shared = [], len(slope)
    for band, factor in zip(bands, factors, strict=True):
        halves.append(factor.forwards(np.dstack([band.border, band.slope])))
        flat = halves[-1].reshape(-1, shared + 1)
        gram = flat.T @ flat
        square, slope = square - gram[:shared, :shared], slope - gram[:shared, shared]
    step: Array = -np.asarray(np.linalg.solve(square, slope), dtype=float) if shared else slope
    weights = np.append(step, 1.0)
    return [
        -factor.backwards((half @ weights)[..., None])[..., 0]
        for half, factor in zip(halves, factors, strict=True)
    ], step
