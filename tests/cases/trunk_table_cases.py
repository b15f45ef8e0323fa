"""Made-up results of studies of trunk loads: numbers follow from formulas, nothing is solved."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from trunk_cases import made_up_trunk

from spinepipe import cohort as cohorts
from spinepipe.cohort import Cohort
from spinepipe.muscles.trunk import BODIES, LEVELS, NO_BODY
from spinepipe.schema import Table
from spinepipe.studies.subjects import SUBJECTS
from spinepipe.studies.trunk_loads.forms import TASKS
from spinepipe.studies.trunk_loads.settings import TrunkLoads
from spinepipe.studies.trunk_loads.tables import (
    AGAINST_GHEZELBASH_2016,
    AGREEMENT,
    DESIGN,
    DRIVERS,
    INTERVALS,
    ITERATIONS,
    LEVELS_TABLE,
    MASSES,
    MUSCLES,
    PATHS,
    PRESSURES,
    QUANTITIES,
    RESPONSES,
    SCALING,
    SIMPLIFICATIONS,
    SIMPLIFIED,
    TUNING,
    UPRIGHT,
)
from spinepipe.studies.trunk_loads.tables import TASKS as TASKS_TABLE
from spinepipe.tables import from_rows

Row = dict[str, Any]

ROOT = Path(__file__).parents[2]
FOLDER = ROOT / "config" / "cohorts" / "trunk_volunteers"

AREA_MM2 = 1500.0
SAMPLED = ("standing", "load_away", "flexion_50")
FACTORS = ("hand_anterior_mm", "bmi", "pcsa", "disc_area", "passive_rotation")
DRAWN = ("standing", "load_away", "one_handed")
MEASURED = {
    "standing": (0.5, "confirmed"),
    "load_close": (1.05, "confirmed"),
    "load_away": (1.8, "confirmed"),
    "flexion_50": (1.09, "confirmed"),
    "full_flexion": (1.6, "from_memory"),
    "flexion_70_with_load": (2.3, "confirmed"),
    "one_handed": (1.0, "from_memory"),
    "side_10": (0.55, "derived"),
    "side_20": (0.6, "confirmed"),
}
COUNTED = ("standing", "load_close", "load_away", "flexion_50", "flexion_70_with_load", "side_20")
ERRORS = {"untuned": 0.3, "tuned": 0.1, "left_out": 0.15}
"""Computed less measured, MPa, with the sign changing from task to task."""

GOALS = {"untuned": 0.25, "tuned": 0.14, "left_out": 0.18}
LOST = ("exertion_flexion", "out_of_reach", "the posture is <out of reach>")
BEYOND = ("exertion_extension", "beyond_strength", "21 N m are left")


@dataclass(frozen=True)
class Size:
    """What a made-up study has.

    Attributes
    ----------
    persons : how many of the cohort. tasks : those that are held; none: all of the cohort.
    failing : task, status and message of tasks that did not end well.
    volunteer, samples, drawn, simplified : whether the study asks for that.
    """

    persons: int = 5
    tasks: tuple[str, ...] = ()
    failing: tuple[tuple[str, str, str], ...] = (LOST, BEYOND)
    volunteer: bool = True
    samples: bool = True
    drawn: tuple[str, ...] = DRAWN
    simplified: bool = True


@cache
def _read() -> Cohort:
    return cohorts.read(FOLDER, (SUBJECTS, TASKS))


def cohort_of(size: Size) -> Cohort:
    """The first persons of the cohort that comes along, and those tasks."""
    whole = _read()
    names = whole.specimen_names[: size.persons]
    tasks = whole.further["tasks"]
    subjects = whole.further["subjects"]
    return replace(
        whole,
        specimens=whole.specimens[whole.specimens["specimen"].isin(names)],
        further={
            "subjects": subjects[subjects["specimen"].isin(names)],
            "tasks": tasks[tasks["task"].isin(size.tasks)] if size.tasks else tasks,
        },
    )


def study_of(size: Size) -> TrunkLoads:
    """The study."""
    asked: Row = {"study": "s", "kind": "trunk_loads", "cohort": "trunk_volunteers"}
    if size.drawn:
        asked["drawn_tasks"] = list(size.drawn)
    if size.samples:
        asked["uncertain"] = {
            "tasks": list(SAMPLED),
            "factors": {name: {"sd": 1.0} for name in FACTORS},
        }
    if size.volunteer:
        asked["volunteer"] = {"specimen": "volunteer"}
    return TrunkLoads.model_validate(asked)


def frame(table: Table, rows: Sequence[Mapping[str, Any]]) -> pd.DataFrame:
    """Rows as the file of a table has them; what a row does not tell is empty."""
    names = [column.name for column in table.columns]
    return from_rows(table, [{name: row.get(name) for name in names} for row in rows]).to_pandas()


@dataclass(frozen=True)
class Held:
    """A task of a person, and what is made up of it.

    Attributes
    ----------
    weigh : the person's mass over 72 kg. reach : 1 in front, more with a load, less upright.
    """

    specimen: str
    task: str
    asked: Mapping[str, Any]
    weigh: float
    status: str
    message: str

    def number(self, name: str) -> float:
        """A cell of tasks.csv, nought where it is empty."""
        value = self.asked[name]
        return 0.0 if pd.isna(value) else float(value)

    @property
    def has_forces(self) -> bool:
        """Whether the task could be posed."""
        return self.status != "out_of_reach"

    @property
    def flexion(self) -> float:
        """Of the trunk, deg, flexion positive."""
        return -self.number("trunk_extension_deg")

    @property
    def compression(self) -> float:
        """Of L4L5, N."""
        loaded = self.number("hand_load_kg") * (30.0 + 0.1 * self.number("hands_anterior_mm"))
        bent = 900.0 * np.sin(np.radians(max(self.flexion, 0.0)))
        pushed = 10.0 * sum(
            abs(self.number(name)) for name in ("push_extension_nm", "push_left_rotation_nm")
        )
        aside = 15.0 * abs(self.number("trunk_right_bending_deg"))
        return self.weigh * (600.0 + bent + loaded + pushed + aside)

    @property
    def shear(self) -> float:
        """Of L4L5, N."""
        return 0.15 * self.compression + 2.0 * self.flexion

    @property
    def pressure(self) -> float:
        """In L4L5, MPa."""
        return self.compression / AREA_MM2 / 0.77


def held(size: Size) -> list[Held]:
    """Every task of every person."""
    cohort = cohort_of(size)
    ends = {task: (status, message) for task, status, message in size.failing}
    return [
        Held(
            person["specimen"],
            task["task"],
            task,
            person["mass_kg"] / 72.0,
            *ends.get(task["task"], ("converged", "")),
        )
        for person in cohort.further["subjects"].to_dict("records")
        for task in cohort.further["tasks"].to_dict("records")
    ]


def task_rows(size: Size) -> Iterator[Row]:
    """Rows of table tasks."""
    for one in held(size):
        number = one.asked["number"]
        nominal = one.compression / AREA_MM2
        row: Row = {
            "specimen": one.specimen,
            "task": one.task,
            "number": None if pd.isna(number) else int(number),
            "trunk_extension_deg": one.number("trunk_extension_deg"),
            "trunk_right_bending_deg": one.number("trunk_right_bending_deg"),
            "pelvis_extension_deg": 0.3 * one.number("trunk_extension_deg"),
            "hand_load_kg": one.number("hand_load_kg"),
            "carried_kg": 40.0 * one.weigh + one.number("hand_load_kg"),
            "largest_stress_mpa": one.number("largest_stress_mpa") or 0.6,
            "tone": "none" if pd.isna(one.asked["tone"]) else one.asked["tone"],
            "status": one.status,
            "message": one.message,
        }
        if one.has_forces:
            row |= {
                "l4l5_pressure_mpa": one.pressure,
                "l4l5_pressure_dreischarf_mpa": one.pressure,
                "l4l5_nominal_pressure_mpa": nominal,
                "l4l5_flexion_deg": 0.11 * one.flexion,
                "inside_eq_6": nominal <= 1.86 and 0.0 <= 0.11 * one.flexion <= 10.0,
                "l4l5_compression_n": one.compression,
                "l4l5_shear_n": one.shear,
                "l5s1_compression_n": 1.05 * one.compression,
                "l5s1_shear_n": 1.4 * one.shear,
                "largest_slack_nm": 21.0 if one.status == "beyond_strength" else 1e-4,
                "strength_used": one.compression / 6000.0,
                "least_stress_mpa": one.compression / 10000.0,
                "highest_stress_mpa": min(1.0, one.compression / 6000.0),
                "tone_share": 0.0,
                "stable": None if one.task not in ("standing", "standing_stable") else True,
                "iterations": 7,
            }
        yield row


def level_rows(size: Size) -> Iterator[Row]:
    """Rows of table levels."""
    joints = 1e3 * made_up_trunk().joints
    for one in held(size):
        for k, level in enumerate(LEVELS):
            row: Row = {
                "specimen": one.specimen,
                "task": one.task,
                "level": level,
                "status": one.status,
            }
            if one.has_forces:
                turned = np.radians(one.flexion) * k / len(LEVELS)
                x, y = joints[k, 0], joints[k, 1]
                row |= {
                    "compression_n": one.compression * (1.05 - 0.08 * k),
                    "shear_anterior_n": one.shear * (1.4 - 0.4 * k),
                    "shear_right_n": 2.0 * one.number("trunk_right_bending_deg"),
                    "extension_deg": -one.flexion / 10.0,
                    "stiffening": 1.2,
                    "x_mm": x + y * np.sin(turned),
                    "y_mm": y * np.cos(turned),
                    "z_mm": 0.0,
                }
            yield row


def fascicles() -> Iterator[tuple[int, str, str, str, float]]:
    """Number, name, group, side and cross-section, mm2, of the made-up trunk's."""
    muscles = made_up_trunk().muscles
    rows = zip(muscles.names, muscles.groups, muscles.sides, muscles.pcsa, strict=True)
    for k, (name, group, side, pcsa) in enumerate(rows):
        yield k, name, group, side, 1e6 * float(pcsa)


