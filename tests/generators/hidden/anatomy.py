"""Geometry, masses and base stiffness of one made-up specimen, T12 to S1. SI.

Axes: x anterior, y superior, z right. J joints, caudal to cranial; joint j carries body j.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.spatial.transform import Rotation

VERTEBRAE = ("S1", "L5", "L4", "L3", "L2", "L1", "T12")
JOINTS = tuple(upper + lower for lower, upper in pairwise(VERTEBRAE))
COORDINATES = ("anterior", "superior", "right", "extension", "right_bending", "left_rotation")
N_JOINTS = len(JOINTS)

# doi 10.1038/s41598-022-21840-x, Table 2: lordosis of each disc, mean and SD; T12L1 assumed.
LORDOSIS_DEG = ((21.6, 7.7), (12.7, 5.1), (9.1, 4.2), (5.9, 4.1), (1.2, 3.6), (0.0, 3.6))
# Panjabi et al. 1992, Table 2 (posterior body height, L5 to T12) plus disc heights of about 10 mm.
SPACING_M = (0.0340, 0.0355, 0.0345, 0.0340, 0.0325, 0.0310)
SPACING_LOG_SD = 0.04
TILT_DEG = 1.5
"""SD of a joint's right bending and left rotation in ground."""
OFFSET_M = 0.0005
SEGMENT_KG, FIXTURE_KG = 0.12, 0.5
"""One vertebra with what stays on it, and what T12 carries besides."""
RADII_M = np.array([0.017, 0.020, 0.018])
"""Gyration about x, y, z of a segment."""

ROTATIONAL_NM_PER_RAD = (75.0, 85.0, 250.0)
"""Medians; Gould et al. 2024b (doi 10.3389/fbioe.2024.1372088), Table 3, found 60 to 420."""
ROTATIONAL_LOG_SD = 0.3
TRANSLATIONAL_N_PER_M = (149_000.0, 1_890_000.0, 135_000.0)
"""Gould et al. 2024b, Table 2, uniform row: the truth wherever no translation is reported."""
TRANSLATIONAL_RANGE_N_PER_M = (1e5, 1e6)
"""Where translations are reported the truth is drawn log-uniformly from here."""


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


def bones(rng: np.random.Generator) -> Bones:
    """A lordotic specimen; each segment's centre of mass lies midway between its two joints."""
    extension = np.cumsum([rng.normal(*level) for level in LORDOSIS_DEG])
    extension -= extension[2:4].mean()  # potted with L3 level
    tilts = rng.normal(0.0, TILT_DEG, (N_JOINTS, 2))
    turns = Rotation.from_euler("ZXY", np.column_stack([extension, tilts]), degrees=True)
    rotations = turns.as_matrix()
    up = rotations[:, :, 1]
    spacing = np.array(SPACING_M) * np.exp(rng.normal(0.0, SPACING_LOG_SD, N_JOINTS))
    ends = np.vstack([up[1:], up[-1:]])
    steps = spacing[:, None] * (up + ends) / 2.0 + rng.normal(0.0, OFFSET_M, (N_JOINTS, 3))
    origins = np.vstack([[0.0, 0.005, 0.0], steps[:-1]]).cumsum(axis=0)
    masses = np.full(N_JOINTS, SEGMENT_KG)
    masses[-1] += FIXTURE_KG
    local = masses[:, None, None] * np.diag(RADII_M**2)
    inertias = rotations @ local @ np.swapaxes(rotations, 1, 2)
    return Bones(*map(_as_written, (origins, rotations, masses, origins + steps / 2.0, inertias)))


def stiffness(rng: np.random.Generator, translations_drawn: bool) -> np.ndarray:
    """(6,) N/m and N m/rad, the same at all levels of a specimen."""
    rotational = np.array(ROTATIONAL_NM_PER_RAD) * np.exp(rng.normal(0.0, ROTATIONAL_LOG_SD, 3))
    drawn = np.exp(rng.uniform(*np.log(TRANSLATIONAL_RANGE_N_PER_M), 3))
    translational = drawn if translations_drawn else np.array(TRANSLATIONAL_N_PER_M)
    return np.concatenate([translational, rotational])


def _as_written(values: np.ndarray) -> np.ndarray:
    """Rounded to 1e-12: symmetric and the same in memory as in the files, to what they hold."""
    return np.round(values, 12)
