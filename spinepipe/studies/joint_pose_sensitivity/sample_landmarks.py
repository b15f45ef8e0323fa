"""Job: landmark sets of all specimens of a study, sampled around their palpated positions."""

import numpy as np
import pandas as pd

from spinepipe.designs import sample_landmarks
from spinepipe.jobs.inputs import study_and_cohort
from spinepipe.jobs.provenance import provenance
from spinepipe.studies import JointPoseSensitivity
from spinepipe.tables import LANDMARKS, to_arrow, write


def run(root: str, study: str, output: str) -> None:
    """Write ``landmarks.parquet``."""
    settings, cohort = study_and_cohort(root, study)
    assert cohort.landmarks is not None
    parts = [
        _specimen(settings, specimen, rows)
        for specimen, rows in cohort.landmarks.groupby("specimen", sort=False)
    ]
    frame = pd.concat(parts, ignore_index=True)
    columns = {column.name: frame[column.name].to_list() for column in LANDMARKS.columns}
    write(to_arrow(LANDMARKS, columns), output, provenance("sample_landmarks", settings, cohort))


def _specimen(settings: JointPoseSensitivity, specimen: object, rows: pd.DataFrame) -> pd.DataFrame:
    """Landmark sets of one specimen, pose by pose."""
    points = rows[["x_mm", "y_mm", "z_mm"]].to_numpy(float)
    own = rows["sd_mm"].fillna(0.0).to_numpy(float)
    sd = own if settings.landmark_sd_mm is None else np.full(len(rows), settings.landmark_sd_mm)
    sampled, poses = sample_landmarks(points, sd, settings.poses, settings.seed, str(specimen))
    flat, n = sampled.reshape(-1, 3), len(rows)
    return pd.DataFrame(
        {
            "specimen": str(specimen),
            "pose": np.repeat(np.asarray(poses), n),
            "vertebra": np.tile(rows["vertebra"].to_numpy(), len(poses)),
            "landmark": np.tile(rows["landmark"].to_numpy(), len(poses)),
            "x_mm": flat[:, 0],
            "y_mm": flat[:, 1],
            "z_mm": flat[:, 2],
            "sd_mm": np.tile(sd, len(poses)),
        }
    )
