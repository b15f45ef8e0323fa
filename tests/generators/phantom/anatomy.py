"""Geometry and masses of one specimen, T12 to S1, from published anatomy.

Axes: x anterior, y superior, z right; mm here, SI in `Anatomy`. Every number is rounded as in the
files before anything is computed from it, so that the files hold exactly what was moved.
What is published, what is assumed, and why: docs/decisions/0006-t12s1-phantom.md.
"""

from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from .bodies import body, potted_body

VERTEBRAE = ("S1", "L5", "L4", "L3", "L2", "L1", "T12")
JOINTS = tuple(upper + lower for lower, upper in pairwise(VERTEBRAE))


class Donor(NamedTuple):
    """One row of Gould et al. 2024b (doi 10.3389/fbioe.2024.1372088), Table 1."""

    name: str
    sex: str
    age_years: int
    height_m: float
    mass_kg: float


DONORS = (
    Donor("s01", "female", 57, 1.57, 59),
    Donor("s02", "female", 54, 1.57, 36),
    Donor("s03", "female", 56, 1.72, 48),
    Donor("s04", "female", 59, 1.65, 113),
    Donor("s05", "female", 44, 1.63, 49),
    Donor("s06", "male", 49, 1.72, 59),
)

REFERENCE_HEIGHT_M = 1.68
"""Mean height of the donors of Panjabi et al. 1991, 1992: lengths grow in proportion to height."""

# Panjabi et al. 1992 (lumbar), 1991 (T12): upper endplate depth and width, posterior body height.
BODY_DEPTH_WIDTH_HEIGHT_MM = {
    "L5": (34.7, 47.3, 22.9),
    "L4": (35.5, 46.6, 24.1),
    "L3": (35.2, 44.1, 23.8),
    "L2": (34.6, 42.6, 24.3),
    "L1": (34.1, 41.2, 23.8),
    "T12": (32.8, 39.0, 22.7),
}
# Panjabi et al. 1991, 1992: width of the canal; Zindrick et al. 1987: width of one pedicle.
CANAL_AND_PEDICLE_WIDTH_MM = {
    "L5": (27.1, 18.0),
    "L4": (25.4, 12.9),
    "L3": (24.3, 10.3),
    "L2": (23.8, 8.9),
    "L1": (23.7, 8.7),
    "T12": (22.2, 7.1),
}
# Shukri et al. 2013 (doi 10.17656/jsmc.10028), 106 asymptomatic adults in MRI; T12L1 assumed.
DISC_HEIGHT_MM = {
    "L5S1": 10.56,
    "L4L5": 11.44,
    "L3L4": 10.71,
    "L2L3": 9.64,
    "L1L2": 8.37,
    "T12L1": 7.0,
}
# doi 10.1038/s41598-022-21840-x, Table 2, all 324 adults: mean and SD; T12L1 assumed.
LORDOSIS_DEG = {
    "L5S1": (21.6, 7.7),
    "L4L5": (12.7, 5.1),
    "L3L4": (9.1, 4.2),
    "L2L3": (5.9, 4.1),
    "L1L2": (1.2, 3.6),
    "T12L1": (0.0, 3.6),
}

# Not published: assumed.
SIZE_SPREAD = 0.04
"""SD of the natural logarithm of one vertebra's size and of one disc's height."""
ASYMMETRY_DEG = 1.5
"""SD of a vertebra's right bending and left rotation in ground."""
OFFSET_MM = 0.5
"""SD of a disc's offset, anterior and right."""
PEDICLE_BELOW = 1.0 / 3.0
"""Share of the body height by which the pedicle bases lie below the superior endplate."""


@dataclass(frozen=True)
class Anatomy:
    """One specimen in the neutral pose, J joints caudal to cranial, joint j below body j.

    Attributes
    ----------
    landmarks_mm : {vertebra: {landmark: (3,) mm}}.
    origins, rotations : (J, 3) m and (J, 3, 3) joint frames in ground.
    masses, centres, inertias : (J,) kg, (J, 3) m, (J, 3, 3) kg m2 about the centre, ground axes.
    """

    landmarks_mm: dict[str, dict[str, np.ndarray]]
    origins: np.ndarray
    rotations: np.ndarray
    masses: np.ndarray
    centres: np.ndarray
    inertias: np.ndarray


