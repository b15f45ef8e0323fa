"""A small made-up trunk: nobody's, of plausible size, with muscles enough to hold every level.

Numbers are round ones, thought of here and taken from no model. 22 fascicles a side: seven short
ones that cross one joint each, three of psoas, three of quadratus lumborum, two local and two
global extensors, rectus, and two of each oblique, one of which hangs in the sheath.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from spinepipe.muscles.trunk import BODIES, NO_BODY, SLICES, THORAX, Muscles, Trunk

MM, MM2 = 1e-3, 1e-6

JOINTS_MM = (
    *((0.0, 0.0), (8.0, 36.0), (9.0, 73.0), (3.0, 110.0)),
    *((-7.0, 145.0), (-18.0, 177.0), (-28.0, 206.0)),
)
"""x and y, L5S1 to T11T12; a joint lies in the middle of the back."""

DISC_TILT_DEG = (-18.0, -6.0, 4.0, 12.0, 18.0, 20.0, 18.0)
DISC_HEIGHT_MM = (12.0, 13.0, 12.0, 11.0, 10.0, 8.0, 7.0)
DISC_AREA_MM2 = (1400.0, 1450.0, 1400.0, 1350.0, 1300.0, 1150.0, 1000.0)

HEIGHT_OF_T11_MM, HEIGHT_OF_T1_MM = 218.0, 430.0


@dataclass(frozen=True)
class Path:
    """A fascicle of the right side: where it runs, mm, and how thick it is, mm2.

    `where` tells bodies and points, caudal to cranial; a point in the sheath is told as one of T11.
    """

    name: str
    group: str
    pcsa_mm2: float
    fibre_mm: float
    where: tuple[tuple[str, tuple[float, float, float]], ...]
    wraps: bool = False
    in_sheath: bool = False


def centre(body: str) -> np.ndarray:
    """(3,) mm, middle of a vertebra between its joints; S1 and T11: a little off their joint."""
    k = BODIES.index(body)
    below = JOINTS_MM[max(k - 1, 0)]
    above = JOINTS_MM[k] if 0 < k < THORAX else (below[0] - 6.0, below[1] + 12.0)
    if k == 0:
        above = (-6.0, -20.0)
    return np.array([0.5 * (below[0] + above[0]), 0.5 * (below[1] + above[1]), 0.0])


def beside(body: str, x: float, y: float, z: float) -> tuple[str, tuple[float, float, float]]:
    """A point so far from the middle of a vertebra, mm."""
    at = centre(body) + np.array([x, y, z])
    return body, (float(at[0]), float(at[1]), float(at[2]))


def short_ones() -> list[Path]:
    """From the root of the joint's process below to the spinous process above, one per joint."""
    return [
        Path(
            f"short_{above}",
            "multifidus",
            300.0,
            45.0,
            (beside(below, -38.0, 2.0, 24.0), beside(above, -52.0, -8.0, 4.0)),
        )
        for below, above in pairwise(BODIES)
    ]


def psoas() -> list[Path]:
    """From the rim of the pelvis to the side of a lumbar vertebra."""
    rim = ("S1", (40.0, -60.0, 72.0))
    return [
        Path(f"psoas_{body}", "psoas", 450.0, 120.0, (rim, beside(body, 20.0, 0.0, 28.0)))
        for body in ("L5", "L3", "L1")
    ]


def quadratus() -> list[Path]:
    """From the crest of the pelvis to transverse processes and the twelfth rib."""
    crest = ("S1", (-30.0, 45.0, 95.0))
    return [
        Path("quadratus_L4", "quadratus_lumborum", 120.0, 50.0, (crest, beside("L4", -18, 2, 38))),
        Path("quadratus_L2", "quadratus_lumborum", 120.0, 80.0, (crest, beside("L2", -18, 2, 38))),
        Path(
            "quadratus_T12", "quadratus_lumborum", 120.0, 95.0, (crest, beside("T12", -25, 0, 55))
        ),
    ]


def extensors() -> list[Path]:
    """Two that end on the lumbar spine and two that run past it."""
    hip, midline = ("S1", (-52.0, 20.0, 45.0)), ("S1", (-66.0, -25.0, 12.0))
    back = (beside("L3", -50.0, 0.0, 14.0), beside("T12", -60.0, 0.0, 18.0))
    rib = (beside("L3", -46.0, 0.0, 48.0), beside("T12", -58.0, 0.0, 55.0))
    return [
        Path("local_L4", "longissimus_lumborum", 350.0, 60.0, (hip, beside("L4", -32, 0, 28))),
        Path("local_L2", "iliocostalis_lumborum", 350.0, 90.0, (hip, beside("L2", -30, 0, 40))),
        Path(
            "global_back",
            "longissimus_thoracis",
            1100.0,
            150.0,
            (midline, *back, ("T11", (-88.0, 285.0, 26.0))),
            wraps=True,
        ),
        Path(
            "global_rib",
            "iliocostalis_thoracis",
            800.0,
            150.0,
            (hip, *rib, ("T11", (-85.0, 260.0, 62.0))),
            wraps=True,
        ),
    ]


