"""What a study of trunk loads concludes of the loads; the sentences stand in conclusions.csv."""

from collections.abc import Iterator

import pandas as pd

from spinepipe.cohort import Cohort
from spinepipe.facts import number
from spinepipe.muscles.trunk import LEVELS
from spinepipe.report.conclusions import Conclusion, Value, numbers_from
from spinepipe.report.page.study_page import ResultTables
from spinepipe.report.words import count, level, listed, plain, short
from spinepipe.studies.trunk_loads.conclusions_of_trust import of_trust, people_mpa
from spinepipe.studies.trunk_loads.measured import beside_measured, counted_and_held, error
from spinepipe.studies.trunk_loads.samples import (
    Tables,
    spread_of,
    times,
    with_interval,
)
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
from spinepipe.studies.trunk_loads.words import SIMPLIFIED, STANDING, task_words

EASY = 0.4
"""Share of the strength: people stand upright with less of theirs."""

LOW_TONE = number(__name__, "standing_tone")
"""Least share of the strength of all muscles at which people stand."""

DEEP_DEG = 80.0
"""Flexion from which on the long back muscles of people are silent."""

SILENT, AS_STRONG = 0.1, 0.9
"""Shares of the largest active force: below, muscles have relaxed; above, they have not."""

SMALL = 5.0
"""Percent of a load: a change that no interval here would show."""

_MOST_NAMES = 4

_INVENTED = "made up"
"""Column ``who`` of a body that stands for nobody."""

GROUPS = {
    "load": "lifting",
    "push": "exertion",
    "aside": "sideways bending",
    "forward": "forward bending",
    "upright": "standing",
}
"""Tasks by what is done, in words."""


def conclusions(study: TrunkLoads, cohort: Cohort, results: ResultTables) -> Iterator[Conclusion]:
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
        yield from _standing(tasks, cohort)
        yield from _effort(tasks, cohort)
        yield from _relaxation(tasks, tables.get("muscles", pd.DataFrame()), cohort)
    if found is not None:
        yield from _range(found, tables, cohort)
        yield from _levels(found, tables)
    yield from _simplified(tables.get("simplified", pd.DataFrame()))
    yield from of_trust(study, tables, found, beside, missed)
    yield _methods(study, cohort, tables)


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
    names = {"task": task_words(row["task"]), "body": task_words(row["specimen"])}
    load, pressure = (
        with_interval(tables, row, *what) for what in ((COMPRESSION, "N"), (PRESSURE, "MPa"))
    )
    ratio = times(tables, found, COMPRESSION)
    with_error = "both" if missed is not None else "standing"
    without = "measured" if missed is not None else "alone"
    verdict = without if ratio is None else with_error
    told = {"load": load, "times": ratio, "error": missed}
    told |= numbers_from("tasks", held=missed.n or 0) if missed is not None else {}
    yield Conclusion("load", verdict, {k: v for k, v in told.items() if v is not None}, names)
    spread, drawn = spread_of(tables, row, COMPRESSION), {}
    if spread:
        lost, held = int(spread["n_failed"]), int(spread["n_samples"])
        drawn = numbers_from("intervals: n_samples and n_failed", lost=lost, samples=lost + held)
    if pd.notna(row["least_stress_mpa"]):
        source = "tasks: least_stress_mpa"
        least = {"value": Value(row["least_stress_mpa"], "MPa", source=source)} | people_mpa()
        least["allowed"] = Value(row["largest_stress_mpa"], "MPa", source="tasks")
        beyond = least["value"].number > least["allowed"].number
        yield Conclusion("stress", "above" if beyond else "allowed", least, names)
    sampled = "single" if load.low is None else "sampled"
    yield Conclusion("compression", sampled, {"value": load, **drawn}, names)
    own = study.volunteer is not None and row["specimen"] == study.volunteer.specimen
    measured = named(beside[beside["task"] == row["task"]]) if own else []
    known = "alone"
    if measured:
        known = "measured" if measured[0]["confirmed"] else "unconfirmed"
        mpa = measured[0]["measured_mpa"]
        drawn["measured"] = Value(mpa, "MPa", source="measured_pressures.csv")
    yield Conclusion("pressure", f"{known}_{sampled}", {"value": pressure, **drawn}, names)
    if missed is not None:
        n = numbers_from("tasks", held=missed.n or 0, counted=int(beside["counted"].sum()))
        yield Conclusion("error", "held", {"value": missed, **n})
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
    cause = cause.mask(every["short_of"].eq("arms").fillna(value=False), "stop_arms")
    by_task = cause.groupby(every["task"], sort=False).agg(
        lambda rows: rows.iloc[0] if rows.nunique() == 1 else "stop_mixed"
    )
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
        values = numbers_from("tasks: status, of every body", tasks=len(own)) | people_mpa()
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


