"""Key findings of a joint-pose study as sentences, their numbers computed from its tables."""

import numpy as np
import pandas as pd
from statsmodels.stats.proportion import proportion_confint

from spinepipe.report.page.document import ResultTables
from spinepipe.report.page.tables import judged
from spinepipe.report.words import count, fixed, number, percent, tick
from spinepipe.studies.joint_pose_sensitivity.figures.bootstrap import LOADING_NAMES
from spinepipe.studies.joint_pose_sensitivity.figures.landmark_precision import (
    WHOSE,
    required_words,
)
from spinepipe.studies.joint_pose_sensitivity.figures.success import refused
from spinepipe.studies.joint_pose_sensitivity.findings_of_stiffness import (
    load_point,
    posterior,
    stiffness,
)
from spinepipe.studies.joint_pose_sensitivity.settings import JointPoseSensitivity

FOLDED = 5.0
"""Percent by which the interaction of sizes must be larger for folding to be named."""

FEWEST_FOR_SPREAD = 3
"""Quartiles of fewer fits say nothing of a spread: those of a single one never differ."""

_WHAT = {"start_bootstrap": "over start values", "damping_bootstrap": "over damping"}

FEWEST_OF_A_RATE = 10
"""Trials of which a rate is told: all of 3 leave 44 to 100 %, all of 10 leave 72 to 100 %."""

_COUNTS = ("fits", "solved", "near_start_any", "near_start_all", "outliers", "reduced")

_PERCENT = "\u00a0%"
"""No line ends between a number and its percent sign."""


def findings(study: JointPoseSensitivity, results: ResultTables) -> list[str]:
    """The sentences, without those that the study has no table for."""
    told = (
        _fits(study, results),
        stiffness(study, results),
        load_point(results),
        settling(study),
        _dominant(results),
        _precision(study, results),
        _methods(results),
        _bootstraps(study, results),
        *posterior(results),
        judged(results.table("against_gould_2024a")),
    )
    return [sentence.replace(" %", _PERCENT) for sentence in told if sentence]


def settling(study: JointPoseSensitivity) -> str:
    """A sentence where simulations show another time than the fits do, else nothing."""
    if study.loading != "settle":
        return ""
    return (
        f"Motion was simulated {tick(study.settle_time_s)} s after loading, while stiffness was "
        "fitted at rest: errors hold what had not settled."
    )


def _fits(study: JointPoseSensitivity, results: ResultTables) -> str:
    """How many fits are in the reduced dataset, and why the others are not."""
    rows = results.table("counts")
    if rows.empty or not (rows["part"] == "poses").any():
        return ""
    poses = rows[rows["part"] == "poses"]
    sums = {name: int(poses[name].sum()) for name in _COUNTS}
    near = "near_start_all" if study.success.failed_when == "all" else "near_start_any"
    which = "all free stiffnesses" if near.endswith("all") else "a free stiffness"
    percents = tick(study.success.near_start_percent)
    lost = (
        f"{sums[near]} had not moved ({which} within {percents} % of the start) and "
        f"{sums['outliers']} {'was an outlier' if sums['outliers'] == 1 else 'were outliers'}"
    )
    share = percent(sums["reduced"], sums["fits"])
    kept = f"{count(sums['reduced'], 'fit')} of {sums['fits']} ({share})"
    return f"{kept} are in the reduced dataset: {sums['solved']} ended with a stiffness, {lost}."


def _dominant(results: ResultTables) -> str:
    """In how many errors pose or stiffness takes more, their 95 % intervals apart.

    Of errors with their sign: where sizes are taken an error is folded at zero, and folding makes
    an interaction of pose and stiffness that is none.
    """
    rows = results.table("variance_shares")
    if rows.empty:
        return ""
    done = rows[(rows["status"] == "done") & rows["signed_share"].notna()]
    keys = ["specimen", "joint", "coordinate"]
    pose, stiffness = (
        done[done["factor"] == factor].set_index(keys) for factor in ("pose", "stiffness")
    )
    if pose.empty:
        return ""
    stiffness = stiffness.reindex(pose.index)
    by_pose = int((pose["signed_share_low"] > stiffness["signed_share_high"]).sum())
    by_stiffness = int((stiffness["signed_share_low"] > pose["signed_share_high"]).sum())
    unknown = len(pose) - by_pose - by_stiffness
    overlap = "cannot be told apart: the 95 % intervals of their shares of the variance overlap."
    errors = f"{count(len(pose), 'error')} (one per joint and direction)"
    together = _together(done)
    if unknown == len(pose):
        return (
            f"In none of {errors} is it clear which counts more: joint pose and stiffness {overlap}"
            f" {together}"
        )
    told = (
        f"Of {errors}, joint pose takes more of the variance than stiffness in {by_pose} and "
        f"stiffness more in {by_stiffness}."
    )
    others = f"In the other {unknown} they {overlap}" if unknown else ""
    return " ".join(words for words in (told, others, together) if words)


def _together(done: pd.DataFrame) -> str:
    """What pose and stiffness do only together, of errors and of their sizes."""
    rows = done[done["factor"] == "interaction"]
    signed, size = (100.0 * float(rows[c].median()) for c in ("signed_share", "share"))
    folded = ": sizes fold errors at zero" if size > signed + FOLDED else ""
    return (
        f"What they do only together takes {fixed(signed, 0)} % of the variance of an error "
        f"(median), and {fixed(size, 0)} % of that of its size{folded}."
    )