def abdominals() -> list[Path]:
    """Rectus from pubis to ribs, and obliques, of which each has one that ends in its sheath."""
    return [
        Path(
            "rectus",
            "rectus_abdominis",
            600.0,
            280.0,
            (("S1", (75.0, -110.0, 15.0)), ("T11", (55.0, 235.0, 40.0))),
        ),
        Path(
            "external_side",
            "external_oblique",
            800.0,
            120.0,
            (("S1", (45.0, 30.0, 118.0)), ("T11", (0.0, 165.0, 122.0))),
        ),
        Path(
            "external_sheath",
            "external_oblique",
            700.0,
            120.0,
            (("T11", (80.0, 185.0, 105.0)), ("T11", (95.0, 70.0, 35.0))),
            in_sheath=True,
        ),
        Path(
            "internal_side",
            "internal_oblique",
            800.0,
            110.0,
            (("S1", (-10.0, 50.0, 112.0)), ("T11", (15.0, 165.0, 118.0))),
        ),
        Path(
            "internal_sheath",
            "internal_oblique",
            600.0,
            110.0,
            (("S1", (50.0, 0.0, 115.0)), ("T11", (95.0, 60.0, 35.0))),
            in_sheath=True,
        ),
    ]


def made_up_trunk() -> Trunk:
    """The whole trunk, its left side the mirror of the right one."""
    right = [*short_ones(), *psoas(), *quadratus(), *extensors(), *abdominals()]
    muscles = both_sides(right)
    rectus = [muscles.names.index(f"rectus_{side}") for side in "rl"]
    return Trunk(
        source="made up",
        joints=np.array([[x, y, 0.0] for x, y in JOINTS_MM]) * MM,
        disc_tilt=np.radians(DISC_TILT_DEG),
        disc_height=np.array(DISC_HEIGHT_MM) * MM,
        disc_area=np.array(DISC_AREA_MM2) * MM2,
        vertebrae=slices(),
        head=np.array([0.005, 0.580, 0.0]),
        shoulders=np.array([[0.0, 0.405, 0.170], [0.0, 0.405, -0.170]]),
        arm_length=0.60,
        sheath=muscles.point[rectus, :2],
        muscles=muscles,
    )


def both_sides(right: list[Path]) -> Muscles:
    """Every fascicle and its mirror image."""
    paths = [(path, side) for side in ("right", "left") for path in right]
    most = max(len(path.where) for path in right)
    body = np.full((len(paths), most), NO_BODY, dtype=np.int64)
    point = np.zeros((len(paths), most, 3))
    for k, (path, side) in enumerate(paths):
        places = np.array([at for _, at in path.where]) * MM
        places[:, 2] *= 1.0 if side == "right" else -1.0
        body[k, : len(places)] = [BODIES.index(name) for name, _ in path.where]
        point[k, : len(places)], point[k, len(places) :] = places, places[-1]
    return Muscles(
        names=tuple(f"{path.name}_{side[0]}" for path, side in paths),
        groups=tuple(path.group for path, _ in paths),
        sides=tuple(side for _, side in paths),
        pcsa=np.array([path.pcsa_mm2 for path, _ in paths]) * MM2,
        fibre=np.array([path.fibre_mm for path, _ in paths]) * MM,
        body=body,
        point=point,
        wraps=np.array([path.wraps for path, _ in paths]),
        in_sheath=np.array([path.in_sheath for path, _ in paths]),
    )


def slices() -> np.ndarray:
    """(17, 3) m, centres of T1 to L5: T1 to T11 evenly along a slight arch."""
    share = np.linspace(1.0, 0.0, 11)
    y = HEIGHT_OF_T11_MM + share * (HEIGHT_OF_T1_MM - HEIGHT_OF_T11_MM)
    x = -31.0 - 14.0 * 4.0 * share * (1.0 - share) + 15.0 * share
    thoracic = np.stack([x, y, np.zeros(11)], axis=1)
    lower = np.array([centre(name) for name in SLICES[11:]])
    found: np.ndarray = np.concatenate([thoracic, lower]) * MM
    return found
