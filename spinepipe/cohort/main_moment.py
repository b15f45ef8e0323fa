"""What a load case mainly does: its largest moment, and which joint coordinate that drives."""

from collections.abc import Sequence

import numpy as np

from spinepipe.effects.contract import Array
from spinepipe.model import LoadCase
from spinepipe.units import COORDINATES

__all__ = ["coupled_range", "loaded_coordinate", "peak_step"]

_DRIVEN = ("right_bending", "left_rotation", "extension")
"""Coordinate driven by a moment about x, y and z of ground."""


def moments(case: LoadCase) -> Array:
    """(T, 3) N m, ground: sum of the moments of each load step."""
    return _sums([[wrench.moment for wrench in step.wrenches] for step in case.steps])


def _sums(vectors: Sequence[Sequence[Array]]) -> Array:
    """(T, 3) sum of the vectors of each load step; zero where there are none."""
    return np.array([np.sum([np.zeros(3), *of_step], axis=0) for of_step in vectors])


def peak_step(case: LoadCase) -> int:
    """Place of the load step with the largest moment; the first of equal ones.

    Where no moment is applied, the step with the largest force.
    """
    applied = moments(case)
    if not applied.any():
        applied = _sums([[wrench.force for wrench in step.wrenches] for step in case.steps])
    return int(np.argmax(np.linalg.norm(applied, axis=1)))


def loaded_coordinate(case: LoadCase) -> str | None:
    """The coordinate that the largest moment drives; None where no moment is applied."""
    largest = moments(case)[peak_step(case)]
    if not largest.any():
        return None
    coordinate = _DRIVEN[int(np.argmax(np.abs(largest)))]
    assert coordinate in COORDINATES
    return coordinate


def coupled_range(case: LoadCase) -> float:
    """N m: root sum square of the ranges of the two moments beside the main one."""
    applied = moments(case)
    main = int(np.argmax(np.abs(applied[peak_step(case)])))
    ranges = np.delete(np.ptp(applied, axis=0), main)
    return float(np.linalg.norm(ranges))
