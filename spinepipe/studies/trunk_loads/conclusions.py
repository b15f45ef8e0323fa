"""What a study of trunk loads concludes of the loads; the sentences stand in conclusions.csv."""

from collections.abc import Iterator

import pandas as pd

from spinepipe.cohort import Cohort
from spinepipe.report.conclusions import Conclusion, Value
from spinepipe.report.page.study_page import Results
from spinepipe.report.words import level, listed, plain, short
from spinepipe.studies.trunk_loads.conclusions_of_trust import of_trust
from spinepipe.studies.trunk_loads.measured import beside_measured, counted_and_held, error
from spinepipe.studies.trunk_loads.samples import Tables, spread_of, times, with_interval
from spinepipe.studies.trunk_loads.selection import (
    COMPRESSION,
    PRESSURE,
    AnsweredTask,
    answer_of,
    courses_of,
    extensor_forces,
    free_handed,
    named,
    of_person,
    of_task,
    pushed,
    sound,
    upright,
)
from spinepipe.studies.trunk_loads.settings import TrunkLoads
from spinepipe.studies.trunk_loads.words import SIMPLIFIED

EASY = 0.5
"""Share of the strength: people stand upright with much less of theirs."""

DEEP_DEG = 80.0
"""Flexion from which on the long back muscles of people are silent."""

SILENT, AS_STRONG = 0.1, 0.9
"""Shares of the largest active force: below, muscles have relaxed; above, they have not."""

SMALL = 5.0
"""Percent of a load: a change that no interval here would show."""

_MOST_LETTERS, _MOST_NAMES = 30, 4

GROUPS = {
    "load": "lifting",
    "push": "exertion",
    "aside": "sideways bending",
    "forward": "forward bending",
    "upright": "standing",
}
"""Tasks by what is done, in words."""


def conclusions(study: TrunkLoads, cohort: Cohort, results: Results) -> Iterator[Conclusion]:
    """All of them."""
    tables = results.tables
    tasks = tables.get("tasks", pd.DataFrame())
    found, beside = answer_of(study, cohort, tables), beside_measured(study, tables)
    off = counted_and_held(beside)
    missed = error(
        off["computed_mpa"], off["measured_mpa"], "tasks: pressures less measured ones, held tasks"
    )
    yield from _answer(study, found, tables, beside, missed)
    rebuilt = "rebuilt" if cohort.rebuilt else "scaled"
    yield Conclusion("bodies_from", f"check_{rebuilt}")
    stopped = list(_not_to_use(tasks, cohort)) if len(tasks) else []
    yield from stopped or [Conclusion("bodies", rebuilt)]
    if len(tasks):
        yield from _effort(tasks, cohort)
        yield from _relaxation(tasks, tables.get("muscles", pd.DataFrame()), cohort)
    if found is not None:
        yield from _range(found, tables)
        yield from _levels(found, tables)
        yield from _muscles(found, tables)
    yield from _simplified(tables.get("simplified", pd.DataFrame()))
    yield from of_trust(study, tables, found, beside, missed)
    yield _methods(study, cohort, tasks)


def task_words(name: str) -> str:
    """A task in a sentence."""
    return short(plain(name), _MOST_LETTERS)


def _answer(
    study: TrunkLoads,
    found: AnsweredTask | None,
    tables: Tables,
    beside: pd.DataFrame,
    missed: Value | None,
) -> Iterator[Conclusion]:
    """The load of the task that stands for the others, and how far pressures are off."""
    if found is None:
        yield Conclusion("load", "none")
        return
    row = found.task
    names = {"task": task_words(row["task"]), "body": short(plain(row["specimen"]), _MOST_LETTERS)}
    load, pressure = (
        with_interval(tables, row, *what) for what in ((COMPRESSION, "N"), (PRESSURE, "MPa"))
    )
    ratio = times(tables, found, COMPRESSION)
    verdict = {
        (True, True): "both",
        (True, False): "standing",
        (False, True): "measured",
        (False, False): "alone",
    }[ratio is not None, missed is not None]
    told = {"load": load, "times": ratio, "error": missed}
    yield Conclusion("load", verdict, {k: v for k, v in told.items() if v is not None}, names)
    spread = spread_of(tables, row, COMPRESSION)
    drawn = {}
    if spread:
        lost, held = int(spread["n_failed"]), int(spread["n_samples"])
        drawn = {
            "lost": Value(lost, source="intervals: n_failed"),
            "samples": Value(lost + held, source="intervals: n_samples and n_failed"),
        }
    sampled = "single" if load.low is None else "sampled"
    yield Conclusion("compression", sampled, {"value": load, **drawn}, names)
    own = study.volunteer is not None and row["specimen"] == study.volunteer.specimen
    measured = named(beside[beside["task"] == row["task"]]) if own else []
    if not measured:
        yield Conclusion("pressure", f"alone_{sampled}", {"value": pressure, **drawn}, names)
    else:
        known = "measured" if measured[0]["confirmed"] else "unconfirmed"
        beside_it = Value(measured[0]["measured_mpa"], "MPa", source="measured_pressures.csv")
        told = {"value": pressure, "measured": beside_it, **drawn}
        yield Conclusion("pressure", f"{known}_{sampled}", told, names)
    if missed is not None:
        counted = int(beside["counted"].sum())
        of = {"held": Value(missed.n or 0), "counted": Value(counted, source="tasks of the paper")}
        yield Conclusion("error", "held", {"value": missed, **of})
    if ratio is not None:
        yield Conclusion("times", "standing", {"value": ratio}, names)


