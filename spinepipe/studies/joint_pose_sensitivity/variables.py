"""What statistics are made of: errors of runs, their two-factor grid, and poses as factors."""

from collections.abc import Callable, Mapping

import numpy as np
import pandas as pd

from spinepipe.units import COORDINATE_COLUMNS, COORDINATES, ROTATIONS, TRANSLATIONS, has_reading

ORIGIN_DISTANCE = "origin_distance"
_AXES: Mapping[str, str] = {
    **{f"{axis}_mm": f"{name}_origin" for axis, name in zip("xyz", TRANSLATIONS, strict=True)},
    **{f"{name}_deg": f"{name}_orientation" for name in ROTATIONS},
}


def readings(rows: pd.DataFrame, zeroed_at_step_0: bool) -> pd.DataFrame:
    """Rows that are readings: where motion is zeroed at step 0, that step's zeros are none."""
    return rows[has_reading(rows["step"], zeroed_at_step_0)]


_RUN = ["specimen", "pose", "stiffness", "joint"]


def absolute_error(simulations: pd.DataFrame) -> pd.DataFrame:
    """Mean absolute error over readings, one row per specimen, pose, stiffness and joint.

    One column per coordinate, mm or deg; NaN where not measured or without a pose. A run of which
    one step has no pose has no error at all: a mean over fewer steps would not compare.
    """
    return _mean_error(simulations, pd.DataFrame.abs)


def signed_error(simulations: pd.DataFrame) -> pd.DataFrame:
    """Mean error along the measured motion; rows and columns as `absolute_error`.

    Above zero a joint moves too far. Which way it is measured to move is that of its mean over
    all poses in each test, or errors under opposite loads would cancel.
    """
    columns = [f"measured_{name}" for name in COORDINATE_COLUMNS]
    by = [simulations[key] for key in ("specimen", "test", "joint")]
    way = np.sign(simulations[columns].groupby(by).transform("mean").to_numpy(float))
    return _mean_error(simulations, lambda errors: errors * way)


def _mean_error(
    simulations: pd.DataFrame, sized: Callable[[pd.DataFrame], pd.DataFrame]
) -> pd.DataFrame:
    columns = [f"error_{name}" for name in COORDINATE_COLUMNS]
    errors = sized(simulations[columns]).set_axis(list(COORDINATES), axis=1)
    measured = simulations[[f"measured_{name}" for name in COORDINATE_COLUMNS]].notna().to_numpy()
    lost = pd.DataFrame(measured & errors.isna().to_numpy(), columns=list(COORDINATES))
    by = [simulations[key].reset_index(drop=True) for key in _RUN]
    mean = errors.reset_index(drop=True).groupby(by, sort=False).mean()
    # a coordinate that was measured in a step without a pose has no mean
    complete = ~lost.groupby(by, sort=False).any()
    return mean.where(complete).reset_index()


def measured_size(simulations: pd.DataFrame) -> pd.DataFrame:
    """Mean absolute measured motion, rows and columns as `absolute_error`."""
    columns = [f"measured_{name}" for name in COORDINATE_COLUMNS]
    sizes = simulations[columns].abs().set_axis(list(COORDINATES), axis=1)
    return sizes.groupby([simulations[key] for key in _RUN], sort=False).mean().reset_index()


def measured_coordinates(errors: pd.DataFrame) -> list[tuple[str, str]]:
    """(joint, coordinate) of which any run has an error, in the order of joints."""
    return [
        (joint, name)
        for joint in dict.fromkeys(errors["joint"])
        for name in COORDINATES
        if np.isfinite(errors.loc[errors["joint"] == joint, name].to_numpy(float)).any()
    ]


def complete_grid(errors: pd.DataFrame, joint: str, coordinate: str) -> pd.DataFrame:
    """Errors of one specimen, joint and coordinate; rows by pose, columns by stiffness set.

    Stiffness sets without any result and poses that lack a run are left out: what is compared
    must be complete.

    Parameters
    ----------
    errors : as `absolute_error` gives them.
    """
    rows = errors[(errors["joint"] == joint) & (errors["stiffness"] != "calibrated")]
    grid = rows.pivot(index="pose", columns="stiffness", values=coordinate)
    return grid.dropna(axis="columns", how="all").dropna(axis="index")


def pose_parameters(poses: pd.DataFrame) -> pd.DataFrame:
    """All parameters of the poses of one specimen: a row per pose, six columns per joint.

    Columns such as ``L2L3_anterior_origin`` (mm) and ``L2L3_extension_orientation`` (deg).
    """
    named = poses.rename(columns=dict(_AXES))
    wide = named.pivot(index="pose", columns="joint", values=list(_AXES.values()))
    order = [(name, joint) for joint in dict.fromkeys(poses["joint"]) for name in _AXES.values()]
    return wide[order].set_axis([f"{joint}_{name}" for name, joint in order], axis=1)


def pose_factors(poses: pd.DataFrame) -> pd.DataFrame:
    """The published description of the poses of one specimen: four columns, a row per pose.

    Angles (deg) averaged over the joints, and the distance (mm) of the joint origins from their
    mean over these poses, averaged over the joints (Gould 2024a, section 2.4.4).
    """
    origin = poses[["x_mm", "y_mm", "z_mm"]]
    off = (origin - origin.groupby(poses["joint"]).transform("mean")).to_numpy(float)
    columns = {f"{name}_orientation": poses[f"{name}_deg"].to_numpy(float) for name in ROTATIONS}
    columns[ORIGIN_DISTANCE] = np.linalg.norm(off, axis=1)
    found = pd.DataFrame(columns).groupby(poses["pose"].to_numpy()).mean()
    return found.rename_axis("pose")
