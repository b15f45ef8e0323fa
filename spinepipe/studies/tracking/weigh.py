"""Job: what it does to a person's motions to count loads more or less beside markers."""

import time
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from spinepipe.jobs.digest import provenance
from spinepipe.jobs.inputs import study_of_kind
from spinepipe.motion.skeleton import MarkerTrial
from spinepipe.studies.recordings import motion_digests
from spinepipe.studies.tracking.approaches import (
    ApproachMotion,
    find_motion,
    objective_of,
    sample_at_nodes,
)
from spinepipe.studies.tracking.error_metrics import Truth, errors_of, truths
from spinepipe.studies.tracking.fit_rows import Row, failed_row, fit_row
from spinepipe.studies.tracking.persons import TrackedPerson, person_of
from spinepipe.studies.tracking.settings import Approach, Tracking
from spinepipe.studies.tracking.tables import WEIGHTS
from spinepipe.studies.tracking.tracked_motions import TrackedMotion
from spinepipe.tables import from_rows, write

APPROACH: Approach = "optk_generic"
"""The approach that is weighed: with generic passive elements."""

MEASURED = ("centre_mm", "angle_deg")
"""Measures of error, each a column."""


def run(root: str, study: str, specimen: str, output: str) -> None:
    """Write the rows of a person."""
    settings, cohort = study_of_kind(Tracking, root, study)
    person = person_of(cohort, specimen, cohort.folder, settings.scaling)
    everyone = truths(dict(cohort.further))
    known = {truth.trial: truth for truth in everyone if truth.specimen == specimen}
    rows = [
        {"specimen": specimen, "trial": trial.name} | row
        for trial in person.trials
        for row in weight_rows(settings, person, trial, known.get(trial.name))
    ]
    made_by = provenance("weigh", settings, cohort, [specimen], motion_digests(cohort, specimen))
    write(from_rows(WEIGHTS, rows), output, made_by)


def weight_rows(
    settings: Tracking, person: TrackedPerson, trial: MarkerTrial, truth: Truth | None
) -> Iterator[Row]:
    """Rows of a trial by ratio."""
    seen = sample_at_nodes(settings, person, trial)
    ask = objective_of(settings, person, APPROACH)
    # loads count so many times as much as the study has them, all else stays
    for ratio in sorted(settings.trade_off):
        heavier = replace(ask, sizes=replace(ask.sizes, loads=ratio * ask.sizes.loads))
        begun = time.process_time()
        try:
            found = find_motion(APPROACH, heavier, seen, {})
            fit = fit_row(settings, found, time.process_time() - begun)
            off = _errors(person, trial.name, found, truth)
        except (ValueError, np.linalg.LinAlgError) as why:
            fit, off = failed_row(str(why)), dict.fromkeys(MEASURED)
        shown = ("marker_rmse_mm", "load_rms_nm", "status")
        yield {"ratio": ratio, **{name: fit[name] for name in shown}, **off}


def _errors(
    person: TrackedPerson, trial: str, found: ApproachMotion, truth: Truth | None
) -> dict[str, float | None]:
    """Mean errors where the truth is known."""
    sizes: dict[str, float | None] = dict.fromkeys(MEASURED)
    if truth is None:
        return sizes
    motion = TrackedMotion(person.name, trial, APPROACH, found.watched.grid.times_s, found.q)
    for off in errors_of(motion, truth, person.skeleton, person.centres):
        if off.measure in MEASURED and off.known.any():
            sizes[off.measure] = float(off.size[off.known].mean())
    return sizes
