"""Resamples of a bootstrap as weights, and intervals from what they give."""

from collections.abc import Iterator

import numpy as np
from scipy.stats import norm

from spinepipe.effects.contract import Array

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
