"""Which persons and tasks stand for the others in figures and sentences, by rule."""

from collections.abc import Sequence

import numpy as np
import pandas as pd

from spinepipe.cohort import Cohort
from spinepipe.muscles.trunk import GLOBAL_EXTENSORS
from spinepipe.status import Balanced
from spinepipe.studies.trunk_loads.forms import PUSH_N, PUSH_NM
from spinepipe.studies.trunk_loads.settings import TrunkLoads

MOST_TASKS = 6
"""So many tasks can be told apart by colour."""

RELAXED = 1
"""Number of relaxed standing in Ghezelbash 2016 Table 1."""

FEWEST_ANGLES = 3
"""A course over the angle has at least so many."""

_UPRIGHT_DEG = 0.5
_TURNS = ("trunk_extension_deg", "trunk_right_bending_deg", "pelvis_extension_deg")


def sound(rows: pd.DataFrame) -> "pd.Series[bool]":
    """Rows whose forces settled and hold the task."""
    return rows["status"] == Balanced.CONVERGED.value


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


def some_tasks(study: TrunkLoads, tasks: pd.DataFrame, most: int = MOST_TASKS) -> list[str]:
    """Tasks of one person that have forces: those that are drawn, then by load from all others.

    The others are spread evenly from the least to the most loaded disc L4L5, sound ones only.
    """
    loaded = tasks.dropna(subset=["l4l5_compression_n"])
    drawn = [name for name in study.drawn_tasks if name in set(loaded["task"])][:most]
    others = loaded[sound(loaded) & ~loaded["task"].isin(drawn)]
    ranked = others.sort_values("l4l5_compression_n", kind="stable")["task"].tolist()
    room = min(most - len(drawn), len(ranked))
    at = np.unique(np.linspace(0, len(ranked) - 1, room).round().astype(int)) if room else ()
    chosen = {*drawn, *(ranked[k] for k in at)}
    return [name for name in tasks["task"] if name in chosen]


def relaxed_standing(tasks: pd.DataFrame, cohort: Cohort) -> str | None:
    """The task of a person that is relaxed standing, None where there is none that is sound.

    That of the paper's number, else one that is upright, without load, push and co-activation.
    """
    good = tasks[sound(tasks)]
    numbered = good[good["number"] == RELAXED]
    if len(numbered):
        return str(numbered["task"].iloc[0])
    free = _free_handed(good, cohort)
    still = free[(free[list(_TURNS)].abs() < _UPRIGHT_DEG).all(axis=1)]
    return str(still["task"].iloc[0]) if len(still) else None


def forward_bends(tasks: pd.DataFrame, cohort: Cohort) -> pd.DataFrame:
    """Sound tasks of one person bent forwards or upright with empty hands, by `flexion_deg`.

    Of two with the same angle the first; none where angles are fewer than `FEWEST_ANGLES`.
    """
    free = _free_handed(tasks[sound(tasks)], cohort)
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


def _free_handed(tasks: pd.DataFrame, cohort: Cohort) -> pd.DataFrame:
    """Tasks without load in the hands, push from outside, or asked-for co-activation."""
    empty = (tasks["hand_load_kg"] == 0.0) & (tasks["tone"] == "none")
    asked = cohort.further.get("tasks")
    if asked is None:
        return tasks[empty]
    there = [name for name in (*PUSH_N, *PUSH_NM) if name in asked]
    pushed = asked.loc[asked[there].fillna(0.0).ne(0.0).any(axis=1), "task"]
    return tasks[empty & ~tasks["task"].isin(set(pushed))]


def grouped(rows: pd.DataFrame, names: Sequence[str]) -> pd.DataFrame:
    """Columns `names` of fascicles summed by group and side, in the order of the rows."""
    return rows.groupby(["group", "side"], sort=False)[list(names)].sum(min_count=1).reset_index()
