"""Sensitivity: what an output hangs on, from tables of results (not from derivatives)."""

from spinepipe.sensitivity.shares import MeanSquares, Share, Shares, mean_squares, variance_shares
from spinepipe.sensitivity.tree import Tree, regression_tree

__all__ = [
    "MeanSquares",
    "Share",
    "Shares",
    "Tree",
    "mean_squares",
    "regression_tree",
    "variance_shares",
]
