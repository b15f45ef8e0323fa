"""Is a joint's motion of a size that its load can make? A wrong unit shows, and has a name.

Motion that differs by more than a factor of five from what published stiffness gives is no
stiffness that was measured before: a joint that is fused or cut, or a unit.
"""

from collections.abc import Sequence
from math import exp, log

from spinepipe.plausibility.score import MistakeHypothesis, suspect, usual
from spinepipe.units import TRANSLATIONS


def is_plausible(ratio: float) -> bool:
    """Whether motion over the expected motion, above 0, is one that joints were seen to have."""
    return usual("motion_over_expected").holds(ratio)


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
    return "" if unit is None else f"{unit.words} ({unit.size})"


def unit_like(
    ratio: float, coordinate: str, quantity: str = "motion_over_expected"
) -> MistakeHypothesis | None:
    """The mistaken unit that makes so large a motion of a coordinate; None if none does."""
    return suspect("translation" if coordinate in TRANSLATIONS else "rotation", ratio, quantity)


def geometric_mean(ratios: Sequence[float]) -> float:
    """The mean on a scale of factors; all above 0."""
    return exp(sum(map(log, ratios)) / len(ratios))
