"""A reading at a level of the load, by local regression on the load.

A parabola is fitted to the rows of a branch whose load is near the level, the nearer the more they
count (tricube weights; Cleveland 1979, J Am Stat Assoc 74, 829-836). What rows leave around the
parabola, with what neighbouring rows share, tells the SD of the reading.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from spinepipe.decomposition import pinvh
from spinepipe.testing_machine.cycles import Branch

Array = NDArray[np.float64]

ENOUGH_ROWS = 8
"""The window around a level grows from half a step until it holds so many rows."""

FOR_A_PARABOLA = 8
"""With fewer rows a straight line is fitted."""

FEWEST_ROWS = 3
STRONGEST_CORRELATION = 0.98
SINGULAR = 1e-10


@dataclass(frozen=True, eq=False)
class Reading:
    """What local regression says at one load step.

    Attributes
    ----------
    values : (C,) reading of each quantity.
    share : SD of a reading in SDs of a single row, where rows err by themselves.
    left : (n, C) what is left of the rows near the level. freedom : n less what was fitted.
    """

    values: Array
    share: float
    left: Array
    freedom: float

    @property
    def raw(self) -> Array:
        """(C,) SD of a single row around the parabola."""
        return np.sqrt((self.left**2).sum(axis=0) / self.freedom)


def read_at(
    level: float, width: float, branch: Branch, load: Array, quantities: Array
) -> Reading | None:
    """Local regression of quantities (N, C) at a level of the load (N,), on one branch.

    ``width``: the step between levels; None where the branch has fewer than three rows.
    """
    u, y = load[branch.rows] - level, quantities[branch.rows]
    if len(u) < FEWEST_ROWS:
        return None
    # the window: half a step to either side, or as far as the eighth nearest row
    enough = np.sort(np.abs(u))[min(ENOUGH_ROWS, len(u)) - 1]
    reach = max(width / 2, 1.001 * float(enough))
    near = np.abs(u) < reach
    x, y = u[near] / reach, y[near]
    # weighted least squares of a parabola in the load, tricube weights
    weight = (1.0 - np.abs(x) ** 3) ** 3
    degree = 2 if len(x) >= FOR_A_PARABOLA else 1
    terms = x[:, None] ** np.arange(degree + 1)
    inverse = pinvh(terms.T @ (weight[:, None] * terms), SINGULAR)
    smoother = inverse @ (terms.T * weight)  # (p, n): coefficients of a parabola from the rows
    coefficients = smoother @ y
    # what is left, and the degrees of freedom: rows less the trace of the smoother
    left = y - terms @ coefficients
    freedom = max(len(x) - float(np.trace(smoother @ terms)), 1.0)
    return Reading(coefficients[0], float(np.linalg.norm(smoother[0])), left, freedom)


def sds_of(readings: Sequence[Reading]) -> Array:
    """(T, C) SDs of readings, more where rows resemble their neighbours: by (1 + r) / (1 - r).

    The correlation r of neighbouring rows is taken from all readings together.
    """
    # lag-1 autocorrelation r of what is left; an AR(1) series has (1 - r) / (1 + r) as many
    # independent rows
    power = sum((one.left**2).sum(axis=0) for one in readings)
    product = sum((one.left[1:] * one.left[:-1]).sum(axis=0) for one in readings)
    r = np.divide(product, power, out=np.zeros_like(power), where=power > 0)
    r = np.clip(r, 0.0, STRONGEST_CORRELATION)
    own = np.array([one.raw * one.share for one in readings])
    return own * np.sqrt((1 + r) / (1 - r))
