"""Job: how many fits each filter of the study takes."""

from typing import Any

import pandas as pd

from spinepipe.jobs.inputs import study_and_cohort
from spinepipe.jobs.provenance import provenance
from spinepipe.jobs.success import judge_bootstrap
from spinepipe.tables import COUNTS, from_rows, read_frames, write

FLAGS = ("solved", "near_start_any", "near_start_all", "outlier", "reduced")


def run(root: str, study: str, tables: list[str], output: str) -> None:
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
