"""Result tables of a joint-pose study of specimen ``a`` whose conclusions are known, by hand.

Palpation moves flexion–extension stiffness by 10 % (9.5 to 10.5 N m/rad about 10), the load's place
by 19 % (SDs of 1 N m/rad each way); one fit's readings leave 8 to 14 N m/rad.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np
import pandas as pd
from study_cases import TABLES

from spinepipe.tables import from_rows

Row = dict[str, Any]
Frames = dict[str, pd.DataFrame]
N = 201
JOINTS = ("V2V1", "V3V2")
SPREAD = {
    "extension": ("nm_per_rad", np.linspace(9.0, 11.0, N), 8.0, 14.0),
    "superior": ("n_per_m", np.linspace(3.0e5, 3.4e5, N), 2.0e5, 9.0e5),
}


def frame(name: str, rows: list[Row]) -> pd.DataFrame:
    """A table as it is declared; columns that no row names are empty."""
    columns = {column.name: None for column in TABLES[name].columns}
    return from_rows(TABLES[name], [{**columns, **row} for row in rows]).to_pandas()


def calibrations(
    specimen: str = "a", joint: str = "*", n: int = N, shift: float = 1.0
) -> list[Row]:
    """Fits that identify both stiffnesses."""
    rows = []
    for pose in range(n):
        row: Row = {"specimen": specimen, "pose": pose, "joint": joint, "status": "converged"}
        row |= {"cost": 1.0, "degrees_of_freedom": 3, "n_optima": 1, "message": ""}
        row |= dict.fromkeys(("iterations", "evaluations", "start_stiffened"), 1)
        for name, (unit, values, low, high) in SPREAD.items():
            row |= {f"{name}_{unit}": shift * float(values[pose]), f"{name}_identifiable": True}
            row |= {f"{name}_low_{unit}": low, f"{name}_high_{unit}": high}
            row |= {f"{name}_open_below": False, f"{name}_open_above": False}
        rows.append(row)
    return rows


def success(specimen: str = "a", n: int = N, left_out: int = 0) -> list[Row]:
    """Of n fits the last are outliers."""
    flags = dict.fromkeys(("near_start_any", "near_start_all", "failed"), False)
    return [
        {"specimen": specimen, "pose": pose, "solved": True, **flags}
        | {"outlier": pose >= n - left_out, "reduced": pose < n - left_out}
        for pose in range(n)
    ]


def counts(fits: int = N, reduced: int = N, **more: Any) -> list[Row]:
    """Of palpations."""
    row = {"specimen": "a", "part": "poses", "loading": "equilibrium", "fits": fits, "solved": fits}
    row |= {"near_start_any": 0, "near_start_all": 0, "outliers": fits - reduced}
    return [{**row, "reduced": reduced, **more}]


def load_point_effect(**more: Any) -> list[Row]:
    """Stiffness against extension; to first order an SD of the root of two."""
    row = {"specimen": "a", "joint": "*", "coordinate": "extension", "unit": "N m/rad"}
    row |= {"stated": 10.0, "stated_low": 8.0, "stated_high": 14.0, "points": 9, "fitted": 9}
    row |= {"per_mm_anterior": 1.0, "per_mm_superior": 0.1, "message": "", "allowed": 9}
    return [{**row, "anterior_sd_mm": 1.0, "superior_sd_mm": 10.0, **more}]


def over_load_point(
    slope: float = 1.0, allowed: bool | None = True, excluded: int = 0
) -> list[Row]:
    """10 + slope times the shift anterior + a tenth of it up; the first points are excluded."""
    rows = []
    for anterior in (-2.0, 0.0, 2.0):
        for superior in (-20.0, 0.0, 20.0):
            value = 10.0 + slope * (anterior + 0.1 * superior)
            row = {"specimen": "a", "joint": "*", "anterior_shift_mm": anterior}
            row |= {"superior_shift_mm": superior, "extension_nm_per_rad": value, "cost": 1.0}
            row |= {
                "extension_low_nm_per_rad": 0.8 * value,
                "extension_high_nm_per_rad": 1.4 * value,
            }
            row |= {"extension_identifiable": True, "degrees_of_freedom": 3, "message": ""}
            rows.append(
                {**row, "allowed": allowed and len(rows) >= excluded, "status": "converged"}
            )
    return rows


def summary(percent: float = 5.0, error: float = 0.05, largest: float = 0.2) -> list[Row]:
    """Errors of motion and spread of joint frames over the retained fits."""
    part = {"specimen": "a", "part": "poses", "loading": "equilibrium", "dataset": "reduced"}
    rows: list[Row] = []
    for joint in JOINTS:
        told: Row = {**part, "joint": joint, "n": N}
        numbers = {
            "median": error,
            "maximum": largest,
            "percent_of_measured": percent,
            "unit": "deg",
        }
        rows.append({**told, "quantity": "error", "coordinate": "extension", **numbers})
        origin, turn = (
            {"coordinate": "anterior", "unit": "mm"},
            {"coordinate": "extension", "unit": "deg"},
        )
        rows.append({**told, "quantity": "origin", **origin, "iqr": 1.25})
        rows.append({**told, "quantity": "orientation", **turn, "iqr": 3.5})
    return rows


def shares(*ends: tuple[float, float, float, float]) -> list[Row]:
    """A motion for each: ends of the intervals of pose and stiffness."""
    rows = []
    for number, (pose_low, pose_high, low, high) in enumerate(ends):
        cell = {"specimen": "a", "joint": JOINTS[number % 2], "status": "done", "message": ""}
        cell |= {
            "coordinate": ("extension", "superior")[number // 2],
            "n_poses": N,
            "n_stiffness": 10,
        }
        for factor, one in (
            ("pose", (pose_low, pose_high)),
            ("stiffness", (low, high)),
            ("interaction", (0.0, 0.1)),
        ):
            signed = {"signed_share_low": one[0], "signed_share_high": one[1]}
            rows.append({**cell, "factor": factor, "signed_share": sum(one) / 2.0, **signed})
    return rows


def simulations(lost: int = 0) -> list[Row]:
    """A step of each pose with its own stiffness; the motion of the first ones is lost."""
    rows = []
    for pose in range(20):
        for joint in JOINTS:
            row = {"specimen": "a", "pose": pose, "stiffness": "calibrated", "test": "flexion"}
            row |= {"cycle": 1, "joint": joint, "unmeasured_taken_as_zero": False, "message": ""}
            for step, motion in ((0, 0.0), (1, -1.0 + 0.01 * pose)):
                told = {"measured_extension_deg": -1.0 * step, "predicted_extension_deg": motion}
                gone = pose < lost and step
                status = {"status": "unstable" if gone else "converged"}
                rows.append({**row, "step": step, **({} if gone else told), **status})
    return rows


def bootstrap(
    start: float = 0.01, dynamic: float = 1.0, damping: float = 0.01, n: int = 20
) -> list[Row]:
    """Fits about 10 N m/rad whose values reach so far to either side; under a ramp times that."""
    rows = []
    for what, loading, reach, times in (
        ("start", "equilibrium", start, 1.0),
        ("start", "dynamic", start, dynamic),
        ("damping", "dynamic", damping, 1.0),
    ):
        for number, value in enumerate(np.linspace(1.0 - reach, 1.0 + reach, n)):
            row = {"specimen": "a", "bootstrap": what, "loading": loading, "set": number}
            row |= {"joint": JOINTS[0], "status": "converged", "message": "", "evaluations": 1}
            row |= {"damping_translation_n_s_per_m": 1e3, "damping_rotation_nm_s_per_rad": 1.4}
            for name, (unit, values, *_) in SPREAD.items():
                middle = float(np.median(values))
                row |= {
                    f"{name}_{unit}": times * middle * value,
                    f"start_{name}_{unit}": 2.0 * middle,
                }
            for name in ("anterior_n_per_m", "right_n_per_m", "right_bending_nm_per_rad"):
                row |= {name: 1.0, f"start_{name}": 1.0}
            row |= {"left_rotation_nm_per_rad": 1.0, "start_left_rotation_nm_per_rad": 1.0}
            rows.append(row)
    return rows


def posterior(below: bool = False, above: bool = False, **more: Any) -> list[Row]:
    """Of stiffness against extension."""
    row = {
        "specimen": "a",
        "quantity": "stiffness",
        "joint": "*",
        "unknown": "extension_nm_per_rad",
    }
    row |= {"unit": "N m/rad", "median": 10.0, "low": 8.0, "high": 13.0, "status": "converged"}
    row |= {"laplace_low": 8.5, "laplace_high": 12.0, "open_below": below, "open_above": above}
    return [{**row, "message": "", **more}]


def posterior_motion(inside: int) -> list[Row]:
    """Ten readings, so many of which lie inside."""
    row = {"specimen": "a", "test": "flexion", "cycle": 1, "joint": JOINTS[0], "unit": "deg"}
    row |= {"coordinate": "extension", "status": "converged", "message": "", "draws": 9}
    return [{**row, "step": step, "inside": step < inside} for step in range(10)]


def pose_weights(*weights: float) -> list[Row]:
    """Of poses 0, 1, ..."""
    row = {"specimen": "a", "joint": "*", "unknown": "extension_nm_per_rad", "status": "converged"}
    return [{**row, "pose": n, "weight": one, "message": ""} for n, one in enumerate(weights)]


def required_precision(sd: float | None = 1.5, n: int = 90, **more: Any) -> list[Row]:
    """Below both limits, with the stiffness fitted to each pose."""
    row = {"specimen": "a", "stiffness": "calibrated", "motion": "both", "share": 0.95, "n": n}
    row |= {"sd_mm": sd, "sd_low_mm": sd and sd - 0.5, "sd_high_mm": sd and sd + 0.5}
    return [{**row, "nominal_share": 0.3, "message": "", **more}]


def precision(*sds: float) -> list[Row]:
    """Shares of poses that fall with the SD of the landmarks."""
    rows = []
    for motion, unit in (("translation", "mm"), ("rotation", "deg")):
        for whose in ("calibrated", "nominal"):
            for sd in sds:
                below = float(np.exp(-0.1 * sd))
                row = {"specimen": "a", "stiffness": whose, "motion": motion, "sd_mm": sd}
                row |= {
                    "unit": unit,
                    "n": 80,
                    "without_result": 0,
                    "median": 0.2 * sd,
                    "limit": 1.0,
                }
                row |= {
                    "below": below,
                    "below_low": below - 0.05,
                    "below_high": min(1.0, below + 0.05),
                }
                rows.append(row)
    return rows


def poses(n: int = 40) -> list[Row]:
    """Frames that scatter by a mm and a degree."""
    drawn = np.random.default_rng(1).normal(size=(n, len(JOINTS), 6))
    names = ("x_mm", "y_mm", "z_mm", "extension_deg", "right_bending_deg", "left_rotation_deg")
    return [
        {"specimen": "a", "pose": pose, "joint": joint, "status": "converged", "message": ""}
        | dict(zip(names, map(float, drawn[pose, number]), strict=True))
        for pose in range(n)
        for number, joint in enumerate(JOINTS)
    ]


def base() -> dict[str, list[Row]]:
    """All tables but those of `make full`."""
    return {
        "calibrations": calibrations(),
        "success": success(),
        "counts": counts(),
        "load_point_effect": load_point_effect(),
        "stiffness_over_load_point": over_load_point(),
        "summary": summary(),
        "variance_shares": shares((0.5, 0.9, 0.1, 0.4), (0.3, 0.9, 0.1, 0.4)),
        "simulations": simulations(),
        "bootstrap": bootstrap(),
        "poses": poses(),
    }


def whole() -> dict[str, list[Row]]:
    """All of them."""
    return base() | {
        "posterior": posterior(),
        "posterior_motion": posterior_motion(10),
        "pose_weights": pose_weights(*[0.1] * 10),
        "landmark_precision": precision(1.0, 2.0, 4.0),
        "required_precision": required_precision(),
    }


def frames(rows: Mapping[str, list[Row]]) -> Frames:
    """Tables as a run would have them."""
    return {name: frame(name, list(one)) for name, one in rows.items()}