def stress(one: Held, group: str, side: str) -> tuple[float, float]:
    """MPa, active and passive: extensors fall silent when the trunk is bent far."""
    back = group not in ("rectus_abdominis", "external_oblique", "internal_oblique", "psoas")
    left = 1.3 if side == "left" and one.task == "one_handed" else 1.0
    rises = np.interp(one.flexion, [0.0, 60.0, 107.3], [1.0, 1.0, 0.05])
    active = 0.0002 * one.compression * rises * left if back else 0.01
    return float(active), float(0.003 * max(one.flexion, 0.0)) if back else 0.0


def muscle_rows(size: Size) -> Iterator[Row]:
    """Rows of table muscles."""
    for one in held(size):
        for _, name, group, side, pcsa in fascicles():
            row: Row = {
                "specimen": one.specimen,
                "task": one.task,
                "muscle": name,
                "group": group,
                "side": side,
                "pcsa_mm2": pcsa,
                "status": one.status,
            }
            if one.has_forces:
                active, passive = stress(one, group, side)
                row |= {
                    "force_n": (active + passive) * pcsa,
                    "passive_n": passive * pcsa,
                    "stress_mpa": active + passive,
                    "activity": active / 0.6,
                    "length_mm": 100.0,
                    "stretch": 1.0 + 0.003 * max(one.flexion, 0.0),
                    "contacts": 0,
                    "contact_n": 0.0,
                }
            yield row


