"""Job: errors over all persons: mean of their mean errors, and its 95 % interval."""

from collections.abc import Iterator
from typing import Any

import pandas as pd

from spinepipe.jobs.digest import provenance
from spinepipe.jobs.inputs import study_of_kind
from spinepipe.statistics.outcome import mean_of
from spinepipe.studies.tracking.settings import Tracking
from spinepipe.studies.tracking.tables import ACCURACY
from spinepipe.tables import from_rows, read_frames, write


def run(root: str, study: str, tables: list[str], output: str) -> None:
    """Write ``accuracy.parquet``."""
    settings, cohort = study_of_kind(Tracking, root, study)
    rows = list(accuracy_rows(read_frames(tables)["errors"]))
    write(from_rows(ACCURACY, rows), output, provenance("accuracy", settings, cohort))


def accuracy_rows(errors: pd.DataFrame) -> Iterator[dict[str, Any]]:
    """Rows by trial, approach and measure: a person counts once, whatever was known of them."""
    named = ["trial", "approach", "measure"]
    for key, rows in errors.groupby(named, sort=False, observed=True):
        mean = mean_of(rows.groupby("specimen", sort=False)["mean"].mean().to_numpy(float))
        low, high = mean.interval or (None, None)
        yield {
            **dict(zip(named, (str(part) for part in key), strict=True)),
            "mean": mean.value,
            "low": low,
            "high": high,
            "n_specimens": mean.n,
        }
