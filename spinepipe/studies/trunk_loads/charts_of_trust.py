"""Figures of how far loads can be trusted: strength, inputs, simplifications."""

import pandas as pd

from spinepipe.cohort import Cohort
from spinepipe.report.forms.chart import Chart, Key, saying
from spinepipe.report.forms.look import BASE, MODEL
from spinepipe.report.forms.rows import Rows
from spinepipe.report.words import capital, case, count, short
from spinepipe.studies.trunk_loads.charts import MOST_ROWS, WHOLE_COURSE
from spinepipe.studies.trunk_loads.conclusions import changes
from spinepipe.studies.trunk_loads.conclusions_of_trust import people_mpa
from spinepipe.studies.trunk_loads.samples import CORRELATIONS, Tables, shares
from spinepipe.studies.trunk_loads.selection import COMPRESSION, PRESSURE, named, sound
from spinepipe.studies.trunk_loads.settings import TrunkLoads
from spinepipe.studies.trunk_loads.words import SIMPLIFIED, assumed, input_words

LOADS = {"pressure": (PRESSURE, BASE), "compression": (COMPRESSION, MODEL)}

LEAST_SHARE = 2.0
"""Percent: inputs that make less of all spreads have no row."""

MOST_PANELS = 4


def strength(study: TrunkLoads, cohort: Cohort, tables: Tables) -> Chart:
    """Least muscle stress that each task takes, over bodies, beside that of people."""
    title = "Muscle stress that tasks take"
    tasks = tables["tasks"]
    known = tasks.dropna(subset=["least_stress_mpa"]) if len(tasks) else tasks
    if known.empty:
        return saying(title, "No finite muscle stress holds a task.")
    few = known[(known["number"].fillna(0) != WHOLE_COURSE) & (known["tone"] == "none")]
    known = few if len(few) else known
    bodies = tasks["specimen"].nunique()
    rows = []
    for task, own in known.groupby("task", sort=False):
        takes, held = own["least_stress_mpa"].astype(float), int(sound(own).sum())
        part = f"{held} of {bodies}" if 0 < held < bodies else ""
        several = {"low": float(takes.min()), "high": float(takes.max())} if len(takes) > 1 else {}
        rows.append({"row": case(str(task)), "value": float(takes.median()), "low": None,
                     "high": None, **several, "hollow": held == 0, "note": part})  # fmt: skip
    frame = pd.DataFrame(rows).sort_values("value", kind="stable")[-MOST_ROWS:]
    people = people_mpa()
    panel = Rows(
        x_label="least muscle stress that holds the task (MPa)",
        frame=frame.astype({"low": float, "high": float}),
        looks={"": MODEL},
        marks={people["highest"].number: "most in people"},
        log=True,
        width=440.0,
    )
    keys = [Key(MODEL, "held"), Key(MODEL, "held in no body", hollow=True)]
    over = f"Median and range over {count(bodies, 'body', 'bodies')}"
    beside = "{lowest:number} to {highest:unit}, mean {mean:unit} (Burkhart 2018)".format(**people)
    caption = f"{over}; at the right, how many hold the task where some do. People have {beside}."
    return Chart(title, [panel], caption, keys)


def drivers(study: TrunkLoads, cohort: Cohort, tables: Tables) -> Chart:
    """Shares of the spread of pressure and compression by input, a panel for each task."""
    title = "Where the spread of the loads comes from"
    places = named(tables["intervals"].drop_duplicates(["specimen", "task"])[:MOST_PANELS])
    found = []
    for place in places:
        for name, (quantity, _) in LOADS.items():
            table, source = shares(study, tables, place, quantity)
            told = {"task": place["task"], "series": name, "hollow": source == CORRELATIONS}
            found.append(table.assign(**told))
    frame = pd.concat(found) if found else pd.DataFrame()
    if frame.empty:
        return saying(title, "Too few samples hold their tasks: shares are not known.")
    largest = frame.groupby("factor")["share"].max().sort_values(ascending=False)
    order = list(largest[largest >= LEAST_SHARE].index) or list(largest.index[:1])
    words = {name: f"{input_words(name)} {assumed(study.uncertain, name)}" for name in order}
    frame = frame[frame["factor"].isin(order)].rename(columns={"share": "value"})
    frame = frame.assign(row=frame["factor"].map(words))
    frame = frame.sort_values("factor", key=lambda names: names.map(order.index), kind="stable")
    panels = [
        Rows(
            title=short(case(str(task)), 24),
            x_label="share of the spread (%)",
            frame=rows,
            looks={name: look for name, (_, look) in LOADS.items()},
            x_limits=(0.0, max(100.0, 1.02 * float(rows["high"].max()))),
            width=330.0,
        )
        for task, rows in frame.groupby("task", sort=False)
    ]
    keys = [Key(look, name) for name, (_, look) in LOADS.items()]
    approximate = ""
    if frame["hollow"].any():
        keys.append(Key(MODEL, "squared correlation", hollow=True))
        approximate = "; hollow where too many samples were lost for an index"
    caption = f"Beside inputs: their assumed SD. Line: 95 % interval of a share{approximate}."
    return Chart(title, panels, caption, keys)


def simplifications(study: TrunkLoads, cohort: Cohort, tables: Tables) -> Chart:
    """Change of the compression by each simplification, and the moment it leaves unbalanced."""
    title = "What simplifications change"
    found = changes(tables["simplified"])
    if found.empty:
        return saying(title, "No held task was solved with and without a simplification.")
    panels = []
    for column, words, marks in (
        ("percent", "change of compression (%)", {0.0: "whole model"}),
        ("imbalance_nm", "moment left unbalanced (N m)", {0.0: ""}),
    ):
        values = found.dropna(subset=[column]).groupby("simplification")[column]
        rows = values.agg(["median", "min", "max"]).reindex(list(SIMPLIFIED)).dropna()
        frame = rows.rename(columns={"median": "value", "min": "low", "max": "high"})
        frame = frame.reset_index().assign(row=frame.index.map(SIMPLIFIED).map(capital))
        panels.append(Rows(x_label=words, frame=frame, looks={"": MODEL}, marks=marks, width=400.0))
    caption = "Median and range over held tasks and bodies, against the whole model."
    return Chart(title, panels, caption)
