"""Confidence intervals of shares by leaving out one row, and one column, of a grid at a time."""

import numpy as np
from scipy import stats
from scipy.special import expit, logit

from spinepipe.statistics.outcome import Array

CONFIDENCE = 0.95


def share_intervals(whole: Array, by_row: Array, by_column: Array) -> tuple[Array, Array]:
    """Low and high ends (k,), within 0 to 1, of the 95 % intervals of k shares.

    Parameters
    ----------
    whole : (k,) shares in the whole grid.
    by_row, by_column : (P, k) and (S, k) shares with one row, or one column, left out.

    On the logit scale; on the plain scale for a share that somewhere lies outside 0 to 1.
    """
    everything = np.vstack([whole, by_row, by_column])
    inside = ((everything > 0.0) & (everything < 1.0)).all(axis=0)
    half = _half_width(by_row, by_column)
    low, high = whole - half, whole + half
    if inside.any():
        scaled = [logit(shares[..., inside]) for shares in (whole, by_row, by_column)]
        half = _half_width(*scaled[1:])
        low[inside], high[inside] = expit(scaled[0] - half), expit(scaled[0] + half)
    return np.clip(low, 0.0, 1.0), np.clip(high, 0.0, 1.0)


def _half_width(*left_out: Array) -> Array:
    """Half widths (k,) from the sum of the jackknife variances, t with Satterthwaite's freedom.

    Without any variance the width is 0, whatever the freedom.
    """
    counts = np.array([[len(some)] for some in left_out])
    spreads = np.array([some.var(axis=0, ddof=1) for some in left_out])
    variances = (counts - 1) ** 2 / counts * spreads
    total = variances.sum(axis=0)
    uncertainty = np.sum(variances**2 / (counts - 1), axis=0)
    freedom = np.divide(total**2, uncertainty, out=np.ones_like(total), where=uncertainty > 0.0)
    half: Array = stats.t.ppf(0.5 + 0.5 * CONFIDENCE, freedom) * np.sqrt(total)
    return half
