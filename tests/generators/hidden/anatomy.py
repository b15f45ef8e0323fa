"""Geometry, masses and base stiffness of one made-up specimen of a region of the spine. SI.

Axes: x anterior, y superior, z right. J joints, caudal to cranial; joint j carries body j.
"""

from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
from scipy.spatial.transform import Rotation

if TYPE_CHECKING:
    from .recipe import Recipe

COORDINATES = ("anterior", "superior", "right", "extension", "right_bending", "left_rotation")
TRANSLATIONS, ROTATIONS = COORDINATES[:3], COORDINATES[3:]

TILT_DEG = 1.5
"""SD of a joint's right bending and left rotation in ground."""
OFFSET_M = 0.0005
SPACING_LOG_SD = 0.04
FIXTURE_KG = 0.5
"""What the uppermost vertebra carries besides."""
RADII_M = np.array([0.017, 0.020, 0.018])
"""Gyration about x, y, z of a segment."""
ROTATIONAL_LOG_SD = 0.3


@dataclass(frozen=True)
class Region:
    """A part of the spine from which specimens are cut.

    Attributes
    ----------
    vertebrae : caudal to cranial. lordosis_deg : of each joint, mean and SD. spacing_m : of joints.
    segment_kg : one vertebra with what stays on it.
    rotational, translational : medians N m/rad and N/m; the latter is the truth wherever no
        translation is reported.
    translational_range : where translations are reported the truth is drawn log-uniformly from it.
    """

    vertebrae: tuple[str, ...]
    lordosis_deg: tuple[tuple[float, float], ...]
    spacing_m: tuple[float, ...]
    segment_kg: float
    rotational: tuple[float, float, float]
    translational: tuple[float, float, float]
    translational_range: tuple[float, float]

    @property
    def joints(self) -> tuple[str, ...]:
        """Names, caudal to cranial."""
        return tuple(upper + lower for lower, upper in pairwise(self.vertebrae))


LUMBAR = Region(
    vertebrae=("S1", "L5", "L4", "L3", "L2", "L1", "T12"),
    # doi 10.1038/s41598-022-21840-x, Table 2: lordosis of each disc, mean and SD; T12L1 assumed.
    lordosis_deg=((21.6, 7.7), (12.7, 5.1), (9.1, 4.2), (5.9, 4.1), (1.2, 3.6), (0.0, 3.6)),
    # Panjabi et al. 1992, Table 2 (posterior height, L5 to T12) plus disc heights of about 10 mm.
    spacing_m=(0.0340, 0.0355, 0.0345, 0.0340, 0.0325, 0.0310),
    segment_kg=0.12,
    # Gould et al. 2024b (doi 10.3389/fbioe.2024.1372088): Table 3, found 60 to 420; Table 2,
    # uniform row.
    rotational=(75.0, 85.0, 250.0),
    translational=(149_000.0, 1_890_000.0, 135_000.0),
    translational_range=(1e5, 1e6),
)
CERVICAL = Region(
    vertebrae=("C7", "C6", "C5", "C4", "C3"),
    lordosis_deg=((2.0, 3.0), (3.0, 3.0), (3.0, 3.0), (3.0, 3.0)),
    spacing_m=(0.0190, 0.0185, 0.0180, 0.0175),
    segment_kg=0.03,
    # Of the size that Moroney et al. 1988 (J Orthop Res 6:713) found for whole segments.
    rotational=(35.0, 40.0, 65.0),
    translational=(100_000.0, 1_300_000.0, 110_000.0),
    translational_range=(6e4, 6e5),
)
REGIONS = {"lumbar": LUMBAR, "cervical": CERVICAL}

JOINTS = LUMBAR.joints
"""Of a whole lumbar specimen."""


@dataclass(frozen=True)
class Bones:
    """One specimen in the neutral pose.

    Attributes
    ----------
    origins, rotations : (J, 3) m and (J, 3, 3), joint frames in ground.
    masses, centres, inertias : (J,) kg, (J, 3) m and (J, 3, 3) kg m2 about the centre, ground axes.
    """

    origins: np.ndarray
    rotations: np.ndarray
    masses: np.ndarray
    centres: np.ndarray
    inertias: np.ndarray


