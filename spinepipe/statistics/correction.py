"""Correction of p values for the number of tests in a family."""

from collections.abc import Sequence
from typing import Literal

import numpy as np
from numpy.typing import NDArray


def family_size(ps: Sequence[float | None]) -> int:
    """How many tests of a family have a p."""
    return sum(p is not None for p in ps)


def corrected(
    ps: Sequence[float | None], method: Literal["bonferroni", "holm"]
) -> list[float | None]:
    """The p values corrected for their family, in their order.

    A test without p (None) stays without, and does not count in the family.

    Raises
    ------
    ValueError
        For a p outside 0 to 1.
    """
    known = np.array([p for p in ps if p is not None], dtype=float)
    if not np.all((known >= 0.0) & (known <= 1.0)):  # also false for a NaN
        raise ValueError("a p value lies between 0 and 1")
    values = iter((_holm(known) if method == "holm" else len(known) * known).clip(max=1.0).tolist())
    return [None if p is None else next(values) for p in ps]


def _holm(p: NDArray[np.float64]) -> NDArray[np.float64]:
    """Holm 1979: the i-th smallest of n times n - i, none below its predecessor.

    Written out because statsmodels collects garbage at each call, 0.1 s in a long-lived process.
    """
    order = np.argsort(p, kind="stable")
    steps = np.maximum.accumulate(np.arange(len(p), 0, -1) * p[order])
    result = np.empty_like(steps)
    result[order] = steps
    return result
