"""Which steps of a test lead to others: the load goes from step to step in proportion."""

from collections.abc import Collection

import numpy as np
from numpy.typing import NDArray

from spinepipe.model.spine import LoadCase

STRAIGHT = 1e-6
"""Share of a load by which files round it."""


def leading_to(case: LoadCase, wanted: Collection[int], pressed: bool) -> list[int]:
    """Places of the wanted steps of a case, and of those before them at which its load turns.

    Parameters
    ----------
    wanted : their places. pressed : whether weight, or a load that no step lists, comes on first.
    """
    loads = _loads(case, pressed)
    last, found = np.zeros(loads.shape[1]), []
    for place in range(max(wanted) + 1):
        if place in wanted or not _straight(last, loads[place], loads[place + 1]):
            found.append(place)
            last = loads[place]
    return found


def _loads(case: LoadCase, pressed: bool) -> NDArray[np.float64]:
    """(T, n) all that a step states, N, N m, m and rad, and whether anything else presses."""
    rows: list[dict[tuple[object, ...], float]] = []
    for step in case.steps:
        row: dict[tuple[object, ...], float] = {("pressed",): float(pressed)}
        for wrench in step.wrenches:
            numbers = (*wrench.force.tolist(), *wrench.moment.tolist())
            for at, number in enumerate(numbers):
                key = (wrench.body, *wrench.point.tolist(), at)
                row[key] = row.get(key, 0.0) + number
        row |= {(one.joint, one.coordinate): one.value for one in step.supports}
        rows.append(row)
    keys = dict.fromkeys(key for row in rows for key in row)
    return np.array([[row.get(key, 0.0) for key in keys] for row in rows])


def _straight(
    start: NDArray[np.float64], middle: NDArray[np.float64], end: NDArray[np.float64]
) -> bool:
    """Whether a load lies on the straight way between two others."""
    way, done = end - start, middle - start
    share = float(np.clip(done @ way / max(float(way @ way), 1e-300), 0.0, 1.0))
    off = np.abs(done - share * way).max(initial=0.0)
    return bool(off <= STRAIGHT * max(np.abs(way).max(initial=0.0), np.abs(done).max(initial=0.0)))
