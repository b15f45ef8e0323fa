"""How large vertebrae are, how heavy, and how joints stand: by level, and in a cohort's specimens.

What is measured or printed stands in `facts.csv`, with its source; a test measures again where the
scans are at hand (patients, many old and some scoliotic, lying). What is chosen stands here.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from spinepipe.cohort.cohort import Cohort
from spinepipe.cohort.specimen import joint_frames
from spinepipe.effects.contract import Array
from spinepipe.facts import numbers, several
from spinepipe.plausibility.score import usual
from spinepipe.units import MM_PER_M

SPACING_MM: Mapping[str, float] = numbers(__name__, "joint_spacing")
"""Between the joints below and above each vertebra."""

DISC_MM: Mapping[str, float] = numbers(__name__, "mean_disc_height")
"""Mean height of the two discs of a lumbar vertebra, and of all thoracic and cervical ones."""

DRY_KG: Mapping[str, float] = numbers(__name__, "dry_vertebra_mass")
"""Mean of a dry vertebra of each region."""

EXTENSION_DEG: Mapping[str, tuple[float, ...]] = several(__name__, "joint_extension")
"""Mean and SD of the extension in ground of the joint above each vertebra."""

REACH_SDS, MOUNTED_DEG = 4.0, 20.0
"""Chosen: SDs that a spine may be off the mean, and how far rig or ground may tilt it besides."""


def is_level(vertebra: str) -> bool:
    """Whether a name is a level of the spine, as L4 is and V4 is not."""
    return vertebra == "S1" or vertebra in SPACING_MM


def spacing_mm(vertebra: str) -> float | None:
    """Between the joints below and above a vertebra, mm; None for names that are no level."""
    return SPACING_MM.get(vertebra)


def height_mm(vertebra: str) -> float | None:
    """Of a body, from endplate to endplate, mm; None for names that are no level."""
    if vertebra not in SPACING_MM:
        return None
    return SPACING_MM[vertebra] - DISC_MM[vertebra if vertebra in DISC_MM else vertebra[0]]


def extension_range_deg(lower: str) -> tuple[float, float] | None:
    """Least and most extension of the joint above a vertebra in ground, deg."""
    if lower in EXTENSION_DEG:
        mean, sd = EXTENSION_DEG[lower]
        reach = REACH_SDS * sd + MOUNTED_DEG
        return mean - reach, mean + reach
    neck = usual("neck_extension")
    return (neck.low, neck.high) if is_level(lower) else None


def least_kg(vertebra: str) -> float:
    """Half of a mean dry vertebra; of names that are no level, of the lightest region."""
    return 0.5 * (DRY_KG[vertebra[0]] if vertebra in SPACING_MM else min(DRY_KG.values()))


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
