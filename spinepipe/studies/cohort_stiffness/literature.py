"""Job: what the published stiffness predicts of one specimen, and whether it moves that way."""

from typing import Any

import numpy as np

from spinepipe.cohort import Cohort
from spinepipe.jobs.inputs import study_of_kind
from spinepipe.status import Status
from spinepipe.studies.cohort_stiffness.fit_rows import stiffness_rows
from spinepipe.studies.cohort_stiffness.predict import error_rows
from spinepipe.studies.cohort_stiffness.problem import (
    base_effects,
    origin,
    specimen_tests,
    start_stiffness,
)
from spinepipe.studies.cohort_stiffness.representations import PUBLISHED, named
from spinepipe.studies.cohort_stiffness.settings import NOTHING, CohortStiffness, has_levels
from spinepipe.studies.cohort_stiffness.sign_checks import sign_rows
from spinepipe.studies.cohort_stiffness.tables import ERRORS, SIGN_CHECKS, STIFFNESS
from spinepipe.tables import from_rows, write


def run(
    root: str, study: str, specimen: str, stiffness: str, errors: str, sign_checks: str
) -> None:
    """Write published stiffness, its errors, and the sign checks of the specimen."""
    settings, cohort = study_of_kind(CohortStiffness, root, study)
    tests = specimen_tests(settings, cohort, specimen)
    others = base_effects(root, settings, cohort, specimen)
    values: list[dict[str, Any]] = []
    seen: list[dict[str, Any]] = []
    for name in published_sets(settings, cohort):
        k = start_stiffness(settings, cohort, name)
        common = {"representation": name, "fitted_to": NOTHING, "source": "literature"}
        none = np.zeros(k.shape, dtype=int)
        rows = stiffness_rows(
            cohort.joint_names, settings.free, k, np.full(k.shape, np.inf), 0.0, None, none
        )
        ended = {"status": Status.CONVERGED.value, "message": ""}
        values += [{**row, **common, **ended} for row in rows]
        found = error_rows(cohort, specimen, tests, k, others)
        seen += [{**row, **common, "stage": "literature"} for row in found]
    k = start_stiffness(settings, cohort, PUBLISHED[0])
    signs = sign_rows(cohort, specimen, tests, k, others)
    made = origin("literature", root, settings, cohort, [specimen])
    write(from_rows(STIFFNESS.without("specimen"), values), stiffness, made)
    write(from_rows(ERRORS.without("specimen"), seen), errors, made)
    write(from_rows(SIGN_CHECKS.without("specimen"), signs), sign_checks, made)


def published_sets(study: CohortStiffness, cohort: Cohort) -> tuple[str, ...]:
    """The published sets that this cohort has values for."""
    levels = has_levels(study, cohort.joint_names)
    return tuple(name for name in PUBLISHED if levels or not named(name).by_level)
