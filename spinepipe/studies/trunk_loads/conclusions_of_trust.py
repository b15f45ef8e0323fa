"""How far the loads of a study of trunk loads can be trusted; sentences in conclusions.csv."""

from collections.abc import Iterator

import pandas as pd

from spinepipe.muscles.strength import HIGHEST_PA, LOWEST_PA, MEAN_PA
from spinepipe.report.conclusions import Conclusion, Value, numbers_from
from spinepipe.report.words import listed, plain
from spinepipe.status import Balanced
from spinepipe.studies.trunk_loads.measured import FEWEST, counted_and_held, error
from spinepipe.studies.trunk_loads.samples import Tables, lost_and_all, shares
from spinepipe.studies.trunk_loads.sampling import LEAST_SAMPLES
from spinepipe.studies.trunk_loads.selection import (
    COMPRESSION,
    PRESSURE,
    AnsweredTask,
    Row,
    named,
    sound,
)
from spinepipe.studies.trunk_loads.settings import TrunkLoads
from spinepipe.studies.trunk_loads.words import REFUSED, assumed, input_words, task_words

TELLABLE_MPA = 0.1
"""Two series of one man's measurements differ by this (Wilke 1999 and 2001, load held close)."""

LOADED = {"pressure": PRESSURE, "compression": COMPRESSION}
"""Loads whose spread is told."""

_MOST_NAMES = 4


def people_mpa() -> dict[str, Value]:
    """Largest stress of people's trunk extensors: lowest, mean and highest of persons."""
    ends = {"lowest": LOWEST_PA, "mean": MEAN_PA, "highest": HIGHEST_PA}
    return {name: Value(1e-6 * pa, "MPa", source="Burkhart 2018") for name, pa in ends.items()}


def of_trust(
    study: TrunkLoads,
    tables: Tables,
    found: AnsweredTask | None,
    beside: pd.DataFrame,
    missed: Value | None,
) -> Iterator[Conclusion]:
    """All of them."""
    yield from _inside(beside)
    yield from _compared(beside, missed)
    yield from _tuned(tables)
    if found is not None:
        yield from _drivers(study, tables, found.task)
    yield from _samples(tables)
    tasks = tables.get("tasks", pd.DataFrame())
    if len(tasks):
        yield _held(tasks)
        held = tasks[sound(tasks)]
        yield from _range_of_formula(held)
        yield from _left_over(held)
        yield from _stability(held)
    yield from _upright(tables.get("upright", pd.DataFrame()))


# --- measured pressures ---------------------------------------------------------------------------


def _inside(beside: pd.DataFrame) -> Iterator[Conclusion]:
    """Whether confirmed measured pressures lie inside the intervals of the computed ones."""
    sampled = beside.dropna(subset=["low"])  # an end that is open holds all above
    known = sampled[sampled["confirmed"]]
    if known.empty:
        return
    measured = known["measured_mpa"]
    out = known[(measured < known["low"]) | (measured > known["high"])]
    lost, held = int(known["n_failed"].sum()), int(known["n_samples"].sum())
    values = numbers_from(
        "intervals: pressure, beside measured_pressures.csv",
        outside=len(out),
        tasks=len(known),
        unconfirmed=len(sampled) - len(known),
        lost=lost,
        samples=lost + held,
    )
    some = "outside" if len(out) <= _MOST_NAMES else "outside_many"
    names = {"which": listed(plain(name) for name in out["task"])}
    yield Conclusion("inside", some if len(out) else "all", values, names)


def _compared(beside: pd.DataFrame, missed: Value | None) -> Iterator[Conclusion]:
    """Over how many tasks pressures are compared, and how sure the measured ones are."""
    if beside.empty:
        return
    held, counted = len(counted_and_held(beside)), int(beside["counted"].sum())
    values = numbers_from(
        "tasks: status, beside measured_pressures.csv",
        held=held,
        counted=counted,
        measured=len(beside),
        fewest=FEWEST,
        unconfirmed=int((~beside["confirmed"]).sum()),
    )
    if missed is None:
        yield Conclusion("compared", "stop", values)
    else:
        whole = "ok" if held == counted else "check"
        yield Conclusion("compared", whole, {**values, "error": missed})
    yield Conclusion("measured", "check", values)


