"""Stiffness that no spine has: the unit of the loads or of the motion is another than stated.

Published stiffness of a joint spans a factor of 60 in a rotation (Gould 2024a, Table 1). A single
rotation counts as impossible a decade beyond; several together sooner, as a wrong unit moves all.
Units that leave the stiffness in that range (lbf in for N m: a factor of 8.85) cannot be told.
"""

from collections.abc import Mapping, Sequence

import numpy as np

from spinepipe.anatomy.published import published
from spinepipe.discrepancy.mistakes.driven import Answer, typical
from spinepipe.discrepancy.mistakes.suspected import ALL, SuspectedError
from spinepipe.units import ROTATIONS, STIFFNESS_COLUMNS

DECADES = 1.0
"""Beyond the published range, for one rotation."""

APART = 30.0
"""Factor between one specimen or test and the others that no anatomy and no preload makes."""

MIX_UPS = {
    1000.0: "loads in N mm taken for N m",
    180.0 / np.pi: "motion in rad taken for deg",
    np.pi / 180.0: "motion in deg taken for rad",
    1e-3: "loads in kN m taken for N m",
}
"""Factor on the stiffness that each mistake makes."""

NEAR = 5.0
"""Factor within which a mistake counts as the one."""


def published_range(coordinate: str) -> tuple[float, float]:
    """Smallest and largest published stiffness of a rotation, N m/rad (Gould 2024a, Table 1)."""
    column = STIFFNESS_COLUMNS[3 + ROTATIONS.index(coordinate)]
    box = published("gould_2024a")["start_stiffness_box"]
    return float(box["low"][column]), float(box["high"][column])


def wrong_units(found: Sequence[Answer]) -> list[SuspectedError]:
    """Suspected units: of single specimens and tests, else of the whole cohort."""
    single = _of_specimens(found) or _of_tests(found)
    if single:
        return single
    stiffness = _stiffness(found)
    if not _is_impossible(stiffness):
        return []
    factors = [k / _middle(name) for name, k in stiffness.items()]
    factor = float(np.exp(np.mean(np.log(factors))))
    evidence = f"{_words(stiffness)}: {_times(factor)} the middle of the published range"
    return [SuspectedError(ALL, _mix_up(factor), evidence)]


def _stiffness(found: Sequence[Answer]) -> dict[str, float]:
    """N m/rad by rotation: of most joints."""
    names = dict.fromkeys(a.coordinate for a in found)
    return {n: 1.0 / typical([a.slope for a in found if a.coordinate == n]) for n in names}


def _is_impossible(stiffness: Mapping[str, float]) -> bool:
    """Beyond the published range by a decade in one rotation, or all the same way by less."""
    if not stiffness:
        return False
    ranges = [published_range(name) for name in stiffness]
    above = [np.log10(k / high) for k, (_, high) in zip(stiffness.values(), ranges, strict=True)]
    below = [np.log10(low / k) for k, (low, _) in zip(stiffness.values(), ranges, strict=True)]
    if max(max(above), max(below)) > DECADES:
        return True
    least = DECADES / np.sqrt(len(stiffness))
    return any(min(side) > 0.0 and float(np.mean(side)) > least for side in (above, below))


def _of_specimens(found: Sequence[Answer]) -> list[SuspectedError]:
    errors = []
    for name in dict.fromkeys(a.specimen for a in found):
        own = [a for a in found if a.specimen == name]
        errors += _apart(name, own, [a for a in found if a.specimen != name], everywhere=True)
    return errors


def _of_tests(found: Sequence[Answer]) -> list[SuspectedError]:
    errors = []
    for specimen, test in dict.fromkeys((a.specimen, a.test) for a in found):
        own = [a for a in found if (a.specimen, a.test) == (specimen, test)]
        others = [a for a in found if (a.specimen, a.test) != (specimen, test)]
        errors += _apart(f"{specimen}, test {test}", own, others, everywhere=False)
    return errors


def _apart(
    where: str, own: Sequence[Answer], others: Sequence[Answer], *, everywhere: bool
) -> list[SuspectedError]:
    """An error where all rotations are far from the others', and further from the published."""
    mine, theirs = _stiffness(own), _stiffness(others)
    shared = [name for name in mine if name in theirs]
    if not shared or (everywhere and len(shared) < len(mine)):
        return []
    logs = np.array([np.log(mine[name] / theirs[name]) for name in shared])
    here = np.array([abs(np.log(mine[name] / _middle(name))) for name in shared])
    there = np.array([abs(np.log(theirs[name] / _middle(name))) for name in shared])
    if abs(logs.mean()) < np.log(APART) or np.ptp(logs) > np.log(APART) or here.sum() < there.sum():
        return []
    factor = float(np.exp(logs.mean()))
    evidence = f"{_words(mine)}: {_times(factor)} that of the others"
    return [SuspectedError(where, _mix_up(factor), evidence)]


def _middle(coordinate: str) -> float:
    low, high = published_range(coordinate)
    return float(np.sqrt(low * high))


def _words(stiffness: Mapping[str, float]) -> str:
    sizes = ", ".join(f"{k:.3g} N m/rad in {n.replace('_', ' ')}" for n, k in stiffness.items())
    return f"stiffness about {sizes}"


def _times(factor: float) -> str:
    return f"{factor:.3g} times"


def _mix_up(factor: float) -> str:
    nearest = min(MIX_UPS, key=lambda known: abs(np.log(factor / known)))
    if abs(np.log(factor / nearest)) < np.log(NEAR):
        return f"unit: {MIX_UPS[nearest]} (a factor of {nearest:.3g})"
    return "unit of loads or motion"
