"""Finding about landmarks: how precise they must be, and what so many poses can tell of it."""

import numpy as np
import pandas as pd
from statsmodels.stats.proportion import proportion_confint

from spinepipe.report.landmark_precision import WHOSE
from spinepipe.report.page.results import Results
from spinepipe.report.required import required_words
from spinepipe.report.words import count, fixed, tick
from spinepipe.studies import JointPoseSensitivity


def precision(study: JointPoseSensitivity, results: Results) -> str:
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
    told = f"{goal}, the SD of a landmark per axis may be at most: {'; '.join(parts)}"
    return f"{told} ({_poses(chosen)} per SD). {_too_few(chosen, asked.share)}".strip()


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


def _poses(chosen: pd.DataFrame) -> str:
    low, high = int(chosen["n"].min()), int(chosen["n"].max())
    return count(high, "pose") if low == high else f"{low} to {count(high, 'pose')}"


def _too_few(chosen: pd.DataFrame, share: float) -> str:
    """That so few poses cannot show the share, even if all of them were below the limits."""
    n = int(chosen["n"].min())
    low = float(proportion_confint(n, n, method="wilson")[0]) if n else 0.0
    if low >= share:
        return ""
    asked = tick(100 * share)
    return (
        f"{count(n, 'pose')} cannot show {asked} %: even with all of them below, the 95 % "
        f"interval of the share begins at {fixed(100 * low, 0)} %."
    )
