"""Figures of errors and of motion: approaches, levels, shares of joints, courses over the cycle."""

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
import pandas as pd

from spinepipe.cohort import Cohort
from spinepipe.effects.contract import Array
from spinepipe.motion.skeleton import BODIES, JOINTS, LUMBAR_JOINTS, PELVIS
from spinepipe.report.forms.chart import Chart, Key, saying
from spinepipe.report.forms.curves import Curves
from spinepipe.report.forms.look import BASE, MEASURED, MODEL, SOFT, Look
from spinepipe.report.forms.rows import Rows
from spinepipe.report.words import POSITIVE, case, count, level, number, short
from spinepipe.studies.tracking.conclusions import judged_likeness, window_rows
from spinepipe.studies.tracking.conclusions_of_errors import Tables
from spinepipe.studies.tracking.error_metrics import SAGITTAL
from spinepipe.studies.tracking.ranking import (
    ANGLES,
    CENTRES,
    FEWEST,
    IK,
    chosen_approach,
    rankings,
)
from spinepipe.studies.tracking.settings import Tracking
from spinepipe.studies.tracking.sharing import sharing_rows, similarity_rows
from spinepipe.studies.tracking.tracked_motions import motions
from spinepipe.studies.tracking.trials import AXIS, kinds_of_trials
from spinepipe.studies.tracking.true_motions import TRUTH, true_motions
from spinepipe.studies.tracking.words import phrase, short_of
from spinepipe.units import DEG_PER_RAD, ROTATIONS

LEVELS = {CENTRES: BODIES[1:], ANGLES: JOINTS[SAGITTAL]}
LABELS = {CENTRES: "error of centres (mm)", ANGLES: "error of angles (°)"}
TITLES = {CENTRES: "Centres", ANGLES: "Angles"}
MOST_TRIALS = 2
NO_TRUTH = "Where vertebrae truly were is not known of any motion."

WILD = 3.0
"""What goes so many times as far as the approach that is told of would flatten all other curves."""

CYCLE = np.linspace(0.0, 1.0, 26)
"""Instants of a motion that are drawn."""


def looks_of(chosen: str, there: Iterable[str]) -> dict[str, Look]:
    """Truth, the approach that is told of, and inverse kinematics, as far as they are there."""
    looks = {TRUTH: MEASURED, IK: BASE, chosen: MODEL}
    return {name: looks[name] for name in looks if name in set(there)}


def _keys(looks: Mapping[str, Look], as_line: bool = False) -> list[Key]:
    return [
        Key(look, "truth" if name == TRUTH else short_of(name), as_line)
        for name, look in looks.items()
    ]


def _left_out(names: Iterable[str]) -> str:
    """A sentence of a caption."""
    wild = ", ".join(phrase(name) for name in names)
    return f" Not drawn, as it leaves the axis: {wild}." if wild else ""


def approach_errors(study: Tracking, cohort: Cohort, tables: Tables) -> Chart:
    """A panel for centres and one for angles, a row for each approach, the nearest first."""
    title = "Errors of approaches"
    found = rankings(cohort, tables["errors"])
    if not found:
        return saying(title, NO_TRUTH)
    first = found[0]
    order = first.approaches
    looks = {"nearest": MODEL, "reference": BASE, "others": SOFT}
    kinds = {IK: "reference", order[0]: "nearest"}
    panels = []
    for one in (same for same in found if same.where == first.where):
        rows = []
        for name in (name for name in order if name in one.approaches):
            error, series = one.error(name), kinds.get(name, "others")
            row = {"row": short_of(name), "series": series, "note": number(error.number, 2)}
            rows.append({**row, "value": error.number, "low": error.low, "high": error.high})
        frame = pd.DataFrame(rows).astype({"low": float, "high": float})
        most = float(frame["value"].max())
        end = float(np.nanmin([1.5 * most, frame["high"].max()])) or 1.0
        how: dict[str, Any] = {"x_limits": (0.0, end), "x_label": LABELS[one.measure]}
        how |= {"title": f"{TITLES[one.measure]} {one.where}", "width": 340.0}
        panels.append(Rows(frame=frame, looks=looks, **how))
    interval = "; line: its 95 % interval" if first.n >= FEWEST else ""
    caption = (
        f"Symbol: mean over {count(first.n, 'subject')}{interval}. Differences are tested within "
        "subjects, so that overlapping intervals tell nothing."
    )
    return Chart(title, panels, caption)


