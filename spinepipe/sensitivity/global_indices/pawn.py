"""PAWN: how far the output's distribution moves when a factor is held in a slice of its range."""

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from spinepipe.effects.contract import Array
from spinepipe.sensitivity.global_indices.distance import Ordered


def pawn(unit: Array, output: Array, weights: Array, slices: int) -> Array:
    """(R, D) median over slices of the distance between the slice's outputs and all outputs.

    Parameters
    ----------
    unit : (N, D) factors. output : (N,). weights : (R, N) of resamples.
    slices : number of slices of equal counts; slices stay the same in all resamples.

    Pianosi & Wagener 2018, doi:10.1016/j.envsoft.2018.07.019, slices as in SALib. It is never 0:
    a factor that does nothing has the distance of a small sample (compare with a dummy).
    """
    outputs = Ordered(output, weights)
    found = np.empty((len(weights), unit.shape[1]))
    for column, values in enumerate(unit.T):
        parts = _slices(values, slices)
        found[:, column] = np.median([outputs.distance(part) for part in parts], axis=0)
    return found


def _slices(values: Array, slices: int) -> list[NDArray[np.bool_]]:
    """(N,) bool of each slice, closed below and open above; the largest value is in none."""
    edges = np.quantile(values, np.linspace(0.0, 1.0, slices + 1))
    return [(values >= low) & (values < high) for low, high in pairwise(edges)]
