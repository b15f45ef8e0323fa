"""How much of the variation is due to specimens, to draws within them, and to shared treatments."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from spinepipe.sensitivity.jackknife import share_intervals
from spinepipe.sensitivity.two_factor import FEWEST, Share
from spinepipe.statistics import Ended
from spinepipe.statistics.outcome import Array

_PARTS = ("specimen", "draw", "treatment")


@dataclass(frozen=True)
class NestedShares:
    """Variance of values by specimen, draw within the specimen, and treatment common to all.

    Attributes
    ----------
    specimen, draw, treatment, rest : shares that sum to 1; the rest is what specimens or draws
        and treatments do only together, and scatter.

    The shares are None where the status is not ``done``.
    """

    status: Ended
    message: str = ""
    specimen: Share | None = None
    draw: Share | None = None
    treatment: Share | None = None
    rest: Share | None = None


def nested_shares(values: ArrayLike) -> NestedShares:
    """Shares in the variance of a full grid of specimens, draws nested in them, and treatments.

    Parameters
    ----------
    values : (S, P, K) one finite value for every specimen, draw of it, and treatment. The p-th
        draws of two specimens have nothing in common; the k-th treatment is the same for all.

    Estimates are the unbiased variance components of the mixed classification with random factors
    (Searle, Casella & McCulloch 1992, Variance Components, chapter 4), negative ones set to 0.
    Intervals are a jackknife over specimens with the treatments as given, see `share_intervals`:
    they speak of other specimens and draws under the same treatments. A few treatments taken from
    a Latin hypercube are no independent draws that could be left out one by one.

    Raises
    ------
    ValueError
        For values that are not three-dimensional and finite.
    """
    grid: Array = np.asarray(values, dtype=np.float64)
    if grid.ndim != 3 or not np.isfinite(grid).all():
        raise ValueError("shares need a full grid (specimens, draws, treatments) of finite numbers")
    if min(grid.shape) < FEWEST:
        shape = " x ".join(map(str, grid.shape))
        return NestedShares(Ended.TOO_FEW, f"grid of {shape}; at least 3 x 3 x 3 are needed")
    scale = float(np.abs(grid - grid.mean()).max())
    if scale <= 1e-12 * float(np.abs(grid).max()):  # but for rounding
        return NestedShares(Ended.CONSTANT, "all values are the same")
    return _shares((grid - grid.mean()) / scale)


def _shares(grid: Array) -> NestedShares:
    whole = components(grid)
    by_specimen = np.array([components(np.delete(grid, at, 0)) for at in range(grid.shape[0])])
    if min(part.sum(axis=-1).min() for part in (whole, by_specimen)) <= 0.0:
        return NestedShares(Ended.CONSTANT, "but for one specimen all values are the same")
    raw, left_out = (part / part.sum(axis=-1, keepdims=True) for part in (whole, by_specimen))
    kept = np.maximum(raw, 0.0)
    estimates = kept / kept.sum()
    low, high = share_intervals(raw, left_out, np.stack([raw, raw]))  # treatments do not vary
    # an estimate set to 0 changes the others a little
    low, high = np.minimum(low, estimates), np.maximum(high, estimates)
    found = [Share(*map(float, share)) for share in zip(estimates, low, high, strict=True)]
    negative = [name for name, share in zip(_PARTS, raw, strict=False) if share < 0.0]
    message = f"negative {' and '.join(negative)} component set to 0" if negative else ""
    return NestedShares(Ended.DONE, message, *found)


def components(grid: Array) -> Array:
    """(4,) variance components of specimen, draw, treatment and rest; chance may have them < 0."""
    specimens, draws, treatments = grid.shape
    by_specimen, by_treatment = grid.mean(axis=(1, 2)), grid.mean(axis=(0, 1))
    by_draw, by_both = grid.mean(axis=2), grid.mean(axis=1)
    specimen = draws * treatments * by_specimen.var(ddof=1)
    treatment = specimens * draws * by_treatment.var(ddof=1)
    draw = treatments * by_draw.var(axis=1, ddof=1).mean()
    both_rest = by_both - by_specimen[:, None] - by_treatment + grid.mean()
    both = draws * np.sum(both_rest**2) / ((specimens - 1) * (treatments - 1))
    left = grid - by_draw[:, :, None] - by_both[:, None, :] + by_specimen[:, None, None]
    scatter = np.sum(left**2) / (specimens * (draws - 1) * (treatments - 1))
    together = (both - scatter) / draws
    return np.array(
        [
            (specimen - draw - both + scatter) / (draws * treatments),
            (draw - scatter) / treatments,
            (treatment - both) / (specimens * draws),
            together + scatter,
        ]
    )
