"""How alike curves are: the coefficient of multiple correlation of Kadaba et al. 1989."""

from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from spinepipe.statistics.outcome import Array, finite

FEWEST_CURVES = 2
FEWEST_POINTS = 2


class Likeness(StrEnum):
    """Whether a coefficient is defined."""

    DONE = "done"
    UNDEFINED = "undefined"
    TOO_FEW = "too_few"


@dataclass(frozen=True)
class MultipleCorrelation:
    """A coefficient of multiple correlation.

    Attributes
    ----------
    value : 0 to 1, at which all curves are the same; None where the status is not ``done``.
    curves, points : how many went in.
    """

    value: float | None
    status: Likeness
    message: str
    curves: int
    points: int


def multiple_correlation(curves: Array) -> MultipleCorrelation:
    """Coefficient of multiple correlation of curves (N, T), in its form within one day.

    With y[j, t] the value of curve j at point t, m[t] the mean over the N curves, and m the mean
    over all N T values,

        CMC^2 = 1 - (sum_jt (y[j, t] - m[t])^2 / (T (N - 1)))
                    / (sum_jt (y[j, t] - m)^2 / (N T - 1)).

    The fraction is the variance of the curves about their mean curve over the variance about their
    mean value. It exceeds one where curves differ more than their mean curve varies; then the root
    is not real, and there is no coefficient (Kadaba et al. 1989, doi:10.1002/jor.1100070611, their
    form within a day, of one day).

    Raises
    ------
    ValueError
        For values that are not finite.
    """
    y = finite(curves, 2)
    n, points = y.shape
    if n < FEWEST_CURVES or points < FEWEST_POINTS:
        found = f"{n} curves of {points} points; {FEWEST_CURVES} and {FEWEST_POINTS} are needed"
        return MultipleCorrelation(None, Likeness.TOO_FEW, found, n, points)
    whole = np.sum((y - y.mean()) ** 2) / (n * points - 1)
    if whole <= np.finfo(float).eps * np.mean(y**2):
        return MultipleCorrelation(None, Likeness.UNDEFINED, "nothing varies", n, points)
    # variance of the curves about their mean curve, over that about their mean value
    apart = np.sum((y - y.mean(axis=0)) ** 2) / (points * (n - 1))
    square = float(1.0 - apart / whole)
    if square < 0.0:
        told = f"curves differ more than they vary: the square is {square:.2g}"
        return MultipleCorrelation(None, Likeness.UNDEFINED, told, n, points)
    return MultipleCorrelation(float(np.sqrt(square)), Likeness.DONE, "", n, points)