def _standing(tasks: pd.DataFrame, cohort: Cohort) -> Iterator[Conclusion]:
    """Whether relaxed standing is as easy and as stable as in people, for every body."""
    free = free_handed(tasks, cohort)
    relaxed = free[upright(free)].dropna(subset=["strength_used", "stable"])
    if relaxed.empty:
        return
    toned = tasks[(tasks["tone"] == "stable") & (tasks["hand_load_kg"] == 0.0) & upright(tasks)]
    toned = toned[sound(toned) & toned["stable"].fillna(value=False).astype(bool)]
    tone = toned.groupby("specimen")["tone_share"].min()
    falling = relaxed[~relaxed["stable"].astype(bool)]["specimen"]
    needed = falling.map(tone).astype(float)
    values = {
        "share": Value(100.0 * float(relaxed["strength_used"].max()), "%", source="tasks"),
        "easy": Value(100.0 * EASY, "%"),
        "low": Value(100.0 * LOW_TONE, "%", source="own estimate"),
        "tone": Value(100.0 * float(needed.max()) if len(needed.dropna()) else 0.0, "%"),
    }
    faults = {
        "held": not sound(relaxed).all(),
        "strong": sound(relaxed).all() and values["share"].number >= 100.0 * EASY,
        "toned": bool(needed.max() > LOW_TONE),
        "falls" if (tasks["tone"] == "stable").any() else "unsought": bool(needed.isna().any()),
    }
    why = listed(STANDING[name].format(**values) for name, one in faults.items() if one)
    yield Conclusion("standing", "fails" if why else "passes", values, {"why": why})


def _effort(tasks: pd.DataFrame, cohort: Cohort) -> Iterator[Conclusion]:
    """Whether the model's muscles do what people do easily: tasks with empty hands."""
    free = free_handed(tasks, cohort)
    free = free[free["least_stress_mpa"].notna() | free["short_of"].eq("arms").fillna(value=False)]
    if free.empty:
        return
    worst = named(free.sort_values("least_stress_mpa", kind="stable", na_position="last"))[-1]
    names, values = {"task": task_words(worst["task"])}, people_mpa()
    if pd.isna(worst["least_stress_mpa"]):
        yield Conclusion("effort", "arms", values, names)
        return
    source = "tasks: least_stress_mpa, empty hands, largest of all bodies"
    values["worst"] = Value(worst["least_stress_mpa"], "MPa", source=source)
    fails = values["worst"].number > values["highest"].number
    yield Conclusion("effort", "weak" if fails else "enough", values, names)


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
    ends = {"least": min(left), "most": max(left)}
    values = {end: Value(100.0 * x, "%", n=len(left), source=how) for end, x in ends.items()}
    verdict = "relaxed" if max(left) <= SILENT else "none" if min(left) >= AS_STRONG else "partly"
    yield Conclusion("relaxation", verdict, values)


