"""What a study of trunk loads concludes of recorded lifts; sentences stand in conclusions.csv."""

from collections.abc import Iterator

import pandas as pd

from spinepipe.cohort import Cohort
from spinepipe.report.conclusions import Conclusion, Value, numbers_from
from spinepipe.report.words import plain
from spinepipe.status import Balanced
from spinepipe.studies.trunk_loads.conclusions_of_trust import people_mpa
from spinepipe.studies.trunk_loads.lift_rows import (
    GUIDELINE_N,
    L4L5,
    LargestLoad,
    largest_load,
    lifts_of,
)
from spinepipe.studies.trunk_loads.samples import Tables
from spinepipe.studies.trunk_loads.selection import sound
from spinepipe.studies.trunk_loads.settings import TrunkLoads

FEW = 0.05
"""Share of frames that are not held, below which the lift can be used with care."""

_SOURCE = "lift_loads: compression_n of L4L5, frames that are held"


def of_lifts(
    study: TrunkLoads, cohort: Cohort, tables: Tables, alone: bool
) -> Iterator[Conclusion]:
    """All of them.

    Parameters
    ----------
    alone : whether the study has no tasks, so that the lifts are its answer.
    """
    lifts = lifts_of(tables)
    if not lifts:
        return
    found = [one for one in (largest_load(tables, *lift) for lift in lifts) if one is not None]
    yield from _largest(found, tables["lift_loads"], alone)
    yield from _held(tables["lift_loads"], study.motions.largest_stress_mpa)
    yield from _bands(tables.get("lift_bands", pd.DataFrame()))
    if len(found) > 1:
        ends = [float(one.row["compression_n"]) for one in found]
        told = {"least": min(ends), "most": max(ends)}
        values = {
            end: Value(value, "N", n=len(ends), source=_SOURCE) for end, value in told.items()
        }
        values |= numbers_from("lift_loads", lifts=len(lifts))
        yield Conclusion("lift_range", "all" if len(found) == len(lifts) else "some", values)
    if alone:
        rebuilt = "rebuilt" if cohort.rebuilt else "scaled"
        yield Conclusion("bodies_from", f"check_{rebuilt}")
        yield Conclusion("bodies", rebuilt)
    frames = int((tables["lift_loads"]["level"] == L4L5).sum())
    values = numbers_from("lift_loads", lifts=len(lifts), frames=frames)
    values |= numbers_from("settings: motions", samples=study.motions.samples)
    drawn = "sampled" if study.motions.samples else "single"
    yield Conclusion("lift_methods", f"alone_{drawn}" if alone else drawn, values)


def _largest(found: list[LargestLoad], loads: pd.DataFrame, alone: bool) -> Iterator[Conclusion]:
    """The largest load of all lifts, and how far it is from what lifting guidelines use."""
    rule = "lift" if alone else "lift_too"
    if not found:
        yield Conclusion(rule, "none")
        return
    most = max(found, key=lambda one: float(one.row["compression_n"]))
    newtons = float(most.row["compression_n"])
    load = Value(newtons, "N", source=_SOURCE)
    if most.band:
        low, high = most.band["low"], most.band["high"]
        ends = float(low), None if pd.isna(high) else float(high)
        n = int(most.band["n_samples"] + most.band["n_failed"])
        load = Value(newtons, "N", *ends, n, f"{_SOURCE}; lift_bands")
    apart = float(round(100.0 * (newtons / GUIDELINE_N - 1.0)))
    values = {
        "load": load,
        "value": load,
        "time": Value(float(most.row["time_s"]), "s", source="lift_loads: time_s"),
        "apart": Value(abs(apart), "%", source=f"{_SOURCE}, over the guideline's"),
        "limit": Value(GUIDELINE_N, "N", source="facts.csv: compression_guideline"),
    }
    names = {"trial": plain(str(most.row["trial"]))}
    side = "above" if apart > 0.0 else "below"
    rows = loads[loads["level"] == L4L5]
    weak = rows[~sound(rows)]
    if len(weak) and float(weak["compression_n"].max()) > newtons:
        values |= numbers_from("lift_loads: status", lost=len(weak), frames=len(rows))
        side = "open"
    yield Conclusion(rule, side, values, names)
    if not alone or side == "open":
        return
    pressure = Value(float(most.row["pressure_mpa"]), "MPa", source="lift_loads: pressure_mpa")
    inside = "inside" if most.row["inside_eq_6"] else "beyond"
    yield Conclusion("lift_pressure", inside, {"value": pressure}, names)
    if most.after_s is not None:
        verdict = "after" if most.after_s >= 0.0 else "before"
        when = Value(round(abs(most.after_s), 2), "s", source="lift_frames: load_n")
        yield Conclusion("lift_time", verdict, {"value": when}, names)
    told = {"value": values["apart"], "limit": values["limit"]}
    yield Conclusion("lift_limit", side, told, names)


def _held(loads: pd.DataFrame, asked_mpa: float) -> Iterator[Conclusion]:
    """Whether muscles hold every frame."""
    rows = loads[loads["level"] == L4L5]
    lost = rows[~sound(rows)]
    values = numbers_from("lift_loads: status", frames=len(rows), lost=len(lost))
    if lost.empty:
        above = rows["status"] == Balanced.CONVERGED_ABOVE
        most = Value(float(rows["least_stress_mpa"].max()), "MPa", source="lift_loads")
        values |= numbers_from("lift_loads: status", above=int(above.sum()))
        values |= {"stress": most, "asked": Value(asked_mpa, "MPa", source="settings: motions")}
        yield Conclusion("lift_held", "check_above" if above.any() else "ok", values)
        return
    words = lost["message"].replace("", pd.NA).dropna()
    names = {"why": str(words.mode().iloc[0]) if len(words) else "they did not converge"}
    verdict = "check" if len(lost) <= FEW * len(rows) else "stop"
    yield Conclusion("lift_held", verdict, values, names)


def _bands(bands: pd.DataFrame) -> Iterator[Conclusion]:
    """How many persons that were drawn do not hold a frame, or at more stress than people have."""
    rows = bands[bands["level"] == L4L5] if len(bands) else bands
    if rows.empty:
        return
    lost, n = int(rows["n_failed"].sum()), int((rows["n_failed"] + rows["n_samples"]).sum())
    values = numbers_from("lift_bands", lost=lost, samples=n)
    values |= numbers_from("lift_bands", frames=len(rows), without=int(rows["high"].isna().sum()))
    values |= numbers_from("lift_bands", above=int(rows["n_above"].sum())) | people_mpa()
    verdict = "check" if lost or values["above"].number else "ok"
    verdict = "check_open" if rows["high"].isna().any() else verdict
    yield Conclusion("lift_bands", verdict, values)
