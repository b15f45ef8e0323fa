"""Absolute errors of simulations, one number per run, joint and coordinate: what is tested."""

from collections.abc import Sequence

import numpy as np
import pandas as pd

from spinepipe.units import COORDINATE_COLUMNS, COORDINATES

UNITS = {
    name: column.rsplit("_", 1)[1]
    for name, column in zip(COORDINATES, COORDINATE_COLUMNS, strict=True)
}
"""``mm`` or ``deg`` of each coordinate."""


def readings(rows: pd.DataFrame, zeroed_at_step_0: bool) -> pd.DataFrame:
    """Rows that are readings: where motion is zeroed at step 0, that step's zeros are none."""
    return rows[rows["step"] > 0] if zeroed_at_step_0 else rows


def absolute_error(simulations: pd.DataFrame) -> pd.DataFrame:
    """Mean absolute error over readings, one row per specimen, pose, stiffness and joint.

    One column per coordinate, mm or deg; NaN where not measured or without a pose. A run of which
    one step has no pose has no error at all: a mean over fewer steps would not compare.
    """
    keys = ["specimen", "pose", "stiffness", "joint"]
    columns = [f"error_{name}" for name in COORDINATE_COLUMNS]
    errors = simulations[columns].abs().set_axis(list(COORDINATES), axis=1)
    measured = simulations[[f"measured_{name}" for name in COORDINATE_COLUMNS]].notna().to_numpy()
    lost = pd.DataFrame(measured & errors.isna().to_numpy(), columns=list(COORDINATES))
    by = [simulations[key].reset_index(drop=True) for key in keys]
    mean = errors.reset_index(drop=True).groupby(by, sort=False).mean()
    complete = ~lost.groupby(by, sort=False).any()
    return mean.where(complete).reset_index()


def measured_size(simulations: pd.DataFrame) -> pd.DataFrame:
    """Mean absolute measured motion, rows and columns as `absolute_error`."""
    keys = ["specimen", "pose", "stiffness", "joint"]
    columns = [f"measured_{name}" for name in COORDINATE_COLUMNS]
    sizes = simulations[columns].abs().set_axis(list(COORDINATES), axis=1)
    by = [simulations[key] for key in keys]
    return sizes.groupby(by, sort=False).mean().reset_index()


def measured_coordinates(errors: pd.DataFrame) -> list[tuple[str, str]]:
    """(joint, coordinate) of which any run has an error, in the order of joints."""
    joints: Sequence[str] = list(dict.fromkeys(errors["joint"]))
    return [
        (joint, name)
        for joint in joints
        for name in COORDINATES
        if np.isfinite(errors.loc[errors["joint"] == joint, name].to_numpy(float)).any()
    ]
