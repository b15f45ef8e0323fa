"""Each cycle of each test of a cohort: what its loads put on the joints, and what was read."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from spinepipe.cohort.cohort import Cohort
from spinepipe.cohort.load_response import joint_loads
from spinepipe.cohort.measured import measured_specimen
from spinepipe.effects.contract import Array
from spinepipe.frames import Pose
from spinepipe.model import LoadCase


@dataclass(frozen=True, eq=False)
class LoadedCycle:
    """One cycle of a test in which no rig fixes a joint.

    Attributes
    ----------
    loads : (T, J, 6) N and N m on each joint coordinate in the neutral pose, of the listed loads.
    readings : (T, J, 6) m and rad, NaN where not read.
    """

    specimen: str
    case: LoadCase
    frames: tuple[Pose, ...]
    loads: Array
    readings: Array

    @property
    def test(self) -> str:
        """Its name."""
        return self.case.test

    @property
    def pushed(self) -> bool:
        """Whether forces act, whose moments hang on where joints are."""
        return any(wrench.force.any() for step in self.case.steps for wrench in step.wrenches)

    @property
    def from_rest(self) -> Array:
        """(T, J, 6) the readings, 0 at step 0 where it was subtracted and is no reading."""
        found = self.readings.copy()
        if len(found) > 1 and not np.isfinite(found[0]).any():
            found[0] = np.where(np.isfinite(found[1]), 0.0, np.nan)
        return found

    @property
    def read_steps(self) -> int:
        """Steps with any reading."""
        return int(np.isfinite(self.readings).any(axis=(1, 2)).sum())


def loaded_cycles(cohort: Cohort) -> Iterator[LoadedCycle]:
    """All cycles whose loads and motion are told, of cohorts that tell where joints are."""
    if cohort.loads is None or cohort.motion is None or not cohort.has_frames:
        return
    for specimen in cohort.specimen_names:
        one = measured_specimen(cohort, specimen, cohort.tests)
        for cycle in one.tested:
            if cycle.case.steps and cycle.case.steps[0].supports:
                continue
            loads = joint_loads(one.frames, cycle.case)
            yield LoadedCycle(specimen, cycle.case, one.frames, loads, cycle.readings)
