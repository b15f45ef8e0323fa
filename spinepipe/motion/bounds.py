"""How far joints go: ranges of motion as sources print them, which a study widens.

Rotations are the wider of White and Panjabi 1990 and, where they are larger, segments in the rig
at 7.5 N m (Wilke 2017); what is printed for flexion and extension together is parted as regions
of the spine do it. Neither source has translations: those are choices but one. The file holds the
raw range; how much wider a motion may be ("increased by 150 %", which is 1.5 or 2.5 times) is a
setting.
"""

from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from spinepipe.effects.contract import Array
from spinepipe.motion.joint_tables import (
    coordinate_places,
    joint_places,
    packaged_rows,
    per_si,
    with_status,
)
from spinepipe.motion.skeleton import JOINTS
from spinepipe.units import COORDINATES

FILE = "bounds.csv"
NUMBERS = ("low", "high")
"""mm or deg."""


@dataclass(frozen=True, eq=False)
class Bounds:
    """Ranges of motion of all joints.

    Attributes
    ----------
    limits : (17, 6, 2) m and rad, lowest (at most zero) and highest (at least zero).
    source, status : (17, 6) text of each.
    """

    limits: Array
    source: NDArray[np.object_]
    status: NDArray[np.object_]

    def __post_init__(self) -> None:
        for array in (self.limits, self.source, self.status):
            array.flags.writeable = False

    def widened(self, times: float) -> Array:
        """(17, 6, 2) m and rad, the range times a factor on both sides of zero."""
        return times * self.limits


def bounds(own: pd.DataFrame | None = None) -> Bounds:
    """The ranges that come along, with a cohort's own rows in place of theirs.

    Parameters
    ----------
    own : sound rows of `bounds.csv`, mm and deg. None: what comes along.
    """
    limits = np.full((len(JOINTS), len(COORDINATES), len(NUMBERS)), np.nan)
    source, status = np.full((2, *limits.shape[:2]), "", dtype=object)
    tables = [packaged_rows(FILE, NUMBERS), *([] if own is None else [with_status(own)])]
    for rows in tables:
        coordinate = coordinate_places(rows)
        at = joint_places(rows), coordinate
        limits[at] = rows[list(NUMBERS)].to_numpy(float) / per_si(coordinate)[:, None]
        source[at], status[at] = (rows[word].to_numpy(object) for word in ("source", "status"))
    return Bounds(limits, source, status)
