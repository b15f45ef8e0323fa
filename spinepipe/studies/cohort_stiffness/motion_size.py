"""Is a joint's motion of a size that its load can make? A wrong unit shows, and has a name.

Published stiffness of healthy joints spans a factor of two to six by level and person (Gould 2024b,
Table 2). Motion that differs from what published stiffness gives by more than five is no stiffness
that was measured before: a joint that is fused or cut, or a unit.
"""

from collections.abc import Sequence
from math import log, pi

from spinepipe.units import TRANSLATIONS

PLAUSIBLE = 5.0
"""Factor by which measured motion may differ from the expected one, either way."""

LIKE = 2.0
"""Factor within which a unit explains what is seen."""

_OF_LOADS = {
    1e-3: "moments in N mm and not N m",
    0.112985: "moments in lbf in and not N m",
    1e3: "moments divided by 1000",
}
_OF_FORCES = {
    1e-3: "translations in m and not mm",
    1e3: "translations in \u00b5m and not mm",
    25.4: "translations multiplied by 25.4 once more",
    1.0 / 25.4: "translations in inches and not mm",
}
_OF_ANGLES = {
    pi / 180.0: "angles in radians and not degrees",
    180.0 / pi: "angles turned into degrees once more",
}


def implausible(slope: float | None) -> str:
    """What is wrong with measured over expected motion, in words; nothing where it may be right."""
    if slope is None or slope <= 0.0 or 1.0 / PLAUSIBLE <= slope <= PLAUSIBLE:
        return ""
    return f"{slope:.3g} times the motion that published stiffness gives"


def unit_of(slopes: Sequence[float], coordinate: str) -> str:
    """The unit that explains the motion of all joints of a test, in words; nothing if none does.

    One joint alone may be fused or cut; a unit is of all.
    """
    if not slopes or not all(implausible(slope) for slope in slopes):
        return ""
    middle = sum(map(log, slopes)) / len(slopes)
    known = _OF_FORCES if coordinate in TRANSLATIONS else _OF_ANGLES | _OF_LOADS
    factor = min(known, key=lambda one: abs(middle - log(one)))
    return f"{known[factor]} ({factor:.3g})" if abs(middle - log(factor)) <= log(LIKE) else ""
