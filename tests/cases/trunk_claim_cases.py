"""Invented results of the five volunteers, whose numbers can be worked by hand."""

from pathlib import Path

import numpy as np
import pandas as pd

ROOT = Path(__file__).parents[2]
FOLDER = ROOT / "config" / "cohorts" / "trunk_volunteers"

PERSONS = {"ng_2002": 73.0, "ouaaid_2013": 72.98, "volunteer": 72.0, "arjmand_2009": 68.0}
"""Mass, kg."""

JOINTS = ("T11T12", "T12L1", "L1L2", "L2L3", "L3L4", "L4L5", "L5S1")
FLEXION = (6.0, 10.9, 14.1, 13.2, 16.9, 20.1, 18.7)
LATERAL = (8.3, 2.8, 9.4, 18.3, 22.8, 25.6, 12.8)
BODIES = ("T11", "T12", "L1", "L2", "L3", "L4", "L5", "S1")
START = (-9.0, -6.0, -3.0, 0.0, 3.0, 6.0, 9.0, 12.0)
EXTENSORS = ("longissimus_thoracis", "iliocostalis_thoracis")

ASKED_SETTINGS = {
    "t11t12_bending_percent": 20.0,
    "joints_behind_mm": 4.0,
    "change_percent": 1.0,
    "pressure_ahead_cm": 5.0,
    "reference_male": 1.0,
    "reference_age_years": 41.8,
    "reference_height_cm": 173.0,
    "reference_mass_kg": 75.1,
}

ERRORS = {"untuned": 0.2, "tuned": 0.05, "left_out": 0.1}
"""Computed less measured pressure, MPa, the same in every task."""

MEASURED = {
    "standing": (0.5, "confirmed"),
    "load_close": (1.0, "confirmed"),
    "load_away": (1.8, "confirmed"),
    "flexion_50": (1.1, "confirmed"),
    "full_flexion": (1.6, "from_memory"),
    "flexion_70_with_load": (2.3, "confirmed"),
    "one_handed": (1.0, "from_memory"),
    "side_10": (0.55, "derived"),
    "side_20": (0.6, "confirmed"),
}


def asked() -> pd.DataFrame:
    """tasks.csv of the cohort that comes along."""
    return pd.read_csv(FOLDER / "tasks.csv")


def subjects() -> pd.DataFrame:
    return pd.read_csv(FOLDER / "subjects.csv")


def compression(mass: float, flexion: float) -> float:
    """N, by mass in kg and flexion in deg: more for who is heavier, and the more the farther."""
    return mass * (8.0 + 0.2 * flexion)


def shear(mass: float, flexion: float) -> float:
    return mass * (1.0 + 0.01 * flexion)


def tasks() -> pd.DataFrame:
    rows = []
    for person, mass in PERSONS.items():
        for task in asked().to_dict("records"):
            flexion = -float(np.nan_to_num(task["trunk_extension_deg"]))
            number = float(task["number"])
            rows.append(
                {
                    "specimen": person,
                    "task": task["task"],
                    "number": number,
                    "trunk_extension_deg": -flexion,
                    "trunk_right_bending_deg": float(
                        np.nan_to_num(task["trunk_right_bending_deg"])
                    ),
                    "hand_load_kg": float(np.nan_to_num(task["hand_load_kg"])),
                    "l4l5_nominal_pressure_mpa": 0.77,
                    "l4l5_pressure_dreischarf_mpa": 1.0,
                    "l4l5_compression_n": compression(mass, flexion),
                    "l4l5_shear_n": shear(mass, flexion),
                    "largest_slack_nm": 0.01 * number,
                    "largest_stress_mpa": 1.0 if number in (3, 8, 10, 11, 12) else 0.6,
                    "strength_used": number / 12.0,
                    "status": "converged",
                    "message": "",
                }
            )
    return pd.DataFrame(rows)


def levels() -> pd.DataFrame:
    """The volunteer's joints: 1 deg of extension upright, then shares of how far T11 turns."""
    rows = []
    for task in asked().to_dict("records"):
        flexion = -float(np.nan_to_num(task["trunk_extension_deg"]))
        bent = float(np.nan_to_num(task["trunk_right_bending_deg"]))
        for joint, forwards, sideways in zip(JOINTS, FLEXION, LATERAL, strict=True):
            rows.append(
                {
                    "specimen": "volunteer",
                    "task": task["task"],
                    "level": joint,
                    "extension_deg": 1.0 - 0.6 * flexion * forwards / 99.9,
                    "right_bending_deg": 0.9 * bent * sideways / 100.0,
                    "status": "converged",
                }
            )
    return pd.DataFrame(rows)


def active(flexion: float) -> float:
    """N: rises to 90 at 60 deg, falls to 5 at full flexion."""
    return float(np.interp(flexion, [0.0, 60.0, 107.3], [30.0, 90.0, 5.0]))


def muscles() -> pd.DataFrame:
    """126 fascicles upright, and the extensors alone, one of each, in the other tasks."""
    rows = []
    for person in PERSONS:
        for task in tasks().query("specimen == @person").to_dict("records"):
            flexion = max(-task["trunk_extension_deg"], 0.0)
            for at in range(126 if task["task"] == "standing" else 2):
                group = EXTENSORS[at] if at < 2 else "multifidus"
                passive = 0.1 * flexion
                rows.append(
                    {
                        "specimen": person,
                        "task": task["task"],
                        "muscle": f"m{at}",
                        "group": group,
                        "pcsa_mm2": 200.0,
                        "force_n": active(flexion) + passive,
                        "passive_n": passive,
                        "contact_n": 0.05 * flexion,
                        "status": "converged",
                    }
                )
    return pd.DataFrame(rows)


def upright() -> pd.DataFrame:
    rows = [
        {
            "specimen": person,
            "body": body,
            "start_deg": start,
            "upright_deg": start + 1.0 + 0.1 * at,
            "moment_before_nm": np.nan if body == "S1" else 4.0,
            "moment_after_nm": np.nan if body == "S1" else -3.0,
        }
        for at, person in enumerate(PERSONS)
        for body, start in zip(BODIES, START, strict=True)
    ]
    return pd.DataFrame(rows)


def pressures() -> pd.DataFrame:
    rows = [
        {
            "specimen": "volunteer",
            "tier": tier,
            "task": task,
            "measured_mpa": value,
            "measured_status": status,
            "measured_source": "somewhere",
            "computed_mpa": value + error,
            "status": "converged",
        }
        for tier, error in ERRORS.items()
        for task, (value, status) in MEASURED.items()
    ]
    return pd.DataFrame(rows)


def agreement() -> pd.DataFrame:
    rows = [
        {
            "specimen": "volunteer",
            "tier": tier,
            "n_tasks": 6,
            "r": r,
            "r_low": r - 0.1,
            "r_high": 0.999,
            "rmse_mpa": error,
        }
        for (tier, error), r in zip(ERRORS.items(), (0.93, 0.99, 0.985), strict=True)
    ]
    return pd.DataFrame(rows)


def complete() -> dict[str, pd.DataFrame]:
    """All tables that claims look at."""
    return {
        "asked": asked(),
        "subjects": subjects(),
        "tasks": tasks(),
        "levels": levels(),
        "muscles": muscles(),
        "upright": upright(),
        "pressures": pressures(),
        "agreement": agreement(),
    }
