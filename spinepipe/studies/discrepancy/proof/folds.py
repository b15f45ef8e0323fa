"""Folds: which load steps of which tests train, and which are predicted.

A test is left out in all specimens at once. A left-out specimen has stiffness of its own, so every
second load step of its tests is given away to fit that, and the others are predicted; then swapped.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from spinepipe.discrepancy.readings import SpecimenReadings

Steps = Mapping[str, tuple[NDArray[np.bool_], ...]]
"""Load steps (T,) of each test, by specimen."""

TEST, SPECIMEN, STEPS = "test", "specimen", "steps"


@dataclass(frozen=True)
class Part:
    """One fit and what it predicts.

    Attributes
    ----------
    training, scored : load steps. apart : a specimen whose own values are fitted last, to its
        training steps alone, while what it shares stays as the other specimens have it.
    """

    training: Steps
    scored: Steps
    apart: str | None = None


@dataclass(frozen=True)
class Fold:
    """What is left out, in one part or in two halves. ``kind`` : test, specimen or steps."""

    name: str
    kind: str
    parts: tuple[Part, ...]


def folds_by_test(
    readings: Mapping[str, SpecimenReadings], tests: Sequence[str]
) -> tuple[Fold, ...]:
    """One test left out in all specimens; none where there is only one."""
    if len(tests) < 2:
        return ()
    return tuple(Fold(name, TEST, (_without(readings, name),)) for name in tests)


def folds_by_specimen(readings: Mapping[str, SpecimenReadings]) -> tuple[Fold, ...]:
    """One specimen left out, but for half of its load steps; none where there is only one."""
    if len(readings) < 2:
        return ()
    return tuple(
        Fold(name, SPECIMEN, tuple(_half(readings, name, first) for first in (0, 1)))
        for name in readings
    )


def step_fold(readings: Mapping[str, SpecimenReadings]) -> Fold:
    """Every second load step left out, then the others: all there is with one specimen and test."""
    halves = []
    for first in (0, 1):
        training = {name: _every_second(one, first) for name, one in readings.items()}
        scored = {name: _every_second(one, 1 - first) for name, one in readings.items()}
        halves.append(Part(training, scored))
    return Fold("every second load step", STEPS, tuple(halves))


def _without(readings: Mapping[str, SpecimenReadings], test: str) -> Part:
    training, scored = {}, {}
    for name, one in readings.items():
        shapes = [(case.test == test, len(case.steps)) for case in one.cases]
        scored[name] = tuple(np.full(steps, left_out) for left_out, steps in shapes)
        training[name] = tuple(np.full(steps, not left_out) for left_out, steps in shapes)
    return Part(training, scored)


def _half(readings: Mapping[str, SpecimenReadings], specimen: str, first: int) -> Part:
    training = {
        name: _every_second(one, first) if name == specimen else _all(one)
        for name, one in readings.items()
    }
    return Part(training, {specimen: _every_second(readings[specimen], 1 - first)}, specimen)


def _all(one: SpecimenReadings) -> tuple[NDArray[np.bool_], ...]:
    return tuple(np.full(len(case.steps), True) for case in one.cases)


def _every_second(one: SpecimenReadings, first: int) -> tuple[NDArray[np.bool_], ...]:
    return tuple(np.arange(len(case.steps)) % 2 == first for case in one.cases)
