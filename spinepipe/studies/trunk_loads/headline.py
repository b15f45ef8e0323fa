"""The answer first: the load that a person would look for, and what is not to be trusted in it.

One task of one person stands for the others: one with an interval if any has, else with a load in
the hands if there is one, and of these the one that presses L4L5 most.
"""

from dataclasses import dataclass
from typing import Any, NamedTuple

import pandas as pd

from spinepipe.cohort import Cohort
from spinepipe.report.page.document import Headline, ResultTables
from spinepipe.report.words import count, fixed, listed, number, plain
from spinepipe.studies.trunk_loads.selection import (
    of_person,
    relaxed_standing,
    shown_person,
    sound,
)
from spinepipe.studies.trunk_loads.settings import TrunkLoads
from spinepipe.studies.trunk_loads.words import TIERS, factor, mpa, newton

COMPRESSION, PRESSURE = "l4l5_compression_n", "l4l5_pressure_mpa"
MOST = 0.5
"""Lower end of a total index above which most of a variance hangs on a factor."""

Row = dict[Any, Any]


@dataclass(frozen=True, eq=False)
class AnsweredTask:
    """The task that the answer is of.

    Attributes
    ----------
    task : its row. standing : row of relaxed standing of the same person, None where there is none
        or the task is that one itself.
    """

    task: Row
    standing: Row | None

    @property
    def name(self) -> str:
        """The task in words."""
        return plain(str(self.task["task"]))


def answer_of(study: TrunkLoads, cohort: Cohort, results: ResultTables) -> AnsweredTask | None:
    """The task that stands for the others, None where no task has sound forces."""
    tasks = results.table("tasks")
    if tasks.empty:
        return None
    person = shown_person(study, tasks[sound(tasks)])
    own = of_person(tasks, person)
    good = own[sound(own)] if len(own) else own
    if good.empty:
        return None
    intervals = of_person(results.table("intervals"), person)
    known = intervals.dropna(subset=["low", "high"])["task"] if len(intervals) else ()
    rank = pd.DataFrame(
        {
            "sampled": good["task"].isin(list(known)),
            "loaded": good["hand_load_kg"] > 0.0,
            "n": good[COMPRESSION].astype(float),
        }
    )
    best = good.loc[rank.sort_values(["sampled", "loaded", "n"], kind="stable").index[-1]]
    still = relaxed_standing(own, cohort)
    others = own[(own["task"] == still) & (own["task"] != best["task"])]
    rows = others.to_dict("records")
    return AnsweredTask(best.to_dict(), rows[0] if rows else None)


def headline(study: TrunkLoads, cohort: Cohort, results: ResultTables) -> Headline:
    """The answer, how sure it is, and what casts doubt on it."""
    found = answer_of(study, cohort, results)
    doubts = tuple(_doubts(results, found))
    if found is None:
        return Headline(
            "No load can be told: no task has muscle forces that settled and hold it.", "", doubts
        )
    sure = (_sampled(found, results), _beside_measured(results))
    return Headline(_words(found, results), " ".join(part for part in sure if part), doubts)


def of_task(rows: pd.DataFrame, task: Row) -> pd.DataFrame:
    """Rows of the person and the task of a row; none of a table that is absent."""
    if rows.empty:
        return rows
    return rows[(rows["specimen"] == task["specimen"]) & (rows["task"] == task["task"])]


def interval(results: ResultTables, row: Row, quantity: str) -> tuple[float, float] | None:
    """Middle 95 % of the samples of a quantity of a task; None where it is not known."""
    rows = of_task(results.table("intervals"), row)
    if rows.empty:
        return None
    known = rows[rows["quantity"] == quantity].dropna(subset=["low", "high"])
    if known.empty:
        return None
    return float(known["low"].iloc[0]), float(known["high"].iloc[0])


class Driver(NamedTuple):
    """A factor with its total index and the index's 95 % interval."""

    factor: str
    total: float
    low: float
    high: float


def leading(results: ResultTables, row: Row, quantity: str = PRESSURE) -> list[Driver]:
    """Factors of a quantity of a task with their total indices, the largest first."""
    rows = of_task(results.table("drivers"), row)
    if rows.empty:
        return []
    columns = ["total", "total_low", "total_high"]
    known = rows[rows["quantity"] == quantity].dropna(subset=columns)
    known = known.sort_values("total", ascending=False, kind="stable")
    values = known[columns].to_numpy(float).tolist()
    return [Driver(str(n), *ends) for n, ends in zip(known["factor"], values, strict=True)]


