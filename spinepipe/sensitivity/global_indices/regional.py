"""Regional sensitivity: do runs with extreme outputs have other factor values than the rest?"""

import numpy as np
from numpy.typing import NDArray

from spinepipe.effects.contract import Array
from spinepipe.sensitivity.global_indices.distance import Ordered


def tail_of(outputs: Array, share: float, highest: bool) -> NDArray[np.bool_]:
    """(N, K) which runs are among the lowest or highest share of each output."""
    if highest:
        return outputs >= np.quantile(outputs, 1.0 - share, axis=0)
    return outputs <= np.quantile(outputs, share, axis=0)


def regional(unit: Array, region: NDArray[np.bool_], weights: Array) -> Array:
    """(R, D, K) distances between factors' values in the region and outside.

    Parameters
    ----------
    unit : (N, D) factors. region : (N, K). weights : (R, N) of resamples.

    The two-sample Kolmogorov-Smirnov distance (Hornberger & Spear 1981; Saltelli et al. 2008,
    Global Sensitivity Analysis: The Primer, doi:10.1002/9780470725184, on Monte Carlo filtering).
    """
    found = np.empty((len(weights), unit.shape[1], region.shape[1]))
    for column, values in enumerate(unit.T):
        factor = Ordered(values, weights)
        for k in range(region.shape[1]):
            found[:, column, k] = _from_rest(factor, region[:, k])
    return found


def _from_rest(factor: Ordered, region: NDArray[np.bool_]) -> Array:
    """(R,) distance between region and rest; 0 for a resample that lies all in one of them.

    With the region's share p in all, F_region - F_all = (1 - p) (F_region - F_rest).
    """
    outside = 1.0 - factor.share(region)
    split = outside > 0.0
    return np.where(split, factor.distance(region) / np.where(split, outside, 1.0), 0.0)
