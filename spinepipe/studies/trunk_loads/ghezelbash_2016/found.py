"""How claims find a person's task in tables of a run or of a cohort's folder.

Two tables are no results: `asked`, the rows of tasks.csv, and `subjects`, those of subjects.csv.
"""

from collections.abc import Callable
from typing import Any

import pandas as pd

from spinepipe.comparison.claim import NotComputed, Ours, Run
from spinepipe.status import Balanced
from spinepipe.studies.trunk_loads.ghezelbash_2016.paper import VOLUNTEER

ASKED, SUBJECTS = "asked", "subjects"

_SAME_ANGLE_DEG = 0.05


def numbered(run: Run, number: int, table: str = "tasks", **where: Any) -> pd.DataFrame:
    """Rows of the tasks of a number of Table 1, at least one."""
    rows = run.rows(table, **where)
    chosen = rows[pd.to_numeric(rows["number"], errors="coerce").astype(float) == float(number)]
    if chosen.empty:
        raise NotComputed(f"this run's table {table} has no task {number} of Table 1")
    return chosen


def filled(rows: pd.DataFrame, column: str) -> "pd.Series[float]":
    """A column of numbers of which none is empty."""
    values = pd.to_numeric(rows[column], errors="coerce").astype(float)
    if values.isna().any():
        lacking = rows[values.isna()].iloc[0]
        told = str(lacking.get("message") or "") or f"status {lacking.get('status', 'not told')}"
        raise NotComputed(f"{column} is empty for task {lacking['task']}: {told}")
    return values


def of_task(
    column: str, number: int, sign: float = 1.0, table: str = "tasks", empty: float | None = None
) -> Callable[[Run], Ours]:
    """The number in a column of the first task of a number; a stated one where the cell is empty.

    Persons are asked the same, so any of them will do.
    """

    def ours(run: Run) -> Ours:
        row = numbered(run, number, table).iloc[[0]]
        if empty is not None and pd.isna(row.iloc[0][column]):
            return Ours(empty)
        return Ours(sign * float(filled(row, column).iloc[0]) + 0.0)  # no minus nought

    return ours


def asked_for(
    column: str, number: int, sign: float = 1.0, empty: float | None = None
) -> Callable[[Run], Ours]:
    """What tasks.csv asks of the first task of a number."""
    return of_task(column, number, sign, ASKED, empty)


def bent_sideways(run: Run, degrees: float, person: str = VOLUNTEER) -> "pd.Series[Any]":
    """A person's task 9 at an angle, to either side."""
    rows = numbered(run, 9, specimen=person)
    turned = pd.to_numeric(rows["trunk_right_bending_deg"]).abs()
    chosen = rows[(turned - degrees).abs() < _SAME_ANGLE_DEG]
    if chosen.empty:
        raise NotComputed(f"this run's table tasks has no lateral bending of {degrees:g} deg")
    return chosen.iloc[0]


def settled(rows: pd.DataFrame) -> pd.DataFrame:
    """Rows whose forces are sound, at least one."""
    sound = rows[rows["status"] == Balanced.CONVERGED.value]
    if sound.empty:
        raise NotComputed(f"task {rows.iloc[0]['task']} ended with {rows.iloc[0]['status']}")
    return sound


def forward(run: Run, person: str) -> pd.DataFrame:
    """A person's sound tasks of forward flexion with empty hands, by growing `flexion_deg`.

    Task 7, and the upright and the full posture that it starts and ends with (tasks 1 and 5).
    """
    parts = [numbered(run, 7, specimen=person)]
    rows = run.rows("tasks", specimen=person)
    number = pd.to_numeric(rows["number"], errors="coerce").astype(float)
    parts.append(rows[number.isin([1.0, 5.0])])
    together = settled(pd.concat(parts))
    together = together.assign(flexion_deg=-filled(together, "trunk_extension_deg"))
    return together.drop_duplicates("flexion_deg").sort_values("flexion_deg")


def task_named(run: Run, number: int, person: str = VOLUNTEER) -> str:
    """What a person's first task of a number is called."""
    return str(numbered(run, number, specimen=person).iloc[0]["task"])


def volunteers_task(number: int, degrees: float | None = None) -> Callable[[Run], str]:
    """What the volunteer's task of a number, and of an angle sideways, is called."""
    if degrees is None:
        return lambda run: task_named(run, number)
    return lambda run: str(bent_sideways(run, degrees)["task"])
