"""Cobb and Ferguson angles of a spine's curves, chosen on the erect film and kept for all films.

A curve lies between two end vertebrae, the ones tilted farthest to either side, the outermost of
equally tilted ones; its apex is the vertebra farthest from the line between their centres. Cobb's
angle is between the tilts of the end vertebrae, Ferguson's between the lines from their centres to
the apex's. Read upside down or mirrored a film has the same ends and Cobb angles.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from spinepipe.effects.contract import Array
from spinepipe.studies.scoliosis.films import Film, Flags

LEAST_CURVE = float(np.deg2rad(5.0)) + 1e-9
"""Changes of tilt up to 5 deg are waves of the line, no curves; rounding makes no curve of one that
is read as 5 deg."""

LOWEST_PROXIMAL, THORACOLUMBAR = 5, "T12"


@dataclass(frozen=True)
class SpinalCurve:
    """Numbers of the lower and upper end vertebra and of the apex, counted from below.

    Attributes
    ----------
    side : 1 for a bulge to the right, -1 to the left.
    """

    lower: int
    upper: int
    apex: int
    side: int

    def cobb(self, film: Film) -> float:
        """Tilt of the lower less that of the upper end vertebra, rad; to its side positive."""
        return float(self.side * (film.tilt[self.lower] - film.tilt[self.upper]))

    def ferguson(self, film: Film) -> float:
        """Angle between the lines below and above the apex, rad; to its side positive."""
        points = np.stack([film.right, film.up], axis=1)
        below = points[self.apex] - points[self.lower]
        above = points[self.upper] - points[self.apex]
        tilt_below, tilt_above = (np.arctan2(*line) for line in (below, above))
        return float(self.side * (tilt_below - tilt_above))

    def read(self, seen: Flags) -> tuple[bool, bool]:
        """Whether both ends, and whether they and the apex, are among the vertebrae (V,) seen."""
        ends = bool(seen[self.lower] and seen[self.upper])
        return ends, ends and bool(seen[self.apex])

    def ferguson_by(self, film: Film) -> Array:
        """(2, V) rad/m: change of Ferguson's angle with right and up of every vertebra."""
        found = np.zeros((2, len(film.right)))
        for low, high, sign in ((self.lower, self.apex, 1), (self.apex, self.upper, -1)):
            right, up = film.right[high] - film.right[low], film.up[high] - film.up[low]
            turned = self.side * sign * np.array([up, -right]) / (right**2 + up**2)
            found[:, high] += turned
            found[:, low] -= turned
        return found


def region(apex: str) -> str:
    """Region of a curve by its apical vertebra, as Lenke 2001 names it.

    PT, proximal thoracic, has its apex down to T5; MT, main thoracic, down to T11; TL/L,
    thoracolumbar or lumbar, below.
    """
    if apex[0] in "LS" or apex == THORACOLUMBAR:
        return "TL/L"
    return "PT" if apex[0] == "C" or int(apex[1:]) <= LOWEST_PROXIMAL else "MT"


def curves(erect: Film) -> tuple[SpinalCurve, ...]:
    """The curves of a spine, caudal to cranial; adjacent ones share an end vertebra.

    Where several are equally tilted between two curves, each curve has the outermost of them.
    """
    before, found = 0, []
    points = np.stack([erect.right, erect.up], axis=1)
    for turn, upper in pairwise(_turning_points(erect.tilt)):
        # equally tilted vertebrae: the lowest one begins the curve, the uppermost one ends it
        lower = before + int(np.argmax(erect.tilt[before:] == erect.tilt[turn]))
        before = turn
        if upper - lower < 2:
            continue
        side = 1 if erect.tilt[lower] > erect.tilt[upper] else -1
        # the apex is the vertebra between them that is farthest from the line through them
        line = points[upper] - points[lower]
        off = points[lower + 1 : upper] - points[lower]
        away = np.abs(line[0] * off[:, 1] - line[1] * off[:, 0])
        found.append(SpinalCurve(lower, upper, lower + 1 + int(np.argmax(away)), side))
    return tuple(found)


def main_curve(erect: Film) -> SpinalCurve:
    """The curve of the largest Cobb angle."""
    return max(curves(erect), key=lambda curve: curve.cobb(erect))


def lumbar_apex(erect: Film, vertebrae: tuple[str, ...]) -> int:
    """Apex of the lowest curve whose apex is lumbar or at T12 or T11; else of the lowest curve."""
    every = curves(erect)
    names = (vertebrae[one.apex] for one in every)
    lowest = [
        one
        for one, name in zip(every, names, strict=True)
        if name[0] == "L" or name in ("T12", "T11")
    ]
    chosen = lowest or list(every[:1])
    return chosen[0].apex if chosen else len(vertebrae) // 3


def _turning_points(tilt: Array) -> list[int]:
    """Vertebrae at which the tilt turns back, ends among them; small waves are none.

    Of equally tilted ones the uppermost. Without a curve: the lowest and the uppermost vertebra.
    """
    # an extreme is a turning point once the tilt has come back from it by more than a wave
    risen, fallen = tilt - np.minimum.accumulate(tilt), np.maximum.accumulate(tilt) - tilt
    gone = np.flatnonzero(np.maximum(risen, fallen) > LEAST_CURVE)
    if not len(gone):
        return [0, len(tilt) - 1]
    extreme = int(gone[0])
    way = 1 if risen[extreme] > fallen[extreme] else -1
    points = [int(np.argmin(way * tilt[:extreme]))]
    for at in range(extreme + 1, len(tilt)):
        back = way * (tilt[extreme] - tilt[at])
        if back <= 0.0:
            extreme = at
        elif back > LEAST_CURVE:
            points.append(extreme)
            way, extreme = -way, at
    return [*points, extreme]
