"""Thin a cycle to load steps: each reading by local regression on the load, with its SD.

At a level of the load a parabola is fitted to the rows of the branch whose load is near, the
nearer the more they count (tricube weights; Cleveland 1979, J Am Stat Assoc 74, 829-836). Loading
and unloading are branches of their own, so a loop stays a loop. What rows leave around the
parabola, with what neighbouring rows share, tells the SD of the reading.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from spinepipe.decomposition import pinvh
from spinepipe.testing_machine.cycles import Branch, Cut, Cycle

Array = NDArray[np.float64]

ENOUGH_ROWS = 8
"""The window around a level grows from half a step until it holds so many rows."""

FOR_A_PARABOLA = 8
"""With fewer rows a straight line is fitted."""

FEWEST_ROWS = 3
STRONGEST_CORRELATION = 0.98
SINGULAR = 1e-10
BEYOND = 0.02
"""Share of the range of a cycle by which a level may lie beyond the turn of a branch."""


@dataclass(frozen=True)
class Step:
    """One load step of a cycle: a level of the load on one of its branches."""

    level: float
    branch: int


@dataclass(frozen=True, eq=False)
class Reading:
    """What local regression says at one load step.

    Attributes
    ----------
    values : (C,) reading of each quantity.
    share : SD of a reading in SDs of a single row, where rows err by themselves.
    left : (n, C) what is left of the rows near the level. freedom : n less what was fitted.
    """

    values: Array
    share: float
    left: Array
    freedom: float

    @property
    def raw(self) -> Array:
        """(C,) SD of a single row around the parabola."""
        return np.sqrt((self.left**2).sum(axis=0) / self.freedom)


def common_levels(
    cut: Cut, cycles: Sequence[Cycle], per_side: int, asked: Sequence[float] | None
) -> tuple[tuple[float, ...], ...]:
    """Levels beyond the reference that all cycles reach, by turn, outwards; signed, absolute.

    Parameters
    ----------
    cycles : those that are kept. asked : sizes of the driving load instead of equal steps.
    """
    sides = []
    for turn in range(max(len(cycle.peaks) for cycle in cycles)):
        way = cut.way if turn == 0 else -cut.way
        reached = min(way * (c.peaks[turn] - cut.reference) for c in cycles if len(c.peaks) > turn)
        if asked is None:
            round_one = float(f"{reached:.2g}")
            top = round_one if round_one <= reached * (1 + BEYOND) else reached
            sizes = [top * (n + 1) / per_side for n in range(per_side)]
            sides.append(tuple(cut.reference + way * size for size in sizes))
        else:
            told = [way * size for size in sorted(asked)]
            told = [one for one in told if way * (one - cut.reference) > 0]
            sides.append(tuple(one for one in told if _within(way * one, way, cut, reached)))
    return tuple(sides)


def _within(size: float, way: int, cut: Cut, reached: float) -> bool:
    return size - way * cut.reference <= reached * (1 + BEYOND)


def plan(cut: Cut, sides: Sequence[Sequence[float]], cycle: Cycle, load: Array) -> list[Step]:
    """The load steps of a cycle in the order in which it passes them, the reference first.

    A cycle that the recording cuts off has those that it passes.
    """
    steps = [Step(cut.reference, 0)]
    for turn, levels in enumerate(sides):
        if turn:
            steps.append(Step(cut.reference, turn))
        steps += [Step(level, turn) for level in levels]
        steps += [Step(level, turn + 1) for level in levels[-2::-1]]
    steps.append(Step(cut.reference, len(sides)))
    if cycle.complete:
        return steps
    kept: list[Step] = []
    for step in steps:
        if step.branch >= len(cycle.branches) or not _passed(cut, cycle, step, load):
            break
        kept.append(step)
    return kept


def _passed(cut: Cut, cycle: Cycle, step: Step, load: Array) -> bool:
    rows = load[cycle.branches[step.branch].rows]
    slack = BEYOND * (cut.high - cut.low)
    return bool(rows.min() - slack <= step.level <= rows.max() + slack)


def read_at(
    level: float, width: float, branch: Branch, load: Array, quantities: Array
) -> Reading | None:
    """Local regression of quantities (N, C) at a level of the load (N,), on one branch.

    ``width``: the step between levels; None where the branch has fewer than three rows.
    """
    u, y = load[branch.rows] - level, quantities[branch.rows]
    if len(u) < FEWEST_ROWS:
        return None
    enough = np.sort(np.abs(u))[min(ENOUGH_ROWS, len(u)) - 1]
    reach = max(width / 2, 1.001 * float(enough))
    near = np.abs(u) < reach
    x, y = u[near] / reach, y[near]
    weight = (1.0 - np.abs(x) ** 3) ** 3
    degree = 2 if len(x) >= FOR_A_PARABOLA else 1
    terms = x[:, None] ** np.arange(degree + 1)
    inverse = pinvh(terms.T @ (weight[:, None] * terms), SINGULAR)
    smoother = inverse @ (terms.T * weight)  # (p, n): coefficients of a parabola from the rows
    coefficients = smoother @ y
    left = y - terms @ coefficients
    freedom = max(len(x) - float(np.trace(smoother @ terms)), 1.0)
    return Reading(coefficients[0], float(np.linalg.norm(smoother[0])), left, freedom)


def sds_of(readings: Sequence[Reading]) -> Array:
    """(T, C) SDs of readings, more where rows resemble their neighbours: by (1 + r) / (1 - r).

    The correlation r of neighbouring rows is taken from all readings together.
    """
    power = sum((one.left**2).sum(axis=0) for one in readings)
    product = sum((one.left[1:] * one.left[:-1]).sum(axis=0) for one in readings)
    r = np.divide(product, power, out=np.zeros_like(power), where=power > 0)
    r = np.clip(r, 0.0, STRONGEST_CORRELATION)
    own = np.array([one.raw * one.share for one in readings])
    return own * np.sqrt((1 + r) / (1 - r))
