"""Figures of trunk loads: loads beside measured pressures, by level, by flexion and by muscle."""

from collections.abc import Mapping

import pandas as pd

from spinepipe.cohort import Cohort
from spinepipe.muscles.trunk import GLOBAL_EXTENSORS, LEVELS
from spinepipe.report.forms.chart import Chart, Key, Panel, saying
from spinepipe.report.forms.curves import Curves
from spinepipe.report.forms.look import BASE, MEASURED, MODEL, SEVERAL, Look
from spinepipe.report.forms.rows import Rows
from spinepipe.report.words import capital, case, level, plain, short
from spinepipe.status import HELD
from spinepipe.studies.trunk_loads.measured import beside_measured
from spinepipe.studies.trunk_loads.samples import Tables, spread_of
from spinepipe.studies.trunk_loads.selection import (
    COMPRESSION,
    PRESSURE,
    answer_of,
    courses_of,
    extensor_forces,
    named,
    of_person,
    shown_person,
    sound,
)
from spinepipe.studies.trunk_loads.settings import TrunkLoads

MOST_BODIES, MOST_ROWS, MOST_LEVELS = len(SEVERAL), 16, 3

WHOLE_COURSE = 7
"""Number of the paper's task that is a course of angles, not one posture."""

LOADS = {
    COMPRESSION: "compression of L4–L5 (N)",
    "l4l5_shear_n": "shear of L4–L5 (N), + forwards",
}
NOT_HELD = "computed, not held by the model: do not use"


def pressures(study: TrunkLoads, cohort: Cohort, tables: Tables) -> Chart:
    """Computed beside measured pressures, then the compression of all tasks and bodies."""
    title, tasks = "Pressure in and compression of L4–L5", tables["tasks"]
    body = shown_person(study, tasks[sound(tasks)]) if len(tasks) else None
    if body is None or tasks[COMPRESSION].isna().all():
        return saying(title, "The model holds no task: there is no load to show.")
    keys = [Key(MODEL, "computed"), Key(MODEL, NOT_HELD, hollow=True)]
    compressed = Rows(
        title="Compression",
        x_label="compression (N)",
        frame=_compressions(tables, body),
        looks={"": MODEL},
    )
    panels: list[Panel] = [compressed]
    beside = beside_measured(study, tables).dropna(subset=["computed_mpa"])
    if len(beside):
        beside = beside.assign(row=beside["task"].map(case))
        measured = {"value": beside["measured_mpa"], "hollow": ~beside["confirmed"]}
        computed = {"value": beside["computed_mpa"], "hollow": ~beside["held"]}
        frames = [
            beside[["row"]].assign(series="measured", **measured),
            beside[["row", "low", "high"]].assign(series="computed", **computed),
        ]
        looks, label = {"measured": MEASURED, "computed": MODEL}, "pressure in L4–L5 (MPa)"
        panels.insert(
            0, Rows(title="Pressure", x_label=label, frame=pd.concat(frames), looks=looks)
        )
        keys.insert(0, Key(MEASURED, "measured"))
        keys.append(Key(MEASURED, "measured, not confirmed in print", hollow=True))
    held = "thick line: range over bodies that hold the task"
    caption = f"{short(plain(body))}; thin line: 95 % of samples, to the edge where open; {held}."
    return Chart(title, panels, capital(caption), keys)


def _compressions(tables: Tables, body: str) -> pd.DataFrame:
    """Tasks of a body by load, without those that are angles on a course alone."""
    tasks = tables["tasks"]
    posed = of_person(tasks, body).dropna(subset=[COMPRESSION])
    own = posed[posed["number"].fillna(0) != WHOLE_COURSE]
    own = (own if len(own) else posed).sort_values(COMPRESSION, kind="stable")
    # equal results stand once: such as standing, and the same with a tone that was not found
    own = own.drop_duplicates([COMPRESSION, PRESSURE])[-MOST_ROWS:]
    found = []
    for row in named(own):
        spread = spread_of(tables, row, COMPRESSION)
        others = tasks[sound(tasks) & (tasks["task"] == row["task"])][COMPRESSION].astype(float)
        several = len(others) > 1
        found.append(
            {
                "row": case(row["task"]),
                "value": float(row[COMPRESSION]),
                **{end: spread.get(end) for end in ("low", "high")},
                "inner_low": float(others.min()) if several else None,
                "inner_high": float(others.max()) if several else None,
                "hollow": row["status"] not in HELD,
            }
        )
    numbers = ("low", "high", "inner_low", "inner_high")
    return pd.DataFrame(found).astype(dict.fromkeys(numbers, float))


