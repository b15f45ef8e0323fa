"""The tests of a specimen, cycle by cycle: the loads, and the motion that was measured."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from spinepipe.cohort.cohort import Cohort
from spinepipe.cohort.load_tests import (
    loaded_coordinate,
    most_pushed_step,
    peak_step,
    pushed_coordinate,
)
from spinepipe.cohort.specimen import joint_frames, load_cases
from spinepipe.cohort.supports import as_read, with_supports
from spinepipe.effects.contract import Array
from spinepipe.frames import Pose, reexpress
from spinepipe.model import LoadCase, MeasuredCase
from spinepipe.units import COORDINATE_COLUMNS, COORDINATES, to_si

NO_SHIFT = np.zeros(3)


@dataclass(frozen=True)
class MeasuredCycle(MeasuredCase):
    """One cycle of one test as a cohort lists it: loads and motion (T, J, 6)."""

    @cached_property
    def peak(self) -> int:
        """Place of the load step with the largest moment; of force where that is what drives."""
        return most_pushed_step(self.case) if self.is_pushed else peak_step(self.case)

    @cached_property
    def loaded(self) -> str | None:
        """Coordinate that the main moment drives, or the main force, see `is_pushed`; or None."""
        return pushed_coordinate(self.case) if self.is_pushed else loaded_coordinate(self.case)

    @cached_property
    def is_pushed(self) -> bool:
        """Whether a force is what is read of: its coordinate is read, that of the moment is not."""
        turned, pushed = loaded_coordinate(self.case), pushed_coordinate(self.case)
        return not self._reads(turned) and self._reads(pushed)

    def _reads(self, coordinate: str | None) -> bool:
        if coordinate is None:
            return False
        return bool(np.isfinite(self.readings[..., COORDINATES.index(coordinate)]).any())

    def in_frames(self, nominal: Sequence[Pose], sampled: Sequence[Pose]) -> "MeasuredCycle":
        """The same motion of the vertebrae, expressed in other joint frames.

        The motion belongs to the vertebrae, so all six components are needed: those not measured
        are taken as zero for the purpose, and stay NaN in the result.
        """
        q = self.measured.copy()
        for step, joint in zip(*np.nonzero(np.isfinite(q).any(axis=2)), strict=True):
            known = np.isfinite(q[step, joint])
            moved = reexpress(np.nan_to_num(q[step, joint]), nominal[joint], sampled[joint])
            q[step, joint] = np.where(known, moved, np.nan)
        return replace(self, measured=q)


@dataclass(frozen=True)
class MeasuredSpecimen:
    """A specimen with its tests.

    Attributes
    ----------
    frames : joint frames in the neutral pose, in which motion is told.
    """

    specimen: str
    frames: tuple[Pose, ...]
    tested: tuple[MeasuredCycle, ...]

    @property
    def tests(self) -> tuple[str, ...]:
        """Names of the tests."""
        return tuple(dict.fromkeys(one.case.test for one in self.tested))

    @property
    def cases(self) -> tuple[LoadCase, ...]:
        """The loads of every cycle."""
        return tuple(one.case for one in self.tested)


def measured_specimen(
    cohort: Cohort, specimen: str, tests: Sequence[str], shift: Array = NO_SHIFT
) -> MeasuredSpecimen:
    """Every cycle of these tests that the cohort lists loads of; motion NaN where there is none.

    Parameters
    ----------
    shift : (3,) m, added to every load point.
    """
    cases = load_cases(cohort, specimen, tests, shift)
    tested = measured_cycles(cohort, specimen, cases)
    return MeasuredSpecimen(specimen, joint_frames(cohort, specimen), tested)


def measured_cycles(
    cohort: Cohort, specimen: str, cases: Sequence[LoadCase]
) -> tuple[MeasuredCycle, ...]:
    """Each case with its measured motion in the cohort's own joint frames."""
    joints = {name: index for index, name in enumerate(cohort.joint_names)}
    found = []
    for case in cases:
        motion = _motion(cohort, specimen, case, joints)
        with_rig = with_supports(cohort, specimen, case, motion)
        read = as_read(with_rig, motion)
        found.append(MeasuredCycle(with_rig, read, cohort.zeroed_at_step_0))
    return tuple(found)


def _motion(cohort: Cohort, specimen: str, case: LoadCase, joints: Mapping[str, int]) -> Array:
    """(T, J, 6) m and rad, NaN where not measured."""
    q = np.full((len(case.steps), len(joints), 6), np.nan)
    if cohort.motion is None:
        return q
    table = cohort.motion
    rows = table[
        (table["specimen"] == specimen)
        & (table["test"] == case.test)
        & (table["cycle"] == case.cycle)
    ]
    at = {step.step: index for index, step in enumerate(case.steps)}
    values = to_si(rows[list(COORDINATE_COLUMNS)].to_numpy(float))
    for step, joint, value in zip(rows["step"], rows["joint"], values, strict=True):
        q[at[int(step)], joints[joint]] = value
    return q
