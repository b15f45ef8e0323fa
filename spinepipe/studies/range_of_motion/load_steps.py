"""Which load steps of which tests are computed for a specimen."""

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from spinepipe.cohort import Cohort
from spinepipe.cohort.load_tests import peak_step, virtual_load_cases
from spinepipe.cohort.specimen import load_cases
from spinepipe.jobs.inputs import study_of_kind
from spinepipe.model import LoadCase, LoadStep
from spinepipe.studies.range_of_motion.settings import RangeOfMotion


@dataclass(frozen=True)
class AskedTest:
    """A test of which some steps are computed.

    Attributes
    ----------
    case : the steps to compute.
    from_neutral : whether motion counts from the neutral pose: nothing acts in step 0, so it need
        not be computed. Otherwise it counts from the first step of the case, which is step 0.
    largest : number of the step of the largest load.
    stored : which steps of the case become rows, from this one on.
    """

    case: LoadCase
    from_neutral: bool
    largest: int
    stored: slice


@lru_cache(maxsize=256)
def asked_tests(root: str, study: str, specimen: str, _digest: str) -> tuple[AskedTest, ...]:
    """Tests of a specimen; ``_digest`` is that of its cohort."""
    settings, cohort = study_of_kind(RangeOfMotion, root, study)
    return tuple(
        _asked(case, cohort.gravity, settings.rows == "all_steps")
        for case in all_cases(settings, cohort, specimen)
    )


def all_cases(settings: RangeOfMotion, cohort: Cohort, specimen: str) -> tuple[LoadCase, ...]:
    """All steps of the tests that the study asks for."""
    tests = settings.virtual_tests
    if tests is not None:
        top = len(cohort.joint_names) - 1
        return virtual_load_cases(tests.tests, tests.moment_nm, tests.steps, top)
    measured = load_cases(cohort, specimen, settings.tests or cohort.tests, np.zeros(3))
    first: dict[str, LoadCase] = {}
    for case in measured:
        first.setdefault(case.test, case)
    return tuple(first.values())


def _asked(case: LoadCase, gravity: bool, all_steps: bool) -> AskedTest:
    """Joints have no memory, so the largest load can be computed without the steps before it."""
    largest = case.steps[peak_step(case)]
    from_neutral = not gravity and not _loaded(case.steps[0])
    if all_steps:
        return AskedTest(case, from_neutral, largest.step, slice(None))
    if from_neutral or largest is case.steps[0]:
        return AskedTest(replace(case, steps=(largest,)), from_neutral, largest.step, slice(None))
    both = replace(case, steps=(case.steps[0], largest))
    return AskedTest(both, from_neutral, largest.step, slice(1, None))


def _loaded(step: LoadStep) -> bool:
    """Whether anything acts; loads that balance each other still press and bend."""
    return any(wrench.force.any() or wrench.moment.any() for wrench in step.wrenches)