def by_level(study: TrunkLoads, cohort: Cohort, tables: Tables) -> Chart:
    """Compression and shear from the top down, of up to three tasks."""
    title, levels = "Load on every joint", tables["levels"]
    found = answer_of(study, cohort, tables)
    if found is None or levels.empty:
        return saying(title, "The model holds no task: there is no load to show.")
    wanted = [found.task["task"], *([found.standing["task"]] if found.standing else [])]
    own = of_person(tables["tasks"], found.task["specimen"])
    known = own[sound(own) & ~own["task"].isin(wanted)].sort_values(COMPRESSION, kind="stable")
    if len(known):
        wanted.insert(1, str(known["task"].iloc[len(known) // 2]))
    looks = {case(name): look for name, look in zip(wanted[:MOST_LEVELS], SEVERAL, strict=False)}
    mine = of_person(levels, found.task["specimen"])
    mine = of_person(levels, found.task["specimen"])
    mine = mine.sort_values("level", key=lambda names: -names.map(LEVELS.index), kind="stable")
    rows = mine[mine["task"].isin(wanted[:MOST_LEVELS])]
    rows = rows.assign(row=rows["level"].map(level), series=rows["task"].map(case))
    panels = [
        Rows(
            x_label=words,
            frame=rows.assign(value=rows[column].astype(float))[["row", "series", "value"]],
            looks=looks,
            marks={0.0: ""},
            width=400.0,
        )
        for column, words in (
            ("compression_n", "compression (N)"),
            ("shear_anterior_n", "shear (N), + upper vertebra forwards"),
        )
    ]
    keys = [Key(look, name) for name, look in looks.items()]
    caption = f"{short(plain(found.task['specimen']))}, with every input as it is."
    return Chart(title, panels, capital(caption), keys)


def over_flexion(study: TrunkLoads, cohort: Cohort, tables: Tables) -> Chart:
    """Compression and shear of all bodies while they bend forwards."""
    title = "Load while bending forwards"
    tasks = tables["tasks"]
    courses = courses_of(tasks, cohort) if len(tasks) else {}
    if not courses:
        return saying(title, "No body has three held angles of bending forwards.")
    names = list(courses)[:MOST_BODIES]
    looks = {plain(name): look for name, look in zip(names, SEVERAL, strict=False)}
    panels = []
    for column, words in LOADS.items():
        frames = []
        for name in names:
            course = courses[name]
            ends = [spread_of(tables, row, column) for row in named(course)]
            line = pd.DataFrame(
                {"x": course["flexion_deg"], "y": course[column].astype(float),
                 "y_low": [one.get("low") for one in ends],
                 "y_high": [one.get("high") for one in ends]}, dtype=float
            )  # fmt: skip
            frames.append(line[["x", "y"]].assign(series=plain(name)))
            frames.append(line.dropna().assign(series=f"{plain(name)}, sampled"))
        points = {f"{name}, sampled": look for name, look in looks.items()}
        panels.append(
            Curves(
                x_label="flexion of the trunk (°)",
                y_label=words,
                frame=pd.concat([one for one in frames if len(one)], ignore_index=True),
                looks={**looks, **points},
                points=tuple(points),
                width=400.0,
            )
        )
    keys = [Key(look, short(name), as_line=True) for name, look in looks.items()]
    caption = "Empty hands, tasks that the model holds. Symbol with line: 95 % of samples."
    return Chart(title, panels, caption, keys)


PARTS: Mapping[str, Look] = {"active": MODEL, "passive": BASE}


def extensors(study: TrunkLoads, cohort: Cohort, tables: Tables) -> Chart:
    """Active and passive force of the long back muscles of one body while it bends forwards."""
    title = "Long back muscles while bending forwards"
    tasks = tables["tasks"]
    courses = courses_of(tasks, cohort) if len(tasks) else {}
    body = shown_person(study, tasks[tasks["specimen"].isin(courses)]) if courses else None
    forces = pd.DataFrame()
    if body is not None and len(tables["muscles"]):
        forces = extensor_forces(of_person(tables["muscles"], body), courses[body])
    if body is None or forces.empty:
        return saying(title, "No body has three held angles of bending forwards.")
    summed = forces.groupby(["group", "flexion_deg"], as_index=False).sum()
    panels = []
    for group in [name for name in GLOBAL_EXTENSORS if name in set(summed["group"])]:
        own = summed[summed["group"] == group].sort_values("flexion_deg")
        parts = [
            pd.DataFrame({"x": own["flexion_deg"], "y": own[part], "series": part})
            for part in PARTS
        ]
        panels.append(
            Curves(
                title=case(group),
                x_label="flexion of the trunk (°)",
                y_label="force (N), both sides",
                frame=pd.concat(parts),
                looks=PARTS,
                width=400.0,
                high=190.0,
            )
        )
    keys = [Key(look, f"{part} force", as_line=True) for part, look in PARTS.items()]
    caption = f"{short(plain(body))}. Muscles that relax have no active force at the right end."
    return Chart(title, panels, capital(caption), keys)


def tuned(study: TrunkLoads, cohort: Cohort, tables: Tables) -> Chart:
    """Pressures with nothing fitted, and predicted from a fit to the other tasks."""
    title = "Pressures before and after fitting"
    rows = tables["pressures"]
    rows = rows[rows["counted"]].dropna(subset=["computed_mpa"]) if len(rows) else rows
    if rows.empty:
        return saying(title, "No pressure was computed for a task whose pressure was measured.")
    looks = {"measured": MEASURED, "nothing fitted": BASE, "predicted from the others": MODEL}
    first = rows[rows["tier"] == "untuned"]
    parts = [first.assign(series="measured", value=first["measured_mpa"], hollow=False)]
    for tier, words in (("untuned", "nothing fitted"), ("left_out", "predicted from the others")):
        own = rows[rows["tier"] == tier]
        parts.append(own.assign(series=words, value=own["computed_mpa"], hollow=~sound(own)))
    frame = pd.concat(parts).sort_values("measured_mpa", kind="stable")
    frame = frame.assign(row=frame["task"].map(case))[["row", "series", "value", "hollow"]]
    panel = Rows(x_label="pressure in L4–L5 (MPa)", frame=frame, looks=looks, width=420.0)
    keys = [Key(look, name) for name, look in looks.items()]
    caption = "Hollow: the model does not hold the task, so it is in no error."
    return Chart(title, [panel], caption, keys)
