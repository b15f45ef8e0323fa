"""Cutting a recording into cycles, by where the driving load turns back.

The driving load is the one force (N) or moment (N m) that the machine drives. A reversal counts
where the load goes back by more than a share of its range, so that noise makes none. A cycle begins
where the load leaves the reference: zero, or, if the load never turns near zero, the end of the
range of its turns that is nearer to its start; or a size that the user gives. What comes before the
first turn and after the last one, as a ramp to a preload, tells no reference. So a load that swings
to both sides is cut where it passes the reference in the direction of the first swing, and one that
stays on one side is cut at its reversals near the reference. The way out is from the reference to
the first peak.

Where a machine holds the load at a turn, both branches have all rows of the hold, and its median is
the peak: within the hold the extreme is where noise puts it.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

REACHES = 0.8
"""A cycle is no repeat of the others if a peak of it, less the reference, is below this share of
their median.
"""


STARTS = 0.1
"""Share of the smallest reversal by which a cycle may begin beyond the reference: what is read
there would be extrapolated, and be subtracted from all its readings.
"""

HOLD_BANDS = (0.5, 0.25, 0.125)
"""Shares of the smallest reversal: bands at a turn in which a hold is looked for, the widest first,
for a load may overshoot and settle.
"""

FLAT = 0.1
"""Median distance of the load from its median, over the width of a band, that a hold may have: most
rows are held. A load that turns at once has 0.25 in any band, be the turn a corner or round; noise
of 0.1, an SD of 0.15, hardly ever spans the band.
"""

HELD_ROWS = 8


@dataclass(frozen=True)
class Branch:
    """Rows of a recording between two reversals: the load goes one way.

    Attributes
    ----------
    first, last : numbers of rows from 0, both included; neighbouring branches share the row of a
        turn, or all rows of a hold.
    way : 1 where the load rises, -1 where it falls.
    end : load at its end. held : whether it ends in a hold.
    """

    first: int
    last: int
    way: int
    end: float
    held: bool

    @property
    def rows(self) -> slice:
        """Its rows."""
        return slice(self.first, self.last + 1)


@dataclass(frozen=True)
class Cycle:
    """One time from the reference out and back.

    Attributes
    ----------
    branches : two for a load on one side (out, back), three for a load on both sides (out, across
        to the other side, back); fewer where the recording ends on the way. The last branch of a
        load on both sides goes on past the reference, as the first one of the next cycle.
    late : load at which it begins where that is beyond the reference, else None.
    peaks : load (N or N m, as recorded) at the end of the way out and, of a load on both sides, of
        the way across.
    complete : whether it comes back to the reference, to within half of the smallest reversal.
    """

    branches: tuple[Branch, ...]
    late: float | None
    peaks: tuple[float, ...]
    complete: bool


@dataclass(frozen=True)
class Segmentation:
    """The cycles of one recording.

    Attributes
    ----------
    reference : load at which cycles begin and end, N or N m.
    way : 1 where the load first goes up from the reference, -1 where it first goes down.
    low, high : range of the load, N or N m.
    both_sides : whether cycles cross to the other side of the reference.
    reversals : how many there are; the ends of the recording are none.
    cycles : all of them, in order, those that are left out too.
    left_out : number of a cycle, from 1, and why it is left out.
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
    load : (N,) the driving load, N or N m.
    smallest_reversal : share of its range by which it must turn back for a reversal to count.
    preconditioning : so many cycles at the beginning are left out.
    asked : size (not below 0) of the load at which cycles begin; it is taken on the side of zero
        to which the range reaches farther. None: found from the load.
    """
    low, high = ends = float(load.min()), float(load.max())
    least = smallest_reversal * (high - low)
    turns = reversals(load, least)
    if len(turns) > 3:  # cycles turn at both ends: a ramp to a preload is none of them
        inner = load[turns[1:-1]]
        low, high = float(inner.min()), float(inner.max())
    # the reference: as asked, or zero if the range comes near it, or the end where the load starts
    if asked is not None:
        reference = float(np.copysign(asked, low + high))
    elif low - least <= 0.0 <= high + least:
        reference = 0.0
    else:
        reference = low if abs(load[0] - low) < abs(load[0] - high) else high
    reference = float(np.clip(reference, *ends))
    # to both sides if the range goes beyond the reference by more than a reversal on each; then the
    # first turn says which way is first, else the side on which the load is
    both = min(high - reference, reference - low) > least
    goes_up = load[turns[1]] > reference if both else high - reference > reference - low
    way = 1 if goes_up else -1
    branches = _branches(turns, load, least)
    cycles = _cycles(branches, way * (load - reference), reference, way, both, least)
    dropped = tuple(_left_out(cycles, reference, preconditioning))
    return Segmentation(reference, way, *ends, both, len(turns) - 2, tuple(cycles), dropped)


def reversals(load: Array, least: float) -> list[int]:
    """Rows where the load turns back by more than ``least``, with the row at which the first branch
    begins and the last row.

    Parameters
    ----------
    least : in the unit of the load.
    """
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
    turns.append(len(load) - 1)
    # small swings before the first branch are not read into it
    away = load[: turns[1] + 1] * (1 if load[turns[1]] > load[0] else -1)
    away = away - away.min()
    lowest = np.flatnonzero(away <= STARTS * least)[-1]
    swings = np.flatnonzero(away[:lowest] > 2 * STARTS * least)
    turns[0] = int(swings[-1]) + 1 if swings.size else 0
    return turns


def _branches(turns: list[int], load: Array, least: float) -> list[Branch]:
    """What lies between one turn and the next, with the holds at both."""
    inner = [_hold(load, turn, least) for turn in turns[1:-1]]
    ends = [(turns[0], turns[0]), *inner, (turns[-1], turns[-1])]
    return [
        Branch(
            *(here[0], there[1], 1 if load[last] > load[first] else -1),
            *(float(np.median(load[there[0] : there[1] + 1])), there[0] < there[1]),
        )
        for (first, last), (here, there) in zip(pairwise(turns), pairwise(ends), strict=True)
    ]


def _hold(load: Array, turn: int, least: float) -> tuple[int, int]:
    """First and last row of the hold around a turn; the turn twice where the load is not held."""
    away = np.abs(load - load[turn])
    for band in (share * least for share in HOLD_BANDS):
        outside = np.flatnonzero(away > band)
        place = np.searchsorted(outside, turn)
        first = int(outside[place - 1]) + 1 if place else 0
        last = int(outside[place]) - 1 if place < len(outside) else len(load) - 1
        rows = load[first : last + 1]
        apart = np.abs(rows - np.median(rows))
        usual = float(np.median(apart))
        if len(rows) >= HELD_ROWS and usual < FLAT * band:
            # four SDs of the hold: without rows on the way there and back
            near = np.flatnonzero(apart <= 6 * usual)
            return first + int(near[0]), first + int(near[-1])
    return turn, turn


def _cycles(
    branches: list[Branch], out: Array, reference: float, way: int, both: bool, least: float
) -> list[Cycle]:
    """Cycles: one begins with each branch that goes out and ends at least ``least`` beyond the
    reference.

    Parameters
    ----------
    out : (N,) load less the reference, positive on the side to which cycles go first.
    reference, way, both : as in `Segmentation`.
    least : smallest reversal, in the unit of the load.
    """
    found = []
    for number, branch in enumerate(branches):
        if branch.way != way or way * (branch.end - reference) < least:
            continue
        nearest = float(out[branch.rows].min())
        late = reference + way * nearest if nearest > STARTS * least else None
        of_cycle = branches[number : number + (3 if both else 2)]
        # back at the reference, to within half a reversal: from above on one side (the second
        # branch), from below after the other side (the third)
        if not both and len(of_cycle) == 2:
            complete = bool(out[of_cycle[1].rows].min() < least / 2)
        else:
            last = of_cycle[-1]
            complete = len(of_cycle) == 3 and bool(out[last.rows].max() > -least / 2)
        peaks = tuple(one.end for one in of_cycle[: 2 if both else 1])
        found.append(Cycle(tuple(of_cycle), late, peaks, complete))
    return found


def _left_out(
    cycles: list[Cycle], reference: float, preconditioning: int
) -> Iterator[tuple[int, str]]:
    """Numbers of the cycles that are left out, from 1, and why.

    Left out are the first ones, for preconditioning; of the later ones those that are not complete
    and those that reach too little (`REACHES`). If no later one is complete, all of them are kept
    but those that begin late.
    """
    later = list(enumerate(cycles, start=1))[preconditioning:]
    for number in range(1, min(preconditioning, len(cycles)) + 1):
        yield number, "preconditioning"
    some_complete = any(cycle.complete for _, cycle in later)
    # (peaks,) size of each peak beyond the reference, the median of complete cycles
    usual = np.median(
        [[abs(peak - reference) for peak in c.peaks] for _, c in later if c.complete] or [[0.0]],
        axis=0,
    )
    for number, cycle in later:
        if cycle.late is not None and number > 1:
            why = "the load does not come back to the reference"
            remedy = f"with `steps.reference: {abs(cycle.late):.3g}` it counts"
            yield number, f"it begins at {cycle.late:.3g}, as {why}; {remedy}"
        elif cycle.late is not None:
            yield number, "the recording begins after it has left the reference"
        elif some_complete and not cycle.complete:
            yield number, "the recording ends before it is back"
        elif some_complete and any(
            abs(peak - reference) < REACHES * size
            for peak, size in zip(cycle.peaks, usual, strict=True)
        ):
            reached = " and ".join(f"{peak:.3g}" for peak in cycle.peaks)
            yield number, f"it reaches only {reached}"