def path_rows(size: Size) -> Iterator[Row]:
    """Rows of table paths."""
    muscles = made_up_trunk().muscles
    for one in held(size):
        if one.task not in size.drawn or not one.has_forces:
            continue
        for k, name, group, side, _ in fascicles():
            active, passive = stress(one, group, side)
            on = muscles.body[k] != NO_BODY
            for point, at in enumerate(1e3 * muscles.point[k][on]):
                yield {
                    "specimen": one.specimen,
                    "task": one.task,
                    "muscle": name,
                    "group": group,
                    "side": side,
                    "point": point,
                    **dict(zip(("x_mm", "y_mm", "z_mm"), at.tolist(), strict=True)),
                    "stress_mpa": active + passive,
                }


def upright_rows(size: Size) -> Iterator[Row]:
    """Rows of table upright: every body 0.5 deg further than it starts, and 0.1 for each person."""
    for number, person in enumerate(cohort_of(size).specimen_names):
        for k, body in enumerate(BODIES):
            start = 10.0 - 2.5 * k
            yield {
                "specimen": person,
                "body": body,
                "start_deg": start,
                "upright_deg": start + 0.5 + 0.1 * number,
                "bound": False,
                "moment_before_nm": None if k == 0 else 3.0,
                "moment_after_nm": None if k == 0 else -1.0,
            }


