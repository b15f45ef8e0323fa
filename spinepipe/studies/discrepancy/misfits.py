"""Misfits as values of sentences, and where they are largest.

Misfit is the root of chi2 / dof - 1 (the column ``gap`` of results), in SDs of the noise.
"""

from dataclasses import replace

import numpy as np
import pandas as pd

from spinepipe.report.conclusions import Value
from spinepipe.report.words import level, plain
from spinepipe.studies.discrepancy.curve_rows import driven_coordinates
from spinepipe.studies.discrepancy.settings import Discrepancy
from spinepipe.studies.discrepancy.tables import MODELS
from spinepipe.studies.discrepancy.verdict import EVERY, Verdict, share_of_gap
from spinepipe.studies.discrepancy.words import in_words, motion_of, name_at

BASE, WITH_EFFECTS = MODELS
NOISE = "× noise"

SMALL, LARGE = 1.0 / 3.0, 3.0
"""In SDs of the noise: less than the first is no matter; above the other the model has the wrong
form, and no name is certain.
"""

MOST_WORDS = 6
"""Of the names of effects in a sentence."""

LIKELIEST = "the likeliest of them"


def model_name(study: Discrepancy) -> str:
    """What the base is called."""
    return "linear model" if study.base.model is None else "base model"


def misfit(where: pd.DataFrame, model: str) -> Value | None:
    """Over all readings, with its interval; None where the model has no pose.

    Parameters
    ----------
    where : here and below, rows of the table of that name.
    """
    if where.empty:
        return None
    rows = where[(where["by"] == "all") & (where["model"] == model) & where["gap"].notna()]
    return None if rows.empty else sized(rows.iloc[0])


def largest(rows: pd.DataFrame, sizes: pd.Series) -> pd.Series:
    """The row with the largest of these sizes."""
    return rows.iloc[int(np.nanargmax(sizes.to_numpy(float)))]


def sized(row: pd.Series) -> Value:
    """That of one row."""
    how = f"where: gap by {row['by']}, {row['model']}"
    ends = float(row["gap_low"]), float(row["gap_high"])
    return Value(float(row["gap"]), NOISE, *ends, int(row["readings"]), how)


def bare(value: Value) -> Value:
    """Without its interval: where a sentence compares two."""
    return replace(value, low=None, high=None)


def change_of_misfit(closed: float) -> float:
    """Change of the misfit in %, where this share of the excess chi2 is taken away."""
    return -100.0 * share_of_gap(min(closed, 1.0))


def place_of_most(
    where: pd.DataFrame, gap: pd.DataFrame, model: str
) -> tuple[str, str, Value | None]:
    """Motion, joint and size of the largest misfit that is above the noise.

    The test is told with the motion where none of its loads drives that motion. Where no single
    place is above the noise, all joints together.

    Parameters
    ----------
    gap : rows of the table of that name.
    """
    rows = where[(where["model"] == model) & where["gap"].notna()] if len(where) else where
    if rows.empty:
        return "", "", None
    single = rows[(rows["by"] == "joint x coordinate x test") & (rows["gap_low"] > 0.0)]
    single = single if len(single) else rows[rows["by"] == "coordinate"]
    single = single if len(single) else rows
    row = largest(single, single["gap"])
    motion = motion_of(row["coordinate"]) if row["coordinate"] != EVERY[0] else "all motions"
    driven = driven_coordinates(gap) if len(gap) else {}
    if driven.get((row["test"], row["joint"]), row["coordinate"]) != row["coordinate"]:
        motion += f" during {plain(row['test'])}"
    joint = "all joints" if row["joint"] == EVERY[0] else level(row["joint"])
    return motion, joint, sized(row)


def stands_for(verdict: Verdict) -> str:
    """What the model with effects has that the base has not, by name; empty where nothing."""
    if verdict.effects:
        names = (name_at(one.name, one.scope.coordinates) for one in verdict.effects)
        return in_words([list(dict.fromkeys(names))], MOST_WORDS) or "the named effects"
    return LIKELIEST if verdict.candidates_in_set else ""
