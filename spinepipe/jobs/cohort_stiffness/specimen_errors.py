"""One error per specimen: root mean square over its tests, joints and rotations."""

import numpy as np
import pandas as pd

from spinepipe.units import ROTATIONS

READING = ["test", "joint", "coordinate"]


def rotations(errors: pd.DataFrame) -> pd.DataFrame:
    """The rows of rotations."""
    return errors[errors["coordinate"].isin(ROTATIONS)]


def specimen_rms(chosen: pd.DataFrame, errors: pd.DataFrame) -> pd.Series:
    """Root mean square error in deg by specimen, weighted by readings.

    Only of specimens with an error for all that was measured of them: others would be compared
    over other readings.

    Parameters
    ----------
    chosen : errors of one stiffness per specimen. errors : all, for what was measured.
    """
    measured = rotations(errors).drop_duplicates(["specimen", *READING])["specimen"].value_counts()
    known = rotations(chosen).dropna(subset="rmse")
    known = known[known["readings"] > 0]
    squares = (known["rmse"] ** 2 * known["readings"]).groupby(known["specimen"]).sum()
    by_specimen = known.groupby("specimen")["readings"]
    complete = by_specimen.size() == measured.reindex(squares.index)
    return (squares / by_specimen.sum())[complete].map(np.sqrt)