def _tuned(tables: Tables) -> Iterator[Conclusion]:
    """What fitting to measured pressures does to held tasks, each predicted from the others."""
    rows = tables.get("pressures", pd.DataFrame())
    if len(rows):
        rows = rows[rows["counted"]].dropna(subset=["computed_mpa"])
        tiers = {
            tier: rows[(rows["tier"] == tier) & sound(rows)].set_index("task")
            for tier in ("untuned", "left_out")
        }
        both = tiers["untuned"].index.intersection(tiers["left_out"].index)
        before, after = (
            error(
                own.loc[both, "computed_mpa"], own.loc[both, "measured_mpa"], f"pressures: {tier}"
            )
            for tier, own in tiers.items()
        )
        counted = rows[rows["tier"] == "untuned"]["task"].nunique()
        n = numbers_from("pressures: status", held=len(both), fewest=FEWEST, counted=counted)
        if before is None or after is None:
            yield Conclusion("tuned", "few", n)
        else:
            change = after.number - before.number
            verdict = (
                "same" if abs(change) < TELLABLE_MPA else "worse" if change > 0.0 else "better"
            )
            values = {"before": before, "after": after, "tellable": Value(TELLABLE_MPA, "MPa")}
            yield Conclusion("tuned", verdict, {**values, **n})
    fitted = tables.get("tuning", pd.DataFrame())
    own = named(fitted[fitted["tier"] == "tuned"]) if len(fitted) else []
    if own:
        loose = [row for row in own if row["at_bound"] or not _closed(row)]
        nominal = [row for row in own if not loose and row["low"] <= row["default"] <= row["high"]]
        which = loose or nominal or own
        verdict = "check_loose" if loose else "check_nominal" if nominal else "ok"
        names = {"which": listed(input_words(row["parameter"]) for row in which)}
        yield Conclusion("fitted", verdict, names=names)


def _closed(row: Row) -> bool:
    """Whether the region of a fitted number has both ends."""
    return bool(pd.notna(row["identifiable"]) and row["identifiable"])


# --- samples --------------------------------------------------------------------------------------


def _drivers(study: TrunkLoads, tables: Tables, task: Row) -> Iterator[Conclusion]:
    """Which assumed input makes most of the spread of each load of the answer's task."""
    if tables.get("intervals", pd.DataFrame()).empty:
        return
    values, names, sources = {}, {"task": task_words(task["task"])}, []
    for name, quantity in LOADED.items():
        ranked, source = shares(study, tables, task, quantity)
        first = named(ranked.head(2))
        if not first:
            return
        sources.append(source)
        if len(first) < 2 or first[0]["low"] > first[1]["share"]:
            share, low, high = (float(first[0][end]) for end in ("share", "low", "high"))
            values[name] = Value(share, "%", low, high, source=f"drivers or responses: {source}")
            of = input_words(first[0]["factor"])
            names[name] = f"{of} ({assumed(study.uncertain, first[0]['factor'])})"
    names = {key if key == "task" else f"{key}_input": words for key, words in names.items()}
    each = [f"{source} ({name})" for source, name in zip(sources, LOADED, strict=True)]
    names["method"] = sources[0] if len(set(sources)) == 1 else "; ".join(each)
    verdict = "both" if len(values) == 2 else next(iter(values), "neither")
    yield Conclusion("drivers", verdict, values, names)


