"""Job: errors of every model over all patients, beside what reading the films alone makes.

A rotation since the erect film is made of four readings of tilt, so its error has twice the SD of
one; a tilt on a film is one reading less that of the lowest vertebra. Places are seen from the
lowest vertebra, whose error is in their SD. Models are held where the film has the top, whose own
reading is theirs too: the floor is an upper one.
"""

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
import pandas as pd

from spinepipe.effects.contract import Array
from spinepipe.jobs.digest import provenance
from spinepipe.jobs.inputs import study_of_kind
from spinepipe.studies.scoliosis.errors import REFERENCE, mean_squares, of_group, squares
from spinepipe.studies.scoliosis.reading_noise import reading_noise
from spinepipe.studies.scoliosis.settings import Scoliosis
from spinepipe.studies.scoliosis.tables import ACCURACY, GROUPS, MEASURES
from spinepipe.tables import from_rows, read_frames, write

READINGS_OF_A_ROTATION = 4
READINGS_OF_A_TILT = 2
READINGS_OF_AN_ANGLE = 2


def run(root: str, study: str, tables: list[str], output: str) -> None:
    """Write ``accuracy.parquet``."""
    settings, cohort = study_of_kind(Scoliosis, root, study)
    read = read_frames(tables)
    rows = list(
        accuracy_rows(
            read["positions"],
            read["displacements"],
            read["curves"],
            reading_noise(settings, cohort),
        )
    )
    write(from_rows(ACCURACY, rows), output, provenance("accuracy", settings, cohort))


def accuracy_rows(
    positions: pd.DataFrame, displacements: pd.DataFrame, curves: pd.DataFrame, sd: Array
) -> Iterator[dict[str, Any]]:
    """Rows by group of films, measure and model."""
    floors = {
        "rotation": np.sqrt(READINGS_OF_A_ROTATION) * sd[1],
        "tilt": np.sqrt(READINGS_OF_A_TILT) * sd[1],
        "place": np.sqrt(2.0) * sd[0],
        "cobb": np.sqrt(READINGS_OF_AN_ANGLE) * sd[1],
        "ferguson": np.nan,
    }
    about = {
        model: _about(positions[positions["model"] == model])
        for model in positions["model"].unique()
    }
    for group in GROUPS:
        chosen = [of_group(one, group) for one in (positions, displacements, curves)]
        for measure, (unit, _) in MEASURES.items():
            of_patients = mean_squares(squares(measure, *chosen))
            rows = [
                {
                    "films": group,
                    "measure": measure,
                    "model": model,
                    "unit": unit,
                    **_pooled(of_patients[of_patients["model"] == model]),
                    "reading_noise": _or_none(floors[measure]),
                    **about[model],
                }
                for model in about
            ]
            yield from _with_reduction(rows)


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


def _about(rows: pd.DataFrame) -> dict[str, Any]:
    """What is the same for all films of a model; curves differ in number, so the most counts."""
    return {
        "free_parameters": int(rows["free_parameters"].max()),
        "decided_parameters": float(rows["decided_parameters"].mean()),
        "scale_from": str(rows["scale_from"].iloc[0]),
    }


def _with_reduction(rows: Sequence[dict[str, Any]]) -> Iterator[dict[str, Any]]:
    other = next((row["rmse"] for row in rows if row["model"] == REFERENCE), None)
    for row in rows:
        known = other and row["rmse"] is not None
        yield row | {"reduction_percent": 100.0 * (1.0 - row["rmse"] / other) if known else None}


def _or_none(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None
