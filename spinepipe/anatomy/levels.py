"""How large vertebrae are, how heavy, and how joints stand, level by level: what a spine can be.

Each number is one of three. *Measured*: means of 83 spines in CT (VID, ImFusion, of scans of VerSe
2019/2020; patients, many old and some scoliotic, lying), which a test measures again where the
scans are at hand. *Printed*: with its doi, read in its abstract or table. *Chosen*: said so.

Distances of joints: T2 to L4 measured. L5: two men, of the Visible Human (Remus 2021, doi
10.1371/journal.pone.0250456; 40.0 mm) and of a full-body model (of Bruno 2015; 39.6 mm).
C3 to C6: bodies of 11.1 mm (posterior, SD 1.4, 100 dry typical vertebrae; J Hum Anat, "Morphometric
Study of the Vertebral Body and Pedicle of Typical Cervical Vertebrae") and discs of 6.0 mm (medians
5.8 to 6.4, 100 adults in MRI; Koken 2014, J Turk Spinal Surg 25:189). C7 and T1: chosen between.

Discs: lumbar Shukri 2013 (doi 10.17656/jsmc.10028, abstract: 8.37, 9.64, 10.71, 11.44, 10.56 mm),
T12L1 chosen at 7 mm; thoracic 4.5 to 7.2 mm (Kunkel 2011, doi 10.1111/j.1469-7580.2011.01397.x,
abstract), taken as 5.9; bodies are what discs leave, not far off what is printed of them: posterior
17.6 (T2) to 20.5 mm (T9) (Egwu 2019, doi 10.4103/JASI.JASI_8_19), 26.3 mm of L5, SD 1.9
(Cook and Baker 2021, Int J Spine Surg 15:1072, Table 6).
"""

import re
from collections.abc import Mapping

SPACING_MM: Mapping[str, float] = {
    **{"L5": 39.8, "L4": 36.0, "L3": 36.0, "L2": 34.8, "L1": 32.8},
    **{"T12": 30.4, "T11": 28.2, "T10": 26.2, "T9": 24.6, "T8": 23.7, "T7": 23.0, "T6": 22.4},
    **{"T5": 21.9, "T4": 21.3, "T3": 21.0, "T2": 20.8, "T1": 20.0},
    **{"C7": 18.5, "C6": 17.1, "C5": 17.1, "C4": 17.1, "C3": 17.1},
}
"""Between the joints below and above each vertebra, mm."""

DISC_MM: Mapping[str, float] = {"L5": 11.0, "L4": 11.1, "L3": 10.2, "L2": 9.0, "L1": 7.7}
"""Mean height of the two discs of a lumbar vertebra, mm."""

THORACIC_DISC_MM, CERVICAL_DISC_MM = 5.9, 6.0

SIZE_SPREAD = 1.8
"""Factor by which a spine may be larger or smaller than these means, chosen: spines in CT differ by
1.35 at most; there are children, and animals as large as people."""

ONE_SPREAD = 2.4
"""Factor for a single distance, chosen: fused, crushed and wedged bodies, joints off centre."""

PEDICLES_MM = (8.0, 75.0)
"""Between the bases, or middles, of a vertebra's two pedicles. Measured: middles 18.0 (T4) to 60.3
mm (L5) apart. Chosen: as much smaller or larger as a spine may be, and a fifth."""

DRY_KG: Mapping[str, float] = {"C": 0.0063, "T": 0.0087, "L": 0.0179}
"""Mean of a dry vertebra of each region, 83 skeletons (doi 10.1002/ar.1091590112, abstract; their
coefficients of variation are 16 to 19 %)."""

SLICE_PERCENT = (1.1, 2.6)
"""Slices of the trunk at T1 and at L5, of body mass (Pearsall 1996, doi 10.1007/BF02667349)."""

HEAVIEST_KG = 300.0
"""Of a person, chosen."""

LEAN_DEG = 60.0
"""Sideways, at every level, chosen: curved spines in CT reach 41 deg, curves of 86 deg (Jalalian
2017, Table 1) tilt their ends by half of it; 15 deg to spare."""

TURN_DEG = 55.0
"""About the long axis, at every level, chosen: curved spines in CT reach 36 deg."""

EXTENSION_DEG: Mapping[str, tuple[float, float]] = {
    **{
        "S1": (-28.7, 8.7),
        "L5": (-10.1, 9.3),
        "L4": (2.4, 6.7),
        "L3": (9.9, 5.1),
        "L2": (12.0, 4.4),
    },
    **{"L1": (11.5, 4.6), "T12": (11.6, 5.2), "T11": (11.0, 5.4), "T10": (8.3, 5.3)},
    **{"T9": (5.2, 5.0), "T8": (1.4, 5.0), "T7": (-4.0, 5.3), "T6": (-10.2, 5.5)},
    **{"T5": (-15.8, 5.9), "T4": (-20.7, 6.7), "T3": (-24.4, 7.8), "T2": (-26.7, 8.9)},
}
"""Mean and SD of the extension in ground of the joint above each vertebra, deg. Measured from L4L5
up, and smoothed over neighbours (a quarter, a half, a quarter). L5S1 printed: sacral slope of 709
adults, 24 to 55 deg within two SDs (Mac-Thiong 2011, doi 10.1007/s00586-011-1923-2), less half of
the disc's lordosis, 21.6 deg, SD 7.7 (doi 10.1038/s41598-022-21840-x, Table 2)."""

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
    others = CERVICAL_DISC_MM if vertebra.startswith("C") else THORACIC_DISC_MM
    return SPACING_MM[vertebra] - DISC_MM.get(vertebra, others)


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
