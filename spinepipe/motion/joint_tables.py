"""Tables of joints that come along and that a cohort may replace: their rows, and what is wrong.

A table names joints (`L4L5`) and coordinates (`extension`) in rows; units are those of files: mm,
deg, N, N m and what is made of them. Each row tells its source. Tables that come along also tell
how sure a row is: confirmed (read in the source), derived (worked out from such), from_memory (in
no text at hand; never used to accept a result), choice (no source at all).
"""

from collections.abc import Iterator, Mapping, Sequence
from importlib.resources import files
from math import isfinite

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from spinepipe.motion.skeleton import JOINTS
from spinepipe.problems import InputError, Problem, Spelling, one_of
from spinepipe.units import BORDER_PER_SI, COORDINATES, ROTATIONS

STATUSES = ("confirmed", "derived", "from_memory", "choice")
GIVEN = "given"
"""Status of rows of a cohort's own table that tells none."""

FIRST_LINE = 2
"""Line of the first row, where an editor shows it."""

SIDES = ("positive", "negative")

_NAMES: Mapping[str, Sequence[str]] = {
    "joint": JOINTS,
    "coordinate": COORDINATES,
    "side": SIDES,
}


def packaged_rows(name: str, numbers: Sequence[str]) -> pd.DataFrame:
    """A table that comes along, its rows indexed by line; `numbers` are columns of numbers."""
    with files("spinepipe.motion").joinpath(name).open(encoding="utf-8") as text:
        rows = pd.read_csv(text, dtype=str, keep_default_na=False)
    rows.index = pd.RangeIndex(FIRST_LINE, FIRST_LINE + len(rows))
    return rows.astype(dict.fromkeys(numbers, float))


def checked(
    rows: pd.DataFrame,
    file: str,
    keys: Sequence[str],
    numbers: Sequence[str],
    coordinates: Sequence[str] = COORDINATES,
) -> pd.DataFrame:
    """The rows, once columns, names and numbers are sound and no key comes twice.

    Parameters
    ----------
    rows : indexed by the line in the file. file : its name in messages.
    keys : columns that name a row. numbers : columns of finite numbers.
    coordinates : those that rows may name.

    Returns
    -------
    The rows with the columns `source` and `status`, in the order given.

    Raises
    ------
    InputError
        With every fault.
    """
    problems = list(_missing(rows, file, (*keys, *numbers, "source")))
    if not problems:
        names = {**_NAMES, "coordinate": coordinates}
        problems += _faults(rows, file, keys, numbers, names)
    if problems:
        raise InputError(problems)
    return rows if "status" in rows else rows.assign(status=GIVEN)


def _missing(rows: pd.DataFrame, file: str, columns: Sequence[str]) -> Iterator[Problem]:
    for name in columns:
        if name not in rows:
            yield Problem(file, 1, name, "no such column", one_of(columns), "add the column")


def _faults(
    rows: pd.DataFrame,
    file: str,
    keys: Sequence[str],
    numbers: Sequence[str],
    names: Mapping[str, Sequence[str]],
) -> Iterator[Problem]:
    words = {column: Spelling(known, "name one of these") for column, known in names.items()}
    for line, row in zip(map(int, rows.index), rows.to_dict("records"), strict=True):
        for column in keys:
            spelling = words.get(column)
            if spelling is not None and row[column] not in spelling.known:
                remedy = spelling.remedy(str(row[column]))
                yield Problem(file, line, column, repr(row[column]), spelling.allowed, remedy)
        for column in numbers:
            if not isfinite(row[column]):
                found = str(row[column])
                yield Problem(file, line, column, found, "a finite number", "fill it in")
        if not isinstance(row["source"], str) or not row["source"].strip():
            yield Problem(file, line, "source", "nothing", "text", "say where it comes from")
    again = rows[rows.duplicated(list(keys))]
    for line, row in zip(map(int, again.index), again.to_dict("records"), strict=True):
        found = " ".join(str(row[key]) for key in keys)
        yield Problem(file, line, keys[0], found, "each once", "remove one of the rows")


def joint_places(rows: pd.DataFrame) -> NDArray[np.int64]:
    """(N,) place of each row's joint in `JOINTS`."""
    return np.array([JOINTS.index(name) for name in rows["joint"]], dtype=np.int64)


def coordinate_places(rows: pd.DataFrame) -> NDArray[np.int64]:
    """(N,) place of each row's coordinate in `COORDINATES`."""
    return np.array([COORDINATES.index(name) for name in rows["coordinate"]], dtype=np.int64)


def per_si(coordinates: NDArray[np.int64]) -> NDArray[np.float64]:
    """(N,) what one m or rad is in mm or deg."""
    found: NDArray[np.float64] = BORDER_PER_SI[coordinates]
    return found


def is_rotation(name: str) -> bool:
    """Whether a coordinate is one of the three rotations."""
    return name in ROTATIONS
