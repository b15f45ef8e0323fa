"""What the rigs of a cohort fix: which joint coordinates, at which values, whether it was measured.

A held coordinate stays where it is in the neutral pose, at zero. A prescribed one is where
``motion.csv`` says at each step; the neutral pose is where zeroed motion counts from. Neither is a
reading then. Where the rig's load was measured, `loads.csv` lists it: what the model needs besides
is read as zero, in the SD of that load.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
import pandas as pd

from spinepipe.cohort.cohort import Cohort
from spinepipe.documents.names import EVERYONE
from spinepipe.effects.contract import Array
from spinepipe.model import LoadCase, Support
from spinepipe.units import COORDINATE_COLUMNS, COORDINATES, to_si

FREE, HELD, PRESCRIBED = "free", "held", "prescribed"
STATES = (FREE, HELD, PRESCRIBED)
MEASURED = "measured"


class FixedCoordinate(NamedTuple):
    """A coordinate that a rig fixes in a test of a specimen; ``state`` is held or prescribed."""

    joint: int
    coordinate: int
    state: str
    measured: bool


class Rig:
    """What `supports.csv` says, by specimen and test, so that many can be asked for.

    Rows that are bad, or of a joint that there is not, say nothing.
    """

    def __init__(self, supports: pd.DataFrame | None, joints: Sequence[str]) -> None:
        """``supports`` : the table; ``joints`` : names in the order of a model."""
        self._rows: dict[tuple[str, str], dict[tuple[int, int], tuple[int, FixedCoordinate]]] = {}
        if supports is None:
            return
        numbers: dict[str, tuple[int, ...]] = {
            name: (number,) for number, name in enumerate(joints)
        }
        numbers[EVERYONE] = tuple(range(len(joints)))
        columns = ("specimen", "test", "joint", "coordinate", "state", "reaction")
        cells = (supports[name].tolist() for name in columns)
        for row, (who, what, joint, coordinate, state, reaction) in enumerate(
            zip(*cells, strict=True)
        ):
            if joint not in numbers or coordinate not in COORDINATES or state not in STATES:
                continue
            known = self._rows.setdefault((who, what), {})
            for number in numbers[joint]:
                place = number, COORDINATES.index(coordinate)
                known[place] = row, FixedCoordinate(*place, state, reaction == MEASURED)

    def fixed(self, specimen: str, test: str) -> tuple[FixedCoordinate, ...]:
        """Coordinates fixed in a test, in the order of a model; the last row that fits counts."""
        found: dict[tuple[int, int], tuple[int, FixedCoordinate]] = {}
        for who in dict.fromkeys((EVERYONE, specimen)):
            for what in dict.fromkeys((EVERYONE, test)):
                for place, (row, one) in self._rows.get((who, what), {}).items():
                    if place not in found or found[place][0] < row:
                        found[place] = row, one
        return tuple(found[place][1] for place in sorted(found) if found[place][1].state != FREE)


def with_supports(cohort: Cohort, specimen: str, case: LoadCase, motion: Array) -> LoadCase:
    """The case with what its rig fixes; ``motion`` (T, J, 6) m and rad as measured."""
    found = Rig(cohort.supports, cohort.joint_names).fixed(specimen, case.test)
    if not found:
        return case
    read_as = _read_as(cohort)
    steps = []
    for step, q in zip(case.steps, motion, strict=True):
        rig = tuple(
            Support(
                one.joint,
                one.coordinate,
                float(q[one.joint, one.coordinate]) if one.state == PRESCRIBED else 0.0,
                read_as[one.coordinate] if one.measured else None,
            )
            for one in found
        )
        steps.append(replace(step, supports=rig))
    return replace(case, steps=tuple(steps))


def _read_as(cohort: Cohort) -> Mapping[int, float | None]:
    """m per N or rad per N m, by coordinate: one SD of a load counts as one SD of a motion."""
    moved, told = cohort.reading_sd(), (cohort.measurement_sd, cohort.accuracy)
    loads = [
        max((of for sd in told if (of := getattr(sd, kind, None)) is not None), default=None)
        for kind in ("force_n", "moment_nm")
    ]
    return {
        number: None if moved is None or load is None else float(to_si(moved)[number]) / load
        for number, load in enumerate(np.repeat(np.array(loads, dtype=object), 3))
    }


def as_read(case: LoadCase, motion: Array) -> Array:
    """The motion (T, J, 6) without what is no reading, and zero where a reaction is one."""
    if not case.fixed:
        return motion
    found = motion.copy()
    for step, q in zip(case.steps, found, strict=True):
        for one in step.supports:
            q[one.joint, one.coordinate] = np.nan if one.read_as is None else 0.0
    return found


def motion_read(cohort: Cohort) -> pd.DataFrame:
    """The table of motion without what is no reading, and zero where a reaction is one."""
    assert cohort.motion is not None
    if cohort.supports is None:
        return cohort.motion
    table = cohort.motion.copy()
    joints = cohort.joint_names
    rig = Rig(cohort.supports, joints)
    for (specimen, test), rows in table.groupby(["specimen", "test"], sort=False):
        for one in rig.fixed(str(specimen), str(test)):
            there = rows.index[rows["joint"] == joints[one.joint]]
            table.loc[there, COORDINATE_COLUMNS[one.coordinate]] = 0.0 if one.measured else np.nan
    return table
