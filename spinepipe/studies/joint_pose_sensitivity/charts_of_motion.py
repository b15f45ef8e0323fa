"""Figures of motion and joint frames: agreement, what errors come from, frames, precision."""

from typing import Any

import numpy as np
import pandas as pd

from spinepipe.cohort import Cohort
from spinepipe.designs import specimen_seed
from spinepipe.report.forms.chart import Chart, Key, saying
from spinepipe.report.forms.curves import Curves
from spinepipe.report.forms.look import BASE, MODEL, SOFT, THIRD
from spinepipe.report.forms.rows import Rows
from spinepipe.report.words import AXIS, POSITIVE, tick, unit
from spinepipe.statistics import bland_altman
from spinepipe.status import USABLE, Status
from spinepipe.studies.joint_pose_sensitivity.charts import MOST_ROWS, Tables
from spinepipe.studies.joint_pose_sensitivity.conclusions_of_motion import ROUNDING
from spinepipe.studies.joint_pose_sensitivity.gould_2024a import GOULD_2024A
from spinepipe.studies.joint_pose_sensitivity.retained import place_of, retained
from spinepipe.studies.joint_pose_sensitivity.settings import JointPoseSensitivity
from spinepipe.studies.joint_pose_sensitivity.spread import iqr_with_ends
from spinepipe.studies.joint_pose_sensitivity.variables import readings
from spinepipe.units import COORDINATE_COLUMNS, COORDINATES, ROTATIONS, TRANSLATIONS

LONG_NAME = 16
"""Letters of a row's name from which a panel is wider."""

WAYS = dict(zip(ROTATIONS, ("flexion", "bending", "rotation"), strict=True))
FITTED_TO = {
    "calibrated": "stiffness fitted to each pose",
    "nominal": "stiffness of one pose for all",
}
"""Whose stiffness poses are run with."""


def _places(rows: pd.DataFrame) -> dict[tuple[str, str], pd.DataFrame]:
    """Rows by specimen and joint, from above."""
    groups = list(rows.groupby(["specimen", "joint"], sort=False))
    return {(str(specimen), str(joint)): part for (specimen, joint), part in reversed(groups)}


def _panel(title: str, x_label: str, frame: pd.DataFrame, **how: Any) -> Rows:
    """Rows with the largest numbers where they are many, as wide as their names ask."""
    sizes = frame["value"].abs().groupby(frame["row"]).max()
    frame = frame[frame["row"].isin(sizes.nlargest(MOST_ROWS).index)]
    wide = 380.0 if frame["row"].str.len().max() > LONG_NAME else 300.0
    return Rows(title=title, x_label=x_label, frame=frame, width=wide, **how)


def _only_largest(rows: int) -> str:
    """What a caption says where there are so many."""
    return f", {MOST_ROWS} largest of {rows} rows" if rows > MOST_ROWS else ""


def agreement(study: JointPoseSensitivity, cohort: Cohort, tables: Tables) -> Chart:
    """Bias and limits of agreement after Bland and Altman, each with its exact 95 % interval."""
    title = "Agreement of predicted with measured motion"
    runs = tables["simulations"]
    own = runs[(runs["stiffness"] == "calibrated") & runs["status"].isin(USABLE)]
    places = _places(readings(retained(own, tables["success"]), cohort.zeroed_at_step_0))
    panels = []
    for name, column in zip(COORDINATES, COORDINATE_COLUMNS, strict=True):
        rows = []
        for place, part in places.items():
            pair = part[[f"measured_{column}", f"predicted_{column}"]].dropna().to_numpy(float)
            rounding = np.abs(pair[:, 1] - pair[:, 0]) < ROUNDING
            found = bland_altman(pair[:, 0], np.where(rounding, pair[:, 0], pair[:, 1]))
            for what in ("bias", "lower_limit", "upper_limit") if found.bias is not None else ():
                ends = {end: getattr(found, f"{what}_{end}") for end in ("low", "high")}
                row = {"row": place_of(*place, cohort), "hollow": what != "bias", **ends}
                rows.append({**row, "value": getattr(found, what)})
        if rows:
            frame = pd.DataFrame(rows).astype(dict.fromkeys(("value", "low", "high"), float))
            label = f"error ({unit(name)}), + {POSITIVE[name]}"
            panels.append(_panel(AXIS[name], label, frame, marks={0.0: ""}))
    if not panels:
        return saying(title, "No motion was measured of which a retained fit has two readings.")
    caption = (
        "Predicted less measured. Filled: mean (bias); hollow: limits of agreement (± 1.96 SD); "
        f"lines: 95 % intervals, over the retained fits{_only_largest(len(places))}."
    )
    return Chart(title, panels, caption)


def errors_by_source(study: JointPoseSensitivity, cohort: Cohort, tables: Tables) -> Chart:
    """Shares of the variance of errors that joint poses and stiffness sets make."""
    title = "What errors of motion come from"
    shares = tables["variance_shares"]
    done = shares[(shares["status"] == "done") & shares["signed_share"].notna()]
    if done.empty:
        return saying(title, "No error varies over the grid of joint poses and stiffness sets.")
    looks = {"joint pose": MODEL, "stiffness": BASE, "both together": THIRD}
    series = dict(zip(("pose", "stiffness", "interaction"), looks, strict=True))
    names = {"signed_share": "value", "signed_share_low": "low", "signed_share_high": "high"}
    panels = []
    for name in (name for name in COORDINATES if name in set(done["coordinate"])):
        rows = done[done["coordinate"] == name].rename(columns=names)[::-1]
        frame = 100.0 * rows[["value", "low", "high"]]
        places = zip(rows["specimen"], rows["joint"], strict=True)
        frame["row"] = [place_of(*place, cohort) for place in places]
        frame["series"] = rows["factor"].map(series)
        label, wide = "share of variance (%)", (0.0, 100.0)
        panels.append(_panel(AXIS[name], label, frame, looks=looks, x_limits=wide))
    first = done.iloc[0]
    caption = (
        f"Symbol: share; line: 95 % interval; {first['n_poses']} joint poses of retained fits, "
        f"each run with {first['n_stiffness']} stiffness sets"
        f"{_only_largest(len(done[['specimen', 'joint']].drop_duplicates()))}."
    )
    return Chart(title, panels, caption, [Key(look, name) for name, look in looks.items()])