def build(donor: Donor, rng: np.random.Generator) -> Anatomy:
    """The specimen of a donor."""
    axes = _vertebra_axes(rng)
    sizes = _sizes(donor, rng)
    landmarks = _landmarks(donor, axes, sizes, rng)
    frames = [_joint_frame(landmarks[below], landmarks[above]) for below, above in _pairs()]
    segments = [body(landmarks[name], axes[name], sizes[name]) for name in VERTEBRAE[1:-1]]
    top = VERTEBRAE[-1]
    segments.append(potted_body(landmarks[top], axes[top], sizes[top]))
    columns = (*zip(*frames, strict=True), *zip(*segments, strict=True))
    return Anatomy(landmarks, *map(np.array, columns))


def _pairs():
    return pairwise(VERTEBRAE)


def _vertebra_axes(rng):
    """{vertebra: (3, 3) its axes as columns}; the specimen is potted with its L3L4 disc level."""
    angles = {joint: rng.normal(*LORDOSIS_DEG[joint]) for joint in JOINTS}
    extension = np.cumsum([0.0, *angles.values()])
    extension -= (extension[VERTEBRAE.index("L4")] + extension[VERTEBRAE.index("L3")]) / 2.0
    tilts = rng.normal(0.0, ASYMMETRY_DEG, (len(VERTEBRAE), 2))
    zxy = np.column_stack([extension, tilts])
    return dict(zip(VERTEBRAE, Rotation.from_euler("ZXY", zxy, True).as_matrix(), strict=True))


def _sizes(donor, rng):
    """{vertebra: (depth, width, height) mm}."""
    scale = donor.height_m / REFERENCE_HEIGHT_M
    return {
        name: scale * np.exp(rng.normal(0.0, SIZE_SPREAD)) * np.array(size)
        for name, size in BODY_DEPTH_WIDTH_HEIGHT_MM.items()
    }


def _landmarks(donor, axes, sizes, rng):
    """Stacked upwards from S1's endplate centre, the origin; S1 needs no other landmark."""
    scale = donor.height_m / REFERENCE_HEIGHT_M
    superior = np.zeros(3)
    landmarks = {"S1": {"superior_endplate_centre": superior}}
    for joint, (below, above) in zip(JOINTS, _pairs(), strict=True):
        height = scale * DISC_HEIGHT_MM[joint] * np.exp(rng.normal(0.0, SIZE_SPREAD))
        upward = axes[below][:, 1] + axes[above][:, 1]
        offset = axes[above][:, ::2] @ rng.normal(0.0, OFFSET_MM, 2)
        inferior = superior + height * upward / np.linalg.norm(upward) + offset
        superior = inferior + sizes[above][2] * axes[above][:, 1]
        pedicles = _pedicle_bases(above, axes[above], sizes[above], superior, scale)
        landmarks[above] = {
            "superior_endplate_centre": superior,
            "inferior_endplate_centre": inferior,
            **pedicles,
        }
    return {v: {n: np.round(p, 6) for n, p in marks.items()} for v, marks in landmarks.items()}


def _pedicle_bases(name, axes, size, superior, scale):
    """On the pedicles' long axes, at the back of the body."""
    half = scale * sum(CANAL_AND_PEDICLE_WIDTH_MM[name]) / 2.0
    depth, _, height = size
    middle = superior - axes @ [depth / 2.0, PEDICLE_BELOW * height, 0.0]
    side = half * axes[:, 2]
    return {"left_pedicle_base": middle - side, "right_pedicle_base": middle + side}


def _axes_of(marks):
    """(3, 3) frame rule of the cohort format: z exact, x normal to it and to the body's line."""
    z = marks["right_pedicle_base"] - marks["left_pedicle_base"]
    x = np.cross(marks["superior_endplate_centre"] - marks["inferior_endplate_centre"], z)
    z, x = z / np.linalg.norm(z), x / np.linalg.norm(x)
    return np.column_stack([x, np.cross(z, x), z])


def _joint_frame(below, above):
    """Origin (3,) m midway in the disc; the vertebrae's mean rotation, over S1 that of L5."""
    facing = below["superior_endplate_centre"] + above["inferior_endplate_centre"]
    upper = _axes_of(above)
    if "left_pedicle_base" not in below:
        return facing / 2000.0, upper
    lower = _axes_of(below)
    halfway = Rotation.from_rotvec(Rotation.from_matrix(lower.T @ upper).as_rotvec() / 2.0)
    return facing / 2000.0, lower @ halfway.as_matrix()
