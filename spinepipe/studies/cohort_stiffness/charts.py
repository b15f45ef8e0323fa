"""Figures of a study of stiffness: how stiff joints are, and how well that predicts motion."""

from collections.abc import Mapping

import numpy as np
import pandas as pd
from scipy import stats

from spinepipe.cohort import Cohort
from spinepipe.report.forms.chart import Chart, Key, saying
from spinepipe.report.forms.curves import Scatter
from spinepipe.report.forms.look import BASE, MODEL, SOFT, THIRD
from spinepipe.report.forms.rows import Rows
from spinepipe.report.words import AXIS, SIGNS, case, level
from spinepipe.studies.cohort_stiffness.claims_of_stiffness import loaded_ratios
from spinepipe.studies.cohort_stiffness.conclusions import one_joint_errors
from spinepipe.studies.cohort_stiffness.conclusions_of_stiffness import FIELD, joint_values
from spinepipe.studies.cohort_stiffness.loop_rows import paired_curves
from spinepipe.studies.cohort_stiffness.representations import (
    IN_WORDS,
    OF_JOINTS,
    PUBLISHED,
    SHARED,
)
from spinepipe.studies.cohort_stiffness.settings import CohortStiffness

Tables = Mapping[str, pd.DataFrame]

LEVEL = 0.975
"""Probability below the upper end of an interval: 95 % lie between the ends."""

MOST_TIMES = 12.0
"""Largest over least value from which on an axis is logarithmic."""

MOST_POINTS = 250
"""Where there are more in a panel of rows only medians are drawn; in others no intervals."""


def stiffness_by_specimen(study: CohortStiffness, cohort: Cohort, tables: Tables) -> Chart:
    """A panel for each direction, a row for each specimen: its joints and their median."""
    return _stiffness("Stiffness of every specimen", tables["stiffness"], "specimen", "joint")


def stiffness_by_level(study: CohortStiffness, cohort: Cohort, tables: Tables) -> Chart:
    """A panel for each direction, a row for each level: its specimens and their median."""
    return _stiffness("Stiffness level by level", tables["stiffness"], "joint", "specimen")


def _stiffness(title: str, stiffness: pd.DataFrame, by: str, of: str) -> Chart:
    values = joint_values(stiffness)
    if values.empty:
        return saying(title, "No fit to all load cases has a stiffness.")
    published = stiffness[stiffness["representation"] == PUBLISHED[0]]
    start = dict(zip(published["coordinate"], published["stiffness"], strict=True))
    panels = []
    for name, rows in values.groupby("coordinate", sort=False):
        unit = rows["unit"].iloc[0]
        marks = {start[name] * dict(FIELD.values())[unit]: ""} if name in start else {}
        panels.append(_panel(rows, by, f"each {of}", AXIS[str(name)], f"stiffness ({unit})", marks))
    shared = values.duplicated([by, "coordinate"]).any()
    described = IN_WORDS[values["representation"].iloc[0]]
    keys = [Key(SOFT, f"each {of}"), Key(MODEL, "median")] if shared else [Key(MODEL, described)]
    caption = (
        f"Fits to all load cases, {described}; lines are 95 % intervals, up to the edge where "
        "readings set no end. A value that readings do not bound has no symbol."
    )
    return Chart(title, panels, caption, [*keys, Key(SOFT, "published, not fitted", as_line=True)])


def _panel(
    values: pd.DataFrame, by: str, each: str, title: str, label: str, marks: Mapping[float, str]
) -> Rows:
    """Single values of each row in grey and their median, or the one that there is.

    Parameters
    ----------
    values : columns ``value``, ``low``, ``high`` and ``place``, see `joint_values`; and ``by``.
    """
    singles = values.assign(row=values[by].map(level), series=each)
    shared = singles["row"].duplicated().any()
    parts = [singles]
    if shared:
        middle = singles.groupby("row", sort=False)["place"].median().replace(float("inf"), None)
        middle = middle.astype(float).where(middle.astype(float) > 0.0)
        one = pd.DataFrame({"row": middle.index, "series": "median", "value": middle.to_numpy()})
        parts = [*parts[: len(singles) <= MOST_POINTS], one]
    columns = ["row", "series", "value", "low", "high"]
    frame = pd.concat(parts, ignore_index=True).reindex(columns=columns)
    seen = [*frame[["value", "low", "high"]].stack().dropna(), *marks]
    log = bool(seen) and max(seen) > MOST_TIMES * min(seen)
    ends = (min(seen, default=1.0) / 1.3 if log else 0.0, max(seen, default=1.0) * 1.08)
    looks = {each: SOFT if shared else MODEL, "median": MODEL}
    frame = frame[::-1] if by == "joint" else frame  # cranial at the top
    width = 300.0 + 5.0 * max(0, min(26, singles["row"].str.len().max()) - 12)
    return Rows(
        title=title,
        x_label=label,
        frame=frame,
        looks=looks,
        marks=marks,
        log=log,
        x_limits=ends,
        width=width,
    )


STAGES = {
    "fitted": ("fitted to this motion", SOFT),
    "left_out_case": ("from the other load cases", THIRD),
    "left_out_specimen": ("from the other specimens", MODEL),
    "published": ("published, not fitted", BASE),
}
"""Errors by where the stiffness comes from."""


