"""Readings that do not follow their loads, and would in another order of steps, columns or joints.

Asked before units and signs: what is found here explains what these would say of the same readings.
"""

from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from spinepipe.cohort.cohort import Cohort
from spinepipe.cohort.load_response import LoadedCycle
from spinepipe.cohort.load_tests import DRIVEN
from spinepipe.effects.contract import Array
from spinepipe.plausibility.score import AGAINST
from spinepipe.plausibility.warnings.warning import PlausibilityWarning, TableCell, first_row, warn
from spinepipe.units import COORDINATE_COLUMNS, COORDINATES

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

Where = tuple[str, str]
"""Specimen and test."""

Cycles = Mapping[Where, Sequence[LoadedCycle]]


@dataclass(frozen=True)
class OrderFindings:
    """Warnings, and the specimens and tests of which units and signs need not be asked."""

    warnings: tuple[PlausibilityWarning, ...]
    places: frozenset[Where]


@dataclass(frozen=True)
class _Order:
    """What another order explains: a row of `warnings.csv`, column, table, and names in texts."""

    warning: str
    column: str
    stem: str = "motion"
    names: Mapping[str, Any] = field(default_factory=dict, compare=False)


def order(cohort: Cohort, cycles: Sequence[LoadedCycle]) -> OrderFindings:
    """What another order would explain, one line for each."""
    of_place: dict[Where, list[LoadedCycle]] = defaultdict(list)
    for cycle in cycles:
        of_place[cycle.specimen, cycle.test].append(cycle)
    told: dict[_Order, list[Where]] = defaultdict(list)
    for place, own in of_place.items():
        found = _steps(own) or _unloaded_joints(cohort, own)
        if found is not None:
            told[found].append(place)
    seen = {place for places in told.values() for place in places}
    rest = {place: own for place, own in of_place.items() if place not in seen}
    for key, places in (*_columns(rest), *_in_ground(rest)):
        told[key] += places
    warnings = []
    for key, places in told.items():
        first = dict(zip(("specimen", "test"), places[0], strict=True))
        cell = TableCell(key.stem, first_row(cohort, key.stem, **first), key.column)
        words = {"tests": tests_of(places), **key.names}
        warnings.append(
            warn(
                cohort,
                key.warning,
                cell,
                whose=dict(places),
                of_tests=[test for _, test in places],
                **words,
            )
        )
    return OrderFindings(
        tuple(warnings), frozenset(place for places in told.values() for place in places)
    )


def tests_of(places: Sequence[Sequence[Any]]) -> str:
    """Tests in words, of specimens and tests."""
    tests = list(dict.fromkeys(test for _, test, *_ in places))
    return f"test{'s' if len(tests) > 1 else ''} {', '.join(tests)}"


def _driven(cycle: LoadedCycle) -> list[tuple[int, int]]:
    """Joint and rotation that the largest moment on each joint drives, where both were read."""
    found = []
    for joint in range(cycle.loads.shape[1]):
        largest = np.abs(cycle.loads[:, joint, 3:]).max(axis=0)
        main = 3 + int(np.argmax(largest))
        if largest.max() > 0.0 and np.isfinite(cycle.readings[:, joint, main]).sum() > 2:
            found.append((joint, main))
    return found


def _steps(cycles: Sequence[LoadedCycle]) -> _Order | None:
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
        return _Order("step_0_repeated", "step")
    # of a cycle that is the same to both sides, read backwards, or against its load, which is left
    # to `response`, nobody can tell which it is, and a wrong sign happens more often
    if AGAINST < here < FOLLOWS and float(np.median(turned)) > BEST:
        return _Order("steps_reversed", "step")
    moved = here < FOLLOWS or (steps > FEW and here < LATE_FOLLOWS)
    limit = BEST if here < FOLLOWS else LATE_BEST
    return _Order("steps_late", "step") if moved and float(np.median(late)) > limit else None


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


