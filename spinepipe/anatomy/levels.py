"""How large vertebrae are, how heavy, and how joints stand, level by level: what a spine can be.

What is measured or printed stands in `facts.csv`, with its source; a test measures again where the
scans are at hand (patients, many old and some scoliotic, lying). What is chosen stands here.
"""

import re
from collections.abc import Mapping

from spinepipe.facts import numbers, several

SPACING_MM: Mapping[str, float] = numbers(__name__, "joint_spacing")
"""Between the joints below and above each vertebra, mm."""

DISC_MM: Mapping[str, float] = numbers(__name__, "mean_disc_height")
"""Mean height of the two discs of a lumbar vertebra, and of all thoracic and cervical ones, mm."""

SIZE_SPREAD = 1.8
"""Factor by which a spine may be larger or smaller than these means, chosen: spines in CT differ by
1.35 at most; there are children, and animals as large as people."""

ONE_SPREAD = 2.4
"""Factor for a single distance, chosen: fused, crushed and wedged bodies, joints off centre."""

PEDICLES_MM = (8.0, 75.0)
"""Between the bases, or middles, of a vertebra's two pedicles. Measured: middles 18.0 (T4) to 60.3
mm (L5) apart. Chosen: as much smaller or larger as a spine may be, and a fifth."""

DRY_KG: Mapping[str, float] = numbers(__name__, "dry_vertebra_mass")
"""Mean of a dry vertebra of each region."""

_SLICES = numbers(__name__, "slice_mass_percent")
SLICE_PERCENT = (_SLICES["T1"], _SLICES["L5"])
"""Slices of the trunk at T1 and at L5, of body mass."""

HEAVIEST_KG = 300.0
"""Of a person, chosen."""

LEAN_DEG = 60.0
"""Sideways, at every level, chosen: curved spines in CT reach 41 deg, curves of 86 deg (Jalalian
2017, Table 1) tilt their ends by half of it; 15 deg to spare."""

TURN_DEG = 55.0
"""About the long axis, at every level, chosen: curved spines in CT reach 36 deg."""

EXTENSION_DEG: Mapping[str, tuple[float, ...]] = several(__name__, "joint_extension")
"""Mean and SD of the extension in ground of the joint above each vertebra, deg."""

REACH_SDS, MOUNTED_DEG = 4.0, 20.0
"""Chosen: SDs that a spine may be off the mean, and how far rig or ground may tilt it besides."""

NECK_EXTENSION_DEG = (-75.0, 60.0)
"""Of C7T1 and above, chosen wide: nothing was read of how single levels of a neck stand."""

_LEVEL = re.compile(r"([SLTC])(\d{1,2})")


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
    return NECK_EXTENSION_DEG if is_level(lower) else None


def least_kg(vertebra: str) -> float:
    """Half of a mean dry vertebra; of names that are no level, of the lightest region."""
    match = _LEVEL.fullmatch(vertebra)
    return 0.5 * DRY_KG.get(match[1] if match else "C", DRY_KG["C"])
