"""Errors of models against films, by patient and model: what comparisons of models begin with."""

from collections.abc import Iterable, Iterator, Sequence
from typing import Any

import numpy as np
import pandas as pd

from spinepipe.studies.scoliosis.tables import GROUPS, MEASURES

REFERENCE = "linear_regions"
"""The model that Jalalian 2017 compares with."""

_OF_FILMS = {"place": "place_rmse_mm", "tilt": "tilt_rmse_deg"}
"""Column of `positions`; films have equally many vertebrae but for those that were not read, so
mean squares may be averaged."""


def of_group(rows: pd.DataFrame, group: str) -> pd.DataFrame:
    """The rows of the fitted, or of the held-out films."""
    return rows[rows["fitted"].astype(bool) == (group == "fitted")]


def squares(
    measure: str, positions: pd.DataFrame, displacements: pd.DataFrame, curves: pd.DataFrame
) -> pd.DataFrame:
    """Squared errors of a measure beside ``specimen`` and ``model``; NaN where there is no pose.

    Of what was read on the films.
    """
    if measure == "rotation":
        rows = displacements.dropna(subset=["measured_deg"])
        error = of_rotations(rows)
    elif measure in _OF_FILMS:
        rows, error = positions, positions[_OF_FILMS[measure]]
    else:
        rows = curves.dropna(subset=[f"{measure}_measured_deg"])
        error = rows[f"{measure}_simulated_deg"] - rows[f"{measure}_measured_deg"]
    return rows[["specimen", "model"]].assign(square=error.astype(float) ** 2)


def errors_by_measure(
    positions: pd.DataFrame,
    displacements: pd.DataFrame,
    curves: pd.DataFrame,
    measures: Iterable[str] = MEASURES,
) -> Iterator[tuple[str, str, pd.DataFrame]]:
    """Group of films, measure and its `squares`, for every group and measure."""
    for group in GROUPS:
        chosen = [of_group(one, group) for one in (positions, displacements, curves)]
        for measure in measures:
            yield group, measure, squares(measure, *chosen)


def of_rotations(displacements: pd.DataFrame) -> "pd.Series[Any]":
    """Simulated less measured rotation, deg; NaN where there is no pose."""
    error: pd.Series[Any] = displacements["simulated_deg"] - displacements["measured_deg"]
    return error.astype(float)


def mean_squares(errors: pd.DataFrame) -> pd.DataFrame:
    """Mean ``square`` and number ``n`` of errors of each ``specimen`` and ``model``.

    Without patients that lack a pose on one of a model's films.
    """
    each = errors.groupby(["specimen", "model"], sort=False)["square"]
    found = each.agg(square="mean", known="count", n="size").reset_index()
    return found[found["known"] == found["n"]]


def by_patient(errors: pd.DataFrame) -> pd.DataFrame:
    """Root mean square errors, a row per patient and a column per model; NaN where one is missing.

    A patient without a pose on one of the films has none in that model.
    """
    means = mean_squares(errors).set_index(["specimen", "model"])["square"]
    found: pd.DataFrame = np.sqrt(means).unstack("model")
    return found.reindex(index=errors["specimen"].unique(), columns=errors["model"].unique())


def with_reduction(rows: Sequence[dict[str, Any]], error: str) -> Iterator[dict[str, Any]]:
    """Rows, one per model, with the percentage by which an error is less than the reference's."""
    other = next((row[error] for row in rows if row["model"] == REFERENCE), None)
    for row in rows:
        known = other and row[error] is not None
        yield row | {"reduction_percent": 100.0 * (1.0 - row[error] / other) if known else None}


def reading_floor(accuracy: pd.DataFrame, measure: str) -> float:
    """Error in a measure that reading films alone makes; NaN where nobody knows."""
    known = accuracy.loc[accuracy["measure"] == measure, "reading_noise"].dropna()
    return float(known.iloc[0]) if len(known) else np.nan


def held_out_error(positions: pd.DataFrame) -> pd.Series:
    """Error of rotations by patient (deg), the models together, smallest first.

    On the films that took no part in fitting; on the others where there are no such films, or no
    pose on them.
    """
    named = ["specimen", "model"]
    for rows in (positions[~positions["fitted"]], positions[positions["fitted"]]):
        squares = rows[named].assign(square=rows["rotation_rmse_deg"].astype(float) ** 2)
        found = np.sqrt(squares.dropna().groupby("specimen", sort=False)["square"].mean())
        if len(found):
            return found.sort_values(kind="stable")
    return pd.Series(dtype=float)
