"""The tests of one specimen that a cohort study uses: chosen cycles, loads and readings."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from spinepipe.cohort import Cohort
from spinepipe.cohort.main_moment import coupled_range, loaded_coordinate, peak_step
from spinepipe.cohort.specimen import joint_frames, load_cases, measured_motion
from spinepipe.effects.contract import Array
from spinepipe.frames import Pose
from spinepipe.model import LoadCase
from spinepipe.studies import CohortStiffness
from spinepipe.studies.fitted_to import ALL, ALL_BUT, tests_of

FIRST_CYCLE = 1


@dataclass(frozen=True)
class TestedCycle:
    """One cycle of one test.

    Attributes
    ----------
    measured : (T, J, 6) m and rad, NaN where not measured; zeros that zeroing makes are no reading.
    peak : place of the load step with the largest moment.
    loaded : coordinate that the main moment drives, None without a moment.
    """

    case: LoadCase
    measured: Array
    peak: int
    loaded: str | None


def driven(cycles: Sequence[TestedCycle]) -> str | None:
    """The coordinate that most cycles of a test load; of equally many that of the first."""
    return Counter(one.loaded for one in cycles).most_common(1)[0][0]


@dataclass(frozen=True)
class SpecimenTests:
    """Joint frames of a specimen in the neutral pose, and its tests."""

    frames: tuple[Pose, ...]
    tested: tuple[TestedCycle, ...]

    @property
    def tests(self) -> tuple[str, ...]:
        """Names of the tests with readings."""
        return tuple(dict.fromkeys(one.case.test for one in self.tested))

    def fitted_to(self, label: str) -> tuple[TestedCycle, ...]:
        """The tests that a label of ``fitted_to`` means, as far as the specimen has them."""
        if label == ALL:
            return self.tested
        if not label.startswith(ALL_BUT):
            return tuple(one for one in self.tested if one.case.test == label)
        left_out = label.removeprefix(ALL_BUT)
        if left_out not in self.tests:
            return ()  # nothing would be held out
        return tuple(one for one in self.tested if one.case.test != left_out)

    def stage(self, test: str, label: str) -> str:
        """``fitted`` where a fit to that label saw the test, else ``left_out_case``."""
        within = {one.case.test for one in self.fitted_to(label)}
        return "fitted" if test in within else "left_out_case"

    def why_none(self, label: str) -> str:
        """Why a label of ``fitted_to`` means no test of this specimen, in words."""
        left_out = label.removeprefix(ALL_BUT)
        if label.startswith(ALL_BUT) and left_out not in self.tests:
            return f"not measured in {left_out}: nothing would be held out"
        return f"no motion to fit for {label}"


def specimen_tests(study: CohortStiffness, cohort: Cohort, specimen: str) -> SpecimenTests:
    """The chosen tests of a specimen; cycles without any reading are none."""
    return _specimen_tests(cohort, specimen, tests_of(study, cohort), study.cycles)


@lru_cache(maxsize=64)
def _specimen_tests(
    cohort: Cohort, specimen: str, tests: tuple[str, ...], cycles: str
) -> SpecimenTests:
    cases = load_cases(cohort, specimen, tests, np.zeros(3))
    motions = measured_motion(cohort, specimen, cases)
    found = [
        TestedCycle(case, _readings(motion.q, cohort), peak_step(case), loaded_coordinate(case))
        for case, motion in zip(cases, motions, strict=True)
    ]
    read = [one for one in found if np.isfinite(one.measured).any()]
    return SpecimenTests(joint_frames(cohort, specimen), tuple(_chosen(cycles, read)))


def _readings(q: Array, cohort: Cohort) -> Array:
    readings = q.copy()
    if cohort.zeroed_at_step_0:
        readings[0] = np.nan
    return readings


def _chosen(cycles: str, found: Sequence[TestedCycle]) -> list[TestedCycle]:
    """Cycles that are used, test by test; ``cycles`` as in the study."""
    chosen: list[TestedCycle] = []
    for test in dict.fromkeys(one.case.test for one in found):
        of_test = [one for one in found if one.case.test == test]
        later = [one for one in of_test if one.case.cycle != FIRST_CYCLE] or of_test
        if cycles == "all":
            later = of_test
        if cycles == "quietest":
            later = [min(later, key=lambda one: coupled_range(one.case))]
        chosen += later
    return chosen
