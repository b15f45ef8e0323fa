"""Rows of a run by the paper's names of models and stages."""

from typing import Any

import numpy as np
import pandas as pd

from spinepipe.comparison.gould_2024b.paper import LITERATURE, LOADED
from spinepipe.comparison.run import NotComputed, Run
from spinepipe.tables.specimen_errors import largest_mean_motion


def of_stage(model: str, stage: str, test: str) -> dict[str, str]:
    """Keys of the stiffness that a model has at a stage; fitted to one load case, as published."""
    if stage == "literature":
        return {"representation": LITERATURE[model], "fitted_to": "nothing", "source": "literature"}
    source = {"fitted": "own", "left_out_specimen": "others_median"}[stage]
    return {"representation": model, "fitted_to": test, "source": source}


def stiffness(run: Run, model: str, test: str, coordinate: str) -> pd.DataFrame:
    """Fitted stiffness, one row per specimen and joint; at least one."""
    where = of_stage(model, "fitted", test)
    rows = run.rows("stiffness", **where, coordinate=coordinate).dropna(subset=["stiffness"])
    if rows.empty:
        raise NotComputed("no fit ended with a stiffness")
    return rows


def errors(run: Run, model: str, stage: str, test: str, coordinate: str = "") -> pd.DataFrame:
    """Errors at the largest load, one row per specimen and joint, in the loaded coordinate.

    Parameters
    ----------
    coordinate : another coordinate instead of the loaded one.
    """
    where = of_stage(model, stage, test)
    seen = run.rows("errors", **where, test=test, coordinate=coordinate or LOADED[test])
    seen = seen.dropna(subset=["peak_error", "measured_peak"])
    if seen.empty:
        raise NotComputed("no motion was predicted")
    return seen


def over_prediction(seen: pd.DataFrame) -> "pd.Series[Any]":
    """How much larger the predicted motion is than the measured one, deg."""
    return predicted(seen) - seen["measured_peak"].abs()


def predicted(seen: pd.DataFrame) -> "pd.Series[Any]":
    """Size of the predicted motion at the largest load, deg."""
    return (seen["peak_error"] + seen["measured_peak"]).abs()


def rms(seen: pd.DataFrame, by: str) -> "pd.Series[Any]":
    """Root mean square error at the largest load within each group, deg."""
    return seen["peak_error"].pow(2).groupby(seen[by]).mean().pow(0.5)


def whole_rms(seen: pd.DataFrame) -> float:
    """Root mean square error at the largest load over all rows, deg."""
    return float(np.sqrt(np.mean(seen["peak_error"].to_numpy(dtype=float) ** 2)))


def largest_motion(seen: pd.DataFrame) -> float:
    """Largest over specimens of the mean measured motion over joints, deg."""
    largest = largest_mean_motion(seen)
    assert largest is not None  # `errors` has no empty ones
    return largest
