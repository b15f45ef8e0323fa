"""Fascicles one by one, as a source gives them, put right and gathered into `Muscles`."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from spinepipe.effects.contract import Array
from spinepipe.muscles.trunk import NO_BODY, Muscles, Trunk

GLOBAL_EXTENSORS = ("longissimus_thoracis", "iliocostalis_thoracis")
"""Groups that run from the pelvis or the lumbar spine to the thorax and lie on what they pass."""

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

    def ordered(self) -> "Fascicle":
        """From the lower body to the higher; from the bone to the sheath where it ends there."""
        if self.in_sheath or self.body[0] <= self.body[-1]:
            return self
        return replace(self, body=self.body[::-1], point=self.point[::-1])


def on_their_sides(fascicles: Sequence[Fascicle]) -> tuple[list[Fascicle], tuple[str, ...]]:
    """All on the side that they are called by, and a remark that names those that were not."""
    wrong = [one.name for one in fascicles if one.on_wrong_side]
    kept = [one.mirrored() if one.on_wrong_side else one for one in fascicles]
    if not wrong:
        return kept, ()
    remark = f"mirrored, because the source has them on the other side: {', '.join(wrong)}"
    return kept, (remark,)


def muscles_of(fascicles: Iterable[Fascicle]) -> Muscles:
    """All as arrays, paths filled up to the longest: NO_BODY and the last point again."""
    rows = [one.ordered() for one in fascicles]
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


def sheath_of(muscles: Muscles, group: str = "rectus_abdominis") -> Array:
    """(2, 2, 3) m, lower and upper end of each side's rectus, right then left.

    The ends of the fascicles of a side are averaged, should a source have several.

    Raises
    ------
    ValueError
        When a side has none.
    """
    ends = []
    for side in ("right", "left"):
        at = [
            k
            for k, (one, where) in enumerate(zip(muscles.groups, muscles.sides, strict=True))
            if (one, where) == (group, side)
        ]
        if not at:
            raise ValueError(f"no {group} on the {side}: the rectus sheath has no ends")
        ends.append([muscles.point[at, 0].mean(axis=0), muscles.point[at, -1].mean(axis=0)])
    return np.array(ends)
