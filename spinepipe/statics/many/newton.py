"""Newton on many chains at once: each goes on until it has arrived, as the engine judges."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from spinepipe.effects.contract import Array, Indices
from spinepipe.model import ScopedEffect
from spinepipe.statics.equilibrium import LARGEST_ROTATION, MOST_ITERATIONS, STEP_TOLERANCE
from spinepipe.statics.many.balance import Loads, balance
from spinepipe.statics.many.spines import Spines

Flags = NDArray[np.bool_]


def arrive(
    spines: Spines, effects: Sequence[tuple[int, ScopedEffect]], loads: Loads, start: Array
) -> tuple[Array, Array, Flags]:
    """Poses (M, J, 6), tangents there (M, n, n) and which chains have arrived (M,).

    A chain whose steps do not contract, or that leaves joint motion, is given up.
    """
    q = start.copy()
    count, n = len(q), 6 * q.shape[1]
    tangents = np.zeros((count, n, n))
    arrived = np.zeros(count, dtype=bool)
    open_ones: Indices = np.arange(count)
    last = np.full(count, np.inf)
    for _ in range(MOST_ITERATIONS):
        whole = len(open_ones) == count
        some = spines if whole else spines.part(open_ones)
        residual, tangent = balance(
            some, effects, loads if whole else loads.part(open_ones), q[open_ones]
        )
        step, solved = _step(tangent, residual)
        sizes = (np.abs(step) / STEP_TOLERANCE).max(axis=(1, 2))
        q[open_ones] += step
        inside = np.abs(q[open_ones][..., 3:]).max(axis=(1, 2)) <= LARGEST_ROTATION
        going = solved & inside & (sizes < 4.0 * last)
        there = going & (sizes < 1.0)
        arrived[open_ones[there]] = True
        tangents[open_ones[there]] = tangent[there]
        left = going & ~there
        open_ones, last = open_ones[left], sizes[left]
        if not len(open_ones):
            break
    return q, tangents, arrived


def _step(tangent: Array, residual: Array) -> tuple[Array, Flags]:
    """Newton steps (M, J, 6), and which tangents could be solved."""
    count, n = residual.shape
    good: Flags = np.asarray(np.isfinite(residual).all(axis=1))
    try:
        step = np.linalg.solve(tangent, -residual[:, :, None])[:, :, 0]
    except np.linalg.LinAlgError:  # one singular tangent stops all of them
        step = np.zeros((count, n))
        for number in np.flatnonzero(good):
            try:
                step[number] = np.linalg.solve(tangent[number], -residual[number])
            except np.linalg.LinAlgError:
                good[number] = False
    good &= np.isfinite(step).all(axis=1)
    return np.where(good[:, None], step, 0.0).reshape(count, -1, 6), good