def error_by_level(study: Tracking, cohort: Cohort, tables: Tables) -> Chart:
    """A panel for each trial and measure, a row for each level from above."""
    title = "Errors by level"
    errors = tables["errors"]
    found = rankings(cohort, errors)
    if not found:
        return saying(title, NO_TRUTH)
    first = found[0]
    looks = looks_of(first.approaches[0], first.approaches)
    rows = errors[errors["approach"].isin(list(looks))]
    panels = []
    for trial in first.trials[:MOST_TRIALS]:
        for measure, levels in LEVELS.items():
            own = rows[(rows["trial"] == trial) & (rows["measure"] == measure)]
            if own.empty:
                continue
            frame = _spread(own.rename(columns={"mean": "value"}), "level", levels)
            heading = f"{short(case(trial), 20)}: {TITLES[measure].lower()}"
            ends = (0.0, 1.05 * float(frame["high"].max()) or 1.0)
            how: dict[str, Any] = {"title": heading, "x_limits": ends}
            panels.append(Rows(x_label=LABELS[measure], frame=frame, looks=looks, **how))
    caption = f"Symbol: mean over {count(first.n, 'subject')}; line: from the least to the largest."
    return Chart(title, panels, caption, _keys(looks))


def _spread(rows: pd.DataFrame, place: str, order: Iterable[str]) -> pd.DataFrame:
    """Mean and range over subjects of a value, by approach and place, the last place first."""
    by = rows.groupby([place, "approach"], observed=True, sort=False)["value"]
    frame = by.agg(value="mean", low="min", high="max").reset_index()
    number_of = {name: k for k, name in enumerate(order)}
    frame = frame.sort_values(place, key=lambda names: names.map(number_of), ascending=False)
    return frame.assign(row=frame[place].map(level), series=frame["approach"].map(str))


def motion_sharing(study: Tracking, cohort: Cohort, tables: Tables) -> Chart:
    """A panel for each trial, a row for each lumbar joint, beside the true shares."""
    title = "How lumbar joints share a motion"
    rows = window_rows(tables["sharing"]).dropna(subset=["share"])
    if rows.empty:
        return saying(title, "In no motion does the lumbar spine turn enough to be shared out.")
    chosen = chosen_approach(cohort, tables.get("errors"), rows["approach"])
    true = window_rows(pd.DataFrame(sharing_rows(true_motions(cohort), kinds_of_trials(cohort))))
    if len(true):
        true = true[true["trial"].isin(rows["trial"])].dropna(subset=["share"])
        rows = pd.concat([rows, true], ignore_index=True)
    looks = looks_of(chosen, rows["approach"])
    rows = rows.assign(value=100.0 * rows["share"])
    means = rows.groupby(["approach", "trial", "joint"], observed=True)["value"].mean().abs()
    limit = WILD * float(means[chosen].max())
    wild = [name for name in looks if float(means[name].max()) > limit]
    looks = {name: look for name, look in looks.items() if name not in wild}
    rows = rows[rows["approach"].isin(list(looks))]
    low, high = float(rows["value"].min()), float(rows["value"].max())
    how: dict[str, Any] = {"x_limits": (min(low - 1.0, 0.0), max(high + 1.0, 20.0))}
    how |= {"marks": {100.0 / len(LUMBAR_JOINTS): ""}, "looks": looks}
    panels = []
    for trial, own in rows.groupby("trial", sort=False, observed=True):
        frame, heading = _spread(own, "joint", LUMBAR_JOINTS), short(case(str(trial)), 30)
        label = "share of lumbar rotation (%)"
        panels.append(Rows(title=heading, x_label=label, frame=frame, **how))
    caption = (
        f"Symbol: mean over {count(rows['specimen'].nunique(), 'subject')}, line: from the least "
        "to the largest; dashed: equal shares."
    )
    return Chart(title, panels[: 2 * MOST_TRIALS], caption + _left_out(wild), _keys(looks))


