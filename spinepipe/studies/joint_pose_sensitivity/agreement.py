"""Job: agreement of predicted with measured motion after Bland and Altman."""

from collections.abc import Iterator
from typing import Any

import pandas as pd

from spinepipe.jobs.digest import provenance
from spinepipe.statistics import bland_altman
from spinepipe.studies.joint_pose_sensitivity.inputs import study_and_cohort
from spinepipe.studies.joint_pose_sensitivity.tables import (
    AGREEMENT,
    NOT_MEANINGFUL,
    NOTHING_TO_TELL,
    TOLD,
)
from spinepipe.studies.joint_pose_sensitivity.variables import readings
from spinepipe.tables import from_rows, read_frames, write
from spinepipe.units import COORDINATE_UNITS

_NUMBERS = (
    *("n", "bias", "bias_low", "bias_high", "sd", "lower_limit", "upper_limit"),
    *("lower_limit_low", "upper_limit_high", "measured_sd", "predicted_sd", "message"),
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
    for name, unit in COORDINATE_UNITS.items():
        pair = part[[f"measured_{name}_{unit}", f"predicted_{name}_{unit}"]]
        if not pair.iloc[:, 0].notna().any():
            continue
        known = pair.dropna().to_numpy(float)
        found = bland_altman(known[:, 0], known[:, 1])
        # the correlation of difference and mean only where it says something of a bias
        rho, p = found.proportional.effect, found.proportional.p
        told = NOTHING_TO_TELL if rho is None else TOLD if found.comparable else NOT_MEANINGFUL
        yield {
            "coordinate": name,
            "unit": unit,
            **{number: getattr(found, number) for number in _NUMBERS},
            "proportional_rho": rho if told == TOLD else None,
            "proportional_p": p if told == TOLD else None,
            "proportional": told,
            "status": found.status.value,
        }
