"""Rows of the table ``stiffness`` from logarithms of stiffness and their errors."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from spinepipe.effects.contract import Array
from spinepipe.units import COORDINATES, STIFFNESS_UNITS

Row = dict[str, Any]
LEVEL = 0.975
"""Upper end of the intervals: 95 % lie between the ends."""

_BOUND = {-1: "lower", 0: "no", 1: "upper"}


def stiffness_rows(
    joints: Sequence[str],
    free: Sequence[str],
    values: Array,
    log_error: Array,
    degrees_of_freedom: float,
    identifiable: NDArray[np.bool_] | None,
    at_bound: NDArray[np.int64],
) -> list[Row]:
    """One row per joint and free coordinate.

    Parameters
    ----------
    values : (J, 6) stiffness, SI. log_error : (J, 6) standard error of its logarithm, infinite
        where there is none. identifiable, at_bound : (J, 6); identifiable None for literature.
    degrees_of_freedom : of Student's t for the intervals; infinite for the normal distribution.
    """
    reach = float(stats.t.ppf(LEVEL, degrees_of_freedom)) if degrees_of_freedom > 0 else np.inf
    rows = []
    for row, joint in enumerate(joints):
        for name in free:
            at = row, COORDINATES.index(name)
            rows.append({
                "joint": joint,
                "coordinate": name,
                "unit": STIFFNESS_UNITS[name],
                **interval(values[at], log_error[at], reach),
                "identifiable": None if identifiable is None else bool(identifiable[at]),
                "at_bound": _BOUND[int(at_bound[at])],
            })  # fmt: skip
    return rows


def interval(value: float, log_error: float, reach: float) -> Row:
    """Value, standard error and ends of the interval, normal in the logarithm."""
    empty: Row = {"standard_error": None, "low": None, "high": None}
    if not np.isfinite(value):
        return {"stiffness": None, **empty}
    with np.errstate(over="ignore"):  # an end beyond all numbers is none
        low, high = value * np.exp([-reach * log_error, reach * log_error])
    if not np.isfinite(log_error) or not np.isfinite(high):
        return {"stiffness": float(value), **empty}
    return {
        "stiffness": float(value),
        "standard_error": float(value * log_error),
        "low": float(low),
        "high": float(high),
    }