def _samples(tables: Tables) -> Iterator[Conclusion]:
    """Samples that do not hold their tasks, and whether those that do stand for all."""
    rows = tables.get("intervals", pd.DataFrame())
    if rows.empty:
        return
    lost, drawn = lost_and_all(rows)
    each = rows[rows["quantity"] == COMPRESSION]
    empty, opened = (int(each[end].isna().sum()) for end in ("low", "high"))
    above = int(each["n_above"].sum())
    source = "intervals: n_samples, n_failed and n_above, over tasks"
    values = numbers_from(source, lost=lost, samples=drawn, above=above)
    values |= numbers_from("intervals", tasks=empty, open=opened - empty, fewest=LEAST_SAMPLES)
    some = "check_open" if opened > empty else "check" if lost else "check_above" if above else "ok"
    verdict = "stop" if empty else some
    yield Conclusion("samples", verdict, values | people_mpa())


# --- solutions ------------------------------------------------------------------------------------


def _held(tasks: pd.DataFrame) -> Conclusion:
    """Bodies and tasks that muscles hold, at what stress, and those that they do not, by cause."""
    n = {one.value: int((tasks["status"] == one.value).sum()) for one in Balanced}
    above, beyond = n[Balanced.CONVERGED_ABOVE], n[Balanced.BEYOND_STRENGTH]
    arms, lost = int((tasks["short_of"] == "arms").sum()), int((~sound(tasks)).sum())
    refused = {"weak": beyond - arms, "arms": arms, "reach": n[Balanced.OUT_OF_REACH]}
    refused["unsolved"] = lost - sum(refused.values())
    source = "tasks: status and short_of"
    values = numbers_from(source, pairs=len(tasks), usual=n[Balanced.CONVERGED], above=above)
    values |= numbers_from(source, lost=lost, **refused)
    why = listed(
        REFUSED[cause].format("all" if many == lost else many)
        for cause, many in refused.items()
        if many
    )
    verdict = "stop" if lost else "check" if above else "ok"
    return Conclusion("held", verdict, values | people_mpa(), {"why": why})


def _range_of_formula(held: pd.DataFrame) -> Iterator[Conclusion]:
    known = held.dropna(subset=["inside_eq_6"])
    if len(known):
        out = int((~known["inside_eq_6"].astype(bool)).sum())
        values = numbers_from("tasks: inside_eq_6", outside=out, pressures=len(known))
        yield Conclusion("formula", "check" if out else "ok", values)


def _left_over(held: pd.DataFrame) -> Iterator[Conclusion]:
    """Moments that no muscle makes in held tasks: of some, as they need all the strength."""
    slack = held["largest_slack_nm"].dropna().astype(float)
    if slack.empty:
        return
    as_asked = held["status"] == Balanced.CONVERGED.value
    over = held[as_asked & (held["strength_used"].astype(float) > 1.0)]
    # to 0.001, as less is what a solver leaves
    values = {"slack": Value(round(float(slack.max()), 3), "N\u00a0m", source="tasks")}
    if len(over):
        values |= numbers_from("tasks: strength_used above 1", pairs=len(over))
        values["most"] = Value(100.0 * float(over["strength_used"].max()), "%", source="tasks")
    yield Conclusion("balance", "check" if len(over) else "ok", values)


def _stability(held: pd.DataFrame) -> Iterator[Conclusion]:
    """Whether the spine of the model comes back when pushed a little."""
    known = held.dropna(subset=["stable"])
    if known.empty:
        return
    stable = known["stable"].astype(bool)
    values = numbers_from("tasks: stable", falling=int((~stable).sum()), postures=len(known))
    asked = known[known["tone"] == "stable"]
    never = asked[~stable[asked.index]]
    n = {"bodies": never["specimen"].nunique(), "asked": asked["specimen"].nunique()}
    values |= numbers_from("tasks: stable, where tone was sought", **n)
    names = {"which": listed(plain(str(name)) for name in dict.fromkeys(never["task"]))}
    verdict = "stop_tone" if len(never) else "ok" if stable.all() else "check"
    yield Conclusion("stability", verdict, values, names)


def _upright(rows: pd.DataFrame) -> Iterator[Conclusion]:
    if len(rows):
        bound = int(rows["bound"].sum())
        values = numbers_from("upright: bound", bound=bound, rotations=len(rows))
        yield Conclusion("upright", "check" if bound else "ok", values)