def _not_to_use(tasks: pd.DataFrame, cohort: Cohort) -> Iterator[Conclusion]:
    """Tasks that fail for every body, by cause and by what is done."""
    failing = tasks[~sound(tasks)]
    bodies = tasks["specimen"].nunique()
    every = failing.groupby("task", sort=False).filter(lambda r: r["specimen"].nunique() == bodies)
    if every.empty:
        return
    causes = {"beyond_strength": "stop_weak", "out_of_reach": "stop_reach"}
    cause = every["status"].map(causes).fillna("stop_unsolved")
    by_task = cause.groupby(every["task"], sort=False).agg(lambda rows: rows.mode().iloc[0])
    group = groups_of(tasks, cohort)
    for verdict, names in by_task.groupby(by_task, sort=False):
        own = [str(name) for name in names.index]
        told = []
        for what, words in GROUPS.items():
            some = [name for name in own if group[name] == what]
            n = sum(one == what for one in group.values())
            if some:
                few = ", ".join(map(task_words, some))
                whole = f"all {n}" if len(some) == n else f"{len(some)} of {n}"
                told.append(f"{words} ({few if len(some) <= _MOST_NAMES else whole})")
        values = {"tasks": Value(len(own), source="tasks: status, of every body")}
        yield Conclusion(
            "not_to_use", str(verdict), values, {"which": listed(told, len(told), None)}
        )


def groups_of(tasks: pd.DataFrame, cohort: Cohort) -> dict[str, str]:
    """What is done in each task, a key of `GROUPS`."""
    against, still = pushed(cohort), upright(tasks)
    found = {}
    for row, straight in zip(named(tasks), still, strict=True):
        name = str(row["task"])
        aside = abs(row["trunk_right_bending_deg"]) > abs(row["trunk_extension_deg"])
        bent = "upright" if straight else "aside" if aside else "forward"
        loaded = "load" if row["hand_load_kg"] > 0.0 else bent
        found[name] = "push" if name in against else loaded
    return found


def _effort(tasks: pd.DataFrame, cohort: Cohort) -> Iterator[Conclusion]:
    """Whether the model's muscles do what people do easily: tasks with empty hands."""
    free = free_handed(tasks, cohort).dropna(subset=["strength_used"])
    if free.empty:
        return
    worst = named(free.sort_values("strength_used", kind="stable"))[-1]
    source = "tasks: strength_used, empty hands, largest of all bodies"
    values = {"worst": Value(100.0 * worst["strength_used"], "%", source=source)}
    names = {"task": task_words(worst["task"])}
    standing = free[upright(free)]
    if len(standing):
        share = float(standing["strength_used"].max())
        values["standing"] = Value(100.0 * share, "%", source=source)
        if share > EASY or worst["strength_used"] > 1.0:
            yield Conclusion("effort", "weak", values, names)
            return
    elif worst["strength_used"] > 1.0:
        yield Conclusion("effort", "weak_task", values, names)
        return
    yield Conclusion("effort", "enough", values, names)


def _relaxation(tasks: pd.DataFrame, muscles: pd.DataFrame, cohort: Cohort) -> Iterator[Conclusion]:
    """What is left of the long back muscles' active force in the deepest bend, of all bodies."""
    left = []
    for body, course in courses_of(tasks, cohort).items() if len(muscles) else ():
        forces = extensor_forces(of_person(muscles, body), course)
        force = forces.groupby("flexion_deg")["active"].sum().sort_index()
        if len(force) and force.max() > 0.0 and force.index[-1] >= DEEP_DEG:
            left.append(float(force.iloc[-1] / force.max()))
    if not left:
        return
    how = "muscles: active force of the long extensors, deepest bend over largest"
    values = {
        "least": Value(100.0 * min(left), "%", n=len(left), source=how),
        "most": Value(100.0 * max(left), "%", n=len(left), source=how),
    }
    verdict = "relaxed" if max(left) <= SILENT else "none" if min(left) >= AS_STRONG else "partly"
    yield Conclusion("relaxation", verdict, values)


