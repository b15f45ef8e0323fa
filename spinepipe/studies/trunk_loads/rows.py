"""Rows of a task that was held: tasks, levels, muscles, paths, iterations."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from spinepipe.anatomy.segments import MASS_PERCENT
from spinepipe.effects.contract import Array
from spinepipe.muscles.disc_pressure import DiscPressure, disc_pressure
from spinepipe.muscles.masses import ARM
from spinepipe.muscles.muscle_equilibrium import L4L5, SolvedTask
from spinepipe.muscles.person import Person
from spinepipe.muscles.task import Task
from spinepipe.muscles.trunk import LEVELS
from spinepipe.status import Balanced
from spinepipe.units import DEG_PER_RAD, MM_PER_M

Row = dict[str, Any]

L5S1 = LEVELS.index("L5S1")
_AXES = ("extension", "right_bending", "left_rotation")
_OF_AXIS = {"right_bending": 0, "left_rotation": 1, "extension": 2}
_MPA = 1e-6


@dataclass(frozen=True, eq=False)
class TaskOutcome:
    """A task of a person, and what became of it.

    Attributes
    ----------
    held : None where it could not be posed; `message` says why.
    tone : least activation of every muscle. stable : None where not asked for.
    factor : how many times the loads could be as large. capacity : (7,) N m left.
    """

    person: Person
    task: Task
    held: SolvedTask | None
    message: str
    tone: float | None = None
    stable: bool | None = None
    factor: float | None = None
    capacity: Array | None = None

    @property
    def status(self) -> Balanced:
        """How it ended."""
        return Balanced.OUT_OF_REACH if self.held is None else self.held.status

    @property
    def pressure(self) -> DiscPressure | None:
        """Pressure in the disc L4L5."""
        if self.held is None:
            return None
        flexion = -float(self.held.poses.turned[L4L5, 2])
        area = float(self.person.lines.trunk.disc_area[L4L5])
        return disc_pressure(float(self.held.compression[L4L5]), area, flexion)


def task_row(outcome: TaskOutcome) -> Row:
    """The row of table tasks."""
    person, task, held = outcome.person, outcome.task, outcome.held
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
    return row | (_loads(outcome, held) if held is not None else {})


def _loads(outcome: TaskOutcome, held: SolvedTask) -> Row:
    pressure = outcome.pressure
    assert pressure is not None
    muscles = outcome.person.lines.trunk.muscles
    active = (held.found.forces - held.stretched) / muscles.pcsa
    return {
        "l4l5_pressure_mpa": _MPA * float(pressure.pa),
        "l4l5_pressure_dreischarf_mpa": _MPA * float(pressure.dreischarf_pa),
        "l4l5_nominal_pressure_mpa": _MPA * float(pressure.nominal_pa),
        "l4l5_flexion_deg": DEG_PER_RAD * float(pressure.flexion),
        "inside_eq_6": bool(pressure.inside),
        "l4l5_compression_n": float(held.compression[L4L5]),
        "l4l5_shear_n": float(held.pushes[L4L5, 0]),
        "l5s1_compression_n": float(held.compression[L5S1]),
        "l5s1_shear_n": float(held.pushes[L5S1, 0]),
        "largest_slack_nm": float(np.abs(held.slack_on_discs).max()),
        "highest_stress_mpa": _MPA * float(active.max()),
        "iterations": len(held.rounds),
    }


def level_rows(outcome: TaskOutcome) -> Iterator[Row]:
    """Rows of table levels."""
    held = outcome.held
    for level, name in enumerate(LEVELS):
        row: Row = {"level": name, "status": outcome.status.value}
        if held is not None:
            place = MM_PER_M * (held.poses.centres[level] - held.poses.centres[0])
            row |= {
                "compression_n": float(held.compression[level]),
                "shear_anterior_n": float(held.pushes[level, 0]),
                "shear_right_n": float(held.pushes[level, 2]),
                "stiffening": float(held.stiffening[level]),
                **dict(zip(("x_mm", "y_mm", "z_mm"), place.tolist(), strict=True)),
            }
            told = {
                "required": held.on_discs[level],
                "passive": held.joint_moments[level],
                "slack": held.slack_on_discs[level],
            }
            for axis in _AXES:
                at = _OF_AXIS[axis]
                row[f"{axis}_deg"] = DEG_PER_RAD * float(held.poses.turned[level, at])
                row |= {f"{what}_{axis}_nm": float(m[at]) for what, m in told.items()}
        if outcome.capacity is not None:
            row["capacity_left_nm"] = float(outcome.capacity[level])
        yield row


def muscle_rows(outcome: TaskOutcome) -> Iterator[Row]:
    """Rows of table muscles."""
    muscles, held = outcome.person.lines.trunk.muscles, outcome.held
    for k, name in enumerate(muscles.names):
        row: Row = {
            "muscle": name,
            "group": muscles.groups[k],
            "side": muscles.sides[k],
            "pcsa_mm2": 1e6 * float(muscles.pcsa[k]),
            "status": outcome.status.value,
        }
        if held is not None:
            force, passive = float(held.found.forces[k]), float(held.stretched[k])
            strength = outcome.task.stress_pa * float(muscles.pcsa[k])
            row |= {
                "force_n": force,
                "passive_n": passive,
                "stress_mpa": _MPA * force / float(muscles.pcsa[k]),
                "activity": max((force - passive) / strength, 0.0),
                "length_mm": MM_PER_M * float(held.pulls.lengths[k]),
                "stretch": float(held.pulls.lengths[k] / outcome.person.rest[k]),
                "contacts": int(held.pulls.contacts[k]),
                "contact_n": force * float(held.pulls.pushes[k]),
            }
        yield row


def path_rows(outcome: TaskOutcome) -> Iterator[Row]:
    """Rows of table paths; none where the task could not be posed."""
    muscles, held = outcome.person.lines.trunk.muscles, outcome.held
    if held is None:
        return
    pulls, origin = held.pulls, held.poses.centres[0]
    for k, name in enumerate(muscles.names):
        known = {"muscle": name, "group": muscles.groups[k], "side": muscles.sides[k]}
        stress = _MPA * float(held.found.forces[k] / muscles.pcsa[k])
        for point in range(int(pulls.traced[k])):
            x, y, z = (MM_PER_M * (pulls.trace[k, point] - origin)).tolist()
            yield known | {"point": point, "x_mm": x, "y_mm": y, "z_mm": z, "stress_mpa": stress}


def iteration_rows(outcome: TaskOutcome) -> Iterator[Row]:
    """Rows of table iterations."""
    for number, one in enumerate(outcome.held.rounds if outcome.held else ()):
        yield {
            "iteration": number,
            "change": one.change,
            "residual_nm": one.residual_nm,
            "l4l5_compression_n": float(one.compression_n),
        }