def held_out_error(study: CohortStiffness, cohort: Cohort, tables: Tables) -> Chart:
    """A row for each description: its errors of fitted motion and of motion left out."""
    title = "Errors of fitted motion and of motion left out"
    ranking = tables["ranking"]
    rows = ranking[ranking["criterion"].isin([*STAGES]) & ranking["value"].notna()]
    if rows.empty:
        return saying(title, "No fit has an error: there is nothing to compare.")
    same = one_joint_errors(rows, len(cohort.joint_names))  # equal results once
    alike = {OF_JOINTS[0]: SHARED[0]} if len(cohort.joint_names) == 1 else {}
    names = rows["representation"].replace(alike).map(IN_WORDS)
    rows = rows.assign(row=names.where(~rows.index.isin(same.index), "all linear descriptions"))
    published = rows["representation"].isin(PUBLISHED)
    rows = rows.assign(series=rows["criterion"].where(~published, "published"))
    rows = rows.drop_duplicates(["row", "series"])
    value, n = rows["value"].astype(float), rows["specimens"].astype(float)
    reach = rows["standard_error"].astype(float) * stats.t.ppf(LEVEL, (n - 1.0).clip(lower=1.0))
    rows = rows.assign(low=(value - reach).clip(lower=0.0), high=value + reach)
    unit = SIGNS[rows["unit"].iloc[0]]
    panel = Rows(
        x_label=f"root mean square error ({unit})",
        frame=rows[["row", "series", "value", "low", "high"]],
        looks={name: look for name, (_, look) in STAGES.items()},
        width=430.0,
        log=bool(value.max() > MOST_TIMES * value[value > 0.0].min()),
    )
    found = set(rows["series"])
    keys = [Key(look, words) for name, (words, look) in STAGES.items() if name in found]
    last = "More unknowns always fit better; whether they are worth it, motion left out shows."
    if study.base is not None:
        last = "The base model's effects are left out nowhere."
    caption = (
        f"Mean over specimens with its 95 % interval, by where the stiffness comes from. {last}"
    )
    return Chart(title, [panel], caption, keys)


def load_case_stiffness(study: CohortStiffness, cohort: Cohort, tables: Tables) -> Chart:
    """A row for each load case: stiffness of the direction it loads, over what the others tell."""
    title = "Stiffness fitted to one load case"
    stiffness, signs = tables["stiffness"], tables["sign_checks"]
    told = set(joint_values(stiffness)["representation"])
    rows = stiffness[stiffness["representation"].isin(told)]
    driven = signs[["specimen", "test", "coordinate"]].drop_duplicates()
    found = loaded_ratios(rows, driven) if len(rows) else rows
    if found.empty:
        return saying(title, "No load case bounds a stiffness by itself.")
    found = found.drop_duplicates("ratio")  # joints that share a value have one
    reach = stats.norm.ppf(LEVEL) * found["error"]
    logs = {"value": found["ratio"], "low": found["ratio"] - reach, "high": found["ratio"] + reach}
    found = found.assign(**{name: np.exp(log) for name, log in logs.items()})
    found = found.assign(place=found["value"], test=[case(str(name)) for name in found["test"]])
    panel = _panel(found, "test", "each fit", "", "ratio of stiffness", {1.0: ""})
    caption = (
        "Stiffness of the loaded direction by the load case alone, over that by the other load "
        "cases; where both are bounded, with 95 % intervals."
    )
    return Chart(title, [panel], caption, [Key(SOFT, "each fit"), Key(MODEL, "median")])


def range_of_motion(study: CohortStiffness, cohort: Cohort, tables: Tables) -> Chart:
    """A panel for each test: range of motion of the fitted model over that of each joint."""
    title = "Range of motion, measured and modelled"
    rows = tables["load_displacement"]
    found = paired_curves(rows, "range_of_motion", "deg").dropna(subset=["measured", "simulated"])
    if found.empty:
        return saying(title, "No range of motion was both measured and modelled.")
    found = found[found["cycle"] == found.groupby("test")["cycle"].transform("max")]
    lines = "Lines are 95 % intervals, by the noise of one reading and by the stiffness."
    many = len(found) > MOST_POINTS
    if many:
        lines = "Intervals of so many curves are in the result files."
    panels = []
    for test, here in found.groupby("test", sort=False):
        x, y = here["measured"], here["simulated"]
        ends = {
            "x_low": x - here["measured_way"], "x_high": x + here["measured_way"],
            "y_low": y - here["simulated_way"], "y_high": y + here["simulated_way"],
        }  # fmt: skip
        panels.append(
            Scatter(
                title=case(str(test)).replace("+", " and "),
                x_label="measured (°)",
                y_label="modelled (°)",
                frame=pd.DataFrame({"x": x, "y": y, **({} if many else ends)}),
                looks={"": MODEL},
                identity=True,
                high=250.0,
            )
        )
    line = "On the line the fitted model moves as the joint did, in the last cycle of each test."
    caption = f"{line} {lines}"
    return Chart(title, panels, caption, [Key(MODEL, "each joint")])
