"""Readings that do not follow their loads, and would in another order of steps, columns or joints.

Asked before units and signs: what is found here explains what these would say of the same readings.
"""

from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from spinepipe.cohort.answers import of_specimens
from spinepipe.cohort.cohort import Cohort
from spinepipe.cohort.doubt import Doubt
from spinepipe.cohort.doubtful_places import file_of, first_row
from spinepipe.cohort.load_tests import DRIVEN
from spinepipe.cohort.loaded_cycles import LoadedCycle
from spinepipe.effects.contract import Array
from spinepipe.problems import Problem
from spinepipe.units import COORDINATE_COLUMNS, COORDINATES, ROTATIONS

FOLLOWS, BEST = 0.75, 0.95
"""Correlation, from zero, below which readings do not follow their loads, and that of the right
order."""

LATE_FOLLOWS, LATE_BEST = 0.97, 0.995
"""The same of readings one step late, where more than `FEW` steps are loaded."""

FEW = 3

MORE = 4.0
"""Times that another rotation must answer a moment more than the one that it drives."""

UNLOADED = 0.3
"""Of the motion of loaded joints: joints without a load that move more than that are loaded."""

IN_A_ROW = 0.95
"""Correlation of motion with the number of joints below: rotations in ground add up."""

Place = tuple[str, str]
"""Specimen and test."""


@dataclass(frozen=True)
class Explained:
    """Doubts, and the specimens and tests of which units and signs need not be asked."""

    doubts: tuple[Doubt, ...]
    places: frozenset[Place]


def doubtful_order(cohort: Cohort, cycles: Sequence[LoadedCycle]) -> Explained:
    """What another order would explain, one line for each."""
    of_place: dict[Place, list[LoadedCycle]] = defaultdict(list)
    for cycle in cycles:
        of_place[cycle.specimen, cycle.test].append(cycle)
    told: dict[tuple[str, str, str, str], list[Place]] = defaultdict(list)
    for place, own in of_place.items():
        found = _steps(own) or _unloaded_joints(cohort, own)
        if found is not None:
            told[found].append(place)
    seen = {place for places in told.values() for place in places}
    rest = {place: own for place, own in of_place.items() if place not in seen}
    for key, places in (*_columns(rest), *_in_ground(rest)):
        told[key] += places
    doubts = [_doubt(cohort, *key, places) for key, places in told.items()]
    return Explained(tuple(doubts), frozenset(p for places in told.values() for p in places))


def _doubt(
    cohort: Cohort, stem: str, column: str, words: str, remedy: str, places: Sequence[Place]
) -> Doubt:
    tests = list(dict.fromkeys(test for _, test in places))
    whose = of_specimens(dict.fromkeys(name for name, _ in places), cohort.specimen_names)
    found = f"{words} ({whose}, test{'s' if len(tests) > 1 else ''} {', '.join(tests)})"
    line = first_row(cohort, stem, places[0][0], places[0][1])
    problem = Problem(
        file_of(cohort, stem), line, column, found, "motion that follows the loads", remedy
    )
    return Doubt(problem, "motion")


def _driven(cycle: LoadedCycle) -> list[tuple[int, int]]:
    """Joint and rotation that the largest moment on each joint drives, where both were read."""
    found = []
    for joint in range(cycle.loads.shape[1]):
        largest = np.abs(cycle.loads[:, joint, 3:]).max(axis=0)
        main = 3 + int(np.argmax(largest))
        if largest.max() > 0.0 and np.isfinite(cycle.readings[:, joint, main]).sum() > 2:
            found.append((joint, main))
    return found


def _steps(cycles: Sequence[LoadedCycle]) -> tuple[str, str, str, str] | None:
    """Steps in reverse, or readings one step late."""
    given, turned, late, steps = [], [], [], 0
    for cycle in cycles:
        readings = cycle.from_rest
        for joint, number in _driven(cycle):
            load, read = cycle.loads[:, joint, number], readings[:, joint, number]
            if (load == 0.0).any() and np.isfinite(read).all():
                steps = max(steps, int((load != 0.0).sum()))
                given.append(_alike(load, read))
                turned.append(_alike(load, read[::-1]))
                late.append(_alike(load[:-1], read[1:]))
    if not given:
        return None
    here = float(np.median(given))
    if all(map(_stands_still, cycles)):
        remedy = "suspected: readings one step late; write them beside the step before"
        return "motion", "step", "the readings of step 0 once more under the first load", remedy
    if here < FOLLOWS and float(np.median(turned)) > BEST:
        remedy = "suspected: steps in reverse order, here or in loads.csv; number them alike"
        return "motion", "step", "readings that follow the loads from the last step back", remedy
    moved = here < FOLLOWS or (steps > FEW and here < LATE_FOLLOWS)
    limit = BEST if here < FOLLOWS else LATE_BEST
    if moved and float(np.median(late)) > limit:
        remedy = "suspected: readings one step late; write them beside the step before"
        return "motion", "step", "readings that follow the load of the step before", remedy
    return None


def _stands_still(cycle: LoadedCycle) -> bool:
    """Whether the first loaded step reads what step 0 does, to the last digit, and others not."""
    if len(cycle.readings) < FEW + 1 or np.array_equal(cycle.loads[0], cycle.loads[1]):
        return False
    read = cycle.from_rest
    same = [np.array_equal(read[k], read[k + 1], equal_nan=True) for k in (0, 1)]
    return same == [True, False] and bool(np.isfinite(read[1]).any())


def _alike(load: Array, read: Array) -> float:
    """Correlation from zero, not from the means."""
    size = float(np.linalg.norm(load) * np.linalg.norm(read))
    return float(load @ read) / size if size > 0.0 else 0.0


