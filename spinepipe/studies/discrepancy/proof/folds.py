"""Folds: which load steps of which tests train and which are predicted, and the readings of those.

A test is left out in all specimens at once. A left-out specimen has stiffness of its own, so every
second load step of its tests is given away to fit that, and the others are predicted; then swapped.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from spinepipe.effects.contract import Array
from spinepipe.studies.discrepancy.search.noise import Noise
from spinepipe.studies.discrepancy.search.readings import Repeats, SpecimenReadings
from spinepipe.studies.discrepancy.search.whitening import Whitening, whitening

Flags = NDArray[np.bool_]

Steps = Mapping[str, tuple[Flags, ...]]
"""Load steps (T,) of each test, by specimen."""

Masks = Mapping[str, tuple[Flags, ...]]
"""Readings of each test, (T, J, 6), by specimen."""

TEST, SPECIMEN, STEPS = "test", "specimen", "steps"


@dataclass(frozen=True)
class FoldFit:
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
    parts: tuple[FoldFit, ...]


def folds_by_test(
    readings: Mapping[str, SpecimenReadings], tests: Sequence[str]
) -> tuple[Fold, ...]:
    """One test left out in all specimens; none where there is only one."""
    if len(tests) < 2:
        return ()
    folds = []
    for test in tests:
        training, scored = {}, {}
        for name, one in readings.items():
            shapes = [(case.test == test, len(case.steps)) for case in one.cases]
            scored[name] = tuple(np.full(steps, left_out) for left_out, steps in shapes)
            training[name] = tuple(np.full(steps, not left_out) for left_out, steps in shapes)
        folds.append(Fold(test, TEST, (FoldFit(training, scored),)))
    return tuple(folds)


def folds_by_specimen(readings: Mapping[str, SpecimenReadings]) -> tuple[Fold, ...]:
    """One specimen left out, but for half of its load steps; none where there is only one."""
    if len(readings) < 2:
        return ()
    whole = {
        name: tuple(np.full(len(case.steps), True) for case in one.cases)
        for name, one in readings.items()
    }
    folds = []
    for name, one in readings.items():
        even, odd = (_every_second(one, first) for first in (0, 1))
        halves = ((even, odd), (odd, even))
        parts = (FoldFit({**whole, name: own}, {name: left}, name) for own, left in halves)
        folds.append(Fold(name, SPECIMEN, tuple(parts)))
    return tuple(folds)


def step_fold(readings: Mapping[str, SpecimenReadings]) -> Fold:
    """Every second load step left out, then the others: all there is with one specimen and test."""
    halves = []
    for first in (0, 1):
        training = {name: _every_second(one, first) for name, one in readings.items()}
        scored = {name: _every_second(one, 1 - first) for name, one in readings.items()}
        halves.append(FoldFit(training, scored))
    return Fold("every second load step", STEPS, tuple(halves))


def _every_second(one: SpecimenReadings, first: int) -> tuple[Flags, ...]:
    return tuple(np.arange(len(case.steps)) % 2 == first for case in one.cases)


def only(test: Repeats, chosen: Flags) -> Repeats:
    """A test with the readings of some load steps (T,), or of some places (T, J, 6), alone."""
    there = chosen[:, None, None] if chosen.ndim == 1 else chosen
    return replace(test, cycles=np.where(there, test.cycles, np.nan))


class ChosenSteps:
    """Whitenings of chosen load steps of a test; each is made once."""

    def __init__(self, readings: Mapping[str, SpecimenReadings], noise: Noise) -> None:
        self.readings, self.noise = readings, noise
        self._known: dict[tuple[str, int, bytes], Whitening] = {}

    def whitening(self, specimen: str, test: int, chosen: Flags) -> Whitening:
        """Of one test of a specimen."""
        key = (specimen, test, chosen.tobytes())
        if key not in self._known:
            masked = only(self.readings[specimen].tests[test], chosen)
            self._known[key] = whitening((masked,), self.noise)
        return self._known[key]

    def mean(self, specimen: str, test: int) -> Array:
        """(T, J, 6) mean over the cycles, 0 where nothing was read."""
        return np.nan_to_num(self.readings[specimen].tests[test].mean)

    def sd(self, specimen: str, test: int) -> Array:
        """(T, J, 6) SD of the mean over the cycles, 0 where nothing was read."""
        count = self.readings[specimen].tests[test].count
        size = np.sqrt(np.diagonal(self.noise.correlations(len(count))))
        sd = size[:, None, None] * self.noise.sd / np.sqrt(np.maximum(count, 1))
        return np.where(count > 0, sd, 0.0)