def joints_of_recipe(recipe: "Recipe") -> tuple[str, ...]:
    """Names of the joints that a recipe's specimens have, caudal to cranial."""
    return _cut(REGIONS[recipe.region].joints, recipe)


def vertebrae_of_recipe(recipe: "Recipe") -> tuple[str, ...]:
    """Names of the vertebrae, caudal to cranial; the first is potted."""
    every = REGIONS[recipe.region].vertebrae
    return every[recipe.lowest : recipe.lowest + recipe.joints + 1]


def _cut(values, recipe):
    cut = values[recipe.lowest : recipe.lowest + recipe.joints]
    if len(cut) != recipe.joints:
        raise ValueError(f"{recipe.region} has no {recipe.joints} joints from {recipe.lowest} on")
    return cut


def bones(rng: np.random.Generator, recipe: "Recipe") -> Bones:
    """A lordotic specimen; each segment's centre of mass lies midway between its two joints."""
    region = REGIONS[recipe.region]
    n_joints = len(region.joints)
    extension = np.cumsum([rng.normal(*level) for level in region.lordosis_deg])
    extension -= extension[2:4].mean() if recipe.joints == n_joints else 0.0  # potted at mid level
    tilts = rng.normal(0.0, TILT_DEG, (n_joints, 2))
    spread = np.exp(rng.normal(0.0, SPACING_LOG_SD, n_joints))
    spacing = _cut(np.array(region.spacing_m) * spread, recipe)
    offsets = _cut(rng.normal(0.0, OFFSET_M, (n_joints, 3)), recipe)
    extension, tilts = _cut(extension, recipe), _cut(tilts, recipe)
    if recipe.joints < n_joints:
        extension = extension - extension.mean()  # a short specimen is potted level
    turns = Rotation.from_euler("ZXY", np.column_stack([extension, tilts]), degrees=True)
    rotations = turns.as_matrix()
    up = rotations[:, :, 1]
    ends = np.vstack([up[1:], up[-1:]])
    steps = spacing[:, None] * (up + ends) / 2.0 + offsets
    origins = np.vstack([[0.0, 0.005, 0.0], steps[:-1]]).cumsum(axis=0)
    masses = np.full(recipe.joints, region.segment_kg)
    masses[-1] += FIXTURE_KG
    local = masses[:, None, None] * np.diag(RADII_M**2)
    inertias = rotations @ local @ np.swapaxes(rotations, 1, 2)
    return Bones(*map(_as_written, (origins, rotations, masses, origins + steps / 2.0, inertias)))


def stiffness(rng: np.random.Generator, recipe: "Recipe") -> np.ndarray:
    """(6,) N/m and N m/rad, the same at all levels of a specimen."""
    region = REGIONS[recipe.region]
    rotational = np.array(region.rotational) * np.exp(rng.normal(0.0, ROTATIONAL_LOG_SD, 3))
    drawn = np.exp(rng.uniform(*np.log(region.translational_range), 3))
    read = np.array([one in recipe.read for one in TRANSLATIONS])
    return np.concatenate([np.where(read, drawn, region.translational), rotational])


def typical(recipe: "Recipe", coordinate: str | None) -> float:
    """N/m or N m/rad: the stiffness that a joint is likely to have."""
    region = REGIONS[recipe.region]
    drawn = float(np.exp(np.mean(np.log(region.translational_range))))
    middle = dict.fromkeys(TRANSLATIONS, drawn) | dict(
        zip(ROTATIONS, region.rotational, strict=True)
    )
    return middle[coordinate or "extension"]


def _as_written(values: np.ndarray) -> np.ndarray:
    """Rounded to 1e-12: symmetric and the same in memory as in the files, to what they hold."""
    return np.round(values, 12)
