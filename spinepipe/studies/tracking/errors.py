"""Job: how far motions are from the truth, per person, trial, approach and level."""

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
import pandas as pd

from spinepipe.jobs.digest import provenance
from spinepipe.jobs.inputs import study_of_kind
from spinepipe.studies.tracking.error_metrics import Bones, ErrorFromTruth, bones_of, errors_of
from spinepipe.studies.tracking.forms import STANCE
from spinepipe.studies.tracking.reload_motions import ReloadedMotions, kinds_of_trials, motions
from spinepipe.studies.tracking.scaled_persons import factors_in
from spinepipe.studies.tracking.settings import Tracking
from spinepipe.studies.tracking.tables import ERRORS
from spinepipe.studies.tracking.truth import Truth, truths
from spinepipe.tables import from_rows, read_frames, write


def run(root: str, study: str, tables: list[str], output: str) -> None:
    """Write ``errors.parquet``; it is empty where no truth is known."""
    settings, cohort = study_of_kind(Tracking, root, study)
    known = list(truths(dict(cohort.further)))
    found = read_frames(tables)
    scaled = settings.scaling == "markers"
    bones = {
        name: bones_of(cohort, name, factors_in(found["sizes"], name) if scaled else None)
        for name in {truth.specimen for truth in known}
    }
    rows = list(error_rows(found["tracked"], known, bones, kinds_of_trials(cohort)))
    write(from_rows(ERRORS, rows), output, provenance("errors", settings, cohort))


def error_rows(
    tracked: pd.DataFrame,
    known: list[Truth],
    bones: Mapping[str, Bones],
    kinds: Mapping[tuple[str, str], str],
) -> Iterator[dict[str, Any]]:
    """Rows by motion with a truth, measure and level."""
    by_trial = {(truth.specimen, truth.trial): truth for truth in known}
    for moved in motions(tracked):
        key = moved.specimen, moved.trial
        if key not in by_trial:
            continue
        for off in errors_of(moved, by_trial[key], bones[moved.specimen]):
            if off.measure == "joint_angle_deg" and kinds[key] == STANCE:
                continue
            yield from _rows(moved, off)


def _rows(moved: ReloadedMotions, off: ErrorFromTruth) -> Iterator[dict[str, Any]]:
    for k, level in enumerate(off.levels):
        size = off.size[off.told[:, k], k]
        if not len(size):
            continue
        yield {
            "specimen": moved.specimen,
            "trial": moved.trial,
            "approach": moved.approach,
            "measure": off.measure,
            "level": level,
            "mean": float(size.mean()),
            "p95": float(np.percentile(size, 95.0)),
            "largest": float(size.max()),
            "n": len(size),
        }
