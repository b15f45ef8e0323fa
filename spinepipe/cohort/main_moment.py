"""What a load case mainly does: its largest moment, and which joint coordinate that drives."""

import numpy as np

from spinepipe.effects.contract import Array
from spinepipe.model import LoadCase
from spinepipe.units import COORDINATES

__all__ = ["coupled_range", "loaded_coordinate", "peak_step"]

_DRIVEN = ("right_bending", "left_rotation", "extension")
"""Coordinate driven by a moment about x, y and z of ground."""


def moments(case: LoadCase) -> Array:
    """(T, 3) N m, ground: sum of the moments of each load step."""
    return np.array(
        [np.sum([np.zeros(3), *(w.moment for w in step.wrenches)], axis=0) for step in case.steps]
    )


def peak_step(case: LoadCase) -> int:
    """Place of the load step with the largest moment; the first of equal ones."""
    return int(np.argmax(np.linalg.norm(moments(case), axis=1)))


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
