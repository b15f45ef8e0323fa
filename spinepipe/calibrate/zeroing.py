"""Readings that were zeroed at step 0 share its error: whitening makes them independent again.

With one SD for every reading before zeroing, the n readings of a joint's coordinate in one cycle
have covariance SD^2 (I + 1 1'). The inverse root of I + 1 1' is I - c 1 1' with c = (1 - 1 / sqrt(1
+ n)) / n: along 1 it is 1 + n, across it 1. Least squares on whitened residuals is generalised
least squares (Aitken 1935, doi:10.1017/S0370164600014346).
"""

import numpy as np
from numpy.typing import NDArray

from spinepipe.effects.contract import Array


def whitened(errors: Array, used: NDArray[np.bool_]) -> Array:
    """Errors of a zeroed case, or their derivatives, as combinations of equal SD, uncorrelated.

    Parameters
    ----------
    errors : (T, J, 6) or (T, J, 6, m); what is not used may be NaN.
    used : (T, J, 6) which readings enter the cost; the zeros of step 0 are none.

    Returns
    -------
    Of the same shape; each used element has the SD of one reading before it was zeroed.
    """
    there = used.reshape(*used.shape, *[1] * (errors.ndim - used.ndim))
    errors = np.where(there, errors, 0.0)
    n = np.maximum(there.sum(axis=0), 1)
    shared: Array = (1.0 - 1.0 / np.sqrt(1.0 + n)) / n * errors.sum(axis=0)
    result: Array = errors - shared
    return result


def shared_sums(rows: Array, sharing: NDArray[np.int64]) -> Array:
    """(G, k) sums of rows (N, k) that share an error; those of number -1 are left out."""
    _, group = np.unique(sharing, return_inverse=True)
    sums = np.zeros((group.max(initial=-1) + 1, rows.shape[1]))
    np.add.at(sums, group, rows)
    return sums[1:] if (sharing < 0).any() else sums
