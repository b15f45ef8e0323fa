"""Findings about the loads themselves: where they are largest, who holds them, who differs."""

from collections.abc import Iterator

import pandas as pd

from spinepipe.cohort import Cohort
from spinepipe.muscles.trunk import GLOBAL_EXTENSORS
from spinepipe.report.page.document import ResultTables
from spinepipe.report.words import count, listed, number, plain
from spinepipe.studies.trunk_loads.headline import COMPRESSION, Row, answer_of, of_task
from spinepipe.studies.trunk_loads.selection import (
    courses_of,
    extensor_forces,
    grouped,
    of_person,
    sound,
)
from spinepipe.studies.trunk_loads.settings import TrunkLoads
from spinepipe.studies.trunk_loads.words import SIMPLIFIED, newton

_LOADS = {
    COMPRESSION: "compression of L4L5",
    "l4l5_shear_n": "shear of L4L5",
    "l5s1_compression_n": "compression of L5S1",
    "l5s1_shear_n": "shear of L5S1",
}


def sound_rows(results: ResultTables, table: str) -> pd.DataFrame:
    """Rows of a table whose forces settled and hold the task; none where it is absent."""
    rows = results.table(table)
    return rows if rows.empty else rows[sound(rows)]


def filled(rows: pd.DataFrame, *columns: str) -> pd.DataFrame:
    """Rows with values in these columns; none of a table that is absent."""
    return rows if rows.empty else rows.dropna(subset=list(columns))


def most(rows: pd.DataFrame, column: str) -> Row:
    """The row with the largest value, of at least one."""
    return max(rows.to_dict("records"), key=lambda row: float(row[column]))


def largest(study: TrunkLoads, cohort: Cohort, results: ResultTables) -> Iterator[str]:
    """The largest of each load over all persons and tasks."""
    rows = sound_rows(results, "tasks")
    told = []
    for column, words in _LOADS.items():
        known = filled(rows, column)
        if len(known):
            row = most(known, column)
            told.append(
                f"{words} {newton(row[column])} ({plain(row['task'])} of {row['specimen']})"
            )
    if told:
        yield f"The largest loads of tasks that settled: {'; '.join(told)}."


def by_level(study: TrunkLoads, cohort: Cohort, results: ResultTables) -> Iterator[str]:
    """Which level of the task of the headline carries most."""
    found = answer_of(study, cohort, results)
    if found is None or results.table("levels").empty:
        return
    rows = of_task(results.table("levels"), found.task).dropna(subset=["compression_n"])
    if rows.empty:
        return
    highest = most(rows, "compression_n")
    lowest = min(rows.to_dict("records"), key=lambda row: float(row["compression_n"]))
    shear = max(rows.to_dict("records"), key=lambda row: abs(float(row["shear_anterior_n"])))
    yield (
        f"In task {found.name}, {highest['level']} is pressed most "
        f"({newton(highest['compression_n'])}) and {lowest['level']} least "
        f"({newton(lowest['compression_n'])}); shear is largest at {shear['level']} "
        f"({newton(shear['shear_anterior_n'])} forwards)."
    )


def muscles(study: TrunkLoads, cohort: Cohort, results: ResultTables) -> Iterator[str]:
    """Which muscles hold the task of the headline."""
    found = answer_of(study, cohort, results)
    if found is None or results.table("muscles").empty:
        return
    rows = of_task(results.table("muscles"), found.task).dropna(subset=["force_n"])
    if rows.empty or rows["force_n"].sum() <= 0.0:
        return
    summed = grouped(rows, ("force_n",)).groupby("group")["force_n"].sum()
    first = summed.sort_values(ascending=False, kind="stable").head(3)
    told = [f"{plain(str(name))} {newton(float(n))}" for name, n in first.items()]
    passive = float(rows["passive_n"].sum()) / float(rows["force_n"].sum())
    yield (
        f"In task {found.name}, of both sides, most is pulled by {listed(told)}; "
        f"{number(100.0 * passive, 2)} % of all muscle force comes of being stretched."
    )


