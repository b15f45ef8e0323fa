"""Job: how far motions are from the truth, per person, trial, approach and level."""

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
import pandas as pd

from spinepipe.effects.contract import Array
from spinepipe.jobs.digest import provenance
from spinepipe.jobs.inputs import study_of_kind
from spinepipe.motion.scaling import SEGMENTS, body_factors, steps_of
from spinepipe.motion.skeleton import Skeleton
from spinepipe.studies.recordings import STANCE
from spinepipe.studies.subjects import subject_of
from spinepipe.studies.tracking.error_metrics import Truth, errors_of, truths
from spinepipe.studies.tracking.persons import centres_of, skeleton_in
from spinepipe.studies.tracking.settings import Tracking
from spinepipe.studies.tracking.tables import ERRORS
from spinepipe.studies.tracking.tracked_motions import motions
from spinepipe.studies.tracking.trials import kinds_of_trials
from spinepipe.tables import from_rows, read_frames, write


def run(root: str, study: str, tables: list[str], output: str) -> None:
    """Write ``errors.parquet``; it is empty where no truth is known."""
    settings, cohort = study_of_kind(Tracking, root, study)
    known = list(truths(dict(cohort.further)))
    found = read_frames(tables)
    bones = {}
    for name in {truth.specimen for truth in known}:
        # the skeleton as it was tracked: as large as markers say, where they say it
        skeleton = skeleton_in(cohort, name, subject_of(cohort, name))
        centres = centres_of(cohort, name, skeleton)
        sizes = found["sizes"][found["sizes"]["specimen"] == name].set_index("segment")["factor"]
        if settings.scaling == "markers" and not sizes.isna().any():
            factors = sizes[list(SEGMENTS)].to_numpy(float)
            skeleton = Skeleton(steps_of(skeleton, factors), skeleton.masses)
            centres = body_factors(factors)[:, None] * centres
        bones[name] = skeleton, centres
    rows = list(error_rows(found["tracked"], known, bones, kinds_of_trials(cohort)))
    write(from_rows(ERRORS, rows), output, provenance("errors", settings, cohort))


def error_rows(
    tracked: pd.DataFrame,
    known: list[Truth],
    bones: Mapping[str, tuple[Skeleton, Array]],
    kinds: Mapping[tuple[str, str], str],
) -> Iterator[dict[str, Any]]:
    """Rows by motion with a truth, measure and level; bones : skeleton and centres by person."""
    by_trial = {(truth.specimen, truth.trial): truth for truth in known}
    for motion in motions(tracked):
        key = motion.specimen, motion.trial
        if key not in by_trial:
            continue
        for off in errors_of(motion, by_trial[key], *bones[motion.specimen]):
            if off.measure == "joint_angle_deg" and kinds[key] == STANCE:
                continue
            for k, level in enumerate(off.levels):
                size = off.size[off.known[:, k], k]
                if len(size):
                    yield motion.names | {
                        "measure": off.measure,
                        "level": level,
                        "mean": float(size.mean()),
                        "p95": float(np.percentile(size, 95.0)),
                        "largest": float(size.max()),
                        "n": len(size),
                    }
