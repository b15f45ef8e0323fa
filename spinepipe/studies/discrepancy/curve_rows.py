"""Rows of curves of load over motion: what a load drives, and stiffness at rest and under load."""

import numpy as np
import pandas as pd

from spinepipe.studies.discrepancy.tables import MODELS
from spinepipe.studies.discrepancy.verdict import EVERY
from spinepipe.studies.discrepancy.words import TOWARDS, motion_of
from spinepipe.units import COORDINATES, DISPLAY_PER_SI

ENDS = {"value": "", "low": "_low", "high": "_high"}
"""Columns of a number with its interval, and how they end in tables of several."""

PLACE = ["specimen", "test", "joint", "coordinate"]


def driven_coordinates(gap: pd.DataFrame) -> dict[tuple[str, str], str]:
    """By test and joint the coordinate in which the load does the most work, over specimens.

    Parameters
    ----------
    gap : here and below, rows of the table of that name.
    """
    factors = dict(zip(COORDINATES, DISPLAY_PER_SI, strict=True))
    per_si = gap["coordinate"].map(factors).astype(float)
    motion = gap["held_at"].fillna(gap["measured"])  # on a rig that moves it, a load is measured
    work = (gap["load"] * motion / per_si).abs()
    keys = PLACE[1:]
    total = work.groupby([gap[key] for key in keys], sort=False).sum().rename("work").reset_index()
    best = total[total["work"] > 0.0].sort_values("work", ascending=False, kind="stable")
    chosen = best.drop_duplicates(["test", "joint"])
    return {(row["test"], row["joint"]): row["coordinate"] for row in chosen.to_dict("records")}


def off_by(rows: pd.DataFrame) -> float:
    """Root mean square of measured less base, in SDs of the noise."""
    residual = (rows["measured"] - rows["base"]) / rows["noise_sd"]
    return float(np.sqrt(np.mean(residual**2)))


def stiffness_at_rest_and_loaded(numbers: pd.DataFrame) -> pd.DataFrame:
    """Rows of where stiffness changes most from rest to load, each specimen's and their mean.

    Parameters
    ----------
    numbers : of the table field_numbers.

    Returns
    -------
    Of one joint, coordinate and side (both, where they are alike): ``specimen``, ``model``,
    ``load``, ``unit``, ``side``, ``every`` (whether all joints are alike), and ``rest`` and
    ``loaded`` with ``_low`` and ``_high``. Empty where neither is known.
    """
    if numbers.empty:
        return numbers
    keys = ["joint", "coordinate", "model", "specimen"]
    rest = numbers[numbers["number"] == "stiffness_at_zero"][[*keys, *ENDS]]
    rest = rest.rename(columns={name: f"rest{end}" for name, end in ENDS.items()})
    found = []
    for number, side in (("stiffness_at_plus", 0), ("stiffness_at_minus", 1)):
        loaded = numbers[numbers["number"] == number]
        both = loaded.rename(columns={name: f"loaded{end}" for name, end in ENDS.items()})
        sides = [TOWARDS[name][side] for name in both["coordinate"]]
        found.append(both.assign(side=sides).merge(rest, on=keys))
    rows = pd.concat(found, ignore_index=True)
    means = rows[(rows["specimen"] == EVERY[0]) & (rows["model"] == MODELS[1])]
    means = means[(means["loaded"] > 0.0) & (means["rest"] > 0.0)]
    if means.empty:
        return means
    change = np.abs(np.log((means["loaded"] / means["rest"]).to_numpy(float)))
    best = means.iloc[int(change.argmax())]
    keys = ["joint", "coordinate", "side"]
    same = means[means["coordinate"] == best["coordinate"]]
    alike = same["loaded"].round(6) == round(best["loaded"], 6)
    joints = same[alike & (same["side"] == best["side"])]
    sides = same[alike & (same["joint"] == best["joint"])]
    chosen = rows[(rows[keys] == best[keys]).all(axis=1)]
    every = len(joints) > 1 and len(joints) == same["joint"].nunique()
    told = motion_of(best["coordinate"]) if len(sides) > 1 else best["side"]
    return chosen.assign(every=every, side=told)
