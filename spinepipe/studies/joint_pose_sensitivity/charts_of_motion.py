"""Figures of motion and joint frames: agreement, what errors depend on, frames, precision."""

from collections.abc import Mapping

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
from spinepipe.studies.joint_pose_sensitivity.conclusions_of_motion import ROUNDING
from spinepipe.studies.joint_pose_sensitivity.gould_2024a import GOULD_2024A
from spinepipe.studies.joint_pose_sensitivity.retained import place_of, retained
from spinepipe.studies.joint_pose_sensitivity.settings import JointPoseSensitivity
from spinepipe.studies.joint_pose_sensitivity.spread import iqr_with_ends
from spinepipe.studies.joint_pose_sensitivity.variables import readings
from spinepipe.units import COORDINATE_COLUMNS, COORDINATES, ROTATIONS, TRANSLATIONS

Tables = Mapping[str, pd.DataFrame]

MOST_ROWS = 24
"""Of a panel: where there are more, those with the largest numbers are drawn."""


OURS = "palpation"
FITTED_TO = {
    "calibrated": "stiffness fitted to each pose",
    "nominal": "stiffness of one pose for all",
}
"""Whose stiffness poses are run with."""

WAYS = {
    **{name: name for name in TRANSLATIONS},
    **dict(zip(ROTATIONS, ("flexion", "bending", "rotation"), strict=True)),
}
"""Short names of directions and axes."""


def _most(frame: pd.DataFrame, size: str) -> pd.DataFrame:
    """Rows of the `MOST_ROWS` rows of a panel whose numbers are largest, in their order."""
    largest = frame.groupby("row", sort=False)[size].max().nlargest(MOST_ROWS).index
    return frame[frame["row"].isin(largest)]


def _only_most(panels: list[Rows], frames: list[pd.DataFrame]) -> str:
    """What a caption says where rows are left out."""
    shown, every = (
        max(frame["row"].nunique() for frame in one) for one in ([p.frame for p in panels], frames)
    )
    return f" The {shown} largest of {every} are shown." if shown < every else ""


