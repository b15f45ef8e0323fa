"""Rank tests of grouped values."""

import numpy as np
from numpy.typing import ArrayLike
from scipy import stats

from spinepipe.statistics.outcome import Ended, Outcome, Test, finite

FEWEST_BLOCKS, FEWEST_TREATMENTS = 2, 3

FRIEDMAN = Test("Friedman", "chi2", "Kendall's W")


def friedman(grid: ArrayLike) -> Outcome:
    """Friedman's rank sum test of unreplicated complete blocks, corrected for ties.

    Parameters
    ----------
    grid : (blocks, treatments); the values of a block are ranked among each other.

    Effect size: Kendall's W = chi2 / (blocks (treatments - 1)), 0 no agreement between the
    blocks' orders, 1 the same order in all.
    """
    values = finite(grid, dimensions=2)
    blocks, treatments = values.shape
    if blocks < FEWEST_BLOCKS or treatments < FEWEST_TREATMENTS:
        return FRIEDMAN.without(
            Ended.TOO_FEW,
            blocks,
            f"{blocks} blocks of {treatments} treatments; at least "
            f"{FEWEST_BLOCKS} of {FEWEST_TREATMENTS} are needed",
        )
    if (values == values[:, :1]).all():
        return FRIEDMAN.without(Ended.CONSTANT, blocks, "within every block all values are equal")
    found = stats.friedmanchisquare(*values.T)
    effect = found.statistic / (blocks * (treatments - 1))
    tied = sum(len(np.unique(block)) < treatments for block in values)
    message = f"ties: in {tied} of {blocks} blocks" if tied else ""
    return FRIEDMAN.done(found.statistic, found.pvalue, blocks, effect, message)