def simplified_rows(size: Size) -> Iterator[Row]:
    """Rows of table simplified: each costs its number times 5 %, more or less in turn."""
    for one in held(size):
        for number, name in enumerate(SIMPLIFICATIONS):
            times = 1.0 + 0.05 * number * (-1) ** number
            row: Row = {"specimen": one.specimen, "task": one.task, "simplification": name}
            row |= {"status": one.status, "message": one.message}
            if one.has_forces:
                row |= {
                    "l4l5_pressure_mpa": one.pressure * times,
                    "l4l5_compression_n": one.compression * times,
                    "l5s1_compression_n": 1.05 * one.compression * times,
                    "imbalance_nm": 3.0 * number,
                }
            yield row


def pressure_rows(size: Size) -> Iterator[Row]:
    """Rows of table pressures."""
    ends = {task: status for task, status, _ in size.failing}
    there = set(cohort_of(size).further["tasks"]["task"])
    for tier, error in ERRORS.items():
        for number, (task, (measured, status)) in enumerate(MEASURED.items()):
            if task not in there or (tier == "left_out" and task not in COUNTED):
                continue
            ended = ends.get(task, "converged")
            computed = None if ended == "out_of_reach" else measured + error * (-1) ** number
            yield {
                "specimen": "volunteer",
                "tier": tier,
                "task": task,
                "measured_mpa": measured,
                "measured_status": status,
                "measured_source": "somewhere",
                "counted": task in COUNTED,
                "computed_mpa": computed,
                "status": ended,
            }


def agreement_rows(size: Size) -> Iterator[Row]:
    """Rows of table agreement."""
    rows = list(pressure_rows(size))
    for tier, error in ERRORS.items():
        own = [row for row in rows if row["tier"] == tier and row["counted"]]
        own = [row for row in own if row["computed_mpa"] is not None]
        n, loose = len(own), sum(row["status"] != "converged" for row in own)
        yield {
            "specimen": "volunteer",
            "tier": tier,
            "n_tasks": n,
            "r": 0.95 if n >= 3 else None,
            "r_low": 0.7 if n >= 4 else None,
            "r_high": 0.99 if n >= 4 else None,
            "rmse_mpa": error if n else None,
            "mean_error_mpa": 0.01 if n else None,
            "goal_rmse_mpa": GOALS[tier],
            "n_not_held": loose,
            "reached": error <= GOALS[tier] and not loose if n else None,
        }


def tuning_rows() -> Iterator[Row]:
    """Rows of table tuning; the area of the disc ends at its bound."""
    for tier, tasks in (("tuned", ("",)), ("left_out", COUNTED)):
        for task in tasks:
            for name, value, bound in (("passive_rotation", 0.7, False), ("disc_area", 2.0, True)):
                yield {
                    "specimen": "volunteer",
                    "tier": tier,
                    "left_out": task,
                    "parameter": name,
                    "value": value,
                    "default": 1.0,
                    "unit": "",
                    "at_bound": bound,
                    **_region_of(tier, bound),
                }


