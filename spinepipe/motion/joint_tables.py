"""Tables of joints that come along and that a cohort may replace: ranges of motion, ratios.

A table names joints (`L4L5`) and coordinates (`extension`) in rows; units are those of files: mm,
deg, N, N m and what is made of them. Each row tells its source. Tables that come along also tell
how sure a row is: confirmed (read in the source), derived (worked out from such), from_memory (in
no text at hand; never used to accept a result), choice (no source at all).

`bounds.csv`: rotations are the wider of White and Panjabi 1990 and, where they are larger, segments
in the rig at 7.5 N m (Wilke 2017); what is printed for flexion and extension together is parted as
regions of the spine do it. Neither source has translations: those are choices but one. The file
holds the raw range; how much wider a motion may be ("increased by 150 %", which is 1.5 or 2.5
times) is a setting.

`ratios.csv`: joints that turn in fixed shares of one rotation, which inverse kinematics is
constrained with. A set has up to three driving rotations, the sums over its joints of extension,
right bending and left rotation. A joint that a set does not name is locked: `christophy_2012`
shares out L1-S1 and holds all from T12L1 upwards stiff. Wang 2021 also used shares of Bruno 2015
and of Shojaei 2017, which are printed in no text at hand; a cohort that has them brings them.
`white_panjabi_1990` is no set of the paper: it shares T1-S1 out as ranges of motion are.
`ghezelbash_2016` is that of its section 2.6, T11-S1.
"""

from collections.abc import Sequence
from importlib.resources import files

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from spinepipe.effects.contract import Array
from spinepipe.motion.skeleton import JOINTS
from spinepipe.problems import InputError, InputProblem
from spinepipe.units import COORDINATES, DISPLAY_PER_SI, ROTATIONS

FIRST_LINE = 2
"""Line of the first row, where an editor shows it."""

SIDES = ("positive", "negative")

BOUNDS_FILE = "bounds.csv"
ENDS = ("low", "high")
"""mm or deg."""

RATIOS_FILE = "ratios.csv"

USUAL_SHARES = "ghezelbash_2016"
"""Set of tasks and of recorded lifts; ligaments of a trunk (`muscles`) are made for it."""

SUM_DIFFERS = 2e-3
"""By how much shares may miss 1: seventeen of them, rounded to four digits."""


def packaged_rows(name: str, numbers: Sequence[str]) -> pd.DataFrame:
    """A table that comes along, its rows indexed by line; `numbers` are columns of numbers."""
    with files("spinepipe.motion").joinpath(name).open(encoding="utf-8") as text:
        rows = pd.read_csv(text, dtype=str, keep_default_na=False)
    rows.index = pd.RangeIndex(FIRST_LINE, FIRST_LINE + len(rows))
    return rows.astype(dict.fromkeys(numbers, float))


def joint_places(rows: pd.DataFrame) -> NDArray[np.int64]:
    """(N,) place of each row's joint in `JOINTS`."""
    return np.array([JOINTS.index(name) for name in rows["joint"]], dtype=np.int64)


def coordinate_places(rows: pd.DataFrame) -> NDArray[np.int64]:
    """(N,) place of each row's coordinate in `COORDINATES`."""
    return np.array([COORDINATES.index(name) for name in rows["coordinate"]], dtype=np.int64)


def bounds(own: pd.DataFrame | None = None) -> Array:
    """(17, 6, 2) m and rad, lowest (at most zero) and highest (at least zero) coordinate of joints.

    Parameters
    ----------
    own : sound rows of a cohort's `bounds.csv`, mm and deg, which replace those that come along.
    """
    limits = np.full((len(JOINTS), len(COORDINATES), len(ENDS)), np.nan)
    for rows in [packaged_rows(BOUNDS_FILE, ENDS), *([] if own is None else [own])]:
        coordinate = coordinate_places(rows)
        values = rows[list(ENDS)].to_numpy(float) / DISPLAY_PER_SI[coordinate][:, None]
        limits[joint_places(rows), coordinate] = values
    return limits


def ratio_sets(own: pd.DataFrame | None = None, file: str = RATIOS_FILE) -> dict[str, Array]:
    """Shares (17, 3) of joints in extension, right bending and left rotation, by name of the set.

    Parameters
    ----------
    own : sound rows of a cohort's `ratios.csv`, indexed by line; its sets take the place of those
        of their name that come along.
    file : its name in messages.

    Raises
    ------
    InputError
        Of shares that do not sum to 1.
    """
    problems = []
    if own is not None:
        # shares of a rotation that are not all of it
        for (name, coordinate), part in own.groupby(["set", "coordinate"], sort=False):
            total = float(part["ratio"].sum())
            if abs(total - 1.0) > SUM_DIFFERS:
                wrong, line = f"ratios of {coordinate} in {name} sum to {total:.4g}", part.index[0]
                told = (wrong, "a sum of 1", "divide each by their sum")
                problems.append(InputProblem(file, int(str(line)), "ratio", *told))
    if problems:
        raise InputError(problems)
    found: dict[str, Array] = {}
    for rows in [packaged_rows(RATIOS_FILE, ("ratio",)), *([] if own is None else [own])]:
        for name, part in rows.groupby("set", sort=False):
            shares = np.zeros((len(JOINTS), len(ROTATIONS)))
            rotation = coordinate_places(part) - COORDINATES.index(ROTATIONS[0])
            shares[joint_places(part), rotation] = part["ratio"].to_numpy(float)
            found[str(name)] = shares
    return found