def _unloaded_joints(
    cohort: Cohort, cycles: Sequence[LoadedCycle]
) -> tuple[str, str, str, str] | None:
    """Joints that carry no load and move as those that do: the wrong vertebra is loaded."""
    moved: dict[bool, list[float]] = {True: [], False: []}
    names = []
    for cycle in cycles:
        turned = np.nan_to_num(cycle.readings[:, :, 3:])
        sizes = np.sqrt(np.mean(np.sum(turned**2, axis=2), axis=0))
        loaded = (cycle.loads != 0.0).any(axis=(0, 2))
        names = [n for n, there in zip(cohort.joint_names, loaded, strict=True) if not there]
        for size, there in zip(sizes, loaded, strict=True):
            moved[bool(there)].append(float(size))
    if not moved[True] or not moved[False]:
        return None
    if np.median(moved[False]) < UNLOADED * np.median(moved[True]) or not any(moved[True]):
        return None
    found = f"{', '.join(names)} move without a load"
    remedy = f"suspected: vertebra: the load is on one above {names[-1]}; correct the name"
    return "loads", "vertebra", found, remedy


_Key = tuple[str, str, str, str]


def _columns(
    of_place: Mapping[Place, Sequence[LoadedCycle]],
) -> Iterator[tuple[_Key, list[Place]]]:
    """Rotations that answer the moments that drive another one, and that one these of its own."""
    answered: dict[tuple[int, int], list[Place]] = defaultdict(list)
    for place, cycles in of_place.items():
        for cycle in cycles:
            pair = _answering(cycle)
            if pair is not None:
                answered[pair].append(place)
    for first, second in ((3, 4), (3, 5), (4, 5)):
        there, back = answered[first, second], answered[second, first]
        right = [*answered[first, first], *answered[second, second]]
        if (there or back) and not right:
            names = [COORDINATE_COLUMNS[k] for k in (first, second)]
            moments = [f"m{'xyz'[DRIVEN.index(COORDINATES[k])]}_nm" for k in (first, second)]
            words = f"{names[1 if there else 0]} answers the moment that drives the other"
            remedy = (
                f"suspected: {names[0]} and {names[1]} exchanged, or {moments[0]} and {moments[1]} "
                "in loads.csv; exchange them back"
            )
            places = list(dict.fromkeys([*there, *back]))
            yield ("motion", names[0], words, remedy), places


def _answering(cycle: LoadedCycle) -> tuple[int, int] | None:
    """The rotation that the test drives, and the one that answers; None where nobody can tell."""
    sizes = np.abs(cycle.loads[:, :, 3:]).max(axis=(0, 1))
    order = np.argsort(sizes)
    if sizes[order[2]] <= 0.0 or sizes[order[1]] > sizes[order[2]] / 3.0:
        return None
    main = 3 + int(order[2])
    answers = {k: _answer(cycle, main, k) for k in range(3, 6)}
    read = {k: size for k, size in answers.items() if size is not None}
    if not read:
        return None
    best = max(read, key=lambda k: read[k])
    if best != main and read.get(main, 0.0) * MORE > read[best]:
        return None
    return main, best


def _answer(cycle: LoadedCycle, main: int, number: int) -> float | None:
    """Median size of a rotation's answer to the main moment; None where it was not read."""
    found = []
    for joint in range(cycle.loads.shape[1]):
        load, read = cycle.loads[:, joint, main], cycle.readings[:, joint, number]
        there = np.isfinite(read)
        load, read = load[there] - load[there].mean() if there.any() else load[there], read[there]
        if load @ load > 0.0:
            read = read - read.mean()
            size = float(np.linalg.norm(load) * np.linalg.norm(read))
            sure = size > 0.0 and abs(float(load @ read)) > 0.9 * size
            found.append(abs(float(load @ read / (load @ load))) if sure else 0.0)
    return float(np.median(found)) if found else None


def _in_ground(
    of_place: Mapping[Place, Sequence[LoadedCycle]],
) -> Iterator[tuple[_Key, list[Place]]]:
    """Rotations that grow from joint to joint, as those of vertebrae in ground do."""
    grown, places, column = [], [], ""
    for place, cycles in of_place.items():
        for cycle in cycles:
            driven = _driven(cycle)
            if cycle.pushed or len(driven) < 3 or len({number for _, number in driven}) > 1:
                continue
            slopes = np.array([_slope(cycle, *one) for one in driven])
            if np.any(slopes <= 0.0):
                return
            numbers = np.array([joint + 1.0 for joint, _ in driven])
            alike = float(np.corrcoef(slopes, numbers)[0, 1])
            wide = float(slopes[-1] / slopes[0]) * numbers[0] / numbers[-1]
            grown.append(alike > IN_A_ROW and 0.5 < wide < 2.0)
            places.append(place)
            column = column or COORDINATE_COLUMNS[driven[0][1]]
    if len(grown) < 2 or not all(grown):
        return
    names = [name for name in COORDINATE_COLUMNS if name.removesuffix("_deg") in ROTATIONS]
    remedy = (
        f"suspected: {', '.join(names)} of vertebrae in ground; subtract those of the vertebra "
        "below"
    )
    words = "rotations that add up from joint to joint"
    yield ("motion", column, words, remedy), list(dict.fromkeys(places))


def _slope(cycle: LoadedCycle, joint: int, number: int) -> float:
    """Motion over load."""
    load, read = cycle.loads[:, joint, number], cycle.readings[:, joint, number]
    there = np.isfinite(read)
    load, read = load[there] - load[there].mean(), read[there] - read[there].mean()
    return float(load @ read / (load @ load)) if load @ load > 0.0 else 0.0
