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
            if chosen.empty:
                continue
            # patients with a pose on every film; films have equally many segments
            lost = chosen.loc[chosen["rotation_rmse_deg"].isna(), "specimen"]
            posed = chosen[~chosen["specimen"].isin(lost)]
            moved = posed["moved_deg"].astype(float)
            yield {
                "varied": varied,
                "value": value,
                "films": group,
                "n_patients": int(posed["specimen"].nunique()),
                **{
                    name: float(np.sqrt(np.mean(posed[name].to_numpy(float) ** 2)))
                    if len(posed)
                    else None
                    for name in ("rotation_rmse_deg", "place_rmse_mm")
                },
                "moved_deg": float(moved.max()) if moved.notna().any() else None,
            }
