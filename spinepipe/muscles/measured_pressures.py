"""Pressures measured in a volunteer's disc, each with its source and the task that it is of.

A status is confirmed (read where it stands), derived (worked out from such), or from_memory (not
found in any text at hand: shown, never used to accept or reject a result).
"""

import csv
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from importlib.resources import files

import numpy as np

from spinepipe.muscles.task import Task
from spinepipe.units import DEG_PER_RAD

COUNTED = (1, 2, 3, 4, 6, 9)
"""Tasks of Ghezelbash 2016 Table 1 over which agreement is counted, 9 at 20 deg."""

SAME_DEG = 0.5


@dataclass(frozen=True)
class MeasuredPressure:
    """Pressure in the disc L4L5 of one volunteer, MPa.

    Attributes
    ----------
    task : of Ghezelbash 2016 Table 1; None for other postures.
    value : None where a range alone is given, `low` to `high`.
    """

    task: int | None
    posture: str
    condition: str
    value: float | None
    low: float | None
    high: float | None
    source: str
    status: str
    note: str


@dataclass(frozen=True)
class PairedPressure:
    """A measured pressure beside a task, MPa: the mean where series differ."""

    task: str
    mpa: float
    status: str
    source: str
    counted: bool


@cache
def measured_pressures() -> tuple[MeasuredPressure, ...]:
    """Pressures measured in L4L5 (Wilke 1999, 2001), several for a task where series differ."""
    text = files("spinepipe.muscles").joinpath("measured_pressures.csv").read_text(encoding="utf-8")
    return tuple(
        MeasuredPressure(
            task=int(row["task"]) if row["task"] else None,
            value=float(row["pressure_mpa"]) if row["pressure_mpa"] else None,
            low=float(row["low_mpa"]) if row["low_mpa"] else None,
            high=float(row["high_mpa"]) if row["high_mpa"] else None,
            **{name: row[name] for name in ("posture", "condition", "source", "status", "note")},
        )
        for row in csv.DictReader(text.splitlines())
    )


def pair_with_tasks(tasks: Mapping[str, Task]) -> tuple[PairedPressure, ...]:
    """Measured pressures of those tasks that have one."""
    return paired(
        {
            name: (task.number, DEG_PER_RAD * float(task.turned[-1, 1]))
            for name, task in tasks.items()
        }
    )


def paired(asked: Mapping[str, tuple[int | None, float]]) -> tuple[PairedPressure, ...]:
    """The same by the tasks' numbers in Table 1 and rotations of the trunk to the right, deg."""
    found = []
    for name, (number, bent_deg) in asked.items():
        if number is None or number == 7:  # a course of angles, not one posture
            continue
        rows = [row for row in measured_pressures() if row.task == number and row.value]
        if number == 9:  # lateral bending was measured at several angles
            of_each = [(row, row.condition.removesuffix(" deg")) for row in rows]
            rows = [
                row
                for row, deg in of_each
                if deg.isdigit() and abs(float(deg) - abs(bent_deg)) < SAME_DEG
            ]
        # confirmed series alone, where there are any
        rows = [row for row in rows if row.status == "confirmed"] or rows
        if rows:
            status = rows[0].status
            source = "; ".join(dict.fromkeys(row.source for row in rows))
            mean = float(np.mean([row.value for row in rows if row.value is not None]))
            counted = number in COUNTED and status == "confirmed"
            found.append(PairedPressure(name, mean, status, source, counted))
    return tuple(found)
