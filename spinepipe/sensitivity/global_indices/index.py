"""What an analysis hands back: indices with intervals, or the reason why there are none."""

from dataclasses import dataclass
from enum import StrEnum
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from spinepipe.effects.contract import Array

Masked = np.ma.MaskedArray[Any, np.dtype[np.float64]]
"""Numbers of which some may be missing; ``tolist()`` gives None for these."""


class Known(StrEnum):
    """Whether an index could be computed."""

    DONE = "done"
    CONSTANT = "constant"
    TOO_MANY_FAILED = "too_many_failed"
    TOO_FEW = "too_few"


@dataclass(frozen=True, eq=False)
class Index:
    """One index of one factor for K outputs.

    Attributes
    ----------
    index : S1, ST, S2, mu, mu_star, sigma, PAWN, S1_RBD, delta, KS_low or KS_high.
    factor : name of the factor or group. other : second one of a pair, else empty.
    estimate, low, high : (K,) estimates and ends of their intervals; masked where the status is
        not ``done``, the ends also where a method has no interval.
    runs : how many runs the estimate rests on. failed : how many runs of the design failed.
    status : (K,) of `Known`. message : (K,) what a reader of the numbers must know.
    """

    index: str
    factor: str
    other: str
    estimate: Masked
    low: Masked
    high: Masked
    runs: int
    failed: int
    status: tuple[Known, ...]
    message: tuple[str, ...]


def masked(values: ArrayLike, missing: ArrayLike) -> Masked:
    """The values without the missing ones, under whose mask there is 0."""
    gaps = np.asarray(missing, dtype=bool)
    kept: Array = np.where(gaps, 0.0, np.asarray(values, dtype=np.float64))
    return np.ma.array(kept, mask=gaps)
