"""The 6 x 6 stiffness of a joint, and its inverse, about a point of one's choice.

A bushing is six springs at the joint's origin. The force and moment that hold a small displacement
and rotation at another point of the upper vertebra are X' diag(k) X, where the adjoint X takes
motion of that point to the origin (Chow and Pope 2019, doi:10.1016/j.medengphy.2019.09.013). It is
that of the neutral pose without load, where no load adds stiffness by turning with the joint.
"""

from collections.abc import Sequence
from itertools import product
from typing import Any

import numpy as np
import pandas as pd

from spinepipe.effects.contract import Array
from spinepipe.studies.cohort_stiffness.problem import with_stiffness
from spinepipe.units import COORDINATES, MM_PER_M

_SPATIAL = tuple(map(COORDINATES.index, ("right_bending", "left_rotation", "extension")))
_ORDER = [0, 1, 2, *_SPATIAL]
"""Coordinates along x, y and z of the joint, then about these."""

NAMES = [COORDINATES[place] for place in _ORDER]
"""What rows and columns are called."""

_UNITS = ("N/m", "N/rad"), ("N m/m", "N m/rad")
_INVERSE_UNITS = ("m/N", "m/(N m)"), ("rad/N", "rad/(N m)")


def matrix_table(
    rows: pd.DataFrame, values: Array, joints: Sequence[str], point_mm: Sequence[float]
) -> pd.DataFrame:
    """36 rows per joint: stiffness and compliance with the ends of 95 % intervals, NaN for unknown.

    An entry that takes a published value has no interval, and one that needs a stiffness that was
    never fitted has no number. The estimates of a joint's springs count as independent.

    Parameters
    ----------
    rows : of the table ``stiffness``, one fit of one specimen. values : (J, 6) SI, of what is in no
        row. point_mm : from each joint's origin along its axes.
    """
    every = [with_stiffness(values, joints, rows), *np.full((2, *values.shape), np.nan)]
    for number, end in enumerate(("low", "high"), 1):
        every[number] = with_stiffness(every[number], joints, rows.assign(stiffness=rows[end]))
    free = set(rows["coordinate"])
    x = np.eye(6)  # the origin moves by u + r x theta
    x[:3, 3:] = np.cross(np.asarray(point_mm, dtype=float) / MM_PER_M, np.eye(3)).T
    back = 2.0 * np.eye(6) - x  # its inverse
    parts = np.einsum("ci,cj->cij", x, x), np.einsum("ic,jc->cij", back, back)
    taken = (parts[0] != 0.0) | (parts[1] != 0.0)
    found = []
    for place, joint in enumerate(joints):
        k, low, high = (one[place, _ORDER] for one in every)
        stiffness = _sum(parts[0], k, low, high)
        compliance = _sum(parts[1], 1.0 / k, 1.0 / high, 1.0 / low)
        for i, j in product(range(6), repeat=2):
            names = [name for c, name in enumerate(NAMES) if taken[c, i, j]]
            found.append(
                {
                    **{"joint": joint, "row": NAMES[i], "column": NAMES[j]},
                    **_cells("stiffness", stiffness[:, i, j], _UNITS[i > 2][j > 2]),
                    **_cells("compliance", compliance[:, i, j], _INVERSE_UNITS[i > 2][j > 2]),
                    "published": ", ".join(name for name in names if name not in free),
                }
            )
    return pd.DataFrame(found)


def _cells(name: str, numbers: Array, unit: str) -> dict[str, Any]:
    value, low, high = numbers.tolist()
    return {name: value, f"{name}_low": low, f"{name}_high": high, f"{name}_unit": unit}


def _sum(weights: Array, value: Array, low: Array, high: Array) -> Array:
    """(3, 6, 6) value and ends of weighted sums of six estimates with uneven intervals.

    MOVER: each end is as far away as the ways to the parts' ends, as independent errors add up
    (Zou and Donner 2008, doi:10.1002/sim.3095).
    """
    ends = [(value, value), (low, high), (high, low)]  # of positive and of negative weights
    middle, least, most = (
        np.where(weights, weights * np.where(weights > 0.0, *(e[:, None, None] for e in pair)), 0.0)
        for pair in ends
    )
    total = middle.sum(axis=0)
    below, above = (np.sqrt(((one - middle) ** 2).sum(axis=0)) for one in (least, most))
    return np.stack([total, total - below, total + above])
