"""Errors of fitted and of held-out motion, one number per specimen."""

import pandas as pd

from spinepipe.report.stage_errors import of_joint_fits
from spinepipe.tables.specimen_errors import specimen_rms

KEYS = ["stage", "representation", "specimen"]


def rotation_errors(errors: pd.DataFrame) -> pd.DataFrame:
    """Root mean square error over all readings of rotations, column ``error``, deg, by ``KEYS``.

    Of held-out load cases each is predicted by the fit that left it out; all else is of fits to
    all load cases. A specimen without an error for all that was measured of it is left out.
    """
    found = {
        (stage, name): values
        for stage in errors["stage"].unique()
        for name, rows in of_joint_fits(errors, stage).groupby("representation", sort=False)
        if len(values := specimen_rms(rows, errors))
    }
    if not found:
        return pd.DataFrame(columns=[*KEYS, "error"])
    return pd.concat(found, names=KEYS).rename("error").reset_index()
