"""Correction of p values for the number of tests in a family."""

from collections.abc import Sequence
from typing import Literal

import numpy as np
from statsmodels.stats.multitest import multipletests


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
    known = [p for p in ps if p is not None]
    if not known:
        return [None] * len(ps)
    if not all(0.0 <= p <= 1.0 for p in known):  # also false for a NaN
        raise ValueError("a p value lies between 0 and 1")
    values = iter(np.asarray(multipletests(known, method=method)[1]).tolist())
    return [None if p is None else next(values) for p in ps]
