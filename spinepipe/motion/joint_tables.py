"""Tables of joints that come along and that a cohort may replace.

A table names joints (`L4L5`) and coordinates (`extension`) in rows; units are those of files: mm,
deg, N, N m and what is made of them. Each row tells its source. Tables that come along also tell
how sure a row is: confirmed (read in the source), derived (worked out from such), from_memory (in
no text at hand; never used to accept a result), choice (no source at all).
"""

from collections.abc import Sequence
from importlib.resources import files

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from spinepipe.motion.skeleton import JOINTS
from spinepipe.units import COORDINATES, DISPLAY_PER_SI

GIVEN = "given"
"""Status of rows of a cohort's own table that tells none."""

FIRST_LINE = 2
"""Line of the first row, where an editor shows it."""

SIDES = ("positive", "negative")


def packaged_rows(name: str, numbers: Sequence[str]) -> pd.DataFrame:
    """A table that comes along, its rows indexed by line; `numbers` are columns of numbers."""
    with files("spinepipe.motion").joinpath(name).open(encoding="utf-8") as text:
        rows = pd.read_csv(text, dtype=str, keep_default_na=False)
    rows.index = pd.RangeIndex(FIRST_LINE, FIRST_LINE + len(rows))
    return rows.astype(dict.fromkeys(numbers, float))


def with_status(rows: pd.DataFrame) -> pd.DataFrame:
    """A cohort's own rows, those without a status as given."""
    told = rows["status"] if "status" in rows else pd.Series(GIVEN, rows.index)
    return rows.assign(status=told.fillna(GIVEN))


def joint_places(rows: pd.DataFrame) -> NDArray[np.int64]:
    """(N,) place of each row's joint in `JOINTS`."""
    return np.array([JOINTS.index(name) for name in rows["joint"]], dtype=np.int64)


def coordinate_places(rows: pd.DataFrame) -> NDArray[np.int64]:
    """(N,) place of each row's coordinate in `COORDINATES`."""
    return np.array([COORDINATES.index(name) for name in rows["coordinate"]], dtype=np.int64)


def per_si(coordinates: NDArray[np.int64]) -> NDArray[np.float64]:
    """(N,) what one m or rad is in mm or deg."""
    found: NDArray[np.float64] = DISPLAY_PER_SI[coordinates]
    return found