def frames(study: JointPoseSensitivity, cohort: Cohort, tables: Tables) -> Chart:
    """Middle half of joint centres and of joint axes over the palpations of retained fits."""
    title = "How far palpation moves joint frames"
    poses = tables["poses"]
    kept = retained(poses[poses["status"] == Status.CONVERGED.value], tables["success"])
    places = _places(kept)
    paper = GOULD_2024A.beside(cohort.name)
    looks = {"palpation": MODEL} | ({paper[0]: BASE} if paper else {})
    centre = dict(zip(TRANSLATIONS, ("x_mm", "y_mm", "z_mm"), strict=True))
    axes = {name: f"{name}_deg" for name in ROTATIONS}
    panels = []
    for kind, symbol, names, printed in (
        ("Joint centre", "mm", centre, "joint_origin"),
        ("Joint axes", "°", axes, "joint_orientation"),
    ):
        rows = []
        for place, part in places.items():
            seed = specimen_seed(study.seed, f"frames/{'/'.join(place)}")
            theirs = paper[1][printed]["complete"].get(place[1], {}).get("iqr", {}) if paper else {}
            for name, column in names.items():
                values = part[column].to_numpy(float)
                if symbol == "°":  # about the first of them, so that none jumps by a turn
                    values = (values - values[0] + 180.0) % 360.0 - 180.0
                wide, low, high = map(float, iqr_with_ends(values, seed))
                row = {"row": f"{place_of(*place, cohort)} {WAYS.get(name, name)}"}
                rows.append({**row, "series": "palpation", "value": wide, "low": low, "high": high})
                key = column if symbol == "°" else f"{name}_mm"
                if paper and key in theirs:
                    rows.append({**row, "series": paper[0], "value": theirs[key]})
        frame = pd.DataFrame(rows, columns=["row", "series", "value", "low", "high"])
        if frame["value"].notna().any():
            limits = (0.0, 1.06 * float(np.nanmax(frame[["value", "high"]].to_numpy(float))))
            panels.append(
                _panel(kind, f"middle half ({symbol})", frame, looks=looks, x_limits=limits)
            )
    if not panels:
        return saying(title, "Fewer than two palpations of a specimen have a retained fit.")
    caption = (
        "Width of the middle half over palpations of retained fits, in ground axes"
        f"{_only_largest(3 * len(places))}; line: 95 % interval (bootstrap)."
    )
    return Chart(title, panels, caption, [Key(looks[name], name) for name in looks if paper])


def precision(study: JointPoseSensitivity, cohort: Cohort, tables: Tables) -> Chart:
    """Share of poses within the limits over the SD of the landmarks."""
    title = "How precise landmarks must be"
    shares = tables["landmark_precision"]
    if shares.empty or not shares["median"].notna().any():
        return saying(title, "No palpation has a result at any landmark SD.")
    alone = shares["specimen"].nunique() == 1
    found = [name for name in FITTED_TO if name in set(shares["stiffness"])]
    looks = dict(zip(FITTED_TO, (MODEL, BASE), strict=True)) | {"asked": SOFT}
    # a single SD makes no line: each also has a symbol
    looks |= {f"{name} points": looks[name] for name in found}
    asked, end = 100.0 * study.landmark_precision.share, 1.15 * float(shares["sd_mm"].max())
    panels = []
    for motion, rows in shares.sort_values("sd_mm").groupby("motion", sort=False):
        columns = {"sd_mm": "x", "below": "y", "stiffness": "series", "specimen": "part"}
        columns |= {"below_low": "y_low", "below_high": "y_high"} if alone else {}
        lines = rows[list(columns)].rename(columns=columns)
        ends = lines.columns.intersection(["y", "y_low", "y_high"])
        lines[ends] *= 100.0
        mark = pd.DataFrame({"x": [0.0, end], "y": asked, "series": "asked", "part": ""})
        dots = lines.assign(series=lines["series"] + " points")
        limit = f"{tick(rows['limit'].iloc[0])}{'°' if motion == 'rotation' else ' mm'}"
        panels.append(
            Curves(
                title=f"{str(motion).capitalize()} within {limit}",
                x_label="SD of landmarks, per axis (mm)",
                y_label="share of poses (%)",
                frame=pd.concat([lines, dots, mark]),
                looks=looks,
                points=tuple(f"{name} points" for name in found),
                labels={"asked": f"{tick(asked)} %"},
                x_limits=(0.0, end),
                y_limits=(-6.0, 106.0),
            )
        )
    whose = "bands: 95 % intervals (Wilson)" if alone else "a line for each specimen"
    caption = f"{shares['n'].max()} poses at each SD; {whose}; dashed: what is asked."
    return Chart(title, panels, caption, [Key(looks[name], FITTED_TO[name]) for name in found])
