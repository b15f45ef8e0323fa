"""Jobs: which fits the study's filters keep, how many each takes, and how ways of fitting fare."""

from typing import Any

import numpy as np
import pandas as pd
from statsmodels.stats.proportion import proportion_confint

from spinepipe.jobs.digest import provenance
from spinepipe.status import USABLE
from spinepipe.studies.joint_pose_sensitivity.filters import judge_bootstrap, judge_poses
from spinepipe.studies.joint_pose_sensitivity.inputs import study_and_cohort
from spinepipe.studies.joint_pose_sensitivity.tables import (
    COUNTS,
    SUCCESS,
    SUCCESS_BY_METHOD,
)
from spinepipe.tables import from_rows, read_frames, write

FLAGS = {
    **{name: name for name in ("solved", "near_start_any", "near_start_all", "reduced")},
    "outliers": "outlier",
}
"""Columns of counts, and the flag of a fit that each counts."""

ARRIVED = 1.01
"""A fit has arrived when its cost is at most this many times the least found for its pose."""

NOTHING = 1e-6
"""Cost (mm2, deg2) below which all fits are exact, and count as equal."""


def success(root: str, study: str, tables: list[str], output: str) -> None:
    """Write ``success.parquet`` from ``calibrations``."""
    settings, cohort = study_and_cohort(root, study)
    judged = judge_poses(settings, read_frames(tables)["calibrations"])
    table = from_rows(SUCCESS, judged.to_dict("records"))
    write(table, output, provenance("success", settings, cohort))


def counts(root: str, study: str, tables: list[str], output: str) -> None:
    """Write ``counts.parquet`` from ``success`` and, where there is one, ``bootstrap``."""
    settings, cohort = study_and_cohort(root, study)
    frames = read_frames(tables)
    parts = [("poses", frames["success"].assign(loading="equilibrium"))]
    if "bootstrap" in frames:
        fits = judge_bootstrap(settings, frames["bootstrap"]).groupby("bootstrap", sort=False)
        parts += [(f"{name}_bootstrap", rows) for name, rows in fits]
    rows = [
        {
            **{"specimen": specimen, "part": part, "loading": loading, "fits": len(fits)},
            **{column: int(fits[flag].sum()) for column, flag in FLAGS.items()},
        }
        for part, judged in parts
        for (specimen, loading), fits in judged.groupby(["specimen", "loading"], sort=False)
    ]
    write(from_rows(COUNTS, rows), output, provenance("counts", settings, cohort))


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
    solved = fits["status"].isin(USABLE)
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
