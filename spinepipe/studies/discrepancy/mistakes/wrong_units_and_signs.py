"""Joints that move against the load that drives them: a sign is wrong, in motion or in loads.

A spring yields to its load. Where a joint answers as much as the others do, but the other way, its
readings have the wrong sign; where most joints of a test do so, the sign of the load (or of the
coordinate) has. Told of rotations that a test drives; not of translations, nor of rotations that
only follow others.
"""

from collections.abc import Sequence

import numpy as np

from spinepipe.discrepancy.mistakes.driven import Answer, typical
from spinepipe.discrepancy.mistakes.suspected import SuspectedError, of_specimens
from spinepipe.effects.contract import Array
from spinepipe.units import COORDINATES, ROTATIONS

AGAINST = -0.9
"""Correlation of motion and load below which a joint moves against its load."""

LIKE = 5.0
"""Factor within which the size of an answer must be that of the other joints."""


def wrong_signs(
    found: Sequence[Answer], joints: Sequence[str], specimens: Sequence[str], sd: Array
) -> list[SuspectedError]:
    """Suspected signs, whole tests first; ``sd`` (6,) of a reading."""
    errors: list[SuspectedError] = []
    for coordinate in ROTATIONS:
        of_coordinate = [a for a in found if a.coordinate == coordinate]
        whole, single = _split(of_coordinate)
        errors += _tests(whole, of_coordinate, specimens)
        errors += _joints(single, of_coordinate, joints, specimens, sd)
    return errors


def _split(found: Sequence[Answer]) -> tuple[list[Answer], list[Answer]]:
    """Answers against the load: of tests where most are, and of single joints."""
    whole: list[Answer] = []
    single: list[Answer] = []
    for answer in found:
        if _is_against(answer, found):
            beside = [a for a in found if (a.specimen, a.test) == (answer.specimen, answer.test)]
            against = sum(_is_against(a, found) for a in beside)
            (whole if 2 * against > len(beside) else single).append(answer)
    return whole, single


def _is_against(answer: Answer, found: Sequence[Answer]) -> bool:
    size = abs(answer.slope) / _usual(answer, found)
    return answer.correlation < AGAINST and 1.0 / LIKE < size < LIKE


def _usual(answer: Answer, found: Sequence[Answer]) -> float:
    return typical([a.slope for a in found if a.specimen == answer.specimen])


def _tests(
    whole: Sequence[Answer], found: Sequence[Answer], specimens: Sequence[str]
) -> list[SuspectedError]:
    """One for each set of tests that the same specimens have wrong."""
    errors = []
    for tests, names in _same(whole).items():
        driven = {a.test for a in found if a.specimen in names}
        chosen = [a for a in whole if a.specimen in names]
        beside = [a for a in found if a.specimen in names and a.test in tests]
        what = f"sign of the load, or of every {chosen[0].coordinate} reading"
        if set(tests) == driven and len(driven) > 1:
            what = f"sign of {chosen[0].coordinate} in all joints, or of its loads"
        evidence = (
            f"{len(chosen)} of {len(beside)} joints and tests move against the load "
            f"(median correlation {np.median([a.correlation for a in chosen]):.3f})"
        )
        where = f"{of_specimens(names, specimens)}, test {', '.join(tests)}"
        errors.append(SuspectedError(where, what, evidence))
    return errors


def _joints(
    single: Sequence[Answer],
    found: Sequence[Answer],
    joints: Sequence[str],
    specimens: Sequence[str],
    sd: Array,
) -> list[SuspectedError]:
    """One for each joint and set of tests that the same specimens have wrong."""
    errors = []
    for joint in dict.fromkeys(a.joint for a in single):
        mine = [a for a in single if a.joint == joint]
        for tests, names in _same(mine).items():
            chosen = [a for a in mine if a.specimen in names]
            place = f"{of_specimens(names, specimens)}, {joints[joint]} {chosen[0].coordinate}"
            driven = {a.test for a in found if a.joint == joint and a.specimen in names}
            where = place if set(tests) == driven else f"{place}, test {', '.join(tests)}"
            errors.append(SuspectedError(where, "sign of the readings", _words(chosen, found, sd)))
    return errors


def _words(chosen: Sequence[Answer], found: Sequence[Answer], sd: Array) -> str:
    """How much better the sign changed agrees with what the other joints do."""
    size = sd[COORDINATES.index(chosen[0].coordinate)]
    slopes, as_read, changed = [], 0.0, 0.0
    for answer in chosen:
        usual = _usual(answer, found)
        slopes.append(answer.slope / usual)
        as_read += float(np.sum((answer.motion - usual * answer.load) ** 2)) / size**2
        changed += float(np.sum((answer.motion + usual * answer.load) ** 2)) / size**2
    return (
        f"moves against its load, {np.median(slopes):.2f} times as far as the other joints with it "
        f"(correlation {np.median([a.correlation for a in chosen]):.3f}); chi2 beside their motion "
        f"{as_read:.0f} as read, {changed:.0f} with the sign changed"
    )


def _same(chosen: Sequence[Answer]) -> dict[tuple[str, ...], list[str]]:
    """Sets of tests, and the specimens that have them."""
    found: dict[tuple[str, ...], list[str]] = {}
    for name in dict.fromkeys(a.specimen for a in chosen):
        tests = dict.fromkeys(a.test for a in chosen if a.specimen == name)
        found.setdefault(tuple(tests), []).append(name)
    return found