def _region_of(tier: str, bound: bool) -> Row:
    """0.4 to 1.1, or 1.4 and more where the value is at its bound; none of tasks left out."""
    names = ("low", "high", "open_below", "open_above", "identifiable")
    if tier != "tuned":
        return dict.fromkeys(names)
    cells = (1.4, None, False, True, False) if bound else (0.4, 1.1, False, False, True)
    return dict(zip(names, cells, strict=True))


def sampled(size: Size) -> list[Held]:
    """Tasks that are sampled, of the first person."""
    first = cohort_of(size).specimen_names[0]
    return [one for one in held(size) if one.task in SAMPLED and one.specimen == first]


def of_quantity(one: Held, quantity: str) -> float:
    """What table tasks has."""
    found = {
        "l4l5_pressure_mpa": one.pressure,
        "l4l5_compression_n": one.compression,
        "l4l5_shear_n": one.shear,
        "l5s1_compression_n": 1.05 * one.compression,
        "l5s1_shear_n": 1.4 * one.shear,
    }
    return found[quantity]


def interval_rows(size: Size) -> Iterator[Row]:
    """Rows of table intervals: a tenth less to a fifth more."""
    for one in sampled(size):
        for quantity in QUANTITIES:
            value = of_quantity(one, quantity)
            ends = {"nominal": value, "low": 0.9 * value, "median": value, "high": 1.2 * value}
            yield {
                "specimen": one.specimen,
                "task": one.task,
                "quantity": quantity,
                **(ends if one.has_forces else {}),
                "n_samples": 220 if one.has_forces else 0,
                "n_failed": 4 if one.has_forces else 224,
                "n_above": 0,
            }


def driver_rows(size: Size) -> Iterator[Row]:
    """Rows of table drivers: of each factor twice what the next one has."""
    for one in sampled(size):
        for quantity in QUANTITIES:
            for number, factor in enumerate(FACTORS):
                total = 0.6 / 2.0**number
                row: Row = {
                    "specimen": one.specimen,
                    "task": one.task,
                    "quantity": quantity,
                    "factor": factor,
                    "n_samples": 220,
                    "message": "" if one.has_forces else "too few samples",
                }
                for name, value in (("first_order", 0.8 * total), ("total", total)):
                    if one.has_forces:
                        row |= {
                            name: value,
                            f"{name}_low": value - 0.05,
                            f"{name}_high": value + 0.06,
                        }
                yield row


def tables_of(size: Size, **changed: pd.DataFrame) -> dict[str, pd.DataFrame]:
    """All tables that the study has."""
    made = {name: rows.copy() for name, rows in _tables(size).items()}
    return made | changed


@cache
def _tables(size: Size) -> dict[str, pd.DataFrame]:
    made = {
        "tasks": frame(TASKS_TABLE, list(task_rows(size))),
        "levels": frame(LEVELS_TABLE, list(level_rows(size))),
        "muscles": frame(MUSCLES, list(muscle_rows(size))),
        "paths": frame(PATHS, list(path_rows(size))),
        "upright": frame(UPRIGHT, list(upright_rows(size))),
        "iterations": frame(ITERATIONS, []),
        "masses": frame(MASSES, []),
        "scaling": frame(SCALING, []),
    }
    if size.simplified:
        made["simplified"] = frame(SIMPLIFIED, list(simplified_rows(size)))
    if size.volunteer:
        made["pressures"] = frame(PRESSURES, list(pressure_rows(size)))
        made["agreement"] = frame(AGREEMENT, list(agreement_rows(size)))
        made["tuning"] = frame(TUNING, list(tuning_rows()))
        made["against_ghezelbash_2016"] = frame(AGAINST_GHEZELBASH_2016, [])
    if size.samples:
        made["design"] = frame(DESIGN, [])
        made["responses"] = frame(RESPONSES, [])
        made["intervals"] = frame(INTERVALS, list(interval_rows(size)))
        made["drivers"] = frame(DRIVERS, list(driver_rows(size)))
    return made
