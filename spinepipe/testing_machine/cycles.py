"""Segmentation a recording into cycles, where the driving load turns back.

A reversal counts where the load goes back by more than a share of its range, so that noise makes
none. A cycle begins where the load leaves the reference: zero, or, if the load never comes near
zero, the end of its range at which it starts. So a load that swings to both sides is cut where it
passes zero the way it began, and one that goes up and down is cut at its lower reversals.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

REACHES = 0.8
"""A cycle that does not reach this share of what the others reach is no repeat of them."""


@dataclass(frozen=True)
class Branch:
    """Rows between two reversals: the load goes one way.

    Attributes
    ----------
    first, last : rows, both included.
    way : 1 where the load rises, -1 where it falls.
    """

    first: int
    last: int
    way: int

    @property
    def rows(self) -> slice:
        """Its rows."""
        return slice(self.first, self.last + 1)


@dataclass(frozen=True)
class Cycle:
    """One time from the reference out and back.

    Attributes
    ----------
    branches : two for a load on one side (out, back), three for a load on both sides (out, across,
        back); fewer where the recording ends on the way.
    start : row where it leaves the reference.
    peaks : load at the turns, in the order of the branches.
    complete : whether it comes back to the reference.
    """

    branches: tuple[Branch, ...]
    start: int
    peaks: tuple[float, ...]
    complete: bool


@dataclass(frozen=True)
class Segmentation:
    """The cycles of one recording.

    Attributes
    ----------
    reference : load at which cycles begin and end. way : 1 where cycles first go up, else -1.
    low, high : range of the load. both_sides : whether cycles cross to the other side.
    reversals : how many there are. cycles : all of them, in order.
    left_out : why each one that is not kept is not, by its number from 1.
    """

    reference: float
    way: int
    low: float
    high: float
    both_sides: bool
    reversals: int
    cycles: tuple[Cycle, ...]
    left_out: tuple[tuple[int, str], ...]

    @property
    def kept(self) -> tuple[tuple[int, Cycle], ...]:
        """The cycles that count, with their numbers from 1."""
        dropped = {number for number, _ in self.left_out}
        numbered = enumerate(self.cycles, start=1)
        return tuple((number, cycle) for number, cycle in numbered if number not in dropped)


def segment(
    load: Array, smallest_reversal: float, preconditioning: int, asked: float | None = None
) -> Segmentation:
    """Cycles of a recording.

    Parameters
    ----------
    load : (N,) the driving load.
    smallest_reversal : share of its range by which it must turn back.
    preconditioning : so many cycles at the beginning are left out.
    asked : size of the load at which cycles begin, on the side on which the load mostly is.
    """
    low, high = float(load.min()), float(load.max())
    least = smallest_reversal * (high - low)
    turns = reversals(load, least)
    if asked is not None:
        reference = float(np.copysign(asked, low + high))
    elif low - least <= 0.0 <= high + least:
        reference = 0.0
    else:
        reference = low if abs(load[0] - low) < abs(load[0] - high) else high
    reference = float(np.clip(reference, low, high))
    both = min(high - reference, reference - low) > least
    goes_up = load[turns[1]] > reference if both else high - reference > reference - low
    way = 1 if goes_up else -1
    branches = _branches(turns, load)
    cycles = _cycles(branches, way * (load - reference), way, both, least)
    cycles = [replace(c, peaks=tuple(reference + way * p for p in c.peaks)) for c in cycles]
    dropped = tuple(_left_out(cycles, reference, preconditioning))
    return Segmentation(reference, way, low, high, both, len(turns) - 2, tuple(cycles), dropped)


def reversals(load: Array, least: float) -> list[int]:
    """Rows where the load turns back by more than ``least``, the first and last row besides."""
    # a turning-point filter with a dead band: `best` is the extreme of the present way; it counts
    # as a reversal once the load has gone back from it by `least`
    turns, best, way = [0], 0, 0
    for row in range(1, len(load)):
        if way == 0:
            if abs(load[row] - load[0]) > least:
                way, best = (1 if load[row] > load[0] else -1), row
        elif way * (load[row] - load[best]) > 0:
            best = row
        elif way * (load[best] - load[row]) > least:
            turns.append(best)
            best, way = row, -way
    return [*turns, len(load) - 1]


def _branches(turns: list[int], load: Array) -> list[Branch]:
    return [
        Branch(first, last, 1 if load[last] > load[first] else -1)
        for first, last in pairwise(turns)
    ]


def _cycles(branches: list[Branch], out: Array, way: int, both: bool, least: float) -> list[Cycle]:
    """Cycles that begin with each branch on the way out; ``out`` is the load beyond the reference.

    ``out`` is positive on the side to which cycles go first.
    """
    found = []
    for number, branch in enumerate(branches):
        if branch.way != way or out[branch.last] < least:
            continue
        inside = np.flatnonzero(out[branch.rows] <= 0.0)
        start = branch.first + (int(inside[-1]) if inside.size else 0)
        of_cycle = branches[number : number + (3 if both else 2)]
        if not both and len(of_cycle) == 2:
            complete = bool(out[of_cycle[1].rows].min() < least / 2)
        else:
            last = of_cycle[-1]
            complete = len(of_cycle) == 3 and bool(out[last.rows].max() > -least / 2)
        peaks = tuple(float(out[one.last]) for one in of_cycle[: 2 if both else 1])
        found.append(Cycle(tuple(of_cycle), start, peaks, complete))
    return found


def _left_out(
    cycles: list[Cycle], reference: float, preconditioning: int
) -> Iterator[tuple[int, str]]:
    """Cycles that are no repeats of the others; an incomplete one counts where it is alone."""
    later = list(enumerate(cycles, start=1))[preconditioning:]
    for number in range(1, min(preconditioning, len(cycles)) + 1):
        yield number, "preconditioning"
    some_complete = any(cycle.complete for _, cycle in later)
    usual = np.median(
        [[abs(peak - reference) for peak in c.peaks] for _, c in later if c.complete] or [[0.0]],
        axis=0,
    )
    for number, cycle in later:
        if some_complete and not cycle.complete:
            yield number, "the recording ends before it is back"
        elif some_complete and any(
            abs(peak - reference) < REACHES * size
            for peak, size in zip(cycle.peaks, usual, strict=True)
        ):
            reached = " and ".join(f"{peak:.3g}" for peak in cycle.peaks)
            yield number, f"it reaches only {reached}"
