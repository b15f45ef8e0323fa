"""Tracked motions as arrays again, from rows of the table."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import pandas as pd

from spinepipe.effects.contract import Array
from spinepipe.motion.skeleton import BODIES, JOINTS
from spinepipe.studies.tracking.tables import PELVIS
from spinepipe.units import COORDINATE_COLUMNS, DISPLAY_PER_SI

IN_ORDER = (PELVIS, *JOINTS)
"""Of the rows of a frame, as bodies are in a posture."""


@dataclass(frozen=True, eq=False)
class TrackedMotion:
    """A motion as an approach found it.

    Attributes
    ----------
    specimen, trial, approach : of what. time_s : (F,). q : (F, 18, 6) m and rad.
    """

    specimen: str
    trial: str
    approach: str
    time_s: Array
    q: Array

    @property
    def names(self) -> dict[str, str]:
        """Of what, as rows of tables have it."""
        return {"specimen": self.specimen, "trial": self.trial, "approach": self.approach}

    def at(self, time_s: Array) -> Array:
        """(N, 18, 6) between frames, straight; one frame alone holds for all times."""
        flat = self.q.reshape(len(self.q), -1)
        found = np.array([np.interp(time_s, self.time_s, column) for column in flat.T])
        return found.T.reshape(len(time_s), *self.q.shape[1:])


def motions(tracked: pd.DataFrame) -> Iterator[TrackedMotion]:
    """All motions of table `tracked`, in its order."""
    number = {name: k for k, name in enumerate(IN_ORDER)}
    for key, rows in tracked.groupby(["specimen", "trial", "approach"], sort=False, observed=True):
        specimen, trial, approach = (str(part) for part in key)
        # rows by frame, then bodies from below
        order = np.lexsort((rows["joint"].map(number).to_numpy(), rows["frame"].to_numpy()))
        flat = rows[list(COORDINATE_COLUMNS)].to_numpy(float)[order] / DISPLAY_PER_SI
        times = rows["time_s"].to_numpy(float)[order][:: len(BODIES)]
        q = flat.reshape(-1, len(BODIES), len(COORDINATE_COLUMNS))
        yield TrackedMotion(specimen, trial, approach, times, q)
