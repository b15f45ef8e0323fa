"""Figures of stiffness: over palpations, over load points, by the sampler, from other starts."""

from collections.abc import Collection, Mapping
from typing import Any

import numpy as np
import pandas as pd
from scipy.stats import norm

from spinepipe.cohort import Cohort
from spinepipe.report.forms.chart import Chart, Key, saying
from spinepipe.report.forms.curves import Curves
from spinepipe.report.forms.look import BASE, MODEL, SOFT, THIRD, Look
from spinepipe.report.forms.rows import Rows
from spinepipe.report.words import AXIS
from spinepipe.status import USABLE, Status
from spinepipe.studies.joint_pose_sensitivity.gould_2024a import GOULD_2024A, stiffness_quartiles
from spinepipe.studies.joint_pose_sensitivity.retained import (
    COLUMN,
    FACTOR,
    MIDDLE_HALF,
    READ,
    UNIT,
    RetainedStiffness,
    effect_on,
    moved_by_load,
    other_fits,
    percentiles,
    place_of,
    stiffnesses,
)
from spinepipe.studies.joint_pose_sensitivity.settings import JointPoseSensitivity
from spinepipe.studies.joint_pose_sensitivity.tables import region_columns
from spinepipe.units import COORDINATES, ROTATIONS, TRANSLATIONS

Tables = Mapping[str, pd.DataFrame]

MOST_ROWS = 24
"""Of a panel: where there are more, those that spread most are drawn."""

PALPATION, LOAD, READINGS = "palpation", "place of the load", "readings of one fit"
LOOKS = {PALPATION: MODEL, LOAD: THIRD, READINGS: SOFT}
PERCENTS = (2.5, 25.0, 50.0, 75.0, 97.5)
SPREAD = ("low", "inner_low", "value", "inner_high", "high")
"""Percentiles, and the columns of a form that show them."""

ROOM = 0.075
"""Share of a panel's height that a label beside a line takes."""


def stiffness(study: JointPoseSensitivity, cohort: Cohort, tables: Tables) -> Chart:
    """What palpation, the load's place and the readings leave of each stiffness, and a paper's."""
    title = "Stiffness, and what it depends on"
    found = stiffnesses(study, cohort, tables)
    if not found:
        return saying(title, "No fit is retained: there is no stiffness to show.")
    effects = tables.get("load_point_effect", pd.DataFrame())
    paper = GOULD_2024A.beside(cohort.name)
    looks = {**LOOKS, **({paper[0]: BASE} if paper else {})}
    panels = []
    told = {one.coordinate for one in found if one.told}
    names = _in_order({one.coordinate for one in found})
    for name in sorted(names, key=lambda name: name not in told):
        every = [one for one in found if one.coordinate == name]
        alone = len(every) == 1
        most = sorted(every, key=lambda one: -one.moved[0] if one.told else 0.0)[:MOST_ROWS]
        rows = [
            {**row, "series": source, "row": source if alone else one.place}
            for one in sorted(most, key=every.index)
            for source, row in _sources(one, effects, alone)
        ]
        published = stiffness_quartiles(cohort.name, COLUMN[name])
        if published and paper:
            low, middle, high = (FACTOR[name] * one for one in published)
            inner = {"inner_low": low, "inner_high": high, "low": low, "high": high}
            row = paper[0] if alone else "all"
            rows.append({"series": paper[0], "row": row, "value": middle, **inner})
        frame = pd.DataFrame(rows, columns=["row", "series", *SPREAD])
        frame = frame.astype(dict.fromkeys(SPREAD, float))
        panels.append(_on_log_axis(AXIS[name], f"stiffness ({UNIT[name]})", frame, looks))
    alone = len(found) == len(panels)
    fits = f"{len(found[0].values)} retained fits" if alone else "retained fits"
    few = f", {MOST_ROWS} that spread most" * (len(found) > MOST_ROWS * len(panels))
    caption = (
        f"Symbol: median; thick: middle half; thin: middle 95 % over {fits}{few}, of readings the "
        "95 % region. No symbol: most fits do not identify it, and the line goes on to the edge."
    )
    drawn = {row for panel in panels for row in panel.frame["series"]}
    keys = [Key(look, name) for name, look in looks.items() if name in drawn]
    return Chart(title, panels, caption, () if alone else keys)


def _in_order(names: Collection[str]) -> list[str]:
    """Coordinates as spines are compared: rotations first."""
    return [name for name in (*ROTATIONS, *TRANSLATIONS) if name in names]


