"""The published filters of fits: what has not moved, and what has moved too far."""

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from spinepipe.status import USABLE
from spinepipe.studies.joint_pose_sensitivity.inputs import start_stiffness
from spinepipe.studies.joint_pose_sensitivity.settings import JointPoseSensitivity
from spinepipe.units import COORDINATES, STIFFNESS_COLUMNS

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]
_ROUNDING = 1e-12


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
    rows["solved"] = fits["status"].isin(USABLE).to_numpy()
    rows["near_start_any"], rows["near_start_all"] = near.any(axis=1), near.all(axis=1)
    rows["outlier"] = above.any(axis=1)
    how = {"solved": "all", "near_start_any": "any", "near_start_all": "all", "outlier": "any"}
    judged = rows.groupby(keys, sort=False).agg(how).reset_index()
    judged["failed"] = judged["solved"] & judged[f"near_start_{rule.failed_when}"]
    judged["reduced"] = judged["solved"] & ~judged["failed"] & ~judged["outlier"]
    return judged


def near_start(values: Array, start: Array, percent: float) -> Flags:
    """(n, k) whether values (n, k) differ from their start (k,) or (n, k) by at most that share.

    Gould 2024a, section 2.5: a stiffness within 1 % of its start has not been optimised. A value
    that is exactly that far still counts as near; NaN, no value, is not near.
    """
    limit = np.abs(start) * (percent / 100.0) * (1.0 + _ROUNDING)
    return np.abs(values - start) <= limit


def above_start(values: Array, start: Array, times: float) -> Flags:
    """(n, k) whether values (n, k) reach that many times their start (k,) or (n, k).

    Gould 2024a, section 2.5: an order of magnitude above the start is an outlier. NaN is none.
    """
    return values >= times * start
