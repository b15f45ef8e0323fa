"""Gould et al. 2024 as the comparison reads it: its numbers, its joints and directions."""

from spinepipe.anatomy import published
from spinepipe.units import (
    COORDINATE_COLUMNS,
    COORDINATES,
    ROTATIONS,
    STIFFNESS_COLUMNS,
    TRANSLATIONS,
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

MOTION_UNIT = {**dict.fromkeys(TRANSLATIONS, "mm"), **dict.fromkeys(ROTATIONS, "deg")}
STIFFNESS_UNIT = {
    **dict.fromkeys(TRANSLATIONS, "N/m"),
    **dict.fromkeys(ROTATIONS, "N m/rad"),
}
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
