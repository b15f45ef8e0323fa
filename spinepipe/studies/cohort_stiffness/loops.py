"""The tests of a specimen as loops of moment and motion: opposite tests are joined to one."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from spinepipe.cohort.load_tests import DRIVEN, moments
from spinepipe.cohort.measured import MeasuredCycle
from spinepipe.effects.contract import Array
from spinepipe.experiment.loop import Loop

AND = "+"
"""Between the names of two tests that are one loop."""


@dataclass(frozen=True)
class LoadingLoop:
    """One cycle of a test, or of two tests to opposite sides one behind the other.

    Attributes
    ----------
    coordinate : rotation that the moment drives; None where no moment drives what was read.
    places : of its recordings among the cycles of the specimen. recordings : these.
    """

    test: str
    number: int
    coordinate: str | None
    places: tuple[int, ...]
    recordings: tuple[MeasuredCycle, ...]

    @cached_property
    def load(self) -> Array:
        """(T,) N m, the moment that drives the coordinate."""
        axis = DRIVEN.index(self.coordinate or DRIVEN[0])
        return np.concatenate([moments(one.case)[:, axis] for one in self.recordings])

    @cached_property
    def measured(self) -> Array:
        """(T, J, 6) m and rad, NaN where not read; where zeroed step 0 is zero as it is told."""
        return np.concatenate([_with_zero(one) for one in self.recordings])

    @property
    def parts(self) -> tuple[int, ...]:
        """Load steps of each recording."""
        return tuple(len(one.measured) for one in self.recordings)

    def of(self, each: Sequence[Array]) -> Array:
        """(T, ...) what is known step by step of all cycles of the specimen, of this loop."""
        return np.concatenate([each[place] for place in self.places])


def _with_zero(one: MeasuredCycle) -> Array:
    motion = one.measured.copy()
    if one.zeroed and len(motion):
        read = np.isfinite(one.readings).any(axis=0)
        motion[0] = np.where(read, 0.0, motion[0])
    return motion


def cycles_of(tested: Sequence[MeasuredCycle]) -> list[LoadingLoop]:
    """The cycles of a specimen in their order, two tests to opposite sides joined to one.

    Joined are tests that drive one rotation, each to its own side alone and the only one to it;
    their cycles of one number make a loop, others stay by themselves.
    """
    alone = [
        LoadingLoop(one.case.test, one.case.cycle, _turned(one), (place,), (one,))
        for place, one in enumerate(tested)
    ]
    partner = dict(_opposite(alone))
    found = {(one.test, one.number): one for one in alone}
    made: list[LoadingLoop] = []
    for one in alone:
        there = found.get((partner.get(one.test, ""), one.number))
        if there is None:
            made.append(one)
        elif one.places < there.places:
            made.append(_joined(one, there))
    return made


def _turned(one: MeasuredCycle) -> str | None:
    """The rotation that the moment drives, where it is what was read."""
    return one.loaded if one.loaded in DRIVEN else None


def _opposite(cycles: Sequence[LoadingLoop]) -> Iterator[tuple[str, str]]:
    """Each test with the one to the other side, where there is exactly one for each side."""
    sides: dict[tuple[str | None, int], set[str]] = {}
    for one in cycles:
        side = _only_side(one.load) if one.coordinate else 0
        sides.setdefault((one.coordinate, side), set()).add(one.test)
    for coordinate in DRIVEN:
        here, there = (sides.get((coordinate, side), set()) for side in (1, -1))
        if len(here) == len(there) == 1 and not here & there:
            positive, negative = min(here), min(there)
            yield from ((positive, negative), (negative, positive))


def _only_side(load: Array) -> int:
    """1 or -1 where only that side is loaded, else 0."""
    loop = Loop(load, load)
    reached = [side for side in (1, -1) if loop.reached(side)]
    return reached[0] if len(reached) == 1 else 0


def _joined(one: LoadingLoop, other: LoadingLoop) -> LoadingLoop:
    return LoadingLoop(
        f"{one.test}{AND}{other.test}",
        one.number,
        one.coordinate,
        one.places + other.places,
        one.recordings + other.recordings,
    )