def _words(found: AnsweredTask, results: ResultTables) -> str:
    row = found.task
    ends = interval(results, row, COMPRESSION)
    between = f" ({newton(ends[0])} to {newton(ends[1])})" if ends else ""
    kg = float(row["hand_load_kg"])
    load = f" ({number(kg)} kg in the hands)" if kg > 0.0 else ""
    told = (
        f"Task {found.name}{load} presses L4L5 of {row['specimen']} with "
        f"{newton(row[COMPRESSION])}{between}"
    )
    if found.standing is not None and found.standing[COMPRESSION] > 0.0:
        times = row[COMPRESSION] / found.standing[COMPRESSION]
        told += f", {number(times, 2)} times relaxed standing"
    ends = interval(results, row, PRESSURE)
    between = f" ({fixed(ends[0])} to {mpa(ends[1])})" if ends else ""
    told += f"; the pressure in the disc is {mpa(row[PRESSURE])}{between}"
    drivers = leading(results, row) if ends else []
    if drivers:
        # which input that comes of, as far as the intervals of the indices tell
        first, second = drivers[0], drivers[1].total if len(drivers) > 1 else 0.0
        part = "most" if first.low > MOST else "the largest part"
        spread = f"{part} of that spread comes of {factor(first.factor)}"
        if first.low <= second:
            spread = "which input that spread comes of most, the samples do not tell"
        told += f"; {spread}"
    return f"{told}."


def _sampled(found: AnsweredTask, results: ResultTables) -> str:
    if interval(results, found.task, COMPRESSION) is None:
        return "How far this can be trusted is not known: the task was not sampled."
    row = of_task(results.table("intervals"), found.task).iloc[0]
    held, failed = int(row["n_samples"]), int(row["n_failed"])
    lost = f"; {failed} more did not hold" if failed else ""
    return (
        f"In brackets: middle 95 % of {count(held, 'sample')} of the uncertain inputs{lost}. What "
        "the model leaves out is not in it."
    )


def _beside_measured(results: ResultTables) -> str:
    """What agreement with measured pressures says of the untuned answer."""
    rows = results.table("agreement")
    if rows.empty:
        return ""
    own = rows[rows["tier"] == "untuned"].dropna(subset=["rmse_mpa"])
    if own.empty:
        return "No computed pressure can be held against a measured one."
    row = own.to_dict("records")[0]
    return (
        f"With {TIERS['untuned']}, pressures are off from measured ones by "
        f"{mpa(row['rmse_mpa'])} (root mean square over {count(int(row['n_tasks']), 'task')})."
    )


def _doubts(results: ResultTables, found: AnsweredTask | None) -> list[str]:
    """What should be looked at before the answer is believed."""
    tasks = results.table("tasks")
    doubts = []
    lost = tasks[~sound(tasks)] if len(tasks) else tasks
    if len(lost):
        ends = [
            f"{len(part)} {plain(str(status))} "
            f"({listed([plain(str(name)) for name in dict.fromkeys(part['task'])], 3)})"
            for status, part in lost.groupby("status", sort=False)
        ]
        doubts.append(
            f"Look at this first: {len(lost)} of {count(len(tasks), 'task')} of all persons did "
            f"not settle or cannot be held: {'; '.join(ends)}."
        )
    inside = None if found is None else found.task["inside_eq_6"]
    if found is not None and pd.notna(inside) and not inside:
        doubts.append(
            f"The pressure of task {found.name} lies outside the range in which its formula was "
            "fitted."
        )
    goals = results.table("agreement")
    known = goals if goals.empty else goals.dropna(subset=["rmse_mpa"])
    misses = [
        f"{plain(row['tier'])} {missed(row)}"
        for row in known.to_dict("records")
        if not row["reached"]
    ]
    if misses:
        words = "Agreement with measured pressures is not what was asked for"
        doubts.append(f"{words}: {'; '.join(misses)}.")
    return doubts


def missed(row: Row) -> str:
    """Of a tier whose goal is not reached: by how much, and tasks that no muscle forces hold."""
    off, goal, loose = float(row["rmse_mpa"]), float(row["goal_rmse_mpa"]), int(row["n_not_held"])
    near = f"{mpa(off)} off, {mpa(goal)} asked for"
    parts = [near if off <= goal else f"{near}, {fixed(off - goal, 3)} MPa too much"]
    if loose:
        held = count(loose, "counted task is", "counted tasks are")
        parts.append(f"{held} not held by any muscle forces")
    return ", and ".join(parts)
