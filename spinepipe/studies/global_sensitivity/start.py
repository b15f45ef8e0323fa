"""Where the variation of a specimen starts: its own spine, landmarks and tests."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from spinepipe.calibration import Problem
from spinepipe.cohort.cohort import Cohort
from spinepipe.cohort.measured import measured_cycles
from spinepipe.cohort.specimen import (
    followers,
    joint_frames,
    landmarks,
    load_cases,
    on_bushings,
)
from spinepipe.effects.contract import Array
from spinepipe.frames import FRAME_LANDMARKS
from spinepipe.model import LoadCase, SpineModel
from spinepipe.studies.global_sensitivity.settings import SampleCalibration
from spinepipe.studies.problem import measured_in_frames, stiffness_problem
from spinepipe.studies.selected_tests import SelectedTest, first_cycles, select_steps

Flags = NDArray[np.bool_]

SUPERIOR, INFERIOR, LEFT, RIGHT = range(len(FRAME_LANDMARKS))
"""Places of the landmarks, in the order of `FRAME_LANDMARKS`."""


@dataclass(frozen=True, eq=False)
class DescribedSpecimen:
    """A specimen as the cohort describes it.

    Attributes
    ----------
    model : its spine on linear bushings, the model's only effect.
    vertebrae : caudal to cranial; the first is fixed.
    points : (J + 1, 4, 3) m, ground: landmarks that make frames; zero where there is none.
    known : (J + 1, 4) which of them there are.
    given : (J,) joints whose frame ``joints.csv`` gives, whatever the landmarks are.
    tests : its tests.
    """

    model: SpineModel
    vertebrae: tuple[str, ...]
    points: Array
    known: Flags
    given: Flags
    tests: tuple[SelectedTest, ...]


def start_of(
    cohort: Cohort,
    specimen: str,
    stiffness: Array,
    damping: Array,
    tests: Sequence[str],
    all_steps: bool,
) -> DescribedSpecimen:
    """A specimen of a cohort with loads.

    Parameters
    ----------
    stiffness : (6,) or (J, 6) N/m and N m/rad. damping : (6,) N s/m and N m s/rad.
    tests : names of tests; those that the specimen does not have are left out.
    all_steps : all load steps, or that of the largest load only.
    """
    return DescribedSpecimen(
        on_bushings(cohort, specimen, joint_frames(cohort, specimen), stiffness, damping),
        cohort.vertebrae,
        *frame_landmarks(cohort, specimen),
        given_joints(cohort, specimen),
        asked_tests(cohort, specimen, tests, all_steps),
    )


def asked_tests(
    cohort: Cohort, specimen: str, tests: Sequence[str], all_steps: bool
) -> tuple[SelectedTest, ...]:
    """The first cycle of each of the tests that the specimen has.

    Motion counts as the cohort's does: from step 0 where that was subtracted.

    Parameters
    ----------
    cohort : with loads.
    all_steps : all load steps, or that of the largest load only.
    """
    under = followers(cohort, specimen)
    return tuple(
        select_steps(case, cohort.gravity or case.test in under, all_steps, cohort.zeroed_at_step_0)
        for case in first_cycles(load_cases(cohort, specimen, tests, np.zeros(3)))
    )


def frame_landmarks(cohort: Cohort, specimen: str) -> tuple[Array, Flags]:
    """Points (J + 1, 4, 3) m, and which of them there are (J + 1, 4)."""
    points = np.zeros((len(cohort.vertebrae), len(FRAME_LANDMARKS), 3))
    known = np.zeros(points.shape[:2], dtype=bool)
    found = {} if cohort.landmarks is None else landmarks(cohort, specimen)
    for row, vertebra in enumerate(cohort.vertebrae):
        for column, name in enumerate(FRAME_LANDMARKS):
            point = found.get(vertebra, {}).get(name)
            if point is not None:
                points[row, column], known[row, column] = point, True
    return points, known


def given_joints(cohort: Cohort, specimen: str) -> Flags:
    """(J,) joints whose frame ``joints.csv`` gives."""
    if cohort.joints is None:
        return np.zeros(len(cohort.joint_names), dtype=bool)
    rows = cohort.joints[cohort.joints["specimen"] == specimen]
    return np.isin(cohort.joint_names, rows["joint"])


def moved_by(known: Flags, given: Flags, vertebra: int, landmark: int) -> list[int]:
    """Joints whose frame a landmark has a part in."""
    # a frame is the mean of those of vertebrae that have all landmarks, at the middle of the two
    # facing endplates: other landmarks of a vertebra that lacks one have no part in it
    whole = [bool(row.all()) for row in known]
    facing = {vertebra: SUPERIOR, vertebra - 1: INFERIOR}  # of the joint above, and of that below
    return [
        joint
        for joint, (lower, upper) in enumerate(pairwise(range(len(known))))
        if vertebra in (lower, upper)
        and known[vertebra, landmark]
        and not given[joint]
        and (whole[vertebra] or facing[joint] == landmark)
    ]


def problem_of(
    options: SampleCalibration,
    cohort: Cohort,
    start: DescribedSpecimen,
    model: SpineModel,
    cases: Sequence[LoadCase],
    free: Sequence[str],
) -> Problem:
    """The fit to measured motion of one stiffness for all joints in each free coordinate.

    Parameters
    ----------
    start : the specimen as the cohort has it.
    model, cases : its spine and loads, perhaps with other joint frames and load points, into which
        the readings are brought.
    free : coordinates.
    """
    specimen = model.specimen
    tested = measured_cycles(cohort, specimen, [test.case for test in start.tests])
    moved = measured_in_frames(tested, joint_frames(cohort, specimen), model.frames)
    measured = [replace(one, case=case) for case, one in zip(cases, moved, strict=True)]
    weights = np.array(options.weights.in_order(), dtype=float)
    return stiffness_problem(model, measured, free, "per_specimen", options.bound_factor, weights)
