"""Absolute errors of simulations, one number per run, joint and coordinate: what is tested.

Job: agreement of predicted with measured motion after Bland and Altman.

The two-factor grid: one error for every joint pose (rows) and best stiffness set (columns).
"""

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
import pandas as pd

from spinepipe.jobs.digest import provenance
from spinepipe.statistics import Agreement, bland_altman
from spinepipe.studies.joint_pose_sensitivity.inputs import study_and_cohort
from spinepipe.studies.joint_pose_sensitivity.tables import AGREEMENT
from spinepipe.tables import from_rows, read_frames, write
from spinepipe.units import COORDINATE_COLUMNS, COORDINATES, has_reading

UNITS = {
    name: column.rsplit("_", 1)[1]
    for name, column in zip(COORDINATES, COORDINATE_COLUMNS, strict=True)
}
"""``mm`` or ``deg`` of each coordinate."""


def readings(rows: pd.DataFrame, zeroed_at_step_0: bool) -> pd.DataFrame:
    """Rows that are readings: where motion is zeroed at step 0, that step's zeros are none."""
    return rows[has_reading(rows["step"], zeroed_at_step_0)]


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


_NUMBERS = (
    *("n", "bias", "bias_low", "bias_high", "sd", "lower_limit", "upper_limit"),
    *("lower_limit_low", "upper_limit_high", "message"),
)


def run(root: str, study: str, tables: list[str], output: str) -> None:
    """Write ``agreement.parquet`` from the poses' own fits."""
    settings, cohort = study_and_cohort(root, study)
    frames = read_frames(tables)
    simulations = frames["simulations"]
    own = readings(simulations[simulations["stiffness"] == "calibrated"], cohort.zeroed_at_step_0)
    kept = frames["success"].loc[frames["success"]["reduced"], ["specimen", "pose"]]
    datasets = {"all": own, "reduced": own.merge(kept, on=["specimen", "pose"])}
    rows = [
        {"dataset": dataset, "specimen": specimen, "joint": joint, **row}
        for dataset, chosen in datasets.items()
        for (specimen, joint), part in chosen.groupby(["specimen", "joint"], sort=False)
        for row in _coordinates(part)
    ]
    write(from_rows(AGREEMENT, rows), output, provenance("agreement", settings, cohort))


def _coordinates(part: pd.DataFrame) -> Iterator[dict[str, Any]]:
    """One row per measured coordinate of a joint; runs without a pose are left out."""
    for name, unit in UNITS.items():
        pair = part[[f"measured_{name}_{unit}", f"predicted_{name}_{unit}"]]
        if not pair.iloc[:, 0].notna().any():
            continue
        known = pair.dropna().to_numpy(float)
        found = bland_altman(known[:, 0], known[:, 1])
        yield {"coordinate": name, "unit": unit, **_row(found)}


def _row(found: Agreement) -> dict[str, Any]:
    return {
        **{name: getattr(found, name) for name in _NUMBERS},
        "proportional_rho": found.proportional.effect,
        "proportional_p": found.proportional.p,
        "status": found.status.value,
    }


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
