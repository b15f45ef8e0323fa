"""Errors of fitted and of held-out motion, one number per specimen."""

import numpy as np
import pandas as pd

from spinepipe.report.cohort.chosen import fitted_to_most, without_one_case
from spinepipe.units import ROTATIONS

KEYS = ["stage", "representation", "specimen"]
_READING = ["test", "joint", "coordinate"]


def rotation_errors(errors: pd.DataFrame) -> pd.DataFrame:
    """Root mean square error over all readings of rotations, degrees, by ``KEYS``.

    Of held-out load cases each is predicted by the fit that left it out; all else is of fits to
    all load cases. A specimen without an error for all that was measured of it is left out: it
    would be compared over other readings.
    """
    rows = errors[errors["coordinate"].isin(ROTATIONS)]
    whole, left_out = fitted_to_most(errors), without_one_case(errors)
    of_case, published = rows["stage"] == "left_out_case", rows["stage"] == "literature"
    kept = np.where(of_case, rows["fitted_to"].isin(left_out), rows["fitted_to"] == whole)
    chosen = rows[(kept | published.to_numpy(bool)) & rows["rmse"].notna()].copy()
    chosen["squares"] = chosen["readings"] * chosen["rmse"].astype(float) ** 2
    sums = chosen.groupby(KEYS, as_index=False).agg(
        squares=("squares", "sum"), readings=("readings", "sum"), known=("rmse", "size")
    )
    measured = rows.drop_duplicates(["specimen", *_READING])["specimen"].value_counts()
    complete = sums["known"] == sums["specimen"].map(measured)
    return sums[complete].assign(error=np.sqrt(sums["squares"] / sums["readings"]))
