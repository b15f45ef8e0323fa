"""What the rigs of a cohort fix: which joint coordinates, at which values, whether it was measured.

A held coordinate stays where it is in the neutral pose, at zero. A prescribed one is where
``motion.csv`` says at each step; the neutral pose is where zeroed motion counts from. Neither is a
reading then. Where the rig's load was measured, `loads.csv` lists it: what the model needs besides
is read as zero, in the SD of that load.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
import pandas as pd

from spinepipe.cohort.cohort import EVERYONE, Cohort, MeasurementSd
from spinepipe.effects.contract import Array
from spinepipe.model import LoadCase, Support
from spinepipe.units import BORDER_PER_SI, COORDINATE_COLUMNS, COORDINATES

FREE, HELD, PRESCRIBED = "free", "held", "prescribed"
STATES = (FREE, HELD, PRESCRIBED)
MEASURED, UNKNOWN = "measured", "unknown"
REACTIONS = (UNKNOWN, MEASURED)


class Fixed(NamedTuple):
    """A coordinate that a rig fixes in a test of a specimen; ``state`` is held or prescribed."""

    joint: int
    coordinate: int
    state: str
    measured: bool


def fixed(
    supports: pd.DataFrame | None, specimen: str, test: str, joints: Sequence[str]
) -> tuple[Fixed, ...]:
    """Coordinates fixed in a test, in the order of a model; of rows that fit the last counts."""
    found: dict[tuple[int, int], Fixed] = {}
    for joint, coordinate, state, reaction in _rows(supports, specimen, test):
        for number, name in enumerate(joints):
            if joint in (EVERYONE, name):
                place = number, COORDINATES.index(coordinate)
                found[place] = Fixed(*place, state, reaction == MEASURED)
    return tuple(found[place] for place in sorted(found) if found[place].state != FREE)


def _rows(
    supports: pd.DataFrame | None, specimen: str, test: str
) -> Iterator[tuple[str, str, str, object]]:
    """Joint, coordinate, state and reaction of rows for a test of a specimen."""
    if supports is None:
        return
    names = ("specimen", "test", "joint", "coordinate", "state", "reaction")
    for who, what, *cells in zip(*(supports[name] for name in names), strict=True):
        joint, coordinate, state, reaction = cells
        sound = isinstance(joint, str) and coordinate in COORDINATES and state in STATES
        if sound and who in (EVERYONE, specimen) and what in (EVERYONE, test):
            yield joint, coordinate, state, reaction


def supported(cohort: Cohort, specimen: str, case: LoadCase, motion: Array) -> LoadCase:
    """The case with what its rig fixes; ``motion`` (T, J, 6) m and rad as measured."""
    found = fixed(cohort.supports, specimen, case.test, cohort.joint_names)
    if not found:
        return case
    read_as = _read_as(cohort.measurement_sd)
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


def _read_as(sd: MeasurementSd | None) -> Mapping[int, float | None]:
    """m per N or rad per N m, by coordinate: one SD of a load counts as one SD of a motion."""
    if sd is None:
        return dict.fromkeys(range(6))
    pairs = [(sd.translation_mm, sd.force_n)] * 3 + [(sd.rotation_deg, sd.moment_nm)] * 3
    return {
        number: None if load is None else moved / float(BORDER_PER_SI[number]) / load
        for number, (moved, load) in enumerate(pairs)
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
    for (specimen, test), rows in table.groupby(["specimen", "test"], sort=False):
        for one in fixed(cohort.supports, str(specimen), str(test), joints):
            there = rows.index[rows["joint"] == joints[one.joint]]
            table.loc[there, COORDINATE_COLUMNS[one.coordinate]] = 0.0 if one.measured else np.nan
    return table
