"""How joints answer the loads that drive them: rad per N m, m per N, by plain least squares.

No model is fitted and no stiffness supposed, so that a mistake in the files cannot drag anything
along. The load is what a chain carries in its neutral pose; it needs the joint frames alone.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from spinepipe.anatomy.stiffness_range import middle
from spinepipe.cohort.cohort import Cohort
from spinepipe.cohort.measured import measured_specimen
from spinepipe.effects.contract import Array
from spinepipe.frames import Pose
from spinepipe.model import LoadCase
from spinepipe.units import COORDINATES, subtract_baseline

ALL = "all specimens"

ABOUT = (2, 0, 1)
"""Axis of the joint frame about which each of `ROTATIONS` turns."""

MAIN_SHARE = 0.5
"""A coordinate is driven in a test if it has this share of the joint's largest squared load.

Forces are compared with forces, moments with moments.
"""

NEAR_OTHERS = 0.2
"""And this share of the largest load of any joint: a short lever arm may change its side."""

UNSURE_M = 0.01
"""Joint centres are known no better: a moment must be larger than the forces make over so much, and
a force must move the joint by more than its rotation does over so much, at usual stiffness."""


@dataclass(frozen=True, eq=False)
class LoadResponse:
    """How one coordinate of one joint moves with the load that drives it in one test.

    Attributes
    ----------
    load, motion : (T,) N m and rad, or N and m, as far as read, both without their mean (or from
        step 0).
    slope : rad per N m or m per N. correlation : of load and motion.
    """

    specimen: str
    test: str
    joint: int
    coordinate: str
    load: Array
    motion: Array

    @property
    def slope(self) -> float:
        """Least squares, motion on load; rad per N m or m per N."""
        return float(self.load @ self.motion / (self.load @ self.load))

    @property
    def correlation(self) -> float:
        """1 where the motion follows the load, -1 where it goes against it."""
        size = np.sqrt((self.load @ self.load) * (self.motion @ self.motion))
        return float(self.load @ self.motion / size) if size > 0.0 else 0.0

    @property
    def rms(self) -> float:
        """Root mean square of the motion, rad or m."""
        return float(np.sqrt(np.mean(self.motion**2)))


def joint_loads(frames: tuple[Pose, ...], case: LoadCase) -> Array:
    """(T, J, 6) N and N m that the listed loads put on each coordinate, in the neutral pose."""
    loads = np.zeros((len(case.steps), len(frames), len(COORDINATES)))
    for row, step in zip(loads, case.steps, strict=True):
        for wrench in step.wrenches:
            for joint in range(wrench.body + 1):
                back = frames[joint].rotation.T
                arm = wrench.point - frames[joint].origin
                about = wrench.moment + np.cross(arm, wrench.force)
                row[joint, :3] += back @ wrench.force
                row[joint, 3:] += (back @ about)[list(ABOUT)]
    return loads


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


def load_responses(
    specimen: str, test: str, loads: Array, motion: Array, zeroed: bool
) -> Iterator[LoadResponse]:
    """All driven coordinates that were read under loads that changed.

    Parameters
    ----------
    loads : (T, J, 6) see `joint_loads`. motion : (T, J, 6) m and rad, NaN where not read.
    """
    centred = subtract_baseline(loads, True) if zeroed else loads - loads.mean(axis=0)
    for joint, number in np.argwhere(_driven(np.sum(centred**2, axis=0))):
        read = motion[:, joint, number]
        load = loads[:, joint, number]
        there = np.isfinite(read)
        load, read = subtract_baseline(load, zeroed)[there], read[there]
        if not zeroed and len(load):
            load, read = load - load.mean(), read - read.mean()
        if load @ load > 0.0:
            yield LoadResponse(specimen, test, int(joint), COORDINATES[number], load, read)


def _driven(power: Array) -> NDArray[np.bool_]:
    """(J, 6) which coordinates a test drives, from the sums of squares (J, 6) of their loads."""
    # forces among forces, moments among moments: large in the joint, and not small in the chain
    found = np.zeros(power.shape, dtype=bool)
    for kind in (slice(0, 3), slice(3, 6)):
        own = power[:, kind]
        least = np.maximum(
            MAIN_SHARE * own.max(axis=1, keepdims=True), NEAR_OTHERS**2 * own.max(initial=0.0)
        )
        found[:, kind] = (own > least) & (own > 0.0)
    # what an error of `UNSURE_M` in a joint centre could make of the other kind is no drive
    usual = np.array([middle(name) for name in COORDINATES])
    forces = power[:, :3].sum(axis=1, keepdims=True)
    turns = np.sum(power[:, 3:] / usual[3:] ** 2, axis=1, keepdims=True)
    found[:, 3:] &= power[:, 3:] > UNSURE_M**2 * forces
    found[:, :3] &= power[:, :3] / usual[:3] ** 2 > UNSURE_M**2 * turns
    return found


def typical(slopes: Sequence[float]) -> float:
    """Size of an answer, whatever the signs."""
    return float(np.median(np.abs(slopes)))


def of_specimens(names: Iterable[str], every: Iterable[str]) -> str:
    """Specimens in words; all of them by one word where there are several."""
    chosen, known = list(names), list(every)
    return ALL if len(known) > 1 and set(chosen) == set(known) else ", ".join(chosen)
