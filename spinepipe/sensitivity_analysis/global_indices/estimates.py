"""What an analysis is asked and hands back: settings, estimates, and indices or why there are none.

Resamples of a bootstrap are weights of runs; intervals come from what they give.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from enum import StrEnum
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.stats import norm

from spinepipe.effects.contract import Array
from spinepipe.sensitivity_analysis.global_indices.design import Method


@dataclass(frozen=True, eq=False)
class IndexEstimates:
    """C indices of K outputs.

    Attributes
    ----------
    names : (C,) of index, factor, and second factor of a pair (else empty).
    estimate : (C, K). ends : (2, C, K), or None where the method has no interval.
    note : what a reader of all these must know.
    """

    names: tuple[tuple[str, str, str], ...]
    estimate: Array
    ends: Array | None
    note: str = ""


NOTHING = IndexEstimates((), np.empty((0, 0)), None)
"""No index of no output."""


Masked = np.ma.MaskedArray[Any, np.dtype[np.float64]]
"""Numbers of which some may be missing; ``tolist()`` gives None for these."""


class IndexStatus(StrEnum):
    """Whether an index could be computed."""

    DONE = "done"
    CONSTANT = "constant"
    TOO_MANY_FAILED = "too_many_failed"
    TOO_FEW = "too_few"


@dataclass(frozen=True, eq=False)
class SensitivityIndex:
    """One index of one factor for K outputs.

    Attributes
    ----------
    index : S1, ST, S2, mu, mu_star, sigma, PAWN, S1_RBD, delta, KS_low or KS_high.
    factor : name of the factor or group. other : second one of a pair, else empty.
    estimate, low, high : (K,) estimates and ends of their intervals; masked where the status is
        not ``done``, the ends also where a method has no interval.
    runs : how many runs the estimate rests on. failed : how many runs of the design failed.
    status : (K,) of `IndexStatus`. message : (K,) what a reader of the numbers must know.
    """

    index: str
    factor: str
    other: str
    estimate: Masked
    low: Masked
    high: Masked
    runs: int
    failed: int
    status: tuple[IndexStatus, ...]
    message: tuple[str, ...]


def masked(values: ArrayLike, missing: ArrayLike) -> Masked:
    """The values without the missing ones, under whose mask there is 0."""
    gaps = np.asarray(missing, dtype=bool)
    kept: Array = np.where(gaps, 0.0, np.asarray(values, dtype=np.float64))
    return np.ma.array(kept, mask=gaps)


WEIGHTS_BYTES = 32_000_000
"""Weights held at a time."""


def resample_weights(n: int, resamples: int, seed: int) -> Iterator[Array]:
    """Blocks (r, n) of how often each of n rows is in each of the resamples, all drawn anew."""
    rng = np.random.default_rng([seed, n, resamples])
    at_once = max(1, WEIGHTS_BYTES // (8 * n))
    for start in range(0, resamples, at_once):
        rows = min(at_once, resamples - start)
        drawn = rng.integers(n, size=(rows, n)) + n * np.arange(rows)[:, None]
        yield np.bincount(drawn.ravel(), minlength=rows * n).reshape(rows, n).astype(float)


def percentile_interval(resampled: Array, confidence: float) -> Array:
    """(2, ...) ends from resampled estimates (R, ...)."""
    tail = (1.0 - confidence) / 2.0
    return np.quantile(resampled, [tail, 1.0 - tail], axis=0)


def normal_interval(
    estimate: Array, resampled: Array, confidence: float, lowest: float = -np.inf
) -> Array:
    """(2, ...) estimate -+ z SDs of the resampled estimates (R, ...), not below the lowest."""
    reach = norm.ppf(0.5 + confidence / 2.0) * resampled.std(axis=0, ddof=1)
    return np.maximum([estimate - reach, estimate + reach], lowest)


INDICES: dict[Method, tuple[str, ...]] = {
    Method.SOBOL: ("S1", "ST", "S2"),
    Method.MORRIS: ("mu", "mu_star", "sigma"),
    Method.FAST: ("S1", "ST"),
    Method.LATIN_HYPERCUBE: ("S1_RBD", "PAWN", "KS_low", "KS_high", "delta"),
}
"""All indices of each kind of design."""


@dataclass(frozen=True)
class Settings:
    """Settings of an analysis.

    Attributes
    ----------
    bootstraps : resamples for each interval. delta_bootstraps : the same for delta, of which
        one resample takes as long as a few hundred of the others.
    confidence : of the intervals.
    seed : of the resamples (0 is a seed like others).
    most_failed : share of lost base samples, trajectories or points above which no index is given.
    wanted : names of indices to compute; None for all that the design has.
    tail : share of the lowest and of the highest outputs that KS_low and KS_high look at.
    slices : conditioning intervals of PAWN.
    """

    bootstraps: int = 1000
    delta_bootstraps: int = 50
    confidence: float = 0.95
    seed: int = 0
    most_failed: float = 0.2
    wanted: tuple[str, ...] | None = None
    tail: float = 0.25
    slices: int = 10

    def __post_init__(self) -> None:
        if min(self.bootstraps, self.delta_bootstraps) < 2 or not 0.0 < self.confidence < 1.0:
            raise ValueError("at least 2 bootstraps and a confidence between 0 and 1 are needed")
        known = {name for names in INDICES.values() for name in names}
        if unknown := sorted(set(self.wanted or ()) - known):
            raise ValueError(f"no index {', '.join(unknown)}; there are {', '.join(sorted(known))}")

    def asks(self, index: str) -> bool:
        """Whether an index is wanted."""
        return self.wanted is None or index in self.wanted
