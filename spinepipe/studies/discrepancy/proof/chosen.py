"""Readings of chosen load steps alone, and their whitening."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from spinepipe.discrepancy.noise import Noise
from spinepipe.discrepancy.readings import Repeats, SpecimenReadings
from spinepipe.discrepancy.whitening import Whitening, whitening
from spinepipe.effects.contract import Array

Flags = NDArray[np.bool_]

Masks = Mapping[str, tuple[Flags, ...]]
"""Readings of each test, (T, J, 6), by specimen."""


def only(test: Repeats, chosen: Flags) -> Repeats:
    """A test with the readings of some load steps (T,), or of some places (T, J, 6), alone."""
    there = chosen[:, None, None] if chosen.ndim == 1 else chosen
    return replace(test, cycles=np.where(there, test.cycles, np.nan))


class Chosen:
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
