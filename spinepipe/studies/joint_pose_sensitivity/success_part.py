"""The published filters of fits: what has not moved, and what has moved too far."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

_ROUNDING = 1e-12


def near_start(values: Array, start: Array, percent: float) -> Flags:
    """(n, k) whether values (n, k) differ from their start (k,) or (n, k) by at most that share.

    Gould 2024a, section 2.5: a stiffness within 1 % of its start has not been optimised. A value
    that is exactly that far still counts as near; NaN, no value, is not near.
    """
    limit = np.abs(start) * (percent / 100.0) * (1.0 + _ROUNDING)
    return np.abs(values - start) <= limit


def above_start(values: Array, start: Array, times: float) -> Flags:
    """(n, k) whether values (n, k) reach that many times their start (k,) or (n, k).

    Gould 2024a, section 2.5: an order of magnitude above the start is an outlier. NaN is none.
    """
    return values >= times * start