def relaxation(study: TrunkLoads, cohort: Cohort, results: ResultTables) -> Iterator[str]:
    """What is left of the extensors' active force in the deepest bend, person by person."""
    tasks, rows = results.table("tasks"), results.table("muscles")
    if tasks.empty or rows.empty:
        return
    told = []
    for person, course in courses_of(tasks, cohort).items():
        forces = extensor_forces(of_person(rows, person), course)
        force = forces.groupby("flexion_deg")["active"].sum().sort_index()
        if len(force) and force.max() > 0.0:
            share = 100.0 * float(force.iloc[-1]) / float(force.max())
            peak = float(force.index[int(force.to_numpy().argmax())])
            deepest = float(force.index[-1])
            told.append(
                f"{person} {number(share, 2)} % at {number(deepest)}° (peak at {number(peak)}°)"
            )
    if told:
        yield (
            "Flexion relaxation: of the largest active force of the long back muscles "
            f"({listed([plain(name) for name in GLOBAL_EXTENSORS])}) the deepest bend forwards "
            f"leaves: {'; '.join(told)}."
        )


def persons(study: TrunkLoads, cohort: Cohort, results: ResultTables) -> Iterator[str]:
    """How far persons differ in the task in which they differ most."""
    rows = sound_rows(results, "tasks")
    if rows.empty or rows["specimen"].nunique() < 2:
        return
    wide = rows.pivot(index="task", columns="specimen", values=COMPRESSION).dropna(how="any")
    wide = wide[(wide > 0.0).all(axis=1)]
    if wide.empty:
        return
    ratio = (wide.max(axis=1) / wide.min(axis=1)).astype(float)
    task = str(wide.index[int(ratio.to_numpy().argmax())])
    more, less = str(wide.loc[task].idxmax()), str(wide.loc[task].idxmin())
    yield (
        f"Persons differ most in task {plain(task)}: L4L5 of {more} is pressed "
        f"{number(100.0 * (float(ratio[task]) - 1.0), 2)} % more than that of {less}."
    )


def simplified(study: TrunkLoads, cohort: Cohort, results: ResultTables) -> Iterator[str]:
    """What each simplification costs at most."""
    rows = results.table("simplified")
    if rows.empty:
        return
    good = rows[sound(rows)].dropna(subset=[COMPRESSION])
    wide = good.pivot(index=["specimen", "task"], columns="simplification", values=COMPRESSION)
    told = []
    for name, words in SIMPLIFIED.items():
        if not {name, "none"} <= set(wide):
            continue
        both = wide[[name, "none"]].dropna()
        both = both[both["none"] > 0.0]
        if both.empty:
            continue
        off = 100.0 * (both[name] / both["none"] - 1.0)
        at = int(off.abs().to_numpy().argmax())
        person, task = both.index.to_list()[at]
        change = float(off.iloc[at])
        signed = f"{'+' if change > 0.0 else ''}{number(change, 2)} %"
        told.append(f"{words}: {signed} ({plain(str(task))} of {person})")
    if told:
        yield (
            f"What simplifications change the compression of L4L5 by, at most: {'; '.join(told)}."
        )


def upright(study: TrunkLoads, cohort: Cohort, results: ResultTables) -> Iterator[str]:
    """What finding the upright posture does to the moments of the joints."""
    rows = results.table("upright")
    columns = ["moment_before_nm", "moment_after_nm"]
    known = filled(rows, *columns)
    if known.empty:
        return
    total = known[columns].abs().groupby(known["specimen"], sort=False).sum()
    before, after = (float(total[name].iloc[0]) for name in columns)
    bound = int(rows["bound"].sum())
    yield (
        f"Upright, the moments required at all joints of {total.index[0]} add up to "
        f"{number(after)} N m, before bodies turned to {number(before)} N m; {bound} of "
        f"{count(len(rows), 'rotation')} of all persons end at a bound."
    )
