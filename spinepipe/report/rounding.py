"""Numbers that are zero but for rounding: an exact fit leaves errors of 1e-16."""

import numpy as np

from spinepipe.report.spread import Array

EXACT_BELOW = 1e-9
"""Errors below this, mm or degrees, are rounding: no instrument and no fit resolves them."""

EXACT = "exact to rounding"


def rounded(values: object) -> Array:
    """The values as an array, those that are only rounding as zero."""
    array = np.asarray(values, dtype=float)
    return np.where(np.abs(array) < EXACT_BELOW, 0.0, array)


def exact(values: object) -> bool:
    """Whether there are values and all of them are zero but for rounding."""
    array = np.asarray(values, dtype=float)
    return bool(array.size) and bool((np.abs(array) < EXACT_BELOW).all())
