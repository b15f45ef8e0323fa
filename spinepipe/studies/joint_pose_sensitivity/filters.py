"""Which fits count: what the published filters keep of them, best first.

A fit that has not moved from its start has failed, one that has moved too far is an outlier
(Gould 2024a, section 2.5); what is left is the reduced dataset.
"""

from typing import Any

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
"""Of the limit: a value that is exactly so far from its start still counts as near."""


def judge_poses(settings: JointPoseSensitivity, calibrations: pd.DataFrame) -> pd.DataFrame:
    """One row per specimen and pose with the flags of the success table."""
    start = np.broadcast_to(start_stiffness(settings), (len(calibrations), 6))
    return _judged(settings, calibrations, start, ["specimen", "pose"])


def judge_bootstrap(settings: JointPoseSensitivity, bootstrap: pd.DataFrame) -> pd.DataFrame:
    """One row per bootstrap fit with the flags of the success table."""
    start = bootstrap[[f"start_{name}" for name in STIFFNESS_COLUMNS]].to_numpy(float)
    return _judged(settings, bootstrap, start, ["specimen", "bootstrap", "loading", "set"])


def _judged(
    settings: JointPoseSensitivity, fits: pd.DataFrame, start: Array, keys: list[str]
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

    NaN, no value, is not near.
    """
    limit = np.abs(start) * (percent / 100.0) * (1.0 + _ROUNDING)
    return np.abs(values - start) <= limit


def above_start(values: Array, start: Array, times: float) -> Flags:
    """(n, k) whether values (n, k) reach that many times their start (k,) or (n, k); NaN does not.

    In the paper an order of magnitude.
    """
    return values >= times * start


def rank_fits(settings: JointPoseSensitivity, calibrations: pd.DataFrame) -> list[dict[str, Any]]:
    """The stiffness sets of the reduced dataset of a specimen, least cost first.

    Each with its name, the pose it comes from, cost, and stiffness (J or 1, 6) SI.

    Parameters
    ----------
    calibrations : rows of the table, of this specimen alone.
    """
    judged = judge_poses(settings, calibrations)
    reduced = calibrations[calibrations["pose"].isin(judged.loc[judged["reduced"], "pose"])]
    costs = reduced.groupby("pose")["cost"].first().sort_values(kind="stable")
    return [
        {
            "name": f"best{rank:02d}",
            "pose": int(pose),
            "cost": float(costs[pose]),
            "stiffness": reduced.loc[reduced["pose"] == pose, list(STIFFNESS_COLUMNS)]
            .to_numpy(float)
            .tolist(),
        }
        for rank, pose in enumerate(costs.index, start=1)
    ]
