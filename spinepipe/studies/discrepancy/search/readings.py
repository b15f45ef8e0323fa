"""The tests of one specimen as a search sees them: one load history each, its repeats together."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from spinepipe.cohort import Cohort
from spinepipe.cohort.load_response import joint_loads
from spinepipe.cohort.measured import measured_specimen
from spinepipe.effects.contract import Array
from spinepipe.frames import Pose
from spinepipe.model import LoadCase
from spinepipe.units import COORDINATES


@dataclass(frozen=True)
class Repeats:
    """All cycles of a test that had the same loads.

    Attributes
    ----------
    case : the loads; its cycle is that of the first.
    cycles : (C, T, J, 6) m and rad; NaN where nothing was read, in step 0 too where it was zeroed.
    """

    case: LoadCase
    cycles: Array

    @cached_property
    def count(self) -> NDArray[np.int64]:
        """(T, J, 6) number of readings."""
        return np.isfinite(self.cycles).sum(axis=0)

    @cached_property
    def mean(self) -> Array:
        """(T, J, 6) mean over the cycles, NaN where nothing was read."""
        with np.errstate(invalid="ignore"):
            total: Array = np.nansum(self.cycles, axis=0) / self.count
        return total


@dataclass(frozen=True)
class SpecimenReadings:
    """A specimen: its joint frames in the neutral pose and its tests."""

    specimen: str
    frames: tuple[Pose, ...]
    tests: tuple[Repeats, ...]

    @property
    def cases(self) -> tuple[LoadCase, ...]:
        """The load histories."""
        return tuple(test.case for test in self.tests)

    @property
    def coordinates(self) -> tuple[str, ...]:
        """Those with a reading in some test."""
        read = np.any([test.count.any(axis=(0, 1)) for test in self.tests], axis=0)
        return tuple(name for name, is_read in zip(COORDINATES, read, strict=True) if is_read)

    def errors(self, predicted: Sequence[Array]) -> list[Array]:
        """(T, J, 6) per test, predicted less measured; 0 where nothing was read."""
        return [
            np.nan_to_num(one - test.mean) for one, test in zip(predicted, self.tests, strict=True)
        ]

    @cached_property
    def applied(self) -> tuple[Array, ...]:
        """(T, J, 6) N and N m of each test: what its loads do at each joint, weight not counted."""
        return tuple(joint_loads(self.frames, case) for case in self.cases)


def specimen_readings(
    cohort: Cohort, specimen: str, tests: Sequence[str], coordinates: Sequence[str]
) -> SpecimenReadings:
    """Readings of a specimen in these tests and coordinates; tests without any are left out."""
    one = measured_specimen(cohort, specimen, tests)
    chosen = np.array([name in coordinates for name in COORDINATES])
    read = [(cycle.case, np.where(chosen, cycle.readings, np.nan)) for cycle in one.tested]
    read = [(case, q) for case, q in read if np.isfinite(q).any()]
    # cycles of equal loads together, in order of first appearance
    groups: dict[tuple[object, ...], list[tuple[LoadCase, Array]]] = {}
    for case, q in read:
        groups.setdefault(_loads(case), []).append((case, q))
    repeats = (Repeats(own[0][0], np.stack([q for _, q in own])) for own in groups.values())
    return SpecimenReadings(specimen, one.frames, tuple(repeats))


def _loads(case: LoadCase) -> tuple[object, ...]:
    """The same for cycles of one test with the same loads at the same times."""
    steps = tuple(
        (
            step.step,
            step.time,
            *(
                (w.body, w.point.tobytes(), w.force.tobytes(), w.moment.tobytes())
                for w in step.wrenches
            ),
            step.supports,
        )
        for step in case.steps
    )
    return (case.test, *steps)
