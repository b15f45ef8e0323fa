"""Which measured pressure stands beside which task."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from spinepipe.muscles.references import MeasuredPressure, measured_pressures
from spinepipe.muscles.task import Task
from spinepipe.units import DEG_PER_RAD

COUNTED = (1, 2, 3, 4, 6, 9)
"""Tasks of Ghezelbash 2016 Table 1 over which agreement is counted, 9 at 20 deg."""

SAME_DEG = 0.5


@dataclass(frozen=True)
class PairedPressure:
    """A measured pressure beside a task, MPa: the mean where series differ."""

    task: str
    mpa: float
    status: str
    source: str
    counted: bool


def beside_tasks(tasks: Mapping[str, Task]) -> tuple[PairedPressure, ...]:
    """Measured pressures of those tasks that have one."""
    found = (_beside(name, task) for name, task in tasks.items())
    return tuple(one for one in found if one is not None)


def _beside(name: str, task: Task) -> PairedPressure | None:
    rows = [row for row in measured_pressures() if row.task == task.number and row.value]
    if task.number is None or task.number == 7:
        return None
    if task.number == 9:
        rows = [row for row in rows if _same_bend(row, task)]
    rows = [row for row in rows if row.status == "confirmed"] or rows
    if not rows:
        return None
    status = rows[0].status
    source = "; ".join(dict.fromkeys(row.source for row in rows))
    mean = float(np.mean([row.value for row in rows if row.value is not None]))
    counted = task.number in COUNTED and status == "confirmed"
    return PairedPressure(name, mean, status, source, counted)


def _same_bend(row: MeasuredPressure, task: Task) -> bool:
    """Whether the measured lateral bending is the task's."""
    bent = DEG_PER_RAD * abs(float(task.turned[-1, 1]))
    told = row.condition.removesuffix(" deg")
    return told.isdigit() and abs(float(told) - bent) < SAME_DEG
