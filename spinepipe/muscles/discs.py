"""Discs where a source of geometry has none: their height and area, and how they lie.

Areas are ratios to L4L5 times that of Ghezelbash 2016. For T12L1 and T11T12 nobody has read a
source here (`facts.csv`): they are no ground for accepting anything.
"""

import numpy as np

from spinepipe.effects.contract import Array
from spinepipe.facts import numbers, several
from spinepipe.muscles.trunk import LEVELS

_L4L5_AREA_MM2 = numbers(__name__, "disc_area")["L4L5"]
_AREA_RATIO = {
    level: area / reference
    for level, (area, reference) in several(__name__, "disc_area_beside_reference").items()
}
_HEIGHT_MM = numbers(__name__, "disc_height")

REMARK = (
    "heights and areas of the discs are not the source's: MRI of 14 adults and one man's endplates "
    "at L1L2 to L5S1, from memory at T11T12 and T12L1"
)


def disc_heights() -> Array:
    """(7,) m at the centre, caudal to cranial."""
    return np.array([_HEIGHT_MM[level] for level in LEVELS]) * 1e-3


def disc_areas() -> Array:
    """(7,) m2, caudal to cranial."""
    return np.array([_AREA_RATIO[level] for level in LEVELS]) * _L4L5_AREA_MM2 * 1e-6


def tilts(joints: Array) -> Array:
    """(N - 1,) rad, extension of vertebrae whose lower and upper joints are (N, 3) m, upwards.

    A vertebra stands along the line from the joint below it to the joint above it.
    """
    x, y, _ = np.diff(joints, axis=0).T
    found: Array = np.arctan2(-x, y)
    return found


def disc_tilts(vertebrae: Array) -> Array:
    """(N,) rad, extension of the disc below each of N vertebrae, whose own is given, upwards.

    A disc lies midway between the two vertebrae that it joins. The lowest lies as the vertebra
    above it, because the sacrum's endplate is not known.
    """
    below = np.concatenate([vertebrae[:1], vertebrae[:-1]])
    return 0.5 * (below + vertebrae)


def vertebra_centres(joints: Array) -> Array:
    """(17, 3) m, T1 to L5, midway between their joints, (18, 3) m, from L5S1 to that above T1."""
    found: Array = 0.5 * (joints[1:] + joints[:-1])[::-1]
    return found
