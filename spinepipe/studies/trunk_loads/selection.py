"""Which bodies and tasks stand for the others in figures and sentences, by rule."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import pandas as pd

from spinepipe.cohort import Cohort
from spinepipe.muscles.trunk import GLOBAL_EXTENSORS
from spinepipe.status import HELD
from spinepipe.studies.trunk_loads.forms import PUSH_N, PUSH_NM
from spinepipe.studies.trunk_loads.settings import TrunkLoads

COMPRESSION, PRESSURE = "l4l5_compression_n", "l4l5_pressure_mpa"

Row = dict[str, Any]

RELAXED = 1
"""Number of relaxed standing in Ghezelbash 2016 Table 1."""

FEWEST_ANGLES = 3
"""A course over the angle has at least so many."""

_UPRIGHT_DEG = 0.5
_TURNS = ("trunk_extension_deg", "trunk_right_bending_deg", "pelvis_extension_deg")


def sound(rows: pd.DataFrame) -> "pd.Series[bool]":
    """Rows whose forces settled and hold the task."""
    return rows["status"].isin(HELD)


def shown_person(study: TrunkLoads, rows: pd.DataFrame) -> str | None:
    """The volunteer, else the first that is sampled, else the first there is; None without rows."""
    if rows.empty:
        return None
    there = list(dict.fromkeys(rows["specimen"]))
    volunteer = (study.volunteer.specimen,) if study.volunteer else ()
    wanted = (*volunteer, *study.uncertain.specimens)
    return next((name for name in wanted if name in there), there[0])


def of_person(rows: pd.DataFrame, person: str | None) -> pd.DataFrame:
    """Rows of a person; none of nobody."""
    return rows if rows.empty else rows[rows["specimen"] == person]


def of_task(rows: pd.DataFrame, task: Row) -> pd.DataFrame:
    """Rows of the body and the task of a row; none of a table that is absent."""
    if rows.empty:
        return rows
    return rows[(rows["specimen"] == task["specimen"]) & (rows["task"] == task["task"])]


@dataclass(frozen=True, eq=False)
class AnsweredTask:
    """The task that the answer is of.

    Attributes
    ----------
    task : its row. standing : row of relaxed standing of the same body; None where there is none
        or the task is that one itself.
    """

    task: Row
    standing: Row | None


def answer_of(
    study: TrunkLoads, cohort: Cohort, tables: Mapping[str, pd.DataFrame]
) -> AnsweredTask | None:
    """The task that stands for the others, None where no task is held.

    One with an interval if any has, else with a load in the hands if there is one, and of these
    the one that loads L4L5 most.
    """
    tasks = tables.get("tasks", pd.DataFrame())
    if tasks.empty:
        return None
    person = shown_person(study, tasks[sound(tasks)])
    own = of_person(tasks, person)
    good = own[sound(own)]
    if good.empty:
        return None
    intervals = of_person(tables.get("intervals", pd.DataFrame()), person)
    known = intervals.dropna(subset=["low"])["task"] if len(intervals) else ()
    rank = pd.DataFrame(
        {
            "sampled": good["task"].isin(list(known)),
            "loaded": good["hand_load_kg"] > 0.0,
            "n": good[COMPRESSION].astype(float),
        }
    )
    rows = named(good.loc[rank.sort_values(["sampled", "loaded", "n"], kind="stable").index[-1:]])
    still = relaxed_standing(own, cohort)
    others = named(own[(own["task"] == still) & (own["task"] != rows[0]["task"])])
    return AnsweredTask(rows[0], others[0] if others else None)


def named(rows: pd.DataFrame) -> list[Row]:
    """Rows by the names of their columns."""
    return [{str(name): cell for name, cell in row.items()} for row in rows.to_dict("records")]


def relaxed_standing(tasks: pd.DataFrame, cohort: Cohort) -> str | None:
    """The task of a person that is relaxed standing, None where there is none that is sound.

    That of the paper's number, else one that is upright, without load, push and co-activation.
    """
    good = tasks[sound(tasks)]
    numbered = good[good["number"] == RELAXED]
    if len(numbered):
        return str(numbered["task"].iloc[0])
    free = free_handed(good, cohort)
    still = free[upright(free)]
    return str(still["task"].iloc[0]) if len(still) else None


def upright(tasks: pd.DataFrame) -> "pd.Series[bool]":
    """Tasks in which trunk and pelvis are as when standing."""
    return (tasks[list(_TURNS)].abs() < _UPRIGHT_DEG).all(axis=1)


def forward_bends(tasks: pd.DataFrame, cohort: Cohort) -> pd.DataFrame:
    """Sound tasks of one person bent forwards or upright with empty hands, by `flexion_deg`.

    Of two with the same angle the first; none where angles are fewer than `FEWEST_ANGLES`.
    """
    free = free_handed(tasks[sound(tasks)], cohort)
    straight = free[free["trunk_right_bending_deg"].abs() < _UPRIGHT_DEG]
    forward = straight.assign(flexion_deg=0.0 - straight["trunk_extension_deg"].astype(float))
    forward = forward[forward["flexion_deg"] > -_UPRIGHT_DEG]
    found = forward.drop_duplicates("flexion_deg").sort_values("flexion_deg", kind="stable")
    return found if len(found) >= FEWEST_ANGLES else found.iloc[:0]


def courses_of(tasks: pd.DataFrame, cohort: Cohort) -> dict[str, pd.DataFrame]:
    """Tasks of bending forwards by person, of those who have enough of them."""
    names = list(dict.fromkeys(tasks["specimen"]))
    found = {name: forward_bends(of_person(tasks, name), cohort) for name in names}
    return {name: rows for name, rows in found.items() if len(rows)}


def extensor_forces(muscles: pd.DataFrame, course: pd.DataFrame) -> pd.DataFrame:
    """Columns group, flexion_deg, active, passive (N) of each fascicle of the global extensors."""
    angle = course.set_index("task")["flexion_deg"]
    rows = muscles[muscles["group"].isin(GLOBAL_EXTENSORS) & muscles["task"].isin(angle.index)]
    return pd.DataFrame(
        {
            "group": rows["group"],
            "flexion_deg": rows["task"].map(angle).astype(float),
            "active": rows["force_n"].astype(float) - rows["passive_n"].astype(float),
            "passive": rows["passive_n"].astype(float),
        }
    )


def free_handed(tasks: pd.DataFrame, cohort: Cohort) -> pd.DataFrame:
    """Tasks without load in the hands, push from outside, or asked-for co-activation."""
    empty = (tasks["hand_load_kg"] == 0.0) & (tasks["tone"] == "none")
    return tasks[empty & ~tasks["task"].isin(pushed(cohort))]


def pushed(cohort: Cohort) -> set[str]:
    """Tasks in which the trunk is pushed from outside: exertions against it."""
    asked = cohort.further.get("tasks")
    if asked is None:
        return set()
    there = [name for name in (*PUSH_N, *PUSH_NM) if name in asked]
    return set(asked.loc[asked[there].fillna(0.0).ne(0.0).any(axis=1), "task"])
