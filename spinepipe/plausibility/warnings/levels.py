"""How large vertebrae are, how heavy, and how joints stand, by `levels.csv`: what a spine can be.

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

Extension: mean and SD in ground of the joint above each vertebra. Measured from L4L5 up, and
smoothed over neighbours (a quarter, a half, a quarter). L5S1 printed: sacral slope of 709 adults,
24 to 55 deg within two SDs (Mac-Thiong 2011, doi 10.1007/s00586-011-1923-2), less half of the
disc's lordosis, 21.6 deg, SD 7.7 (doi 10.1038/s41598-022-21840-x, Table 2).

Dry vertebrae: means of each region, 83 skeletons (doi 10.1002/ar.1091590112, abstract; their
coefficients of variation are 16 to 19 %).
"""

from collections.abc import Mapping

from spinepipe.plausibility.score import table, usual

PACKAGE = "spinepipe.plausibility.warnings"


def _column(name: str) -> Mapping[str, float]:
    """Level to number, where there is one."""
    return {row["level"]: float(row[name]) for row in table(PACKAGE, "levels") if row[name]}


SPACING_MM = _column("spacing_mm")
"""Between the joints below and above each vertebra."""

DISC_MM = _column("disc_mm")
"""Mean height of the two discs of a vertebra."""

DRY_KG = _column("dry_kg")

_MEANS, _SDS = _column("extension_deg"), _column("extension_sd_deg")
EXTENSION_DEG = {name: (mean, _SDS[name]) for name, mean in _MEANS.items()}
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
    return SPACING_MM[vertebra] - DISC_MM[vertebra] if vertebra in SPACING_MM else None


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
    return 0.5 * DRY_KG.get(vertebra, min(DRY_KG.values()))