def kinematics(study: Tracking, cohort: Cohort, tables: Tables) -> Chart:
    """A panel for each lumbar joint in the motion whose likeness is told of, else in the first."""
    title = "How lumbar joints turn"
    courses = courses_of(cohort, tables["tracked"])
    if not courses:
        return saying(title, "No approach found a motion of more than one posture.")
    there = dict.fromkeys(name for one in courses.values() for name in one if name != TRUTH)
    chosen = chosen_approach(cohort, tables.get("errors"), there)
    kinds = kinds_of_trials(cohort)
    alike = pd.DataFrame(similarity_rows(true_motions(cohort), kinds))
    told = [trial for trial, _ in judged_likeness(tables.get("similarity"), alike, chosen)]
    trial = next((name for name in told if chosen in courses.get(name, {})), next(iter(courses)))
    one = courses[trial]
    reach = {name: float(np.abs(curves).max()) for name, curves in one.items()}
    looks = looks_of(chosen, one)
    limit = WILD * reach.get(chosen, max(reach.values()))
    wild = [name for name in looks if reach[name] > limit]
    looks = {name: look for name, look in looks.items() if name not in wild}
    rows = _courses_rows({name: one[name] for name in looks})
    sizes = np.append(rows[["y", "y_low", "y_high"]].to_numpy(float).ravel(), 0.0)
    low, high = np.nanmin(sizes), np.nanmax(sizes)
    room = 0.06 * (high - low) or 1.0
    axis = next(AXIS[kind] for (_, name), kind in kinds.items() if name == trial and kind in AXIS)
    how: dict[str, Any] = {"x_label": "cycle of the motion (%)", "x_limits": (0.0, 100.0)}
    how |= {"y_label": "rotation (°)", "y_limits": (low - room, high + room)}
    how |= {"looks": looks, "high": 190.0}
    panels = [
        Curves(title=level(joint), frame=rows[rows["joint"] == joint], **how)
        for joint in LUMBAR_JOINTS
    ]
    most = max(len(one[name]) for name in looks)
    band = "; band: one SD to each side" if most > 1 else ""
    caption = f"{case(trial)}, + {POSITIVE[ROTATIONS[axis]]}; mean over "
    caption += f"{count(most, 'subject')}{band}.{_left_out(wild)}"
    return Chart(title, panels, caption, _keys(looks, as_line=True))


def _courses_rows(courses: Mapping[str, Array]) -> pd.DataFrame:
    """Mean and SD over subjects (P, 26, 6), by approach and joint."""
    parts = []
    for name, curves in courses.items():
        mean = curves.mean(axis=0)
        sd = curves.std(axis=0, ddof=1) if len(curves) > 1 else np.full_like(mean, np.nan)
        for k, joint in enumerate(LUMBAR_JOINTS):
            own = {"x": 100.0 * CYCLE, "y": mean[:, k], "series": name, "joint": joint}
            own |= {"y_low": (mean - sd)[:, k], "y_high": (mean + sd)[:, k]}
            parts.append(pd.DataFrame(own))
    return pd.concat(parts, ignore_index=True)


def courses_of(cohort: Cohort, tracked: pd.DataFrame) -> dict[str, dict[str, Array]]:
    """(P, 26, 6) deg by trial and approach: lumbar joints about the motion's axis, and truly."""
    kinds = kinds_of_trials(cohort)
    found: dict[str, dict[str, list[Array]]] = {}
    for rows in (tracked, true_motions(cohort)):
        for one in motions(rows):
            kind = kinds.get((one.specimen, one.trial))
            lonely = one.approach == TRUTH and one.trial not in found
            if kind not in AXIS or len(one.time_s) < 2 or lonely:
                continue
            times = one.time_s[0] + CYCLE * (one.time_s[-1] - one.time_s[0])
            turned = one.at(times)[:, PELVIS + 1 :, 3 + AXIS[kind]]
            degrees = DEG_PER_RAD * turned[:, : len(LUMBAR_JOINTS)]
            found.setdefault(one.trial, {}).setdefault(one.approach, []).append(degrees)
    return {
        trial: {name: np.array(curves) for name, curves in by.items()}
        for trial, by in found.items()
    }
