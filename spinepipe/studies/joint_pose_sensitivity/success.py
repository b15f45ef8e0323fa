"""Job: which fits the study's filters keep."""

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from spinepipe.jobs.inputs import start_stiffness, study_and_cohort
from spinepipe.jobs.provenance import provenance
from spinepipe.sensitivity.success import above_start, near_start
from spinepipe.statics import Status
from spinepipe.studies import JointPoseSensitivity
from spinepipe.tables import SUCCESS, from_rows, read_frame, write
from spinepipe.units import COORDINATES, STIFFNESS_COLUMNS


def run(root: str, study: str, calibrations: str, output: str) -> None:
    """Write ``success.parquet``."""
    settings, cohort = study_and_cohort(root, study)
    judged = judge_poses(settings, read_frame(calibrations))
    table = from_rows(SUCCESS, judged.to_dict("records"))
    write(table, output, provenance("success", settings, cohort))


def judge_poses(settings: JointPoseSensitivity, calibrations: pd.DataFrame) -> pd.DataFrame:
    """One row per specimen and pose with the flags of the success table."""
    start = np.broadcast_to(start_stiffness(settings), (len(calibrations), 6))
    return _judged(settings, calibrations, start, ["specimen", "pose"])


def judge_bootstrap(settings: JointPoseSensitivity, bootstrap: pd.DataFrame) -> pd.DataFrame:
    """One row per bootstrap fit with the flags of the success table."""
    start = bootstrap[[f"start_{name}" for name in STIFFNESS_COLUMNS]].to_numpy(float)
    return _judged(settings, bootstrap, start, ["specimen", "bootstrap", "loading", "set"])


def _judged(
    settings: JointPoseSensitivity,
    fits: pd.DataFrame,
    start: NDArray[np.float64],
    keys: list[str],
) -> pd.DataFrame:
    """Flags of every fit; where stiffness is per joint, over all rows of the fit."""
    rule = settings.success
    free = [COORDINATES.index(name) for name in settings.calibration.free]
    values = fits[[STIFFNESS_COLUMNS[index] for index in free]].to_numpy(float)
    near = pd.DataFrame(near_start(values, start[:, free], rule.near_start_percent))
    above = pd.DataFrame(above_start(values, start[:, free], rule.outlier_times_start))
    rows = fits[keys].reset_index(drop=True)
    rows["solved"] = fits["status"].isin([s.value for s in Status if s.usable]).to_numpy()
    rows["near_start_any"], rows["near_start_all"] = near.any(axis=1), near.all(axis=1)
    rows["outlier"] = above.any(axis=1)
    how = {"solved": "all", "near_start_any": "any", "near_start_all": "all", "outlier": "any"}
    judged = rows.groupby(keys, sort=False).agg(how).reset_index()
    judged["failed"] = judged["solved"] & judged[f"near_start_{rule.failed_when}"]
    judged["reduced"] = judged["solved"] & ~judged["failed"] & ~judged["outlier"]
    return judged
