"""Weakest-link pruning of a grown regression tree: at which complexity each node becomes a leaf.

scikit-learn prunes by growing the tree again for every complexity; one pass over the grown tree
gives its whole sequence of subtrees, which makes cross-validation several times faster.
"""

import numpy as np
from numpy.typing import NDArray
from sklearn.tree import DecisionTreeRegressor

from spinepipe.statistics.outcome import Array


def collapse_complexities(model: DecisionTreeRegressor) -> Array:
    """(nodes,) complexity, relative to the root's impurity, from which on a node is a leaf.

    0 for the leaves of the grown tree. Weakest link first (Breiman et al. 1984, section 3.3).
    """
    tree = model.tree_
    if tree.node_count == 1:
        return np.zeros(1)
    share = tree.weighted_n_node_samples / tree.weighted_n_node_samples[0]
    error = tree.impurity * share / tree.impurity[0]
    found = np.where(tree.children_left < 0, 0.0, np.inf)
    complexity = 0.0
    while np.isinf(found[0]):
        gain = _gain_per_leaf(tree.children_left, tree.children_right, error, np.isfinite(found))
        weakest = int(np.argmin(gain))
        complexity = max(complexity, float(gain[weakest]))
        found[weakest] = complexity
        _close(tree.children_left, tree.children_right, found)
    return found


def _close(left: NDArray[np.int64], right: NDArray[np.int64], found: Array) -> None:
    """What hangs below a node that became a leaf is gone with it."""
    for node in np.flatnonzero(left >= 0):  # parents come before their children
        for son in (left[node], right[node]):
            found[son] = min(found[son], found[node])


def _gain_per_leaf(
    left: NDArray[np.int64], right: NDArray[np.int64], error: Array, leaf: NDArray[np.bool_]
) -> Array:
    """(nodes,) error that a node's splits save per leaf added; infinite for leaves."""
    below, leaves = error.copy(), np.ones(len(error))
    gain = np.full(len(error), np.inf)
    for node in np.flatnonzero(~leaf)[::-1]:  # children come after their parent
        sons = [left[node], right[node]]
        below[node], leaves[node] = below[sons].sum(), leaves[sons].sum()
        gain[node] = (error[node] - below[node]) / (leaves[node] - 1.0)
    return gain


def pruned_predictions(model: DecisionTreeRegressor, x: Array, complexities: Array) -> Array:
    """(k, n) predictions at x (n, d) of the tree pruned at each of the complexities (k,)."""
    tree = model.tree_
    collapse, values = collapse_complexities(model), tree.value[:, 0, 0]
    rows = x.astype(np.float32)  # as scikit-learn compares with its thresholds
    found = np.empty((len(complexities), len(x)))
    for index, complexity in enumerate(complexities):
        at = np.zeros(len(x), dtype=np.int64)
        while (inner := np.flatnonzero(collapse[at] > complexity)).size:
            node = at[inner]
            goes_left = rows[inner, tree.feature[node]] <= tree.threshold[node]
            at[inner] = np.where(goes_left, tree.children_left[node], tree.children_right[node])
        found[index] = values[at]
    return found
