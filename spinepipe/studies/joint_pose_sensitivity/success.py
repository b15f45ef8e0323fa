"""Job: which fits the study's filters keep.

The published filters of fits: what has not moved, and what has moved too far.

Job: how many fits each filter of the study takes.

Job: what each way of fitting makes of the same poses.
"""

from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from statsmodels.stats.proportion import proportion_confint

from spinepipe.jobs.digest import provenance
from spinepipe.status import Status
from spinepipe.studies.joint_pose_sensitivity.inputs import start_stiffness, study_and_cohort
from spinepipe.studies.joint_pose_sensitivity.settings import JointPoseSensitivity
from spinepipe.studies.joint_pose_sensitivity.tables_of_fits import (
    COUNTS,
    SUCCESS,
    SUCCESS_BY_METHOD,
)
from spinepipe.tables import from_rows, read_frames, write
from spinepipe.units import COORDINATES, STIFFNESS_COLUMNS

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

_ROUNDING = 1e-12


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


def success(root: str, study: str, tables: list[str], output: str) -> None:
    """Write ``success.parquet`` from ``calibrations``."""
    settings, cohort = study_and_cohort(root, study)
    judged = judge_poses(settings, read_frames(tables)["calibrations"])
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


FLAGS = ("solved", "near_start_any", "near_start_all", "outlier", "reduced")


def counts(root: str, study: str, tables: list[str], output: str) -> None:
    """Write ``counts.parquet`` from ``success`` and, where there is one, ``bootstrap``."""
    settings, cohort = study_and_cohort(root, study)
    frames = read_frames(tables)
    parts = [("poses", frames["success"].assign(loading="equilibrium"))]
    if "bootstrap" in frames:
        fits = judge_bootstrap(settings, frames["bootstrap"]).groupby("bootstrap", sort=False)
        parts += [(f"{name}_bootstrap", rows) for name, rows in fits]
    rows = [row for part in parts for row in _counts(*part)]
    write(from_rows(COUNTS, rows), output, provenance("counts", settings, cohort))


def _counts(part: str, judged: pd.DataFrame) -> list[dict[str, Any]]:
    rows = []
    for (specimen, loading), fits in judged.groupby(["specimen", "loading"], sort=False):
        taken = {flag: int(fits[flag].sum()) for flag in FLAGS}
        taken["outliers"] = taken.pop("outlier")
        key = {"specimen": specimen, "part": part, "loading": loading}
        rows.append({**key, "fits": len(fits), **taken})
    return rows


ARRIVED = 1.01
"""A fit has arrived when its cost is at most this many times the least found for its pose."""

NOTHING = 1e-6
"""Cost (mm2, deg2) below which all fits are exact, and count as equal."""


def success_by_method(root: str, study: str, tables: list[str], output: str) -> None:
    """Write ``success_by_method.parquet`` from ``method_fits``."""
    settings, cohort = study_and_cohort(root, study)
    rows = count_by_method(read_frames(tables)["method_fits"], settings.success.failed_when)
    table = from_rows(SUCCESS_BY_METHOD, rows)
    write(table, output, provenance("success_by_method", settings, cohort))


def count_by_method(fits: pd.DataFrame, failed_when: str) -> list[dict[str, Any]]:
    """One row per specimen and method; refused fits count as tried and not successful.

    Parameters
    ----------
    failed_when : ``all`` or ``any`` of the free stiffnesses near their start make a failed fit.
    """
    fits = fits.copy()
    fits["cost"] = fits["cost"].astype(float)
    least = fits.groupby(["specimen", "pose"])["cost"].transform("min")
    fits["arrived"] = fits["cost"] <= ARRIVED * least + NOTHING
    groups = fits.groupby(["specimen", "method"], sort=False)
    return [
        {"specimen": specimen, "method": method, **_counted(part, failed_when)}
        for (specimen, method), part in groups
    ]


def _counted(fits: pd.DataFrame, failed_when: str) -> dict[str, Any]:
    solved = fits["status"].isin([status.value for status in Status if status.usable])
    near = {how: fits[f"near_start_{how}"].eq(True) & solved for how in ("any", "all")}
    successful = int((solved & ~near[failed_when]).sum())
    low, high = proportion_confint(successful, len(fits), method="wilson")
    error = fits["derivative_error"].astype(float)
    known = bool(error.notna().any())
    return {
        "fits": len(fits),
        "solved": int(solved.sum()),
        "near_start_any": int(near["any"].sum()),
        "near_start_all": int(near["all"].sum()),
        "claimed": int(fits["claims_success"].sum()),
        "successful": successful,
        "success": successful / len(fits),
        "success_low": float(np.clip(low, 0.0, 1.0)),
        "success_high": float(np.clip(high, 0.0, 1.0)),
        "arrived": int(fits["arrived"].sum()),
        "evaluations_median": float(fits["evaluations"].median()),
        "evaluations_largest": int(fits["evaluations"].max()),
        "derivative_error_median": float(error.median()) if known else None,
        "derivative_error_largest": float(error.max()) if known else None,
    }