def _sources(
    one: RetainedStiffness, effects: pd.DataFrame, alone: bool
) -> list[tuple[str, dict[str, Any]]]:
    """What leaves how much of a stiffness; of one without a number the region alone."""
    low, high = one.region
    readings = [(READINGS, {"low": low, "high": high})] if (low, high) != (None, None) else []
    if not one.told:
        return [(PALPATION, {})] * alone + readings
    found = [(PALPATION, dict(zip(SPREAD, one.at(*PERCENTS), strict=True)))]
    effect = effect_on(one, effects)
    moved = None if effect is None else moved_by_load(effect)
    if effect is not None and moved is not None:
        middle = FACTOR[one.coordinate] * float(effect["stated"])
        normal = norm.ppf(np.array(PERCENTS) / 100.0, middle, 0.01 * moved * middle / MIDDLE_HALF)
        found.append((LOAD, dict(zip(SPREAD, normal, strict=True))))
    return found + readings


def _on_log_axis(title: str, label: str, frame: pd.DataFrame, looks: Mapping[str, Look]) -> Rows:
    """Rows on a logarithmic axis around all ends, with room beyond for those that are open."""
    ends = frame[["low", "value", "high"]].to_numpy(float)
    ends = ends[np.isfinite(ends) & (ends > 0.0)]
    low, high = (float(ends.min()), float(ends.max())) if len(ends) else (1.0, 1.0)
    is_open = (frame["low"].isna() != frame["high"].isna()).any()
    room = max(2.0 if is_open else 1.2, (high / low) ** 0.12)
    frame = frame.assign(low=frame["low"].mask(frame["low"] <= 0.0))  # goes on to the edge
    limits = (low / room, high * room)
    return Rows(title=title, x_label=label, frame=frame, looks=looks, log=True, x_limits=limits)


def load_point(study: JointPoseSensitivity, cohort: Cohort, tables: Tables) -> Chart:
    """The stiffness that the answer tells over the load's place, and the cost of the fits."""
    title = "Stiffness over where the load acts"
    tried = tables["stiffness_over_load_point"]
    solved = tried[tried["status"].isin(USABLE)]
    names = _in_order(study.calibration.free)
    name = next((one for one in names if solved[f"{one}_identifiable"].eq(True).any()), None)
    if name is None:
        return saying(title, "At no load point does the fit identify a stiffness.")
    ways = {"superior": "superior_shift_mm", "anterior": "anterior_shift_mm"}
    along = max(ways, key=lambda way: tried[ways[way]].nunique())
    across = next(way for way in ways if way != along)
    alone = len(solved[["specimen", "joint"]].drop_duplicates()) == 1
    rows = solved.rename(columns={ways[along]: "x", ways[across]: "across"}).sort_values("x")
    rows = rows if alone else rows[rows["across"] == 0.0]
    own = rows[(rows["x"] == 0.0) & (rows["across"] == 0.0)].drop_duplicates("specimen")
    stated = own.set_index("specimen")["cost"].replace(0.0, np.nan)
    label = f"load point moved {along} (mm)"
    _, low, high, *_, identifiable = region_columns(name)
    own = rows[rows[identifiable].eq(True)]
    lines = _lines(own, FACTOR[name] * own[COLUMN[name]], across, alone)
    if alone:
        stated_only = FACTOR[name] * own[[low, high]].where(own["across"] == 0.0)
        lines[["y_low", "y_high"]] = stated_only.to_numpy(float)
    panels = [_over_shift(AXIS[name], label, f"stiffness ({UNIT[name]})", lines, 1.35)]
    each = rows.drop_duplicates(["specimen", "x", "across"])
    cost = _lines(each, each["cost"] / each["specimen"].map(stated), across, alone)
    if cost["y"].notna().any():
        panels.append(_over_shift("Misfit", label, "cost (1: as stated)", cost, 1.2))
    beside = f"Beside lines: mm moved {across}; band: 95 % region of the fit"
    caption = (
        f"{beside if alone else 'A line for each specimen and joint'}. Where the cost "
        "hardly rises, the readings exclude no load point."
    )
    return Chart(title, panels, caption)


