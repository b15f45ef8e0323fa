"""One specimen with its frames, points, bodies and tests, as views of it need them."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from spinepipe.cohort import Cohort
from spinepipe.cohort.measured import MeasuredCycle, measured_specimen
from spinepipe.cohort.specimen import (
    Landmarks,
    bodies,
    joint_frames,
    landmarks,
)
from spinepipe.frames import Pose
from spinepipe.model import Body, LoadCase
from spinepipe.units import MM_PER_M


@dataclass(frozen=True)
class SpecimenView:
    """One specimen; SI, ground axes, neutral pose.

    Attributes
    ----------
    frames : of the joints, caudal to cranial; none where the cohort does not tell them.
    points : landmarks, empty where there are none.
    bodies : the moving vertebrae that have a mass. tested : one per test and cycle.
    """

    specimen: str
    frames: tuple[Pose, ...]
    points: Landmarks
    bodies: tuple[Body, ...]
    tested: tuple[MeasuredCycle, ...]

    @property
    def cases(self) -> tuple[LoadCase, ...]:
        """The loads of every cycle."""
        return tuple(one.case for one in self.tested)


def view_of(
    cohort: Cohort,
    specimen: str,
    tests: Sequence[str] | None = None,
    load_shift_mm: Sequence[float] = (0.0, 0.0, 0.0),
) -> SpecimenView:
    """A specimen of a cohort with its tests, by default all of them.

    Parameters
    ----------
    load_shift_mm : (3,) by which a study moves the point where loads act: x anterior, y superior,
        z right.
    """
    shift = np.array(load_shift_mm) / MM_PER_M
    asked = tests or cohort.tests
    tested = (
        () if cohort.loads is None else measured_specimen(cohort, specimen, asked, shift).tested
    )
    return SpecimenView(
        specimen=specimen,
        frames=joint_frames(cohort, specimen) if cohort.has_frames else (),
        points={} if cohort.landmarks is None else landmarks(cohort, specimen),
        bodies=tuple(body for body in bodies(cohort, specimen) if body.mass > 0.0),
        tested=tested,
    )
