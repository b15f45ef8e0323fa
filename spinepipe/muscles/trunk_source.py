"""What sources of a trunk are put right by: fascicles one by one, and discs that none of them has.

Areas of discs are ratios to L4L5 times that of Ghezelbash 2016. For T12L1 and T11T12 nobody has
read a source here (`facts.csv`): they are no ground for accepting anything.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from spinepipe.effects.contract import Array
from spinepipe.facts import numbers, several
from spinepipe.muscles.trunk import GLOBAL_EXTENSORS, LEVELS, NO_BODY, RECTUS, SIDES, Muscles, Trunk

DISC_REMARK = (
    "heights and areas of the discs are not the source's: MRI of 14 adults and one man's endplates "
    "at L1L2 to L5S1, from memory at T11T12 and T12L1"
)

_L4L5_AREA_MM2 = numbers(__name__, "disc_area")["L4L5"]
_AREA_RATIO = {
    level: area / reference
    for level, (area, reference) in several(__name__, "disc_area_beside_reference").items()
}
_HEIGHT_MM = numbers(__name__, "disc_height")

_MIRROR = np.array([1.0, 1.0, -1.0])


@dataclass(frozen=True, eq=False)
class Source:
    """A trunk and what was done to it on the way in.

    Attributes
    ----------
    trunk : ready to be used.
    remarks : sentences on what was put right, left out or assumed.
    """

    trunk: Trunk
    remarks: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class Fascicle:
    """One row of `Muscles`; attributes as there.

    Attributes
    ----------
    body : (P,) index into BODIES. point : (P, 3) m.
    """

    name: str
    group: str
    side: str
    pcsa: float
    fibre: float
    body: tuple[int, ...]
    point: Array
    in_sheath: bool = False

    @property
    def on_wrong_side(self) -> bool:
        """Whether it is called right and lies left of the midline, or the reverse."""
        outwards = float(self.point[:, 2].sum())
        return outwards < 0.0 if self.side == "right" else outwards > 0.0

    @property
    def length(self) -> float:
        """m, along the straight lines from point to point."""
        return float(np.linalg.norm(np.diff(self.point, axis=0), axis=1).sum())

    def mirrored(self) -> "Fascicle":
        """Left and right exchanged, the name kept."""
        return replace(self, point=self.point * _MIRROR)


def mirror_wrong_sides(fascicles: Sequence[Fascicle]) -> tuple[list[Fascicle], tuple[str, ...]]:
    """All on the side that they are called by, and a remark that names those that were not."""
    wrong = [one.name for one in fascicles if one.on_wrong_side]
    right = [one.mirrored() if one.on_wrong_side else one for one in fascicles]
    if not wrong:
        return right, ()
    remark = f"mirrored, because the source has them on the other side: {', '.join(wrong)}"
    return right, (remark,)


def muscles_of(fascicles: Iterable[Fascicle]) -> Muscles:
    """All as arrays, paths filled up to the longest: NO_BODY and the last point again."""
    # from the lower body to the higher; from the bone to the sheath where one ends there
    rows = [
        one
        if one.in_sheath or one.body[0] <= one.body[-1]
        else replace(one, body=one.body[::-1], point=one.point[::-1])
        for one in fascicles
    ]
    most = max(len(one.body) for one in rows)
    body = np.full((len(rows), most), NO_BODY, dtype=np.int64)
    point = np.zeros((len(rows), most, 3))
    for k, one in enumerate(rows):
        body[k, : len(one.body)] = one.body
        point[k] = one.point[np.minimum(np.arange(most), len(one.body) - 1)]
    return Muscles(
        names=tuple(one.name for one in rows),
        groups=tuple(one.group for one in rows),
        sides=tuple(one.side for one in rows),
        pcsa=np.array([one.pcsa for one in rows]),
        fibre=np.array([one.fibre for one in rows]),
        body=body,
        point=point,
        wraps=np.array([one.group in GLOBAL_EXTENSORS for one in rows]),
        in_sheath=np.array([one.in_sheath for one in rows]),
    )


def sheath_of(muscles: Muscles) -> Array:
    """(2, 2, 3) m, lower and upper end of each side's rectus, right then left.

    The ends of the fascicles of a side are averaged, should a source have several.

    Raises
    ------
    ValueError
        When a side has none.
    """
    ends = []
    for side in SIDES:
        of_each = enumerate(zip(muscles.groups, muscles.sides, strict=True))
        at = [k for k, one in of_each if one == (RECTUS, side)]
        if not at:
            raise ValueError(f"no {RECTUS} on the {side}: the rectus sheath has no ends")
        ends.append([muscles.point[at, 0].mean(axis=0), muscles.point[at, -1].mean(axis=0)])
    return np.array(ends)


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


def backwards(vertebrae: Array) -> Array:
    """(N, 3) of length 1, backwards across the spine at vertebrae (N, 3) m, from above, by the
    centres about each."""
    line = np.concatenate([vertebrae[:1], vertebrae[:-1]])
    line = line - np.concatenate([vertebrae[1:], vertebrae[-1:]])
    back = np.stack([-line[:, 1], line[:, 0], np.zeros(len(line))], axis=1)
    found: Array = back / np.linalg.norm(back, axis=1, keepdims=True)
    return found


def vertebra_centres(joints: Array) -> Array:
    """(17, 3) m, T1 to L5, midway between their joints, (18, 3) m, from L5S1 to that above T1."""
    found: Array = 0.5 * (joints[1:] + joints[:-1])[::-1]
    return found
