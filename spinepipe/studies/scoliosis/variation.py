"""Job: the variants of all patients, fitted and held-out films apart."""

from collections.abc import Iterator
from typing import Any

import numpy as np
import pandas as pd

from spinepipe.jobs.digest import provenance
from spinepipe.jobs.inputs import study_of_kind
from spinepipe.studies.scoliosis.settings import Scoliosis
from spinepipe.studies.scoliosis.tables import GROUPS, VARIATION
from spinepipe.tables import from_rows, read_frames, write


def run(root: str, study: str, tables: list[str], output: str) -> None:
    """Write ``variation.parquet``."""
    settings, cohort = study_of_kind(Scoliosis, root, study)
    rows = list(variation_rows(read_frames(tables)["variants"]))
    write(from_rows(VARIATION, rows), output, provenance("variation", settings, cohort))


def variation_rows(variants: pd.DataFrame) -> Iterator[dict[str, Any]]:
    """A row for each choice, value and group of films that there is."""
    for (varied, value), rows in variants.groupby(["varied", "value"], sort=False):
        for group in GROUPS:
            chosen = rows[rows["fitted"] == (group == "fitted")]
            if len(chosen):
                known = {"varied": varied, "value": value, "films": group}
                yield known | _over_patients(chosen)


def _over_patients(rows: pd.DataFrame) -> dict[str, Any]:
    """Over those that have a pose on every film; films have equally many segments."""
    missing = rows.loc[rows["rotation_rmse_deg"].isna(), "specimen"]
    kept = rows[~rows["specimen"].isin(missing)]
    if kept.empty:
        nothing = ("rotation_rmse_deg", "place_rmse_mm", "moved_deg")
        return {"n_patients": 0, **dict.fromkeys(nothing)}
    moved = kept["moved_deg"].astype(float)
    return {
        "n_patients": int(kept["specimen"].nunique()),
        **{name: _root_mean_square(kept[name]) for name in ("rotation_rmse_deg", "place_rmse_mm")},
        "moved_deg": float(moved.max()) if moved.notna().any() else None,
    }


def _root_mean_square(values: "pd.Series[float]") -> float:
    return float(np.sqrt(np.mean(values.to_numpy(float) ** 2)))
