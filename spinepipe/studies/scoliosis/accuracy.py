"""Job: errors of every model over all patients, beside what reading the films alone makes.

A rotation since the erect film is made of four readings of tilt, so its error has twice the SD of
one; a tilt on a film is one reading less that of the lowest vertebra. Places are seen from the
lowest vertebra, whose error is in their SD. Models are held where the film has the top, whose own
reading is theirs too: the floor is an upper one.
"""

from collections.abc import Iterator
from typing import Any

import numpy as np
import pandas as pd

from spinepipe.effects.contract import Array
from spinepipe.jobs.digest import provenance
from spinepipe.jobs.inputs import study_of_kind
from spinepipe.studies.scoliosis.errors import errors_by_measure, mean_squares, with_reduction
from spinepipe.studies.scoliosis.films import reading_noise
from spinepipe.studies.scoliosis.settings import Scoliosis
from spinepipe.studies.scoliosis.tables import ACCURACY, MEASURES
from spinepipe.tables import from_rows, read_frames, write

READINGS_OF_A_ROTATION = 4
READINGS_OF_A_TILT = 2
READINGS_OF_AN_ANGLE = 2


def run(root: str, study: str, tables: list[str], output: str) -> None:
    """Write ``accuracy.parquet``."""
    settings, cohort = study_of_kind(Scoliosis, root, study)
    read = read_frames(tables)
    positions, displacements, curves = read["positions"], read["displacements"], read["curves"]
    noise = reading_noise(settings, cohort)
    rows = list(accuracy_rows(positions, displacements, curves, noise))
    write(from_rows(ACCURACY, rows), output, provenance("accuracy", settings, cohort))


def accuracy_rows(
    positions: pd.DataFrame, displacements: pd.DataFrame, curves: pd.DataFrame, sd: Array
) -> Iterator[dict[str, Any]]:
    """Rows by group of films, measure and model."""
    floors = {
        "rotation": float(np.sqrt(READINGS_OF_A_ROTATION) * sd[1]),
        "tilt": float(np.sqrt(READINGS_OF_A_TILT) * sd[1]),
        "place": float(np.sqrt(2.0) * sd[0]),
        "cobb": float(np.sqrt(READINGS_OF_AN_ANGLE) * sd[1]),
        "ferguson": np.nan,
    }
    about = {}
    for model in positions["model"].unique():
        own = positions[positions["model"] == model]
        about[model] = {
            # curves differ in number, so that the most parameters count
            "free_parameters": int(own["free_parameters"].max()),
            "decided_parameters": float(own["decided_parameters"].mean()),
            "scale_from": str(own["scale_from"].iloc[0]),
        }
    for group, measure, errors in errors_by_measure(positions, displacements, curves):
        of_patients = mean_squares(errors)
        rows = [
            {
                "films": group,
                "measure": measure,
                "model": model,
                "unit": MEASURES[measure][0],
                **_pooled(of_patients[of_patients["model"] == model]),
                "reading_noise": floors[measure] if np.isfinite(floors[measure]) else None,
                **about[model],
            }
            for model in about
        ]
        yield from with_reduction(rows, "rmse")


def _pooled(patients: pd.DataFrame) -> dict[str, Any]:
    """Over the patients that have a pose on every film of the group, by their mean squares."""
    square, n = patients["square"].to_numpy(float), patients["n"].to_numpy()
    own = np.sqrt(square)
    return {
        "n_patients": len(own),
        "n": int(n.sum()),
        "rmse": float(np.sqrt(square @ n / n.sum())) if len(own) else None,
        "mean_of_patients": float(own.mean()) if len(own) else None,
        "sd_of_patients": float(own.std(ddof=1)) if len(own) > 1 else None,
    }
