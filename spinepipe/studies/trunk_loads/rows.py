"""What became of a task of a person, as rows of tasks, levels, muscles, paths and iterations."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from spinepipe.anatomy.segments import MASS_PERCENT
from spinepipe.effects.contract import Array
from spinepipe.muscles.disc_pressure import DiscPressure, disc_pressure
from spinepipe.muscles.masses import ARM
from spinepipe.muscles.muscle_equilibrium import L4L5, SolvedTask, SolverOptions
from spinepipe.muscles.person import Person
from spinepipe.muscles.strength import HeldTask, hold_task
from spinepipe.muscles.task import Task
from spinepipe.muscles.trunk import LEVELS
from spinepipe.status import Balanced
from spinepipe.units import DEG_PER_RAD, MM_PER_M

Row = dict[str, Any]

L5S1 = LEVELS.index("L5S1")
_AXES = {"extension": 2, "right_bending": 0, "left_rotation": 1}
"""Which of x, y, z each is about, in the order of the columns."""

_MPA = 1e-6


@dataclass(frozen=True, eq=False)
class TaskOutcome:
    """A task of a person, and what became of it.

    Attributes
    ----------
    solved : None where it could not be posed; `message` says why.
    tone : least activation of every muscle. stable : None where not asked for.
    factor : how many times the loads could be as large. capacity : (7,) N m left.
    held : at what muscle stress, and what a task lacks that is not held.
    """

    person: Person
    task: Task
    solved: SolvedTask | None
    message: str
    tone: float | None = None
    stable: bool | None = None
    factor: float | None = None
    capacity: Array | None = None
    held: HeldTask | None = None

    @property
    def status(self) -> Balanced:
        """How it ended."""
        return Balanced.OUT_OF_REACH if self.solved is None else self.solved.status

    @property
    def pressure(self) -> DiscPressure | None:
        """Pressure in the disc L4L5."""
        if self.solved is None:
            return None
        flexion = -float(self.solved.poses.turned[L4L5, 2])
        area = float(self.person.lines.trunk.disc_area[L4L5])
        return disc_pressure(float(self.solved.compression[L4L5]), area, flexion)


def outcome_of(person: Person, task: Task, options: SolverOptions) -> TaskOutcome:
    """What becomes of a task; a load that the arms do not reach is an outcome as well."""
    try:
        held = hold_task(person, task, options, least="untold")
    except ValueError as why:
        return TaskOutcome(person, task, None, str(why))
    return TaskOutcome(person, task, held.solved, held.solved.message, held=held)


def task_row(outcome: TaskOutcome) -> Row:
    """The row of table tasks."""
    person, task, solved, held = outcome.person, outcome.task, outcome.solved, outcome.held
    # counted from upright, as tasks are told
    turned = DEG_PER_RAD * (task.turned - (0.0 if task.from_upright else person.upright))
    subject = person.subject
    percent = sum(MASS_PERCENT[f"{segment} {subject.sex}"] for segment in ARM)
    arms = 0.02 * percent * subject.mass_kg
    row: Row = {
        "number": task.number,
        "trunk_extension_deg": float(turned[-1, 0]),
        "trunk_right_bending_deg": float(turned[-1, 1]),
        "pelvis_extension_deg": float(turned[0, 0]),
        "hand_load_kg": task.hands.kg,
        "carried_kg": sum(mass.kg for mass in person.masses) + arms + task.hands.kg,
        "largest_stress_mpa": _MPA * task.stress_pa,
        "tone": task.tone,
        "tone_share": outcome.tone,
        "stable": outcome.stable,
        "strength_used": None if not outcome.factor else 1.0 / outcome.factor,
        "status": outcome.status.value,
        "message": outcome.message,
    }
    if held is not None:
        least = None if held.least_pa is None else _MPA * held.least_pa
        row |= {"least_stress_mpa": least, "short_of": held.short_of, "short_at": held.short_at}
    pressure = outcome.pressure
    if solved is None or pressure is None:
        return row
    active = (solved.found.forces - solved.stretched) / person.lines.trunk.muscles.pcsa
    return row | {
        "l4l5_pressure_mpa": _MPA * float(pressure.pa),
        "l4l5_pressure_dreischarf_mpa": _MPA * float(pressure.dreischarf_pa),
        "l4l5_nominal_pressure_mpa": _MPA * float(pressure.nominal_pa),
        "l4l5_flexion_deg": DEG_PER_RAD * float(pressure.flexion),
        "inside_eq_6": bool(pressure.inside),
        "l4l5_compression_n": float(solved.compression[L4L5]),
        "l4l5_shear_n": float(solved.pushes[L4L5, 0]),
        "l5s1_compression_n": float(solved.compression[L5S1]),
        "l5s1_shear_n": float(solved.pushes[L5S1, 0]),
        "largest_slack_nm": float(np.abs(solved.slack_on_discs).max()),
        "highest_stress_mpa": _MPA * float(active.max()),
        "iterations": len(solved.rounds),
    }


def level_rows(outcome: TaskOutcome) -> Iterator[Row]:
    """Rows of table levels."""
    solved = outcome.solved
    for level, name in enumerate(LEVELS):
        row: Row = {"level": name, "status": outcome.status.value}
        if solved is not None:
            place = MM_PER_M * (solved.poses.centres[level] - solved.poses.centres[0])
            row |= {
                "compression_n": float(solved.compression[level]),
                "shear_anterior_n": float(solved.pushes[level, 0]),
                "shear_right_n": float(solved.pushes[level, 2]),
                "stiffening": float(solved.stiffening[level]),
                **dict(zip(("x_mm", "y_mm", "z_mm"), place.tolist(), strict=True)),
            }
            told = {
                "required": solved.on_discs[level],
                "passive": solved.joint_moments[level],
                "slack": solved.slack_on_discs[level],
            }
            for axis, at in _AXES.items():
                row[f"{axis}_deg"] = DEG_PER_RAD * float(solved.poses.turned[level, at])
                row |= {f"{what}_{axis}_nm": float(m[at]) for what, m in told.items()}
        if outcome.capacity is not None:
            row["capacity_left_nm"] = float(outcome.capacity[level])
        yield row


def muscle_rows(outcome: TaskOutcome) -> Iterator[Row]:
    """Rows of table muscles."""
    muscles, solved = outcome.person.lines.trunk.muscles, outcome.solved
    for k, name in enumerate(muscles.names):
        row: Row = {
            "muscle": name,
            "group": muscles.groups[k],
            "side": muscles.sides[k],
            "pcsa_mm2": 1e6 * float(muscles.pcsa[k]),
            "status": outcome.status.value,
        }
        if solved is not None:
            force, passive = float(solved.found.forces[k]), float(solved.stretched[k])
            strength = outcome.task.stress_pa * float(muscles.pcsa[k])
            row |= {
                "force_n": force,
                "passive_n": passive,
                "stress_mpa": _MPA * force / float(muscles.pcsa[k]),
                "activity": max((force - passive) / strength, 0.0),
                "length_mm": MM_PER_M * float(solved.pulls.lengths[k]),
                "stretch": float(solved.pulls.lengths[k] / outcome.person.rest[k]),
                "contacts": int(solved.pulls.contacts[k]),
                "contact_n": force * float(solved.pulls.pushes[k]),
            }
        yield row


def path_rows(outcome: TaskOutcome) -> Iterator[Row]:
    """Rows of table paths; none where the task could not be posed."""
    muscles, solved = outcome.person.lines.trunk.muscles, outcome.solved
    if solved is None:
        return
    pulls, origin = solved.pulls, solved.poses.centres[0]
    for k, name in enumerate(muscles.names):
        known = {"muscle": name, "group": muscles.groups[k], "side": muscles.sides[k]}
        stress = _MPA * float(solved.found.forces[k] / muscles.pcsa[k])
        for point in range(int(pulls.traced[k])):
            x, y, z = (MM_PER_M * (pulls.trace[k, point] - origin)).tolist()
            yield known | {"point": point, "x_mm": x, "y_mm": y, "z_mm": z, "stress_mpa": stress}


def iteration_rows(outcome: TaskOutcome) -> Iterator[Row]:
    """Rows of table iterations."""
    for number, one in enumerate(outcome.solved.rounds if outcome.solved else ()):
        yield {
            "iteration": number,
            "change": one.change,
            "residual_nm": one.residual_nm,
            "l4l5_compression_n": float(one.compression_n),
        }
