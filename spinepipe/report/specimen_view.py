"""What is shown of one specimen: its frames, points, bodies, loads and measured motion."""

from dataclasses import dataclass

import numpy as np

from spinepipe.cohort import Cohort
from spinepipe.cohort.specimen import (
    Landmarks,
    MeasuredMotion,
    bodies,
    joint_frames,
    landmarks,
    load_cases,
    measured_motion,
)
from spinepipe.frames import Pose
from spinepipe.model import Body, LoadCase
from spinepipe.studies import JointPoseSensitivity
from spinepipe.units import MM_PER_M


@dataclass(frozen=True)
class SpecimenView:
    """One specimen; SI, ground axes, neutral pose.

    Attributes
    ----------
    frames : of the joints, caudal to cranial. points : landmarks, empty where there are none.
    bodies : the moving vertebrae that have a mass. cases, motions : one per test and cycle.
    """

    specimen: str
    frames: tuple[Pose, ...]
    points: Landmarks
    bodies: tuple[Body, ...]
    cases: tuple[LoadCase, ...]
    motions: tuple[MeasuredMotion, ...]


def view_of(cohort: Cohort, specimen: str, study: JointPoseSensitivity | None) -> SpecimenView:
    """A specimen of a cohort, with the tests and the load shift of a study where there is one."""
    tests = cohort.tests if study is None else study.tests or cohort.tests
    shift = np.zeros(3)
    if study is not None:
        shift = np.array(study.load_point_shift_mm.in_order()) / MM_PER_M
    cases = () if cohort.loads is None else load_cases(cohort, specimen, tests, shift)
    return SpecimenView(
        specimen=specimen,
        frames=joint_frames(cohort, specimen),
        points={} if cohort.landmarks is None else landmarks(cohort, specimen),
        bodies=tuple(body for body in bodies(cohort, specimen) if body.mass > 0.0),
        cases=cases,
        motions=measured_motion(cohort, specimen, cases),
    )