def _range(found: AnsweredTask, tables: Tables, cohort: Cohort) -> Iterator[Conclusion]:
    """How far bodies differ in the task of the answer, beside the interval of one of them.

    Without bodies that were invented: what was put in would come out.
    """
    people, tasks = cohort.specimens, tables["tasks"]
    if "who" in people:
        invented = people[people["who"] == _INVENTED]["specimen"]
        tasks = tasks[~tasks["specimen"].isin(invented)]
    rows = tasks[sound(tasks) & (tasks["task"] == found.task["task"])].dropna(subset=[COMPRESSION])
    if len(rows) < 2:
        return
    ranked = named(rows.sort_values(COMPRESSION, kind="stable"))
    ends = {"least": ranked[0], "most": ranked[-1]}
    how = "tasks: compression of L4L5, held tasks"
    values = {end: Value(row[COMPRESSION], "N", source=how) for end, row in ends.items()}
    names = {f"{end}_body": short(plain(row["specimen"]), 20) for end, row in ends.items()}
    one, verdict = with_interval(tables, found.task, COMPRESSION, "N"), "unsampled"
    if one.low is not None and one.high is not None:
        wide = one.high - one.low
        apart = values["most"].number - values["least"].number
        verdict = "differ" if apart > wide else "alike"
        values["wide"] = Value(wide, "N", source="intervals: high less low")
    values |= numbers_from(how, bodies=len(rows))
    names["task"] = task_words(found.task["task"])
    yield Conclusion("range", verdict, values, names)


def _levels(found: AnsweredTask, tables: Tables) -> Iterator[Conclusion]:
    """Where in the spine the load of the answer's task is."""
    rows = of_task(tables.get("levels", pd.DataFrame()), found.task)
    ranked = named(rows.dropna(subset=["compression_n"])) if len(rows) else []
    if len(ranked) < 2:
        return
    ranked.sort(key=lambda row: float(row["compression_n"]))
    order = [LEVELS[::-1].index(row["level"]) for row in ranked]
    rises = order == sorted(order) and not rows["compression_n"].duplicated().any()
    ends = {"least": ranked[0], "most": ranked[-1]}
    how = "levels: compression_n"
    values = {end: Value(row["compression_n"], "N", source=how) for end, row in ends.items()}
    names = {f"{end}_level": level(row["level"]) for end, row in ends.items()}
    names["task"] = task_words(found.task["task"])
    down = rises and (ranked[0]["level"], ranked[-1]["level"]) == ("T11T12", "L5S1")
    yield Conclusion("levels", "down" if down else "elsewhere", values, names)


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
    worst = named(found.sort_values("percent", key=abs, kind="stable"))[-1]
    own = found[found["simplification"] == worst["simplification"]]["percent"]
    how, worst_percent = "simplified: compression of L4L5", abs(float(worst["percent"]))
    ends = {"low": float(own.min()), "high": float(own.max()), "size": worst_percent}
    values = {end: Value(value, "%", n=len(own), source=how) for end, value in ends.items()}
    fewest = int(found["simplification"].value_counts().min())
    values |= numbers_from("simplified: status", pairs=len(own), fewest=fewest)
    names = {"what": SIMPLIFIED.get(worst["simplification"], plain(worst["simplification"]))}
    yield Conclusion("simplified", "small" if worst_percent < SMALL else "matters", values, names)


def _methods(study: TrunkLoads, cohort: Cohort, tables: Tables) -> Conclusion:
    tasks, sampled = (tables.get(name, pd.DataFrame()) for name in ("tasks", "intervals"))
    n = tasks["task"].nunique() if len(tasks) else 0
    values = numbers_from("specimens.csv and tasks", bodies=len(cohort.specimen_names), tasks=n)
    if sampled.empty:
        return Conclusion("methods", "single", values)
    values |= numbers_from("settings: samples", samples=study.uncertain.runs)
    names = {
        "sampled_bodies": count(sampled["specimen"].nunique(), "body", "bodies"),
        "sampled_tasks": count(sampled["task"].nunique(), "task"),
    }
    return Conclusion("methods", "sampled", values, names)
