"""Which load steps of which tests are computed for a specimen, and where its motion begins."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from spinepipe.cohort.cohort import Cohort
from spinepipe.cohort.main_moment import peak_step
from spinepipe.cohort.specimen import load_cases
from spinepipe.model import LoadCase, LoadStep


@dataclass(frozen=True)
class AskedTest:
    """A test of which some steps are computed.

    Attributes
    ----------
    case : the steps to compute.
    from_first : whether motion counts from the first step of the case, which is step 0; otherwise
        from the neutral pose.
    stored : which steps of the case become rows.
    """

    case: LoadCase
    from_first: bool
    stored: slice

    @property
    def steps(self) -> tuple[int, ...]:
        """Numbers of the steps that become rows."""
        return tuple(step.step for step in self.case.steps[self.stored])


def asked_tests(
    cohort: Cohort, specimen: str, tests: Sequence[str], all_steps: bool
) -> tuple[AskedTest, ...]:
    """The first cycle of each of the tests that the specimen has.

    Motion counts as the cohort's does: from step 0 where that was subtracted.

    Parameters
    ----------
    cohort : with loads.
    all_steps : all load steps, or that of the largest load only.
    """
    first: dict[str, LoadCase] = {}
    for case in load_cases(cohort, specimen, tests, np.zeros(3)):
        first.setdefault(case.test, case)
    return tuple(_asked(case, cohort, all_steps) for case in first.values())


def _asked(case: LoadCase, cohort: Cohort, all_steps: bool) -> AskedTest:
    """Joints have no memory, so the largest load can be computed without the steps before it."""
    # where nothing acts in step 0, that is the neutral pose and need not be subtracted
    from_first = cohort.zeroed_at_step_0 and (cohort.gravity or _loaded(case.steps[0]))
    if all_steps:
        return AskedTest(case, from_first, slice(None))
    largest = case.steps[peak_step(case)]
    if not from_first or largest is case.steps[0]:
        return AskedTest(replace(case, steps=(largest,)), from_first, slice(None))
    return AskedTest(replace(case, steps=(case.steps[0], largest)), from_first, slice(1, None))


def _loaded(step: LoadStep) -> bool:
    """Whether anything acts; loads that balance each other still press and bend."""
    return any(wrench.force.any() or wrench.moment.any() for wrench in step.wrenches)
