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
    """Share of poses within the limits, and the largest error, over the SD of the landmarks."""
    title = "How precise landmarks must be"
    curves = tables["landmark_precision"]
    if curves.empty or not curves["median"].notna().any():
        return saying(title, "No palpation has a result at any landmark SD.")
    whose = {
        "calibrated": "stiffness fitted to each pose",
        "nominal": "stiffness of the pose as palpated",
    }
    lines = {
        name: look
        for name, look in zip(whose, (MODEL, BASE), strict=True)
        if name in set(curves["stiffness"])
    }
    looks = {**lines, **{f"{name} points": look for name, look in lines.items()}, "asked": SOFT}
    alone = curves["specimen"].nunique() == 1
    end = 1.12 * float(curves["sd_mm"].max())
    panels = []
    for motion in dict.fromkeys(curves["motion"]):
        rows = curves[curves["motion"] == motion].sort_values("sd_mm")
        symbol, limit = (
            unit("anterior" if motion == "translation" else "extension"),
            float(rows["limit"].iloc[0]),
        )
        asked = 100.0 * study.landmark_precision.share
        for what, y, ends, level, words in (
            (
                f"{motion.capitalize()}s within {tick(limit)} {symbol}",
                "below",
                ("below_low", "below_high"),
                asked,
                f"{tick(asked)} %",
            ),
            (f"Largest error, {motion}", "p95", (None, None), limit, f"{tick(limit)} {symbol}"),
        ):
            factor = 100.0 if y == "below" else 1.0
            frame = pd.DataFrame(
                {
                    "x": rows["sd_mm"],
                    "y": factor * rows[y],
                    "series": rows["stiffness"],
                    "part": rows["specimen"],
                }
            )
            if alone and ends[0]:
                frame = frame.assign(y_low=factor * rows[ends[0]], y_high=factor * rows[ends[1]])
            frame = frame.dropna(subset=["y"])
            dots = frame.assign(series=frame["series"] + " points")
            mark = pd.DataFrame({"x": [0.0, end], "y": level, "series": "asked", "part": ""})
            top = 104.0 if y == "below" else 1.15 * max(level, float(frame["y"].max()))
            panels.append(
                Curves(
                    title=what,
                    x_label="SD of landmarks, per axis (mm)",
                    y_label="share of poses (%)" if y == "below" else f"95th percentile ({symbol})",
                    frame=pd.concat([frame, dots, mark]),
                    looks=looks,
                    points=tuple(name for name in looks if name.endswith("points")),
                    labels={"asked": words},
                    x_limits=(0.0, end),
                    y_limits=(0.0, top),
                )
            )
    n = int(curves["n"].max())
    caption = (
        f"{n} poses at each SD; bands and lines: 95 % intervals (Wilson); dashed: what is asked."
        if alone
        else f"A line for each specimen, {n} poses at each SD; dashed: what is asked."
    )
    return Chart(title, panels, caption, [Key(lines[name], whose[name]) for name in lines])
