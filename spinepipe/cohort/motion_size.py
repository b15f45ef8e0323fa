"""Is a joint's motion of a size that its load can make? A wrong unit shows, and has a name.

Published stiffness of healthy joints spans a factor of two to six by level and person (Gould 2024b,
Table 2). Motion that differs from what published stiffness gives by more than five is no stiffness
that was measured before: a joint that is fused or cut, or a unit.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import exp, log, pi

from spinepipe.units import TRANSLATIONS

PLAUSIBLE = 5.0
"""Factor by which measured motion may differ from the expected one, either way."""

LIKE = 2.4
"""Factor within which a unit explains what is seen: the factors of units that are common lie 6.5
apart and more, so that no motion is like two of them."""


@dataclass(frozen=True)
class Unit:
    """A mistaken unit.

    Attributes
    ----------
    factor : on motion over load. words : what it is. of_loads : whether loads.csv has it, or
        motion.csv.
    """

    factor: float
    words: str
    of_loads: bool = False

    def __str__(self) -> str:
        """What it is, and its factor."""
        return f"{self.words} ({self.factor:.3g})"


_OF_ROTATIONS = (
    Unit(pi / 180.0, "angles in radians and not degrees"),
    Unit(180.0 / pi, "angles turned into degrees once more"),
    Unit(1e-3, "moments in N mm and not N m", of_loads=True),
    Unit(0.112985, "moments in lbf in and not N m", of_loads=True),
    Unit(1e3, "moments divided by 1000", of_loads=True),
)
_OF_TRANSLATIONS = (
    Unit(1e-3, "translations in m and not mm"),
    Unit(1e3, "translations in \u00b5m and not mm, or forces in kN and not N"),
    Unit(25.4, "translations multiplied by 25.4 once more"),
    Unit(1.0 / 25.4, "translations in inches and not mm"),
)


def is_plausible(ratio: float) -> bool:
    """Whether motion over the expected motion, above 0, is one that joints were seen to have."""
    return 1.0 / PLAUSIBLE <= ratio <= PLAUSIBLE


def implausible(slope: float | None) -> str:
    """What is wrong with measured over expected motion, in words; nothing where it may be right."""
    if slope is None or slope <= 0.0 or is_plausible(slope):
        return ""
    return f"{slope:.3g} times the motion that published stiffness gives"


def unit_of(slopes: Sequence[float], coordinate: str) -> str:
    """The unit that explains the motion of all joints of a test, in words; nothing if none does.

    One joint alone may be fused or cut; a unit is of all.
    """
    if not slopes or not all(implausible(slope) for slope in slopes):
        return ""
    unit = unit_like(geometric_mean(slopes), coordinate)
    return "" if unit is None else str(unit)


def unit_like(ratio: float, coordinate: str) -> Unit | None:
    """The mistaken unit that makes so large a motion of a coordinate; None if none does."""
    known = _OF_TRANSLATIONS if coordinate in TRANSLATIONS else _OF_ROTATIONS
    unit = min(known, key=lambda one: abs(log(ratio / one.factor)))
    return unit if abs(log(ratio / unit.factor)) <= log(LIKE) else None


def geometric_mean(ratios: Sequence[float]) -> float:
    """The mean on a scale of factors; all above 0."""
    return exp(sum(map(log, ratios)) / len(ratios))
