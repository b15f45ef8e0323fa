"""Normal equations of a trajectory: a band of blocks, with a border of what is shared.

A node touches three neighbouring coefficients of n numbers each (108 where all coordinates are
free), so that the matrix of all nodes is block pentadiagonal; parameters that all nodes share
border it and are eliminated last (Schur complement). Cholesky factors and substitutions go block by
block, so that all is matrix times matrix: LAPACK substitutes into a band column by column, which
takes ten times as long. BLAS works in place: what lies in memory row by row is to it the transposed
block, column by column.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.linalg import LinAlgError
from scipy.linalg.blas import dgemm, dtrsm, dtrsv
from scipy.linalg.lapack import dpotrf

from spinepipe.effects.contract import Array
from spinepipe.motion.points import COUNT

REACH = 3
"""Coefficients that one node touches."""


@dataclass(frozen=True, eq=False)
class Band:
    """Sums over nodes: matrix of the C coefficients, border, and gradient.

    Attributes
    ----------
    blocks : (C, 3, n, n) of the coefficient itself, the next and the one after that (rows) with
        the coefficient (columns). border : (C, n, P). slope : (C, n).
    """

    blocks: Array
    border: Array
    slope: Array

    @classmethod
    def empty(cls, coefficients: int, shared: int, count: int = COUNT) -> "Band":
        """Of so many coefficients of `count` numbers, and shared parameters."""
        return cls(
            np.zeros((coefficients, REACH, count, count)),
            np.zeros((coefficients, count, shared)),
            np.zeros((coefficients, count)),
        )

    @property
    def diagonal(self) -> Array:
        """(C, n), a view that can be written to."""
        found: Array = np.einsum("cii->ci", self.blocks[:, 0])
        return found


@dataclass(frozen=True, eq=False)
class BandFactor:
    """A damped band, factored: (C, 3, n, n), below each diagonal block the two under it."""

    blocks: Array

    @classmethod
    def of(cls, band: Band, grown: Array) -> "BandFactor":
        """Block Cholesky, the diagonal larger by `grown` (C, n).

        Raises
        ------
        LinAlgError
            Of a matrix that is not positive definite.
        """
        size = band.blocks.shape[-1]
        # two coefficients past the end, with which nothing hangs together, spare the loop its ends
        found = np.zeros((len(grown) + REACH - 1, *band.blocks.shape[1:]))
        for k, own in enumerate(band.blocks):
            # pivot block: L = chol(A), then the two blocks under it, and what they leave of the
            # next two columns (right-looking block Cholesky; Golub and Van Loan 2013, section 4.2)
            here = found[k]
            here += own
            here[0].reshape(-1)[:: size + 1] += grown[k]
            pivot, failed = dpotrf(here[0].T, lower=0, overwrite_a=1)
            if failed:
                raise LinAlgError("Matrix is not positive definite")
            under = here[1:].reshape(-1, size).T
            dtrsm(1.0, pivot, under, trans_a=1, overwrite_b=1)
            first, second = under[:, :size], under[:, size:]
            next_two, after = found[k + 1, :2].reshape(-1, size).T, found[k + 2, 0].T
            dgemm(-1.0, first, under, 1.0, next_two, trans_a=1, overwrite_c=1)
            dgemm(-1.0, second, second, 1.0, after, trans_a=1, overwrite_c=1)
        return cls(found[: len(grown)])

    def forwards(self, right: Array) -> Array:
        """(C, n, m) of (C, n, m): the lower factor's inverse times it."""
        _, size, columns = right.shape
        found = np.zeros((len(right) + REACH - 1, size, columns))
        found[: len(right)] = right
        for k, (pivot, *_) in enumerate(self.blocks):
            here, under = found[k].T, self.blocks[k, 1:].reshape(-1, size).T
            dtrsm(1.0, pivot.T, here, side=1, overwrite_b=1)
            next_two = found[k + 1 : k + REACH].reshape(-1, columns).T
            dgemm(-1.0, here, under, 1.0, next_two, overwrite_c=1)
        return found[: len(right)]

    def backwards(self, right: Array) -> Array:
        """(C, n) of (C, n): the inverse of the lower factor, transposed, times it."""
        size = right.shape[1]
        found = np.zeros((len(right) + REACH - 1, size))
        for k in reversed(range(len(right))):
            under = self.blocks[k, 1:].reshape(-1, size)
            above = right[k] - found[k + 1 : k + REACH].reshape(-1) @ under
            found[k] = dtrsv(self.blocks[k, 0].T, above)
        return found[: len(right)]


def bordered_step(
    bands: Sequence[Band], factors: Sequence[BandFactor], square: Array, slope: Array
) -> tuple[list[Array], Array]:
    """Newton step of each trial's coefficients (C, n), and of the P parameters they share.

    Parameters
    ----------
    square, slope : (P, P) and (P,) of the shared parameters alone, damped.
    """
    # Schur complement of the shared parameters, by the half-solved border: L^-1 [border, slope]
    halves, shared = [], len(slope)
    for band, factor in zip(bands, factors, strict=True):
        halves.append(factor.forwards(np.dstack([band.border, band.slope])))
        flat = halves[-1].reshape(-1, shared + 1)
        gram = flat.T @ flat
        square, slope = square - gram[:shared, :shared], slope - gram[:shared, shared]
    step: Array = -np.asarray(np.linalg.solve(square, slope), dtype=float) if shared else slope
    # back into each band: -A^-1 (slope + border step)
    weights = np.append(step, 1.0)
    return [
        -factor.backwards(half @ weights) for half, factor in zip(halves, factors, strict=True)
    ], step
