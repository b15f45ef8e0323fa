"""Job: one motion of one person by one approach."""

import time
from collections.abc import Mapping
from typing import Any

import numpy as np

from spinepipe.jobs.digest import mark_of, provenance
from spinepipe.jobs.inputs import study_of_kind
from spinepipe.motion.passive import PassiveLaw
from spinepipe.studies.tracking.animation_rows import drawn_rows
from spinepipe.studies.tracking.approaches import (
    ApproachMotion,
    asked_of,
    found_by,
    learns,
    seen_in,
)
from spinepipe.studies.tracking.extra_inputs import marks_of
from spinepipe.studies.tracking.laws import law_in
from spinepipe.studies.tracking.persons import TrackedPerson, person_of, ratio_sets
from spinepipe.studies.tracking.rows import Row, failed_row, fit_row, motion_rows
from spinepipe.studies.tracking.settings import Approach, Tracking
from spinepipe.studies.tracking.tables import DRAWN, FITS, TRACKED
from spinepipe.tables import from_rows, read_frame, write


def run(
    root: str,
    study: str,
    specimen: str,
    trial: str,
    approach: Approach,
    tracked: str,
    fits: str,
    drawn: str,
    law: list[str],
) -> None:
    """Write a file for each table; law : the calibration that is taken over, if any."""
    settings, cohort = study_of_kind(Tracking, root, study)
    person = person_of(cohort, specimen, cohort.folder, settings.scaling)
    taken = [law_in(read_frame(path), person.passive) for path in law]
    learnt = taken[0] if taken else None
    known: Row = {"specimen": specimen, "trial": trial, "approach": approach}
    begun = time.process_time()
    found, message = _found(settings, person, trial, approach, learnt, ratio_sets(cohort))
    spent = time.process_time() - begun
    others = [*marks_of(cohort, specimen), *(mark_of(path) for path in law)]
    made_by = provenance("track", settings, cohort, [specimen], others)
    motion = list(motion_rows(found)) if found else []
    fit = fit_row(settings, found, spent) if found else failed_row(message)
    write(from_rows(TRACKED, [known | row for row in motion]), tracked, made_by)
    write(from_rows(FITS, [fit | known]), fits, made_by)
    shown = approach in settings.drawn_approaches
    scenes = drawn_rows(found.watched, found.q) if found and shown else ()
    write(from_rows(DRAWN, [known | row for row in scenes]), drawn, made_by)


def _found(
    settings: Tracking,
    person: TrackedPerson,
    trial: str,
    approach: Approach,
    learnt: PassiveLaw | None,
    ratios: Mapping[str, Any],
) -> tuple[ApproachMotion | None, str]:
    """The motion, or why there is none."""
    if learns(approach) and learnt is None:
        return None, "no passive elements were calibrated"
    chosen = next(one for one in person.trials if one.name == trial)
    ask = asked_of(settings, person, approach, learnt)
    try:
        found = found_by(approach, ask, seen_in(settings, person, chosen), ratios)
    except (ValueError, np.linalg.LinAlgError) as why:
        return None, str(why)
    if not np.isfinite(found.q).all():
        return None, "coordinates are not finite"
    return found, ""
