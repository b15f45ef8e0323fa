"""One LU factorisation of a tangent, reused for the step, the determinant and the sensitivities."""

from dataclasses import dataclass

import numpy as np
from scipy.linalg.lapack import dgetrf, dgetrs

from spinepipe.effects.contract import Array


class SingularTangent(ArithmeticError):
    """The tangent has no inverse at this pose."""


@dataclass(frozen=True)
class Factored:
    """LU factors of K (n, n); `sign` of its determinant."""

    lu: Array
    pivots: Array
    sign: int

    def solve(self, right: Array) -> Array:
        """K^-1 times (n,) or (n, m)."""
        solution, _ = dgetrs(self.lu, self.pivots, right)
        return solution


def factor(tangent: Array) -> Factored:
    """Factor a tangent.

    Raises
    ------
    SingularTangent
        When it is singular or not finite.
    """
    if not np.isfinite(tangent).all():
        raise SingularTangent("the tangent is not finite")
    lu, pivots, info = dgetrf(tangent)
    if info != 0:
        raise SingularTangent("the tangent is singular")
    swaps = np.count_nonzero(pivots != np.arange(len(pivots)))
    negative = np.count_nonzero(np.diagonal(lu) < 0.0)
    return Factored(lu, pivots, -1 if (swaps + negative) % 2 else 1)
