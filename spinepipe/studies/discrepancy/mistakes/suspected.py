"""What may be wrong in the files and not in the model: a mistake that a person should look for.

How joints answer the loads that drive them: radians per newton metre, by plain least squares.

No model is fitted and no stiffness supposed, so that a mistake in the files cannot drag anything
along. The load is what a chain carries in its neutral pose; it needs the joint frames alone.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from spinepipe.effects.contract import Array
from spinepipe.frames import Pose
from spinepipe.model import LoadCase
from spinepipe.studies.discrepancy.search.readings import Repeats, SpecimenReadings
from spinepipe.units import COORDINATES, ROTATIONS, less_step_0

ALL = "all specimens"


def of_specimens(names: Iterable[str], every: Iterable[str]) -> str:
    """Specimens in words; all of them by one word where there are several."""
    chosen, known = list(names), list(every)
    return ALL if len(known) > 1 and set(chosen) == set(known) else ", ".join(chosen)


ABOUT = (2, 0, 1)
"""Axis of the joint frame about which each of `ROTATIONS` turns."""

MAIN_SHARE = 0.5
"""A rotation is driven in a test if it has this share of the joint's largest squared load."""

NEAR_OTHERS = 0.2
"""And this share of the largest load of any joint: a short lever arm may change its side."""


@dataclass(frozen=True, eq=False)
class Answer:
    """How one rotation of one joint moves with the load that drives it in one test.

    Attributes
    ----------
    load, motion : (T,) N m and rad, as far as read, both without their mean (or from step 0).
    slope : rad per N m. correlation : of load and motion.
    """

    specimen: str
    test: str
    joint: int
    coordinate: str
    load: Array
    motion: Array

    @property
    def slope(self) -> float:
        """Least squares, motion on load; rad per N m."""
        return float(self.load @ self.motion / (self.load @ self.load))

    @property
    def correlation(self) -> float:
        """1 where the motion follows the load, -1 where it goes against it."""
        size = np.sqrt((self.load @ self.load) * (self.motion @ self.motion))
        return float(self.load @ self.motion / size) if size > 0.0 else 0.0


def answers(
    readings: Mapping[str, SpecimenReadings], zeroed: bool, sd: Array, clear: float
) -> list[Answer]:
    """All driven rotations whose motion is clear of the noise.

    Parameters
    ----------
    sd : (6,) of a reading, m and rad. clear : SDs that the motion's root mean square exceeds.
    """
    found = []
    for name, one in readings.items():
        for test in one.tests:
            found += _of_test(name, test, joint_moments(one.frames, test.case), zeroed)
    return [a for a in found if _rms(a.motion) > clear * sd[COORDINATES.index(a.coordinate)]]


def joint_moments(frames: tuple[Pose, ...], case: LoadCase) -> Array:
    """(T, J, 3) N m that the listed loads put on each of `ROTATIONS`, in the neutral pose."""
    moments = np.zeros((len(case.steps), len(frames), 3))
    for row, step in zip(moments, case.steps, strict=True):
        for wrench in step.wrenches:
            for joint in range(wrench.body + 1):
                arm = wrench.point - frames[joint].origin
                about = wrench.moment + np.cross(arm, wrench.force)
                row[joint] += (frames[joint].rotation.T @ about)[list(ABOUT)]
    return moments


def _of_test(specimen: str, test: Repeats, moments: Array, zeroed: bool) -> list[Answer]:
    centred = less_step_0(moments, True) if zeroed else moments - moments.mean(axis=0)
    power = np.sum(centred**2, axis=0)
    least = np.maximum(
        MAIN_SHARE * power.max(axis=1, keepdims=True), NEAR_OTHERS**2 * power.max(initial=0.0)
    )
    found = []
    for joint, number in np.argwhere((power > least) & (power > 0.0)):
        name = ROTATIONS[number]
        motion = test.mean[:, joint, COORDINATES.index(name)]
        load = moments[:, joint, number]
        there = np.isfinite(motion)
        load, motion = less_step_0(load, zeroed)[there], motion[there]
        if not zeroed and len(load):
            load, motion = load - load.mean(), motion - motion.mean()
        if load @ load > 0.0:
            found.append(Answer(specimen, test.case.test, int(joint), name, load, motion))
    return found


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))


def typical(slopes: list[float]) -> float:
    """Size of an answer, whatever the signs."""
    return float(np.median(np.abs(slopes)))
