"""Which load steps of which tests are computed for a specimen."""

from functools import lru_cache

import numpy as np

from spinepipe.cohort import Cohort
from spinepipe.cohort.load_tests import virtual_load_cases
from spinepipe.cohort.specimen import followers, load_cases
from spinepipe.jobs.inputs import study_of_kind
from spinepipe.model import LoadCase
from spinepipe.studies.range_of_motion.settings import RangeOfMotion
from spinepipe.studies.selected_tests import SelectedTest, first_cycles, select_steps


@lru_cache(maxsize=256)
def asked_tests(root: str, study: str, specimen: str, _digest: str) -> tuple[SelectedTest, ...]:
    """Tests of a specimen; ``_digest`` is that of its cohort."""
    settings, cohort = study_of_kind(RangeOfMotion, root, study)
    virtual = virtual_tensions(settings)
    tension_n = followers(cohort, specimen) if virtual is None else virtual
    return tuple(
        select_steps(
            case,
            cohort.gravity or tension_n.get(case.test, 0.0) > 0.0,
            settings.rows == "all_steps",
        )
        for case in all_cases(settings, cohort, specimen)
    )


def all_cases(settings: RangeOfMotion, cohort: Cohort, specimen: str) -> tuple[LoadCase, ...]:
    """All steps of the tests that the study asks for."""
    tests = settings.virtual_tests
    if tests is not None:
        top = len(cohort.joint_names) - 1
        return virtual_load_cases(tests.tests, tests.moment_nm, tests.steps, top)
    return first_cycles(load_cases(cohort, specimen, settings.tests or cohort.tests, np.zeros(3)))


def virtual_tensions(settings: RangeOfMotion) -> dict[str, float] | None:
    """Follower load in N of each virtual test; None: the tests are the cohort's, as it says."""
    asked_for = settings.virtual_tests
    return None if asked_for is None else dict.fromkeys(asked_for.tests, asked_for.follower_n)