def _precision(study: JointPoseSensitivity, results: ResultTables) -> str:
    """The largest landmark SD that will do, with each stiffness."""
    rows = results.table("required_precision")
    if rows.empty:
        return ""
    asked = study.landmark_precision
    limits = {
        "translation": f"{tick(asked.translation_limit_mm)} mm",
        "rotation": f"{tick(asked.rotation_limit_deg)}°",
    }
    limits = {"both": " and ".join(limits.values()), **limits}
    # where there is no row of both, one kind of motion alone was measured
    motion = next(name for name in limits if (rows["motion"] == name).any())
    goal = f"For {tick(100 * asked.share)} % of poses to stay below {limits[motion]}"
    chosen = rows[rows["motion"] == motion]
    parts = [
        f"with {WHOSE[str(whose)]} {_required(part, asked.sd_mm)}"
        for whose, part in chosen.groupby("stiffness")
    ]
    low, high = int(chosen["n"].min()), int(chosen["n"].max())
    poses = count(high, "pose") if low == high else f"{low} to {count(high, 'pose')}"
    told = f"{goal}, the SD of a landmark per axis may be at most: {'; '.join(parts)}"
    return f"{told} ({poses} per SD). {_too_few(low, asked.share)}".strip()


def _required(part: pd.DataFrame, sampled: tuple[float, ...]) -> str:
    if len(part) == 1:
        return required_words(part.iloc[0], sampled)
    known = part[np.isfinite(part["sd_mm"])]
    others = part.drop(known.index)
    why = [
        f"{message} in {', '.join(rows['specimen'])}"
        for message, rows in others.groupby("message", sort=False)
    ]
    if known.empty:
        return "; ".join(why)
    least = known.loc[known["sd_mm"].idxmin()]
    which = f"smallest of {count(len(known), 'specimen')}, {least['specimen']}"
    return ", but ".join([f"{fixed(least['sd_mm'])} mm ({which})", *why])


def _too_few(n: int, share: float) -> str:
    """That so few poses cannot show the share, even if all of them were below the limits."""
    low = float(proportion_confint(n, n, method="wilson")[0]) if n else 0.0
    if low >= share:
        return ""
    asked = tick(100 * share)
    return (
        f"{count(n, 'pose')} cannot show {asked} %: even with all of them below, the 95 % "
        f"interval of the share begins at {fixed(100 * low, 0)} %."
    )


def _methods(results: ResultTables) -> str:
    """Successful fits of each method, or why methods were not compared."""
    rows = results.table("success_by_method")
    if rows.empty:
        return ""
    why = refused(results.table("method_fits"))
    sums = rows.groupby("method", sort=False)[["successful", "fits", "arrived"]].sum()
    parts = [
        f"{str(method).replace('_', ' ')} not compared ({why[str(method)]})"
        if method in why
        else f"{str(method).replace('_', ' ')} {row['successful']} of {row['fits']} "
        f"(least cost reached: {row['arrived']})"
        for method, row in sums.iterrows()
    ]
    if set(sums.index) <= set(why):
        return f"Methods of fitting were not compared: {'; '.join(dict.fromkeys(why.values()))}."
    fits = int(sums["fits"].max())
    few = f" {count(fits, 'fit')} of each tell no rate." if fits < FEWEST_OF_A_RATE else ""
    return f"Successful fits of the same poses by method: {'; '.join(parts)}.{few}"


def _bootstraps(study: JointPoseSensitivity, results: ResultTables) -> str:
    """Spread of the widest direction by part and loading, then the fits without a stiffness."""
    rows, counts = results.table("summary"), results.table("counts")
    if rows.empty:
        return ""
    chosen = rows[
        rows["part"].isin(_WHAT)
        & (rows["dataset"] == "all")
        & (rows["quantity"] == "stiffness")
        & rows["coordinate"].isin(study.calibration.free)
    ].dropna(subset=["median"])
    parts = [_widest(str(part), fits) for part, fits in chosen.groupby("part", sort=False)]
    lead = "Middle half (IQR) of the fitted stiffness as a share of its median, widest direction"
    told = f"{lead}: {'; '.join(parts)}." if parts else ""
    return " ".join(words for words in (told, _lost(counts)) if words)


def _widest(part: str, rows: pd.DataFrame) -> str:
    """The widest spread of a part of the study, under each loading."""
    if (rows["n"] < FEWEST_FOR_SPREAD).all():
        return f"{_WHAT[part]} not told, with fewer than {FEWEST_FOR_SPREAD} fits of a kind"
    told = []
    for loading, fits in rows.groupby("loading", sort=False):
        enough = fits[fits["n"] >= FEWEST_FOR_SPREAD]
        share = 100.0 * float((enough["iqr"] / enough["median"]).max())  # NaN of none
        spread = f"{'below 0.01' if share < 0.01 else number(share, 2)} %"
        few = f"fewer than {FEWEST_FOR_SPREAD} fits"
        told.append(f"{few if enough.empty else spread} {LOADING_NAMES[str(loading)]}")
    return f"{_WHAT[part]} {', '.join(told)}"


def _lost(counts: pd.DataFrame) -> str:
    """How many of how many fits ended without a stiffness."""
    if counts.empty:
        return ""
    parts = []
    for part, what in _WHAT.items():
        rows = counts[counts["part"] == part]
        fits, lost = int(rows["fits"].sum()), int((rows["fits"] - rows["solved"]).sum())
        each = rows.assign(lost=rows["fits"] - rows["solved"]).groupby("loading", sort=False)
        where = [
            f"{LOADING_NAMES[str(loading)]} {int(of['lost'])} of {int(of['fits'])}"
            for loading, of in each[["lost", "fits"]].sum().iterrows()
            if of["lost"]
        ]
        if fits:
            told = f" ({', '.join(where)})" if lost else ""
            parts.append(f"{what} {lost} of {fits}{told}")
    return f"Fits lost, without a stiffness: {'; '.join(parts)}." if parts else ""
