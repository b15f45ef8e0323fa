"""Joints that turn in fixed shares of one rotation: what inverse kinematics is constrained with.

A set has up to three driving rotations, the sums over its joints of extension, right bending and
left rotation. A joint that a set does not name is locked: `christophy_2012` shares out L1-S1 and
holds all from T12L1 upwards stiff. Wang 2021 also used shares of Bruno 2015 and of Shojaei 2017,
which are printed in no text at hand; a cohort that has them brings them as `ratios.csv`.
`white_panjabi_1990` is no set of the paper: it shares T1-S1 out as ranges of motion are.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from spinepipe.effects.contract import Array
from spinepipe.motion.joint_tables import (
    coordinate_places,
    joint_places,
    packaged_rows,
    with_status,
)
from spinepipe.motion.skeleton import JOINTS
from spinepipe.problems import InputError, InputProblem
from spinepipe.units import COORDINATES, ROTATIONS

FILE = "ratios.csv"
NUMBERS = ("ratio",)

SUM_DIFFERS = 2e-3
"""By how much shares may miss 1: seventeen of them, rounded to four digits."""


@dataclass(frozen=True, eq=False)
class RatioSet:
    """Shares of joints in driving rotations.

    Attributes
    ----------
    name : christophy_2012, ... source : of its rows, each text once. status : likewise.
    shares : (17, 3) of joints from below in extension, right bending and left rotation.
    """

    name: str
    source: tuple[str, ...]
    status: tuple[str, ...]
    shares: Array

    def __post_init__(self) -> None:
        self.shares.flags.writeable = False

    @property
    def locked(self) -> NDArray[np.bool_]:
        """(17,) joints that do not turn at all."""
        return np.asarray(~self.shares.any(axis=1))

    @property
    def mapping(self) -> Array:
        """(17, 6, 3) coordinates of the joints by the driving rotations, rad by rad."""
        found = np.zeros((len(JOINTS), len(COORDINATES), len(ROTATIONS)))
        for k, name in enumerate(ROTATIONS):
            found[:, COORDINATES.index(name), k] = self.shares[:, k]
        return found

    def coordinates(self, driving: Array) -> Array:
        """(..., 17, 6) coordinates of joints turned by driving rotations (..., 3), rad."""
        return np.einsum("jck,...k->...jc", self.mapping, driving)


def ratio_sets(own: pd.DataFrame | None = None, file: str = FILE) -> dict[str, RatioSet]:
    """The sets that come along, and a cohort's own, which take the place of those of their name.

    Parameters
    ----------
    own : sound rows of `ratios.csv`, indexed by line. None: what comes along.
    file : its name in messages.

    Raises
    ------
    InputError
        Of shares that do not sum to 1.
    """
    if own is not None and (problems := list(_faults(own, file))):
        raise InputError(problems)
    found: dict[str, RatioSet] = {}
    for rows in [packaged_rows(FILE, NUMBERS), *([] if own is None else [with_status(own)])]:
        found |= {str(key): _set(str(key), part) for key, part in rows.groupby("set", sort=False)}
    return found


def _set(name: str, rows: pd.DataFrame) -> RatioSet:
    shares = np.zeros((len(JOINTS), len(ROTATIONS)))
    turned = coordinate_places(rows) - COORDINATES.index(ROTATIONS[0])
    shares[joint_places(rows), turned] = rows["ratio"].to_numpy(float)
    source, status = (tuple(dict.fromkeys(rows[word])) for word in ("source", "status"))
    return RatioSet(name, source, status, shares)


def _faults(rows: pd.DataFrame, file: str) -> Iterator[InputProblem]:
    """Shares of a rotation that are not all of it."""
    for (name, coordinate), part in rows.groupby(["set", "coordinate"], sort=False):
        total = float(part["ratio"].sum())
        if abs(total - 1.0) > SUM_DIFFERS:
            found = f"ratios of {coordinate} in {name} sum to {total:.4g}"
            line = int(str(part.index[0]))
            yield InputProblem(file, line, "ratio", found, "a sum of 1", "divide each by their sum")
