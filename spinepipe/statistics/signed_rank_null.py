"""Exact distribution of Wilcoxon's signed rank sum, also with ties.

scipy's exact one holds without ties only, and its permutations take a second for 14 differences.
"""

import numpy as np

from spinepipe.statistics.outcome import Array

LARGEST = 50
"""Up to so many differences."""


def exact_p(v: float, ranks: Array) -> float:
    """Two-sided p of a rank sum v: the doubled smaller tail over all signs of the ranks (n,)."""
    share, place = _distribution(ranks), round(2.0 * v)
    return float(min(1.0, 2.0 * min(share[: place + 1].sum(), share[place:].sum())))


def _distribution(ranks: Array) -> Array:
    """Probability that twice the rank sum is 0, 1, ...; mid-ranks are halves, doubled whole."""
    doubled = np.rint(2.0 * ranks).astype(int)
    share = np.eye(1, doubled.sum() + 1)[0]
    for rank in doubled:
        moved = np.zeros_like(share)
        moved[rank:] = share[:-rank]  # nothing is lost off the end: no sum is above the total
        share = 0.5 * (share + moved)
    return share
