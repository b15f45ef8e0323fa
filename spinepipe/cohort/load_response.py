"""How joints answer the loads that drive them: rad per N m, m per N, by plain least squares.

No model is fitted, so that a mistake in the files (sign, unit) cannot drag anything along.
Published stiffness is used once, to tell which coordinates a test drives (`_driven`). Loads are
those that the chain carries in its neutral pose, for which the joint frames are enough.

Signs: a load on a coordinate is positive where it pushes towards positive motion, so a sound joint
has a positive slope. T load steps, J joints from below; 6 coordinates in the order of
`spinepipe.units.COORDINATES`.
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
"""Axis of the joint frame about which each rotation turns, in the order of `COORDINATES`: extension
about z (right), right bending about x (forwards), left rotation about y (up)."""

MAIN_SHARE = 0.5
"""A coordinate is driven in a test if it has more than this share of the joint's largest squared
load, summed over the steps.

Forces are compared with forces, moments with moments.
"""

NEAR_OTHERS = 0.2
"""And more than this share of the largest load of any joint in the test, not squared.

Where a force passes close to a joint its lever arm is short, and a small error of the joint centre
may turn the sign of the moment.
"""

UNSURE_M = 0.01
"""Error of a joint centre that is allowed for, m: palpated centres are taken to be no surer.

A moment drives only if it is larger than the joint's forces make with this lever arm. A force
drives only if it shifts the joint further than the joint's rotation shifts a point at this
distance, both at usual stiffness.
"""


@dataclass(frozen=True, eq=False)
class LoadResponse:
    """How one coordinate of one joint moves with the load that drives it in one test.

    Attributes
    ----------
    joint : its number from below. coordinate : one of `COORDINATES`.
    load, motion : (R,) N m and rad, or N and m, of the R steps with a reading; both less their
        means, or, where motion was zeroed, as changes from step 0.
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
        """Least squares of motion on load, through the origin; rad per N m or m per N."""
        return float(self.load @ self.motion / (self.load @ self.load))

    @property
    def correlation(self) -> float:
        """1 where the motion follows the load, -1 where it goes against it; 0 without motion.

        About the means, or about step 0 where motion was zeroed (then no Pearson correlation).
        """
        size = np.sqrt((self.load @ self.load) * (self.motion @ self.motion))
        return float(self.load @ self.motion / size) if size > 0.0 else 0.0

    @property
    def rms(self) -> float:
        """Root mean square of the motion, rad or m."""
        return float(np.sqrt(np.mean(self.motion**2)))


def joint_loads(frames: tuple[Pose, ...], case: LoadCase) -> Array:
    """(T, J, 6) N and N m that the listed loads put on each coordinate, in the neutral pose.

    Of every wrench on a vertebra above the joint: its force on the axes of the joint's frame, its
    moment about the frame's origin.

    Parameters
    ----------
    frames : of the joints in ground, caudal to cranial; joint j carries vertebra j.
    """
    loads = np.zeros((len(case.steps), len(frames), len(COORDINATES)))
    for row, step in zip(loads, case.steps, strict=True):
        for wrench in step.wrenches:
            for joint in range(wrench.body + 1):  # all joints below the vertebra it acts on
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
    frames : of the J joints in ground, neutral pose.
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
        """Whether forces act: their moments, unlike pure ones, depend on where joints are."""
        return any(wrench.force.any() for step in self.case.steps for wrench in step.wrenches)

    @property
    def from_rest(self) -> Array:
        """(T, J, 6) the readings; where step 0 has none, 0 there for what step 1 reads.

        A step 0 that was subtracted from the others is no reading, and stands as NaN.
        """
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
    """Responses of one test, of all driven coordinates that were read under loads that changed.

    Parameters
    ----------
    loads : (T, J, 6) see `joint_loads`. motion : (T, J, 6) m and rad, NaN where not read.
    zeroed : whether step 0 was subtracted from the motion; the loads are then told from there too.
    """
    # driven: by the change of load over all steps, whether read or not
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
    """(J, 6) which coordinates a test drives, see `MAIN_SHARE`, `NEAR_OTHERS` and `UNSURE_M`.

    ``power`` (J, 6) : sums of squares over the steps of the change of load, N2 and N2 m2.
    """
    # forces among forces, moments among moments: large in the joint, and not small in the chain
    found = np.zeros(power.shape, dtype=bool)
    for kind in (slice(0, 3), slice(3, 6)):
        own = power[:, kind]
        least = np.maximum(
            MAIN_SHARE * own.max(axis=1, keepdims=True), NEAR_OTHERS**2 * own.max(initial=0.0)
        )
        found[:, kind] = (own > least) & (own > 0.0)
    # what an error of `UNSURE_M` in a joint centre could make of the other kind is no drive;
    # load over usual stiffness (N/m, N m/rad) is the motion to expect, m and rad
    usual = np.array([middle(name) for name in COORDINATES])
    forces = power[:, :3].sum(axis=1, keepdims=True)
    turns = np.sum(power[:, 3:] / usual[3:] ** 2, axis=1, keepdims=True)
    found[:, 3:] &= power[:, 3:] > UNSURE_M**2 * forces
    found[:, :3] &= power[:, :3] / usual[:3] ** 2 > UNSURE_M**2 * turns
    return found


def typical(slopes: Sequence[float]) -> float:
    """Median size of slopes, whatever the signs."""
    return float(np.median(np.abs(slopes)))


def of_specimens(names: Iterable[str], every: Iterable[str]) -> str:
    """Specimens in words; all of them by one word where there are several."""
    chosen, known = list(names), list(every)
    return ALL if len(known) > 1 and set(chosen) == set(known) else ", ".join(chosen)