def _unloaded_joints(cohort: Cohort, cycles: Sequence[LoadedCycle]) -> _Order | None:
    """Joints that carry no load and move as those that do: the wrong vertebra is loaded."""
    moved: dict[bool, list[float]] = {True: [], False: []}
    names = []
    for cycle in cycles:
        # root mean square over the steps of the turn of each joint, about all three axes
        turned = np.nan_to_num(cycle.readings[:, :, 3:])
        sizes = np.sqrt(np.mean(np.sum(turned**2, axis=2), axis=0))
        loaded = (cycle.loads != 0.0).any(axis=(0, 2))
        names = [n for n, there in zip(cohort.joint_names, loaded, strict=True) if not there]
        for size, there in zip(sizes, loaded, strict=True):
            moved[bool(there)].append(float(size))
    if not moved[True] or not moved[False] or not any(moved[True]):
        return None
    if np.median(moved[False]) < UNLOADED * np.median(moved[True]):
        return None
    told = {"joints": ", ".join(names), "joint": names[-1]}
    return _Order("joints_unloaded", "vertebra", "loads", told)


def _columns(of_place: Cycles) -> Iterator[tuple[_Order, list[Where]]]:
    """Rotations that answer the moments that drive another one, and that one these of its own."""
    answered: dict[tuple[int, int], list[Where]] = defaultdict(list)
    for place, cycles in of_place.items():
        for pair in filter(None, map(_answering, cycles)):
            answered[pair].append(place)
    for first, second in ((3, 4), (3, 5), (4, 5)):
        there, back = answered[first, second], answered[second, first]
        right = [*answered[first, first], *answered[second, second]]
        if (there or back) and not right:
            a, b = (COORDINATE_COLUMNS[k] for k in (first, second))
            ma, mb = (f"m{'xyz'[DRIVEN.index(COORDINATES[k])]}_nm" for k in (first, second))
            told = {"answers": b if there else a, "a": a, "b": b, "ma": ma, "mb": mb}
            places = list(dict.fromkeys([*there, *back]))
            yield _Order("rotations_exchanged", a, names=told), places


def _answering(cycle: LoadedCycle) -> tuple[int, int] | None:
    """The rotation that the test drives, and the one that answers; None where nobody can tell."""
    # moments about two axes at once tell nothing: the second must be a third of the first at most
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
        load, read = _centred(cycle.loads[:, joint, main], cycle.readings[:, joint, number])
        if load @ load > 0.0:
            sure = abs(_alike(load, read)) > -AGAINST
            found.append(abs(float(load @ read / (load @ load))) if sure else 0.0)
    return float(np.median(found)) if found else None


def _centred(load: Array, read: Array) -> tuple[Array, Array]:
    """Both less their means, where there is a reading."""
    there = np.isfinite(read)
    if not there.any():
        return load[there], read[there]
    return load[there] - load[there].mean(), read[there] - read[there].mean()


def _in_ground(of_place: Cycles) -> Iterator[tuple[_Order, list[Where]]]:
    """Rotations that grow from joint to joint, as those of vertebrae in ground do."""
    grown, places, column = [], [], ""
    for place, cycles in of_place.items():
        for cycle in cycles:
            driven = _driven(cycle)
            if cycle.pushed or len(driven) < 3 or len({number for _, number in driven}) > 1:
                continue
            pairs = [_centred(cycle.loads[:, j, n], cycle.readings[:, j, n]) for j, n in driven]
            slopes = np.array([x @ y / (x @ x) if x @ x > 0.0 else 0.0 for x, y in pairs])
            if np.any(slopes <= 0.0):
                return
            # Told in ground, joint n reads the sum of the n joints up to it: slopes grow as n does.
            numbers = np.array([joint + 1.0 for joint, _ in driven])
            alike = float(np.corrcoef(slopes, numbers)[0, 1])
            wide = float(slopes[-1] / slopes[0]) * numbers[0] / numbers[-1]
            grown.append(alike > BEST and 0.5 < wide < 2.0)
            places.append(place)
            column = column or COORDINATE_COLUMNS[driven[0][1]]
    if len(grown) >= 2 and all(grown):
        told = {"columns": ", ".join(COORDINATE_COLUMNS[3:])}
        yield _Order("rotations_in_ground", column, names=told), list(dict.fromkeys(places))
