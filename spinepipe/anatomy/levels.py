"""How large vertebrae are and how joints stand, level by level: what a spine can be.

Heights of bodies: Panjabi et al. 1991 (Spine 16:888, Table 1, thoracic; Spine 16:861, cervical)
and 1992 (Spine 17:299, lumbar), posterior height, the means of adult cadavers, entered from memory
as in docs/decisions/0006. Heights of discs: Shukri et al. 2013 (doi 10.17656/jsmc.10028), lumbar;
above them 4 to 7 mm (Kunkel et al. 2011, J Anat 219:375, from memory). Distances of neighbouring
joints are their sums.

Attitude: sacral slope 20 to 65 deg (Roussouly et al. 2005, Spine 30:346), lordosis of each disc
(doi 10.1038/s41598-022-21840-x, Table 2) and thoracic kyphosis up to 70 deg, and 83 spines in CT
(T1 to L5, VerSe), whose joints reach -48 to 31 deg, and 41 deg sideways where spines are curved.
The ranges here hold all of these with 15 deg to spare: specimens are mounted, grounds chosen.

All printed sources but the lordosis and Shukri et al. were entered from memory and not looked up.
The factors are choices, made wide enough that every shipped cohort and the CT pass.
"""

import re
from collections.abc import Mapping

HEIGHT_MM: Mapping[str, float] = {
    **{"L5": 22.9, "L4": 24.1, "L3": 23.8, "L2": 24.3, "L1": 23.8},
    **{"T12": 22.7, "T11": 21.3, "T10": 20.2, "T9": 19.3, "T8": 18.7, "T7": 18.2},
    **{"T6": 17.4, "T5": 16.2, "T4": 16.2, "T3": 15.7, "T2": 15.6, "T1": 14.1},
    **{"C7": 12.8, "C6": 10.9, "C5": 11.4, "C4": 11.4, "C3": 11.6},
}
"""Posterior height of each body, mm: Panjabi et al. 1991, 1992."""

DISC_MM: Mapping[str, float] = {"L5": 11.0, "L4": 11.1, "L3": 10.2, "L2": 9.0, "L1": 7.7}
"""Mean height of the two discs of a vertebra, mm: Shukri et al. 2013."""

THORACIC_DISC_MM = 5.0
"""Of all others: Kunkel et al. 2011, T1 to T12."""

SIZE_SPREAD = 1.8
"""Factor by which a spine may be larger or smaller than these means: from children of ten years and
animals as large as people to the tallest; CT of adults differs by 1.35 at most."""

ONE_SPREAD = 2.4
"""Factor for a single distance: fused, crushed and wedged bodies, and joints taken off centre."""

PEDICLES_MM = (8.0, 75.0)
"""Between the bases, or middles, of a vertebra's two pedicles: canal 15 to 30 mm wide (Panjabi
1991, 1992) and pedicles of 3 to 20 mm (Zindrick et al. 1987, Spine 12:160), a third to spare."""

LEAN_DEG = 60.0
"""Sideways: scoliotic spines of the CT reach 41 deg."""

TURN_DEG = 55.0
"""About the long axis: scoliotic spines of the CT reach 36 deg."""

_EXTENSION_DEG: Mapping[str, tuple[float, float]] = {
    "S": (-75.0, 30.0),
    "L": (-50.0, 45.0),
    "T": (-75.0, 55.0),
    "C": (-75.0, 60.0),
}
"""Of the joint above a vertebra of each region in ground."""

_LEVEL = re.compile(r"([SLTC])(\d{1,2})")


def is_level(vertebra: str) -> bool:
    """Whether a name is a level of the spine, as L4 is and V4 is not."""
    return vertebra == "S1" or vertebra in HEIGHT_MM


def spacing_mm(vertebra: str) -> float | None:
    """Between the joints below and above a vertebra, mm; None for names that are no level."""
    height = HEIGHT_MM.get(vertebra)
    return None if height is None else height + DISC_MM.get(vertebra, THORACIC_DISC_MM)


def extension_range_deg(lower: str) -> tuple[float, float] | None:
    """Least and most extension of the joint above a vertebra in ground, deg."""
    match = _LEVEL.fullmatch(lower)
    return _EXTENSION_DEG[match[1]] if match else None