def _lines(rows: pd.DataFrame, y: pd.Series, across: str, alone: bool) -> pd.DataFrame:
    """Lines over one shift: of every other shift, or of every specimen and joint."""
    frame = pd.DataFrame({"x": rows["x"].astype(float), "y": y.astype(float)})
    if not alone:
        return frame.assign(series="0", part=rows["specimen"] + " " + rows["joint"])
    return frame.assign(series=rows["across"].map(lambda mm: f"{mm:+g}" if mm else "0"))


def _over_shift(title: str, x_label: str, y_label: str, lines: pd.DataFrame, room: float) -> Curves:
    """Curves over the shift, up to ``room`` times the highest, with words beside the outermost."""
    top = room * float(lines["y"].max())
    names = sorted(set(lines["series"]), key=float)
    ends = {names[0], names[-1], "0"} & set(names) if len(names) > 1 else set()
    last = lines.drop_duplicates("series", keep="last").set_index("series")["y"]
    if len(ends) > 1 and np.diff(np.sort(last[sorted(ends)])).min() < ROOM * top:
        labels = {"0": "all"}
    else:
        labels = {name: name.replace("-", "\u2212") for name in ends}
    looks = {name: SOFT for name in names if name != "0"} | {"0": MODEL}
    reach = float(np.ptp(lines["x"])) or 1.0
    x_limits = (float(lines["x"].min()) - 0.03 * reach, float(lines["x"].max()) + 0.12 * reach)
    return Curves(
        title=title, x_label=x_label, y_label=y_label, frame=lines, looks=looks, labels=labels,
        x_limits=x_limits, y_limits=(-0.06 * top, top), high=190.0,
    )  # fmt: skip


def posterior(study: JointPoseSensitivity, cohort: Cohort, tables: Tables) -> Chart:
    """Median and 95 % interval of each stiffness by the sampler."""
    title = "Stiffness with landmarks as unknowns too"
    every = tables["posterior"]
    converged = (every["status"] == Status.CONVERGED.value) & every["median"].notna()
    good = every[converged & (every["quantity"] == "stiffness")]
    if good.empty:
        return saying(title, "The sampler did not converge for any specimen.")
    panels = []
    for name in _in_order({one for one in COORDINATES if COLUMN[one] in set(good["unknown"])}):
        own = good[good["unknown"] == COLUMN[name]].head(MOST_ROWS)
        below, above = (own[f"open_{side}"].astype(bool) for side in ("below", "above"))
        frame = FACTOR[name] * own[["median", "low", "high"]].rename(columns={"median": "value"})
        for column, is_open in (("low", below), ("high", above), ("value", below | above)):
            frame[column] = frame[column].mask(is_open)
        places = zip(own["specimen"], own["joint"], strict=True)
        frame["row"] = [place_of(*place, cohort) or "all joints" for place in places]
        panels.append(_on_log_axis(AXIS[name], f"stiffness ({UNIT[name]})", frame, {"": MODEL}))
    caption = (
        "Symbol: median; line: 95 % interval. A line that goes on to the edge has no end there "
        "that the readings set."
    )
    return Chart(title, panels, caption)


def bootstrap(study: JointPoseSensitivity, cohort: Cohort, tables: Tables) -> Chart:
    """Change of each stiffness from other starts, with other damping, and under other loadings."""
    title = "Stiffness from other starts, with other damping"
    found = [one for one in stiffnesses(study, cohort, tables) if one.told]
    panels = []
    for name in _in_order({one.coordinate for one in found}):
        own = [one for one in found if one.coordinate == name]
        changes = {PALPATION: [one.values / one.at(50.0)[0] for one in own]}
        for one in own:
            for (what, loading), values in other_fits(study, tables["bootstrap"], one).items():
                changes.setdefault(f"{what}, {READ[loading]}", []).append(values)
        rows = []
        for row, parts in changes.items():
            ends = 100.0 * percentiles(np.concatenate(parts), *PERCENTS) - 100.0
            series = PALPATION if row == PALPATION else "other"
            rows.append({**dict(zip(SPREAD, ends, strict=True)), "row": row, "series": series})
        if len(rows) > 1:
            looks = {PALPATION: MODEL, "other": THIRD}
            label, frame = "change of stiffness (%)", pd.DataFrame(rows)
            panels.append(Rows(title=AXIS[name], x_label=label, frame=frame, looks=looks))
    if not panels:
        return saying(title, "No fit of a stiffness that has a number is retained.")
    caption = (
        "Symbol: median; thick: middle half; thin: middle 95 % of retained fits. Palpation: change "
        "from its median; others: from that of other start values at rest."
    )
    return Chart(title, panels, caption)