def agreement(study: JointPoseSensitivity, cohort: Cohort, tables: Tables) -> Chart:
    """Bias and limits of agreement after Bland and Altman, each with its exact 95 % interval."""
    title = "Agreement of predicted with measured motion"
    runs = tables["simulations"]
    own = runs[(runs["stiffness"] == "calibrated") & runs["status"].isin(USABLE)]
    own = readings(retained(own, tables["success"]), cohort.zeroed_at_step_0)
    panels, frames = [], []
    for name, column in zip(COORDINATES, COORDINATE_COLUMNS, strict=True):
        rows = []
        for (specimen, joint), part in own.groupby(["specimen", "joint"], sort=False):
            pair = part[[f"measured_{column}", f"predicted_{column}"]].dropna().to_numpy(float)
            exact = np.abs(pair[:, 1] - pair[:, 0]) < ROUNDING
            found = bland_altman(pair[:, 0], np.where(exact, pair[:, 0], pair[:, 1]))
            if found.bias is None:
                continue
            place = {"row": place_of(specimen, joint, cohort)}
            rows += [
                {**place, "hollow": what != "bias", "value": getattr(found, what)}
                | {end: getattr(found, f"{what}_{end}") for end in ("low", "high")}
                for what in ("bias", "lower_limit", "upper_limit")
            ]
        if rows:
            frame = pd.DataFrame(rows).astype(dict.fromkeys(("value", "low", "high"), float))
            frames.append(frame)
            label = f"predicted less measured ({unit(name)}), + {POSITIVE[name]}"
            chosen = _most(frame.assign(size=frame["value"].abs()), "size")
            panels.append(Rows(title=AXIS[name], x_label=label, frame=chosen, marks={0.0: ""}))
    if not panels:
        return saying(title, "No motion was measured of which a retained fit has two readings.")
    caption = (
        "Filled: mean difference (bias); hollow: limits of agreement, bias ± 1.96 SD; lines: 95 % "
        f"intervals, over the retained fits.{_only_most(panels, frames)}"
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
    panels, frames = [], []
    for name in (name for name in COORDINATES if name in set(done["coordinate"])):
        rows = done[done["coordinate"] == name].rename(columns=names)
        frame = (
            rows[["value", "low", "high"]]
            .mul(100.0)
            .assign(
                row=[
                    place_of(*one, cohort)
                    for one in zip(rows["specimen"], rows["joint"], strict=True)
                ],
                series=rows["factor"].map(series),
            )
        )
        frames.append(frame)
        label = "share of the variance of the error (%)"
        panels.append(
            Rows(
                title=AXIS[name],
                x_label=label,
                frame=_most(frame, "value"),
                looks=looks,
                x_limits=(0.0, 100.0),
            )
        )
    first = done.iloc[0]
    caption = (
        f"Symbol: share; line: 95 % interval; {first['n_poses']} joint poses of retained fits, "
        f"each run with {first['n_stiffness']} stiffness sets.{_only_most(panels, frames)}"
    )
    return Chart(title, panels, caption, [Key(look, name) for name, look in looks.items()])


def frames(study: JointPoseSensitivity, cohort: Cohort, tables: Tables) -> Chart:
    """Middle half of joint centres and of joint axes over the palpations of retained fits."""
    title = "How far palpation moves joint frames"
    poses = tables["poses"]
    kept = retained(poses[poses["status"] == Status.CONVERGED.value], tables["success"])
    paper = GOULD_2024A.beside(cohort.name)
    panels, every = [], []
    centre = dict(zip(TRANSLATIONS, ("x_mm", "y_mm", "z_mm"), strict=True))
    axes = {name: f"{name}_deg" for name in ROTATIONS}
    for kind, symbol, names, printed in (
        ("Joint centre", "mm", centre, "joint_origin"),
        ("Joint axes", "°", axes, "joint_orientation"),
    ):
        rows = []
        for (specimen, joint), part in list(kept.groupby(["specimen", "joint"], sort=False))[::-1]:
            seed = specimen_seed(study.seed, f"frames/{specimen}/{joint}")
            theirs = paper[1][printed]["complete"].get(joint, {}).get("iqr", {}) if paper else {}
            for name, column in names.items():
                values = part[column].to_numpy(float)
                if symbol == "°":  # about the first of them, so that none jumps by a turn
                    values = (values - values[0] + 180.0) % 360.0 - 180.0
                wide, *ends = map(float, iqr_with_ends(values, seed))
                row = {"row": f"{place_of(specimen, joint, cohort)} {WAYS[name]}"}
                row |= {"value": wide, "low": ends[0], "high": ends[1], "series": OURS}
                theirs_of = theirs.get(column if symbol == "°" else f"{name}_mm")
                rows.append(row)
                if theirs_of is not None and paper:
                    nothing = {"low": np.nan, "high": np.nan}
                    rows.append({**row, **nothing, "series": paper[0], "value": theirs_of})
        frame = pd.DataFrame(rows, columns=["row", "value", "low", "high", "series"])
        if frame["value"].notna().any():
            every.append(frame)
            looks = {OURS: MODEL, **({paper[0]: BASE} if paper else {})}
            label = f"width of the middle half ({symbol})"
            wide = (0.0, 1.06 * float(frame[["value", "high"]].max(axis=None)))
            rows_ = _most(frame, "value")
            panels.append(Rows(title=kind, x_label=label, frame=rows_, looks=looks, x_limits=wide))
    if not panels:
        return saying(title, "Fewer than two palpations of a specimen have a retained fit.")
    caption = (
        "Interquartile range over the palpations of retained fits, in ground axes; line: 95 % "
        f"interval (bootstrap).{_only_most(panels, every)}"
    )
    return Chart(
        title, panels, caption, [Key(look, name) for name, look in looks.items()] if paper else ()
    )


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
