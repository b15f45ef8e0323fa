"""What is known of where vertebrae were, from a cohort's `truth_centres.csv`."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from spinepipe.effects.contract import Array
from spinepipe.motion.skeleton import BODIES, rotations
from spinepipe.studies.tracking.forms import TRUTH_CENTRES
from spinepipe.units import MM_PER_M, ROTATIONS

_PLACE = ["x_mm", "y_mm", "z_mm"]
_TURN = [f"{axis}_deg" for axis in ROTATIONS]


@dataclass(frozen=True, eq=False)
class Truth:
    """True poses of bodies in ground, at some instants of a trial.

    Attributes
    ----------
    specimen, trial : of what. time_s : (N,). centres : (N, 18, 3) m, zero where not known.
    known : (N, 18). turns : (N, 18, 3, 3), unity where not known. turned : (N, 18).
    """

    specimen: str
    trial: str
    time_s: Array
    centres: Array
    known: NDArray[np.bool_]
    turns: Array
    turned: NDArray[np.bool_]


def truths(further: dict[str, pd.DataFrame]) -> Iterator[Truth]:
    """All that a cohort's folder tells, in its order; nothing where it has no such file."""
    rows = further.get(TRUTH_CENTRES.stem)
    if rows is None:
        return
    for key, own in rows.groupby(["specimen", "trial"], sort=False):
        specimen, trial = (str(part) for part in key)
        yield _truth(specimen, trial, own)


def _truth(specimen: str, trial: str, rows: pd.DataFrame) -> Truth:
    times, at = np.unique(rows["time_s"].to_numpy(float), return_inverse=True)
    body = np.array([BODIES.index(name) for name in rows["vertebra"]])
    shape = (len(times), len(BODIES))
    known, turned = np.zeros(shape, dtype=bool), np.zeros(shape, dtype=bool)
    centres, turns = np.zeros((*shape, 3)), np.tile(np.eye(3), (*shape, 1, 1))
    known[at, body] = True
    centres[at, body] = rows[_PLACE].to_numpy(float) / MM_PER_M
    angles = np.deg2rad(rows[_TURN].to_numpy(float))
    told = np.isfinite(angles).all(axis=1)
    turned[at[told], body[told]] = True
    turns[at[told], body[told]] = rotations(angles[told])
    return Truth(specimen, trial, times, centres, known, turns, turned)
