"""Suspected mistakes in the files: they are no physics, and no effect should explain them.

Signs and units come from how joints answer their loads, without any model; scatter from repeats,
or from what the base leaves. Exchanged specimens: `swapped_specimens`. What cannot be told is not
reported.

Signs. A spring yields to its load. Where a joint answers as much as the others do, but the other
way, its readings have the wrong sign; where most joints of a test do so, the sign of the load (or
of the coordinate) has. Told of coordinates that a test drives, translations by forces and rotations
by moments; not of those that only follow others.

Units. Published stiffness of a joint spans a factor of 60 in a rotation and 30 in a translation
(Gould 2024a, Table 1). A single coordinate counts as impossible a decade beyond; several of a kind
together sooner, as a wrong unit moves all. Units that leave the stiffness in that range (lbf in for
N m: a factor of 8.85; lbf for N; cm for mm) cannot be told.
"""

from collections.abc import Mapping, Sequence

import numpy as np

from spinepipe.anatomy.stiffness_range import middle, published_range
from spinepipe.cohort.load_response import (
    ALL,
    LoadResponse,
    joint_loads,
    load_responses,
    of_specimens,
    typical,
)
from spinepipe.effects.contract import Array
from spinepipe.plausibility.score import AGAINST, CLEAR, geometric_mean, is_plausible, unit_like
from spinepipe.studies.discrepancy.mistakes.bad_markers import (
    bad_markers,
    beside_the_curve,
    between_cycles,
)
from spinepipe.studies.discrepancy.search.baseline import BaselineFit
from spinepipe.studies.discrepancy.search.readings import SpecimenReadings
from spinepipe.studies.discrepancy.verdict import SuspectedError
from spinepipe.units import COORDINATES, MM_PER_M, ROTATIONS, TRANSLATIONS

DECADES = 1.0
"""Beyond the published range, for one coordinate."""

APART = 30.0
"""Factor between one specimen or test and the others that no anatomy and no preload makes."""


def suspected_errors(
    baseline: BaselineFit, measured: Sequence[SpecimenReadings]
) -> tuple[SuspectedError, ...]:
    """What can be told before effects are looked for: signs, units and scatter.

    ``measured`` : the readings before outliers were left out; loose markers look like outliers.
    """
    joints = next(iter(baseline.fit.models.values())).joints
    found = [*before_a_fit(measured, joints, baseline.noise.sd, zeroed=baseline.noise.zeroed)]
    if not _is_repeated(measured):
        scatter = beside_the_curve(measured, baseline.fit.predicted)
        found += bad_markers(scatter, list(baseline.readings), joints, in_every=True)
    return tuple(found)


def _is_repeated(measured: Sequence[SpecimenReadings]) -> bool:
    return any(bool((test.count >= 2).any()) for one in measured for test in one.tests)


def before_a_fit(
    measured: Sequence[SpecimenReadings], joints: Sequence[str], sd: Array, *, zeroed: bool
) -> tuple[SuspectedError, ...]:
    """What can be told without a model: signs, units, and scatter between cycles.

    Also when the base has no fit, which a wrong unit may well be the reason for. ``sd`` (6,) m and
    rad, NaN where nothing was read.
    """
    by_name: Mapping[str, SpecimenReadings] = {one.specimen: one for one in measured}
    found = answers(by_name, zeroed, np.nan_to_num(sd), CLEAR)
    errors = []
    for kind in (ROTATIONS, TRANSLATIONS):  # apart: a unit is of forces or moments, of mm or deg
        errors += _wrong_units([one for one in found if one.coordinate in kind])
    errors += wrong_signs(found, joints, list(by_name), sd)
    if _is_repeated(measured):
        errors += bad_markers(between_cycles(measured), list(by_name), joints, in_every=False)
    return tuple(errors)


def answers(
    readings: Mapping[str, SpecimenReadings], zeroed: bool, sd: Array, clear: float
) -> list[LoadResponse]:
    """All driven coordinates whose motion is clear of the noise.

    Parameters
    ----------
    sd : (6,) of a reading, m and rad. clear : SDs that the motion's root mean square exceeds.
    """
    found: list[LoadResponse] = []
    for name, one in readings.items():
        for test in one.tests:
            loads = joint_loads(one.frames, test.case)
            found += load_responses(name, test.case.test, loads, test.mean, zeroed)
    return [a for a in found if a.rms > clear * sd[COORDINATES.index(a.coordinate)]]


def wrong_signs(
    found: Sequence[LoadResponse], joints: Sequence[str], specimens: Sequence[str], sd: Array
) -> list[SuspectedError]:
    """Suspected signs, whole tests first; ``sd`` (6,) of a reading."""
    errors: list[SuspectedError] = []
    for coordinate in COORDINATES:
        of_coordinate = [a for a in found if a.coordinate == coordinate]
        # answers against the load: of tests where most joints are, and of single joints
        whole: list[LoadResponse] = []
        single: list[LoadResponse] = []
        for answer in of_coordinate:
            if _is_against(answer, of_coordinate):
                place = (answer.specimen, answer.test)
                beside = [a for a in of_coordinate if (a.specimen, a.test) == place]
                against = sum(_is_against(a, of_coordinate) for a in beside)
                (whole if 2 * against > len(beside) else single).append(answer)
        errors += _signs_of_tests(whole, of_coordinate, specimens)
        errors += _signs_of_joints(single, of_coordinate, joints, specimens, sd)
    return errors


def _is_against(answer: LoadResponse, found: Sequence[LoadResponse]) -> bool:
    return answer.correlation < AGAINST and is_plausible(abs(answer.slope) / _usual(answer, found))


