"""The six coordinates of a joint: their names, their units, and the load step they count from.

Degrees and millimetres in files and tables, SI inside the code. Motion may have been zeroed at
step 0: its coordinates there were subtracted from all others, and its own zeros are no readings.
"""

import numpy as np
from numpy.typing import ArrayLike, NDArray

COORDINATES = (
    "anterior",
    "superior",
    "right",
    "extension",
    "right_bending",
    "left_rotation",
)
"""The six coordinates of a joint, in the order used everywhere."""

TRANSLATIONS = COORDINATES[:3]
ROTATIONS = COORDINATES[3:]

GRAVITY_M_S2 = 9.81
STANDARD_GRAVITY = np.array([0.0, -GRAVITY_M_S2, 0.0])
"""m/s2 in ground axes: y points up."""

MM_PER_M = 1000.0
DEG_PER_RAD = float(np.rad2deg(1.0))

DISPLAY_PER_SI = np.array([MM_PER_M] * 3 + [DEG_PER_RAD] * 3)
"""(6,) what one SI unit of each coordinate is in file units (mm, deg)."""

COORDINATE_COLUMNS = tuple(
    f"{name}_{'mm' if name in TRANSLATIONS else 'deg'}" for name in COORDINATES
)
"""Column names of the six coordinates in files and tables."""

STIFFNESS_COLUMNS = tuple(
    f"{name}_{'n_per_m' if name in TRANSLATIONS else 'nm_per_rad'}" for name in COORDINATES
)
"""Column names of the six stiffnesses in files and tables."""

COORDINATE_UNITS = {name: "mm" if name in TRANSLATIONS else "deg" for name in COORDINATES}
"""Unit of each coordinate in files and tables."""

LOAD_UNITS = {name: "N" if name in TRANSLATIONS else "N m" for name in COORDINATES}
"""Unit of the load on each coordinate in files and tables."""

STIFFNESS_UNITS = {name: "N/m" if name in TRANSLATIONS else "N m/rad" for name in COORDINATES}
"""Unit of each stiffness in files and tables."""


def to_si(coordinates: ArrayLike) -> NDArray[np.float64]:
    """(…, 6) coordinates in mm and deg to m and rad."""
    return np.asarray(coordinates, dtype=float) / DISPLAY_PER_SI


def from_si(coordinates: ArrayLike) -> NDArray[np.float64]:
    """(…, 6) coordinates in m and rad to mm and deg."""
    return np.asarray(coordinates, dtype=float) * DISPLAY_PER_SI


def subtract_baseline(motion: NDArray[np.float64], zeroed: bool) -> NDArray[np.float64]:
    """(T, ...) motion by load step, or what is linear in it, as it is read: zeroed or not."""
    return motion - motion[0] if zeroed else motion


def without_step_0(readings: NDArray[np.float64], zeroed: bool) -> NDArray[np.float64]:
    """(T, ...) readings, NaN in step 0 where zeroing made what stands there."""
    kept = readings.copy()
    if zeroed:
        kept[:1] = np.nan
    return kept


def has_reading(step: ArrayLike, zeroed: bool) -> NDArray[np.bool_]:
    """Whether there can be a reading at load steps of these numbers."""
    return (np.asarray(step) != 0) | (not zeroed)
