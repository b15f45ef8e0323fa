"""Errors of models against films, by patient: what tables, figures and tests pool.

A patient counts in a group of films when the model has a pose on every one of them.
"""

import numpy as np
import pandas as pd


def square_errors(
    measure: str, positions: pd.DataFrame, displacements: pd.DataFrame, curves: pd.DataFrame
) -> pd.DataFrame:
    """Columns specimen, model and square (mm2 or deg2); of a pose that is not there NaN.

    Parameters
    ----------
    measure : one of `tables.MEASURES`.
    positions, displacements, curves : rows of these tables, of one group of films.
    """
    if measure == "rotation":
        error, rows = displacements["simulated_deg"] - displacements["measured_deg"], displacements
    elif measure in ("ferguson", "cobb"):
        error = curves[f"{measure}_simulated_deg"] - curves[f"{measure}_measured_deg"]
        rows = curves
    else:
        name = {"place": "place_rmse_mm", "tilt": "tilt_rmse_deg"}[measure]
        error, rows = positions[name], positions
    return rows[["specimen", "model"]].assign(square=error.astype(float) ** 2)


def of_whole_patients(squares: pd.DataFrame) -> pd.DataFrame:
    """The rows of one model and of the patients that have a pose on every film."""
    whole = squares["square"].notna().groupby(squares["specimen"], sort=False).all()
    return squares[squares["specimen"].isin(list(whole.index[whole]))]


def rmse_of_patients(squares: pd.DataFrame) -> pd.Series:
    """Root mean square error of each whole patient, by specimen; of one model."""
    means = of_whole_patients(squares).groupby("specimen", sort=False)["square"].mean()
    found: pd.Series = np.sqrt(means)
    return found


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
