"""Passive elements as rows of table `stiffness`, and back."""

from collections.abc import Iterator
from typing import Any

import numpy as np
import pandas as pd

from spinepipe.effects.contract import Array
from spinepipe.motion.joint_tables import SIDES
from spinepipe.motion.passive import PassiveLaw
from spinepipe.motion.passive_elements import PassiveElements
from spinepipe.motion.skeleton import JOINTS
from spinepipe.status import Status
from spinepipe.units import COORDINATES, ROTATIONS

LOW_MOMENT_NM = 0.1
"""Wang 2021 reads stiffness where this moment resists, and at the joint's high moment."""

_SHAPE = (len(JOINTS), len(COORDINATES), len(SIDES))


def law_in(rows: pd.DataFrame, generic: PassiveElements) -> PassiveLaw | None:
    """Passive elements of a calibration; None where it ended without."""
    if rows["a"].isna().any():
        return None
    a, b = generic.a.copy(), generic.b.copy()
    at = (
        rows["joint"].map(JOINTS.index).to_numpy(int),
        rows["coordinate"].map(COORDINATES.index).to_numpy(int),
        rows["side"].map(SIDES.index).to_numpy(int),
    )
    a[at], b[at] = rows["a"].to_numpy(float), rows["b"].to_numpy(float)
    return PassiveLaw(a, b)


def stiffness_rows(
    law: PassiveLaw, generic: PassiveElements, high: Array, status: Status, message: str
) -> Iterator[dict[str, Any]]:
    """Of all joints, coordinates and sides.

    Parameters
    ----------
    high : (17, 6, 2) N and N m, largest passive load of each side in the motions.
    """
    lower, usual, upper = (
        PassiveLaw(generic.a * factor, generic.b).stiffness_at(high)
        for factor in (generic.lower, np.ones(_SHAPE), generic.upper)
    )
    low, own = law.stiffness_at(np.full(_SHAPE, LOW_MOMENT_NM)), law.stiffness_at(high)
    for place in np.ndindex(*_SHAPE):
        turns = COORDINATES[place[1]] in ROTATIONS
        loaded = turns and high[place] > 0.0
        yield {
            **_key(place),
            "a": float(law.a[place]),
            "b": float(law.b[place]),
            "at_low_moment": float(low[place]) if turns else None,
            "at_high_moment": float(own[place]) if loaded else None,
            "high_moment_nm": float(high[place]) if loaded else None,
            "generic_low": float(lower[place]) if loaded else None,
            "generic_high": float(upper[place]) if loaded else None,
            "inside_generic": bool(lower[place] <= own[place] <= upper[place]) if loaded else None,
            "ratio_to_generic": float(own[place] / usual[place]) if loaded else None,
            "status": status,
            "message": message,
        }


def without(message: str) -> Iterator[dict[str, Any]]:
    """Rows of a calibration that ended without passive elements."""
    numbers = ("a", "b", "at_low_moment", "at_high_moment", "high_moment_nm", "generic_low")
    blank = dict.fromkeys((*numbers, "generic_high", "inside_generic", "ratio_to_generic"))
    for place in np.ndindex(*_SHAPE):
        yield {**_key(place), **blank, "status": Status.NOT_CONVERGED, "message": message}


def _key(place: tuple[int, ...]) -> dict[str, str]:
    joint, coordinate, side = place
    return {"joint": JOINTS[joint], "coordinate": COORDINATES[coordinate], "side": SIDES[side]}


def highest(law: PassiveLaw, motions: list[Array]) -> Array:
    """(17, 6, 2) N and N m, largest load of each side in motions (F, 17, 6)."""
    loads = np.concatenate([law.forces(q) for q in motions])
    return np.stack([np.maximum(loads, 0.0).max(axis=0), np.maximum(-loads, 0.0).max(axis=0)], -1)
