"""Noise from cycles whose loads were meant to be equal and are not quite.

The base's prediction takes the difference of the loads out; what it misses is common to the cycles
of a test, so that differences of their residuals are noise.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from spinepipe.discrepancy.noise import REPEATS, Noise, estimated_noise, without_outliers
from spinepipe.discrepancy.readings import Repeats, SpecimenReadings
from spinepipe.effects.contract import Array

Predicted = Mapping[str, Sequence[Array]]


def noise_of_residuals(
    readings: Mapping[str, SpecimenReadings], predicted: Predicted, noise: Noise
) -> tuple[dict[str, SpecimenReadings], Noise]:
    """Readings without outliers, and their noise; as it was where there are too few cycles.

    Parameters
    ----------
    predicted : by specimen, per load history (T, J, 6). noise : as declared.
    """
    residuals = [_residuals(one, predicted[name]) for name, one in readings.items()]
    kept, outliers = without_outliers(residuals)
    found = estimated_noise(kept, None, noise.zeroed, noise.outliers + outliers)
    if found is None or found.source != REPEATS:
        return dict(readings), noise
    names = readings.items()
    clean = {name: _without(one, left) for (name, one), left in zip(names, kept, strict=True)}
    return clean, found


def _histories(one: SpecimenReadings) -> list[list[int]]:
    """Numbers of the load histories that are cycles of one test: same name, same steps."""
    groups: dict[tuple[object, ...], list[int]] = {}
    for number, test in enumerate(one.tests):
        steps = tuple(step.step for step in test.case.steps)
        groups.setdefault((test.case.test, steps), []).append(number)
    return list(groups.values())


def _residuals(one: SpecimenReadings, predicted: Sequence[Array]) -> SpecimenReadings:
    """Residuals in the place of readings, cycles of a test together."""
    tests = []
    for numbers in _histories(one):
        cycles = np.concatenate([one.tests[n].cycles - predicted[n] for n in numbers])
        tests.append(Repeats(one.tests[numbers[0]].case, cycles))
    return replace(one, tests=tuple(tests))


def _without(one: SpecimenReadings, kept: SpecimenReadings) -> SpecimenReadings:
    """The readings less those whose residual was dropped."""
    tests = list(one.tests)
    for numbers, group in zip(_histories(one), kept.tests, strict=True):
        at = 0
        for n in numbers:
            cycles = tests[n].cycles
            there = np.isfinite(group.cycles[at : at + len(cycles)])
            at += len(cycles)
            tests[n] = replace(tests[n], cycles=np.where(there, cycles, np.nan))
    return replace(one, tests=tuple(tests))
