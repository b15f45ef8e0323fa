"""The two-factor grid: one error for every joint pose (rows) and best stiffness set (columns)."""

import pandas as pd


def complete_grid(errors: pd.DataFrame, joint: str, coordinate: str) -> pd.DataFrame:
    """Errors of one specimen, joint and coordinate; rows by pose, columns by stiffness set.

    Stiffness sets without any result and poses that lack a run are left out: what is compared
    must be complete.

    Parameters
    ----------
    errors : as `spinepipe.jobs.errors.absolute_error` gives them.
    """
    rows = errors[(errors["joint"] == joint) & (errors["stiffness"] != "calibrated")]
    grid = rows.pivot(index="pose", columns="stiffness", values=coordinate)
    return grid.dropna(axis="columns", how="all").dropna(axis="index")
