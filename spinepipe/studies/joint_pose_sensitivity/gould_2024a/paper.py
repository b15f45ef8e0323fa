"""Gould et al. 2024 as the comparison reads it: its numbers, and the summary beside them."""

from collections.abc import Callable, Iterable
from typing import Any

import pandas as pd

from spinepipe.anatomy import published
from spinepipe.comparison.claim import NotComputed, Ours, Run
from spinepipe.units import (
    COORDINATE_COLUMNS,
    COORDINATES,
    STIFFNESS_COLUMNS,
)

PAPER = published("gould_2024a")

COUNTS = PAPER["counts"]
REDUCED = int(COUNTS["pose_samples_reduced"])

SAMPLES = int(COUNTS["pose_samples"])

P_BELOW = float(PAPER["significance"]["p_below"])

MEASURED_JOINTS = ("L2L3", "L3L4")

JOINTS = ("L1L2", "L2L3", "L3L4")

FITTED = ("anterior", "superior", "extension")
"""Directions whose stiffness is fitted and whose error is reported."""

MOTION_KEY = dict(zip(COORDINATES, COORDINATE_COLUMNS, strict=True))

STIFFNESS_KEY = dict(zip(COORDINATES, STIFFNESS_COLUMNS, strict=True))

NO_RAW_DATA = (
    "the paper's value rests on scans, motion and load components that are not published, and "
    "this cohort's landmarks, load line and unmeasured motion are partly assumed "
    "(docs/decisions/0001), so it cannot be reproduced exactly"
)


def measured(joint: str, name: str) -> float:
    """Size of the published motion of a joint, mm or deg."""
    return abs(float(PAPER["measured_motion"][joint][MOTION_KEY[name]]))


def summary_median(**where: Any) -> Callable[[Run], Ours]:
    """Median of one row with its quartiles."""

    def ours(run: Run) -> Ours:
        low, high = (_end(run, name, where) for name in ("low_quartile", "high_quartile"))
        return Ours(summary_value(run, "median", **where), low, high)

    return ours


def summary_cell(column: str, **where: Any) -> Callable[[Run], Ours]:
    """Another column of one row."""
    return lambda run: Ours(summary_value(run, column, **where))


def summary_largest(column: str, joints: Iterable[str], **where: Any) -> Callable[[Run], Ours]:
    """Largest value of a column over joints."""
    names = tuple(joints)
    return lambda run: Ours(
        max(summary_value(run, column, joint=joint, **where) for joint in names)
    )


def summary_percent(column: str, **where: Any) -> Callable[[Run], Ours]:
    """A spread as a percentage of its median."""

    def ours(run: Run) -> Ours:
        middle = summary_value(run, "median", **where)
        if middle == 0.0:
            raise NotComputed("the median is 0")
        return Ours(100.0 * summary_value(run, column, **where) / middle)

    return ours


def summary_value(run: Run, column: str, **where: Any) -> float:
    """One cell of the summary."""
    return run.number("summary", column, **where)


def _end(run: Run, column: str, where: dict[str, Any]) -> float | None:
    found = run.row("summary", **where)[column]
    return None if pd.isna(found) else float(found)
