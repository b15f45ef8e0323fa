"""Figures of a search for missing effects.

The base is dashed vermilion, the model with effects blue, in all of them.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from spinepipe.cohort import Cohort
from spinepipe.effects.contract import Array
from spinepipe.report.forms.chart import Chart, Key, Panel, saying
from spinepipe.report.forms.curves import Curves
from spinepipe.report.forms.look import BASE, MEASURED, MODEL, THIRD
from spinepipe.report.forms.rows import BeforeAfter, Rows
from spinepipe.report.words import (
    POSITIVE,
    capital,
    count,
    level,
    number,
    plain,
    short,
    unit,
)
from spinepipe.studies.discrepancy.alternatives import USEFUL, advised, run_in_words
from spinepipe.studies.discrepancy.curve_rows import (
    driven_coordinates,
    off_by,
    stiffness_at_rest_and_loaded,
)
from spinepipe.studies.discrepancy.misfits import model_name, stands_for
from spinepipe.studies.discrepancy.quantities import UNITS
from spinepipe.studies.discrepancy.settings import Discrepancy
from spinepipe.studies.discrepancy.tables import MODELS
from spinepipe.studies.discrepancy.verdict import EVERY, REPEATS, SURE, VerdictKind, read_verdict
from spinepipe.studies.discrepancy.words import general, load_axis, motion_of
from spinepipe.tables import StudyTables
from spinepipe.units import LOAD_UNITS

MOST_CURVES, MOST_ROWS = 4, 8
BAND_SD = 2.0
"""SDs of the measured mean to each side of a point."""

MISFIT = "misfit (× noise SD)"

_LINES = {"base": BASE, "with_effects": MODEL, "with_table": THIRD}
_JUMP = 2.0
"""Times the usual change of load from which a change of side is a jump."""

_UNLOADED = 0.02
"""Share of the largest load below which a step is unloaded."""

_CURVE = ["specimen", "joint", "coordinate"]

Steps = NDArray[np.int64]


def load_displacement(study: Discrepancy, cohort: Cohort, tables: StudyTables) -> Chart:
    """Load over motion of a joint, of each motion where the base is farthest off."""
    title, gap = "Load over motion, measured and modelled", tables["gap"]
    rows = gap[gap["base"].notna() & (gap["noise_sd"] > 0.0)].sort_values("step", kind="stable")
    curves = worst_curves(rows)
    if not curves:
        return saying(title, "No curve: no pose, or no joint is loaded.")
    verdict = read_verdict(tables.files["verdict"])
    words = {"base": model_name(study), "with_effects": f"with {stands_for(verdict)}"}
    words["with_table"] = "with an empirical curve"
    shown = models_shown(rows)
    panels = []
    for curve in curves:
        first = curve.iloc[0]
        whose = [level(first["joint"]), *[first["specimen"]] * (len(cohort.specimen_names) > 1)]
        frame = pd.concat(_curve_rows(curve, shown))
        loads, moves = load_axis(first["driven"]), motion_of(first["coordinate"])
        moved = f"{moves} ({unit(first['coordinate'])}), + {POSITIVE[first['coordinate']]}"
        panels.append(
            Curves(
                title=short(", ".join(whose), 34),
                x_label=moved,
                y_label=loads,
                frame=frame,
                looks={"measured": MEASURED, **{name: _LINES[name] for name in shown[::-1]}},
                points=("measured",),
                high=256.0,
                x_limits=_with_zero(frame, "x"),
                y_limits=_with_zero(frame, "y"),
            )
        )
    assumed = "" if verdict.noise.source == REPEATS else "assumed "
    keys = [Key(MEASURED, f"measured, ±2 SD of the {assumed}noise")]
    keys += [Key(_LINES[name], words[name], as_line=True) for name in shown]
    caption = (
        "A model is right where its line stays within the bars; shown is where the "
        f"{model_name(study)} is farthest off. Lines leave out errors of the set-up, which the "
        "misfit allows for."
    )
    return Chart(title, panels, caption, keys)


def _with_zero(frame: pd.DataFrame, axis: str) -> tuple[float, float]:
    """Ends of an axis on which all that is drawn lies, and zero."""
    drawn = np.r_[0.0, frame.filter(regex=f"^{axis}").to_numpy(float).ravel()]
    low, high = float(np.nanmin(drawn)), float(np.nanmax(drawn))
    return low - 0.06 * (high - low), high + 0.06 * (high - low)


def worst_curves(gap: pd.DataFrame) -> list[pd.DataFrame]:
    """Rows of single curves with ``driven`` and ``drive``, the coordinate that a load drives there
    and that load: of each motion the base's farthest, then the next.

    One curve has all tests of a specimen that drive the same coordinate of a joint.
    """
    loads = driven_coordinates(gap)
    keys = list(zip(gap["test"], gap["joint"], strict=True))
    rows = gap.assign(driven=[loads.get(key, "") for key in keys])
    rows = rows[rows["driven"] != ""]
    if rows.empty:
        return []
    at = ["specimen", "test", "step", "joint"]
    drives = rows[rows["coordinate"] == rows["driven"]].set_index(at)["load"].rename("drive")
    rows = rows.join(drives, on=at).dropna(subset="drive")
    curves = [part for _, part in rows.groupby([*_CURVE, "driven"], sort=False)]
    ordered = sorted(curves, key=off_by, reverse=True)
    first: dict[str, pd.DataFrame] = {}
    for curve in ordered:
        first.setdefault(curve["coordinate"].iloc[0], curve)
    chosen = list(first.values())[:MOST_CURVES]
    others = [curve for curve in ordered if all(curve is not one for one in chosen)]
    loaded = [one for one in others if (one["driven"] == one["coordinate"]).all()]
    return chosen + loaded[: MOST_CURVES - len(chosen)]


def models_shown(gap: pd.DataFrame) -> tuple[str, ...]:
    """The models that differ: the base, that with effects, that with a table besides."""
    added = not gap["base"].fillna(0.0).equals(gap["with_effects"].fillna(0.0))
    tabulated = bool(gap["with_table"].notna().any())
    return ("base", *["with_effects"] * added, *["with_table"] * tabulated)


def _curve_rows(curve: pd.DataFrame, shown: Sequence[str]) -> Iterator[pd.DataFrame]:
    """Points with bars, then a line for each model and way of a test."""
    on_a_rig = bool(curve["held_at"].notna().all())  # that moves the joint: a load was measured
    band = BAND_SD * curve["noise_sd"]
    ends = {"low": curve["measured"] - band, "high": curve["measured"] + band}
    seen, drive, bars = ("y", "x", "y_") if on_a_rig else ("x", "y", "x_")
    along = curve["held_at"] if on_a_rig else curve["drive"]
    points = {seen: curve["measured"], drive: along, **{f"{bars}{k}": v for k, v in ends.items()}}
    yield pd.DataFrame({**points, "series": "measured", "part": "0"})
    for test, rows in curve.groupby("test", sort=False):
        driven = along[rows.index].to_numpy(float)
        for which, way in enumerate(ways(driven)):
            for name in shown:
                line = {seen: rows[name].to_numpy(float)[way], drive: driven[way]}
                yield pd.DataFrame({**line, "series": name, "part": f"{test} {which}"}).dropna()


def ways(load: Array) -> list[Steps]:
    """Steps that a line may join: a jump to the other side starts anew, from where all began."""
    # a change of side is usual where a test sweeps through zero: there the change is small
    change = np.abs(np.diff(load))
    sides = load[1:] * load[:-1] < 0.0
    usual = float(np.median(change)) if len(change) else 0.0
    jumps = np.flatnonzero(sides & (change > _JUMP * usual)) + 1
    found: list[Steps] = np.split(np.arange(len(load)), jumps)
    unloaded = abs(load[0]) <= _UNLOADED * float(np.abs(load).max(initial=0.0))
    return [np.r_[0, way] if unloaded and way[0] else way for way in found]


_BY = {"test": ("By test", plain), "coordinate": ("By motion", motion_of)}


def misfit(study: Discrepancy, cohort: Cohort, tables: StudyTables) -> Chart:
    """Misfit of both models, pooled in several ways."""
    title, where = "Misfit of the models", tables["where"]
    rows = where[where["gap"].notna() & where["by"].isin(_BY)] if len(where) else where
    frames = {}
    for by, (heading, words) in _BY.items() if len(rows) else ():
        own = rows[rows["by"] == by].assign(row=rows[by].map(words)).set_index("row")
        sides = [_side(own[own["model"] == model], "gap", name) for model, name in _SIDES.items()]
        if len(sides[0]) > 1 or by == "test":
            frames[heading] = pd.concat(sides, axis=1)
    return _compared(title, frames, study, tables)


def left_out(study: Discrepancy, cohort: Cohort, tables: StudyTables) -> Chart:
    """Misfit of both models on each part that was left out."""
    title, held_out = "Misfit on readings left out of the fit", tables["held_out"]
    rows = held_out[held_out["gap_base"].notna()] if len(held_out) else held_out
    frames = {}
    for kind, own in rows.groupby("kind", sort=False) if len(rows) else ():
        own = own.set_index(own["fold"].map(plain if kind == "test" else str).rename("row"))
        sides = [_side(own, f"gap_{model}", name) for model, name in _SIDES.items()]
        frames[_KINDS[str(kind)]] = pd.concat(sides, axis=1)
    lost = len(held_out) - len(rows)
    more = f"Not shown: {count(lost, 'test')} that the others do not determine." if lost else ""
    return _compared(title, frames, study, tables, more)


_SIDES = dict(zip(MODELS, ("before", "after"), strict=True))
_KINDS = {"test": "Left-out tests", "specimen": "Left-out specimens", "steps": "Left-out steps"}
ENDS = ("", "_low", "_high")
_ALONE = {"before": "value", "before_low": "low", "before_high": "high"}


def _side(rows: pd.DataFrame, column: str, name: str) -> pd.DataFrame:
    """A misfit and its interval, named as a `BeforeAfter` has them."""
    return rows.rename(columns={f"{column}{end}": f"{name}{end}" for end in ENDS})[
        [f"{name}{end}" for end in ENDS]
    ]


def _compared(
    title: str,
    frames: Mapping[str, pd.DataFrame],
    study: Discrepancy,
    tables: StudyTables,
    more: str = "0 is noise alone.",
) -> Chart:
    """Panels on one scale, of many rows the largest before; without effects the base alone."""
    if not frames:
        return saying(title, "There is no misfit to show.")
    told = stands_for(read_verdict(tables.files["verdict"]))
    most = max(float(frame.filter(regex="_high$").max().max()) for frame in frames.values())
    panels: list[Panel] = []
    for heading, frame in frames.items():
        how: dict[str, Any] = {"title": heading, "x_label": MISFIT, "x_limits": (0.0, 1.05 * most)}
        kept = frame["before"].nlargest(MOST_ROWS).index
        own = frame[frame.index.isin(kept)].reset_index()
        if told:
            panels.append(BeforeAfter(frame=own, before=BASE, after=MODEL, **how))
        else:
            alone = own.rename(columns=_ALONE)
            panels.append(Rows(frame=alone, looks={"": BASE}, **how))
    after = f", ● with {told}" if told else ""
    caption = f"■ {model_name(study)}{after}; lines: 95 % intervals. {more}"
    return Chart(title, panels, caption.strip())


def stiffness(study: Discrepancy, cohort: Cohort, tables: StudyTables) -> Chart:
    """Stiffness at rest and under load, of each specimen and their mean."""
    title = "Stiffness at rest and under load"
    rows = stiffness_at_rest_and_loaded(tables["field_numbers"])
    if rows.empty:
        return saying(title, "No named effect changes a stiffness.")
    first, base = rows.iloc[0], rows["model"] == MODELS[0]
    printed, factor = UNITS.get(first["unit"], (first["unit"], 1.0))
    under = f"at {first['load']:g} {LOAD_UNITS[first['coordinate']]}"
    parts = [(rows[base], "loaded", model_name(study)), (rows[~base], "rest", "at rest")]
    frames = []
    for own, column, series in [*parts, (rows[~base], "loaded", under)]:
        values = {end.lstrip("_") or "value": factor * own[f"{column}{end}"] for end in ENDS}
        named = own["specimen"].replace(EVERY[0], "mean")
        frames.append(pd.DataFrame({"row": named, "series": series, **values}))
    every = pd.concat(frames)
    names = list(dict.fromkeys(every["row"]))
    every = every[every["row"].isin([*names[: MOST_ROWS - 1], "mean"])]
    looks = dict(zip(dict.fromkeys(every["series"]), (BASE, THIRD, MODEL), strict=False))
    joint = "every joint" if first["every"] else level(first["joint"])
    panel = Rows(
        title=f"{capital(first['side'])}, {joint}",
        x_label=f"stiffness ({printed})",
        frame=every,
        looks=looks,
        x_limits=(0.0, 1.05 * float(np.nanmax(every[["value", "high"]].to_numpy(float)))),
    )
    caption = "Slope of load over motion of the models; lines: 95 % intervals by errors of the fit."
    return Chart(title, [panel], caption, [Key(look, name) for name, look in looks.items()])


def evidence(study: Discrepancy, cohort: Cohort, tables: StudyTables) -> Chart:
    """How probable it is of each effect that it is missing.

    Where nothing is missing also from which misfit on each effect would have been found.
    """
    title = "How probable each effect is"
    verdict = read_verdict(tables.files["verdict"])
    panels = []
    if verdict.verdict is VerdictKind.NULL and verdict.smallest_detectable:
        title = "What these tests could have shown"
        found = sorted((one.gap, general(one.name), "") for one in verdict.smallest_detectable)
        panels.append(_bars("To be found", "smallest misfit (× noise SD)", found))
    ranked = sorted(verdict.probabilities.items(), key=lambda one: -one[1])[:MOST_ROWS]
    if ranked:
        bars = [(p, general(name), f"{p:.2f}") for name, p in ranked]
        panels.append(_bars("", "probability of being missing", bars, {SURE: ""}))
    if not panels:
        return saying(title, "No effect was tried.")
    caption = (
        "Several may be missing together, so probabilities need not sum to one; something else is "
        f"a law without a name. Dashed: {SURE:g}, from which on a name is said."
    )
    return Chart(title, panels, caption)


Bars = list[tuple[float, str, str]]
"""Size, name and note of each."""


def _bars(heading: str, label: str, bars: Bars, marks: Mapping[float, str] | None = None) -> Rows:
    frame = pd.DataFrame(bars, columns=["value", "row", "note"])
    how: dict[str, Any] = {"marks": marks or {}, "bars": True, "looks": {"": MODEL}, "width": 400.0}
    return Rows(title=heading, x_label=label, frame=frame, **how)


def next_tests(study: Discrepancy, cohort: Cohort, tables: StudyTables) -> Chart:
    """Expected gain of further runs for the question that comes first."""
    title, rows = "What to measure next", tables["next_tests"]
    first = advised(read_verdict(tables.files["verdict"]), rows)
    if first is None:
        return saying(title, "No further test is advised.")
    own = rows[(rows["effect_or_pair"] == first["effect_or_pair"]) & rows["status"].isin(USEFUL)]
    ordered = own.sort_values("gain_per_cycle", ascending=False, kind="stable").head(MOST_ROWS)
    bars = [
        (row["gain_per_cycle"], run_in_words(row["test"]), number(row["gain_per_cycle"], 2))
        for row in ordered.to_dict("records")
    ]
    tests = {name.partition(", ")[0] for _, name, _ in bars}
    where = ""
    if len(tests) == 1:
        bars = [(size, name.partition(", ")[2] or name, note) for size, name, note in bars]
        where = f" All are of {tests.pop()}."
    panel = replace(_bars("", "expected gain per cycle", bars), letters=44, width=460.0)
    caption = f"Expected gain in log evidence per cycle of a test on one specimen.{where}"
    return Chart(title, [panel], caption)