def _range(found: AnsweredTask, tables: Tables) -> Iterator[Conclusion]:
    """How far bodies differ in the task of the answer, beside the interval of one of them."""
    tasks = tables["tasks"]
    rows = tasks[sound(tasks) & (tasks["task"] == found.task["task"])].dropna(subset=[COMPRESSION])
    if len(rows) < 2:
        return
    ranked = named(rows.sort_values(COMPRESSION, kind="stable"))
    least, most = ranked[0], ranked[-1]
    how = "tasks: compression of L4L5, held tasks"
    values = {
        "least": Value(least[COMPRESSION], "N", source=how),
        "most": Value(most[COMPRESSION], "N", source=how),
        "bodies": Value(len(rows), source=how),
    }
    names = {"task": task_words(found.task["task"])}
    names |= {
        k: short(plain(row["specimen"]), 20)
        for k, row in (("least_body", least), ("most_body", most))
    }
    one = with_interval(tables, found.task, COMPRESSION, "N")
    verdict = "unsampled"
    if one.low is not None and one.high is not None:
        wide = most[COMPRESSION] - least[COMPRESSION] > one.high - one.low
        verdict = "differ" if wide else "alike"
        values["wide"] = Value(one.high - one.low, "N", source="intervals: high less low")
    yield Conclusion("range", verdict, values, names)


def _levels(found: AnsweredTask, tables: Tables) -> Iterator[Conclusion]:
    """Where in the spine the load of the answer's task is."""
    rows = of_task(tables.get("levels", pd.DataFrame()), found.task)
    ranked = named(rows.dropna(subset=["compression_n"])) if len(rows) else []
    if len(ranked) < 2:
        return
    ranked.sort(key=lambda row: float(row["compression_n"]))
    least, most = ranked[0], ranked[-1]
    values = {
        name: Value(row["compression_n"], "N", source="levels: compression_n")
        for name, row in (("least", least), ("most", most))
    }
    names = {"least_level": level(least["level"]), "most_level": level(most["level"])}
    down = (least["level"], most["level"]) == ("T11T12", "L5S1")
    names["task"] = task_words(found.task["task"])
    yield Conclusion("levels", "down" if down else "elsewhere", values, names)


def _muscles(found: AnsweredTask, tables: Tables) -> Iterator[Conclusion]:
    """Who pulls in the answer's task."""
    rows = of_task(tables.get("muscles", pd.DataFrame()), found.task)
    total = float(rows["force_n"].sum()) if len(rows) else 0.0
    if total <= 0.0:
        return
    summed = rows.groupby("group", sort=False)["force_n"].sum()
    passive = float(rows["passive_n"].sum()) / total
    how = "muscles: forces summed over fascicles"
    values = {
        "first": Value(100.0 * float(summed.max()) / total, "%", source=how),
        "passive": Value(100.0 * passive, "%", source=how),
    }
    names = {"group": plain(str(summed.idxmax())), "task": task_words(found.task["task"])}
    yield Conclusion("muscles", "stretched" if passive > 0.5 else "active", values, names)


def changes(simplified: pd.DataFrame) -> pd.DataFrame:
    """Change of the compression of L4L5 by each simplification, percent of the whole model's.

    Columns simplification, specimen, task, percent, imbalance_nm; tasks that both hold.
    """
    columns = ["simplification", "specimen", "task", "percent", "imbalance_nm"]
    good = simplified[sound(simplified)] if len(simplified) else simplified
    if good.empty:
        return pd.DataFrame(columns=columns)
    place = ["specimen", "task"]
    whole = good[good["simplification"] == "none"].set_index(place)[COMPRESSION].rename("whole")
    rows = good[good["simplification"] != "none"].join(whole, on=place).dropna(subset=["whole"])
    rows = rows[rows["whole"] > 0.0]
    return rows.assign(percent=100.0 * (rows[COMPRESSION] / rows["whole"] - 1.0))[columns]


def _simplified(simplified: pd.DataFrame) -> Iterator[Conclusion]:
    """Which simplification changes the load most."""
    found = changes(simplified)
    if found.empty:
        return
    worst = found.loc[found["percent"].abs().idxmax()]
    own = found[found["simplification"] == worst["simplification"]]["percent"]
    how = "simplified: compression of L4L5, held tasks of all bodies"
    values = {
        "low": Value(float(own.min()), "%", n=len(own), source=how),
        "high": Value(float(own.max()), "%", n=len(own), source=how),
        "size": Value(abs(float(worst["percent"])), "%", n=len(own), source=how),
    }
    names = {"what": SIMPLIFIED.get(worst["simplification"], plain(worst["simplification"]))}
    small = abs(float(worst["percent"])) < SMALL
    yield Conclusion("simplified", "small" if small else "matters", values, names)


def _methods(study: TrunkLoads, cohort: Cohort, tasks: pd.DataFrame) -> Conclusion:
    n = tasks["task"].nunique() if len(tasks) else 0
    values = {
        "bodies": Value(len(cohort.specimen_names), source="specimens.csv"),
        "tasks": Value(n, source="tasks"),
    }
    if not study.uncertain.tasks:
        return Conclusion("methods", "single", values)
    values["samples"] = Value(study.uncertain.runs, source="settings: samples")
    return Conclusion("methods", "sampled", values)