def _usual(answer: LoadResponse, found: Sequence[LoadResponse]) -> float:
    return typical([a.slope for a in found if a.specimen == answer.specimen])


def _signs_of_tests(
    whole: Sequence[LoadResponse], found: Sequence[LoadResponse], specimens: Sequence[str]
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


def _same(chosen: Sequence[LoadResponse]) -> dict[tuple[str, ...], list[str]]:
    """Sets of tests, and the specimens that have them."""
    found: dict[tuple[str, ...], list[str]] = {}
    for name in dict.fromkeys(a.specimen for a in chosen):
        tests = dict.fromkeys(a.test for a in chosen if a.specimen == name)
        found.setdefault(tuple(tests), []).append(name)
    return found


def _signs_of_joints(
    single: Sequence[LoadResponse],
    found: Sequence[LoadResponse],
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
            # how much better the sign changed agrees with what the other joints do
            size = sd[COORDINATES.index(chosen[0].coordinate)]
            slopes, as_read, changed = [], 0.0, 0.0
            for answer in chosen:
                usual = _usual(answer, found)
                slopes.append(answer.slope / usual)
                as_read += float(np.sum((answer.motion - usual * answer.load) ** 2)) / size**2
                changed += float(np.sum((answer.motion + usual * answer.load) ** 2)) / size**2
            evidence = (
                f"moves against its load, {np.median(slopes):.2f} times as far as the other joints "
                f"with it (correlation {np.median([a.correlation for a in chosen]):.3f}); chi2 "
                f"beside their motion {as_read:.0f} as read, {changed:.0f} with the sign changed"
            )
            errors.append(SuspectedError(where, "sign of the readings", evidence))
    return errors


def _wrong_units(found: Sequence[LoadResponse]) -> list[SuspectedError]:
    """Suspected units of rotations, or of translations: in single specimens, in single tests, else
    in the whole cohort.
    """
    whole = {a.specimen: (a.specimen,) for a in found}
    tests = {f"{a.specimen}, test {a.test}": (a.specimen, a.test) for a in found}
    for places, everywhere in ((whole, True), (tests, False)):
        errors = []
        for where, place in places.items():
            own = [a for a in found if (a.specimen, a.test)[: len(place)] == place]
            others = [a for a in found if (a.specimen, a.test)[: len(place)] != place]
            errors += _unit_apart(where, own, others, everywhere=everywhere)
        if errors:
            return errors
    stiffness = _stiffness(found)
    if not _is_impossible(stiffness):
        return []
    factor = geometric_mean([k / middle(name) for name, k in stiffness.items()])
    evidence = f"{_words_of_unit(stiffness)}: {factor:.3g} times the middle of the published range"
    return [SuspectedError(ALL, _mix_up(factor, stiffness), evidence)]


def _unit_apart(
    where: str, own: Sequence[LoadResponse], others: Sequence[LoadResponse], *, everywhere: bool
) -> list[SuspectedError]:
    """An error where all are far from the others', and further from the published."""
    mine, theirs = _stiffness(own), _stiffness(others)
    shared = [name for name in mine if name in theirs]
    if not shared or (everywhere and len(shared) < len(mine)):
        return []
    logs = np.array([np.log(mine[name] / theirs[name]) for name in shared])
    here = np.array([abs(np.log(mine[name] / middle(name))) for name in shared])
    there = np.array([abs(np.log(theirs[name] / middle(name))) for name in shared])
    if abs(logs.mean()) < np.log(APART) or np.ptp(logs) > np.log(APART) or here.sum() < there.sum():
        return []
    factor = float(np.exp(logs.mean()))
    evidence = f"{_words_of_unit(mine)}: {factor:.3g} times that of the others"
    return [SuspectedError(where, _mix_up(factor, mine), evidence)]


def _stiffness(found: Sequence[LoadResponse]) -> dict[str, float]:
    """N/m or N m/rad by coordinate: of most joints."""
    names = dict.fromkeys(a.coordinate for a in found)
    return {n: 1.0 / typical([a.slope for a in found if a.coordinate == n]) for n in names}


def _words_of_unit(stiffness: Mapping[str, float]) -> str:
    """In the units that testers use."""
    sizes = (
        f"{k / MM_PER_M:.3g} N/mm in {name}"
        if name in TRANSLATIONS
        else f"{k:.3g} N m/rad in {name}"
        for name, k in stiffness.items()
    )
    return f"stiffness about {', '.join(sizes)}".replace("_", " ")


def _mix_up(factor: float, stiffness: Mapping[str, float]) -> str:
    """The unit that makes stiffness so many times larger, and motion as many times smaller."""
    unit = unit_like(1.0 / factor, next(iter(stiffness)), "stiffness_over_published")
    return (
        f"unit: {unit.words} (a factor of {unit.factor:.3g})" if unit else "unit of loads or motion"
    )


def _is_impossible(stiffness: Mapping[str, float]) -> bool:
    """Beyond the published range by a decade in one coordinate, or all the same way by less."""
    if not stiffness:
        return False
    ranges = [published_range(name) for name in stiffness]
    above = [np.log10(k / high) for k, (_, high) in zip(stiffness.values(), ranges, strict=True)]
    below = [np.log10(low / k) for k, (low, _) in zip(stiffness.values(), ranges, strict=True)]
    if max(max(above), max(below)) > DECADES:
        return True
    least = DECADES / np.sqrt(len(stiffness))
    return any(min(side) > 0.0 and float(np.mean(side)) > least for side in (above, below))
