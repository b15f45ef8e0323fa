"""Where the joints of a cohort stand and which way they face, for doubts about the places."""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from spinepipe.cohort.cohort import Cohort
from spinepipe.cohort.specimen import joint_frames
from spinepipe.effects.contract import Array
from spinepipe.plausibility.warnings.levels import spacing_mm
from spinepipe.units import MM_PER_M

USUAL_MM = 35.0
"""Between joints of vertebrae whose names are no level, see `spacing_mm`."""


@dataclass(frozen=True, eq=False)
class NeutralPose:
    """Joint frames of one specimen in ground, caudal to cranial.

    Attributes
    ----------
    vertebrae : (J + 1) names. origins : (J, 3) mm. rotations : (J, 3, 3).
    """

    specimen: str
    vertebrae: tuple[str, ...]
    origins: Array
    rotations: Array

    @property
    def spacing(self) -> Array:
        """(J - 1) mm between neighbouring joints."""
        return np.array([float(np.linalg.norm(b - a)) for a, b in pairwise(self.origins)])

    def near(self, vertebra: str) -> Array:
        """(3,) mm: the middle of a vertebra; of the first and last, half of one past its joint."""
        level = self.vertebrae.index(vertebra)
        if 0 < level < len(self.origins):
            between: Array = self.origins[level - 1 : level + 1].mean(axis=0)
            return between
        joint, side = (0, -0.5) if level == 0 else (-1, 0.5)
        size = side * (spacing_mm(vertebra) or USUAL_MM)
        beyond: Array = self.origins[joint] + size * self.rotations[joint][:, 1]
        return beyond


def neutral_poses(cohort: Cohort) -> Iterator[NeutralPose]:
    """Every specimen of a cohort that tells where its joints are."""
    for name in cohort.specimen_names:
        frames = joint_frames(cohort, name)
        origins = np.array([frame.origin for frame in frames]) * MM_PER_M
        rotations = np.array([frame.rotation for frame in frames])
        yield NeutralPose(name, cohort.vertebrae, origins, rotations)
