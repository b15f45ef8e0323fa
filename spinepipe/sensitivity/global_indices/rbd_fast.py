"""First-order indices from any sample by RBD-FAST."""

import numpy as np
from SALib.analyze import rbd_fast
from scipy.fft import rfft

from spinepipe.effects.contract import Array

HARMONICS = 10
"""SALib's default. More than 2 HARMONICS points are needed."""


def rbd_fast_s1(unit: Array, outputs: Array) -> Array:
    """(D, K) first-order indices of outputs (N, K) by SALib, its correction of the bias included.

    Parameters
    ----------
    unit : (N, D) factors.
    """
    found = np.empty((unit.shape[1], outputs.shape[1]))
    for column, k in np.ndindex(found.shape):
        permuted = rbd_fast.permute_outputs(unit[:, column], outputs[:, k])
        raw = rbd_fast.compute_first_order(permuted, HARMONICS)
        found[column, k] = rbd_fast.unskew_S1(raw, HARMONICS, len(outputs))
    return found


def rbd_fast_resampled(unit: Array, outputs: Array, weights: Array) -> Array:
    """(R, D, K) the same of resamples with whole weights (R, N) that sum to N.

    SALib takes 0.4 ms for each resample of 1,024 points, one transform for all 0.012 ms.
    """
    found = np.empty((len(weights), unit.shape[1], outputs.shape[1]))
    for column, values in enumerate(unit.T):
        rows = _sorted_rows(values, weights)
        for k in range(outputs.shape[1]):
            raw = _first_order(outputs[rows, k])
            found[:, column, k] = rbd_fast.unskew_S1(raw, HARMONICS, len(outputs))
    return found


def _sorted_rows(values: Array, weights: Array) -> Array:
    """(R, N) rows of each resample, up through every other one by value and down the rest."""
    order = np.argsort(values, kind="stable")
    r, n = weights.shape
    counts = weights[:, order].astype(int).ravel()
    rows = np.repeat(np.tile(order, r), counts).reshape(r, n)
    return np.hstack([rows[:, ::2], rows[:, 1::2][:, ::-1]])


def _first_order(permuted: Array) -> Array:
    """(R,) share of the first harmonics in the variance of each row (R, N); 0 without any."""
    n = permuted.shape[1]
    power = np.abs(rfft(permuted - permuted.mean(axis=1, keepdims=True), axis=1)) ** 2
    power[:, 1 : (n + 1) // 2] *= 2.0  # both sides, but for the middle one of an even number
    whole = power[:, 1:].sum(axis=1)
    first = power[:, 1 : HARMONICS + 1].sum(axis=1)
    return np.divide(first, whole, out=np.zeros_like(whole), where=whole > 0.0)
