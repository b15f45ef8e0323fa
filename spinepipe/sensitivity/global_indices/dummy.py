"""The noise floor: what an index says of a factor that changes nothing."""

from collections.abc import Sequence

import numpy as np

from spinepipe.sensitivity.global_indices.design import DUMMY
from spinepipe.sensitivity.global_indices.index import Index, Masked


def noise_floor(found: Sequence[Index]) -> dict[str, Masked]:
    """(K,) upper interval end of the dummy, by name of index; empty without a dummy.

    Of S2 it is the highest end among the dummy's pairs, of an index that may be negative (mu) the
    end farther from 0. An index without intervals (FAST) has the dummy's estimate as its floor.

    In Sobol and Morris designs the runs that a dummy changes are repetitions, so that its S1, ST,
    mu and sigma are 0 but for the model's own scatter: these estimators have no noise floor, and a
    factor above it is one whose interval leaves 0 out. In S2, FAST and given-data indices the
    floor is the method's noise.
    """
    floors: dict[str, Masked] = {}
    for index in found:
        if DUMMY in (index.factor, index.other):
            top = _farthest(index)
            floors[index.index] = np.ma.maximum(floors.get(index.index, top), top)
    return floors


def above_floor(index: Index, floors: dict[str, Masked]) -> tuple[bool | None, ...]:
    """(K,) whether the whole interval lies above the floor; None where one of both is missing."""
    if index.index not in floors:
        return (None,) * len(index.status)
    return tuple((_nearest(index) > floors[index.index]).tolist())


def _farthest(index: Index) -> Masked:
    low, high = _ends(index)
    return np.ma.maximum(high, -low) + 0.0 if index.index == "mu" else high


def _nearest(index: Index) -> Masked:
    low, high = _ends(index)
    return np.ma.maximum(low, -high) if index.index == "mu" else low


def _ends(index: Index) -> tuple[Masked, Masked]:
    if np.ma.getmaskarray(index.low).all():
        return index.estimate, index.estimate
    return index.low, index.high
