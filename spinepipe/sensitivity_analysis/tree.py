"""Regression tree: which inputs split an output best, as R's ``rpart`` grows and prunes it."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from sklearn.base import clone
from sklearn.model_selection import GroupKFold
from sklearn.tree import DecisionTreeRegressor

from spinepipe.statistics import ComputationStatus
from spinepipe.statistics.outcome import Array

Groups = NDArray[np.int64]

FEWEST_TO_SPLIT = 20
FEWEST_IN_LEAF = 7
"""``minsplit`` and ``minbucket`` of ``rpart.control``."""

FEWEST_FOLDS = 2
BEYOND_ROOT = 2.0
"""A relative complexity at which every tree is its root alone: none saves more than 1."""


@dataclass(frozen=True)
class Tree:
    """A pruned regression tree.

    Attributes
    ----------
    names, importance : (d,) inputs and their shares of the decrease of variance over all splits;
        they sum to 1, or are all 0 for a tree of one leaf. Inputs that would split the rows alike
        (the stiffnesses of a few fixed sets) share theirs by the seed's luck: take their sum.
    leaves, depth : size of the pruned tree.
    complexity : smallest cost per leaf, as a share of the variance, that prunes to this tree.
    r2_cross_validated : 1 - error in folds left out / variance; below 0 if worse than the mean.
    r2_training : 1 - error in the data it was grown on / variance.

    Both are None, and the tree is one leaf, where the status is not ``done``.
    """

    names: tuple[str, ...]
    importance: Array
    leaves: int
    depth: int
    complexity: float
    r2_cross_validated: float | None
    r2_training: float | None
    status: ComputationStatus
    message: str = ""


def regression_tree(
    x: ArrayLike,
    y: ArrayLike,
    names: Sequence[str],
    seed: int,
    folds: int = 10,
    complexity: float = 0.01,
    groups: Groups | None = None,
) -> Tree:
    """The smallest tree within one standard error of the best cross-validated one.

    Grown with the defaults of R's ``rpart`` (20 rows to split, 7 in a leaf, complexity 0.01), cut
    back by cost-complexity pruning with the 1-SE rule (Breiman et al. 1984; Therneau and Atkinson,
    An introduction to recursive partitioning using the RPART routines).

    Parameters
    ----------
    x : (n, d) inputs; scikit-learn compares them in single precision.
    y : (n,) output.
    groups : (n,) rows of one group stay in one fold. A joint pose stands in one row per stiffness
        set; with its rows in several folds the tree could learn the pose by heart and be praised
        for it. The standard error is then that of groups, whose rows are not independent.

    Raises
    ------
    ValueError
        For shapes that do not fit, numbers that are not finite, fewer than 2 folds, or a
        complexity outside 0 to 1.
    """
    inputs, output = np.asarray(x, dtype=np.float64), np.asarray(y, dtype=np.float64)
    units = np.arange(len(output)) if groups is None else np.asarray(groups)
    _check(inputs, output, tuple(names), units, folds, complexity)
    n_units = len(np.unique(units))
    if len(output) < FEWEST_TO_SPLIT or n_units < FEWEST_FOLDS:
        message = f"{len(output)} rows in {n_units} groups; at least 20 in 2 are needed"
        return _without(tuple(names), complexity, ComputationStatus.TOO_FEW, message)
    if (output == output[0]).all():
        return _without(
            tuple(names), complexity, ComputationStatus.CONSTANT, "all outputs are the same"
        )
    # scaled, since scikit-learn takes a variance below 1e-16 or so for none
    output = (output - output.mean()) / output.std()
    growth = _growth(complexity, seed)
    splitter = GroupKFold(min(folds, n_units), shuffle=True, random_state=seed)
    return _chosen(growth, splitter, inputs, output, tuple(names), units)


def _growth(complexity: float, seed: int) -> DecisionTreeRegressor:
    """What every tree of one analysis is grown with, for outputs of variance 1.

    As in rpart, a split that saves less than the complexity is not attempted.
    """
    return DecisionTreeRegressor(
        min_samples_split=FEWEST_TO_SPLIT,
        min_samples_leaf=FEWEST_IN_LEAF,
        min_impurity_decrease=complexity,
        random_state=seed,
    )


def _check(
    x: Array, y: Array, names: tuple[str, ...], units: Groups, folds: int, complexity: float
) -> None:
    if x.ndim != 2 or y.shape != x.shape[:1] or units.shape != y.shape or len(names) != x.shape[1]:
        raise ValueError(
            f"shapes do not fit: x {x.shape}, y {y.shape}, groups {units.shape}, {len(names)} names"
        )
    if not (np.isfinite(x).all() and np.isfinite(y).all()):
        raise ValueError("a tree needs finite numbers: leave out what failed, and say so")
    if folds < FEWEST_FOLDS or not 0.0 < complexity < 1.0:
        raise ValueError("a tree needs at least 2 folds and a complexity between 0 and 1")


def _without(
    names: tuple[str, ...], complexity: float, status: ComputationStatus, message: str
) -> Tree:
    return Tree(names, np.zeros(len(names)), 1, 0, complexity, None, None, status, message)


def _chosen(
    growth: DecisionTreeRegressor,
    splitter: GroupKFold,
    x: Array,
    y: Array,
    names: tuple[str, ...],
    units: Groups,
) -> Tree:
    """The tree after cross-validation of the whole sequence of subtrees."""
    ends = growth.cost_complexity_pruning_path(x, y).ccp_alphas
    ends[0] = growth.min_impurity_decrease  # below it the whole tree stands
    # as in rpart: each subtree is tried at the geometric mean of the ends of its range
    inner = np.append(np.sqrt(ends[:-1] * ends[1:]), BEYOND_ROOT)
    error, standard_error = _cross_validated(growth, splitter, x, y, inner, units)
    # 1-SE rule: the smallest tree whose error is within one standard error of the least
    best = int(np.argmin(error))
    index = int(np.flatnonzero(error <= error[best] + standard_error[best])[-1])
    model = clone(growth).set_params(ccp_alpha=float(inner[index])).fit(x, y)
    message = "no split is worth its leaf" if model.get_n_leaves() == 1 else ""
    return Tree(
        names,
        model.feature_importances_,
        int(model.get_n_leaves()),
        int(model.get_depth()),
        float(ends[index]),
        1.0 - float(error[index]),
        float(model.score(x, y)),
        ComputationStatus.DONE,
        message,
    )


def _cross_validated(
    growth: DecisionTreeRegressor,
    splitter: GroupKFold,
    x: Array,
    y: Array,
    complexities: Array,
    units: Groups,
) -> tuple[Array, Array]:
    """Error (k,) in folds left out, as a share of the variance, and its standard error (k,).

    A complexity costs the same per row in every fold, as in rpart. The tree of a fold is grown once
    and cut back at all complexities: growing is what takes time.
    """
    predicted = np.empty((len(complexities), len(y)))
    for kept, left_out in splitter.split(x, y, units):
        model = clone(growth).fit(x[kept], y[kept])
        leaves, ends = model.apply(x[left_out]), _weakest_links(model.tree_)
        for number, complexity in enumerate(complexities):
            predicted[number, left_out] = _cut_back(model.tree_, ends, complexity)[leaves]
    # the standard error is that of sums over groups, whose rows are not independent
    squared = (y - predicted) ** 2
    _, unit = np.unique(units, return_inverse=True)
    sums = np.array([np.bincount(unit, row) for row in squared])
    whole = len(y) * float(y.var())
    return sums.sum(axis=1) / whole, sums.std(axis=1) * np.sqrt(sums.shape[1]) / whole


def _weakest_links(tree: Any) -> Array:
    """(nodes,) complexity from which on each node is a leaf: minimal cost-complexity pruning.

    Again and again the branch that saves least per leaf becomes a leaf (Breiman et al. 1984,
    chapter 3). Children stand behind their parents. Leaves: below all; what is cut off with a
    branch before its own turn: infinite.
    """
    left, right = tree.children_left, tree.children_right
    error = tree.impurity * tree.weighted_n_node_samples / tree.weighted_n_node_samples[0]
    ends = np.where(left < 0, -np.inf, np.inf)
    reached = 0.0
    while ends[0] > reached:
        # error and leaves of each node's branch from below, then which nodes are still reached
        branch, leaves, there = error.copy(), np.ones(len(error)), np.zeros(len(error), dtype=bool)
        for node in range(len(error) - 1, -1, -1):
            if ends[node] > reached:
                branch[node] = branch[left[node]] + branch[right[node]]
                leaves[node] = leaves[left[node]] + leaves[right[node]]
        there[0] = True
        for node in range(len(error)):
            if there[node] and ends[node] > reached:
                there[[left[node], right[node]]] = True
        # the weakest link saves least per leaf; its complexity is where the next subtree begins
        branches = np.flatnonzero(there & (leaves > 1.0))
        saved = (error - branch)[branches] / (leaves[branches] - 1.0)
        reached = max(reached, float(saved.min()))
        ends[branches[np.argmin(saved)]] = reached
    return ends


def _cut_back(tree: Any, ends: Array, complexity: float) -> Array:
    """(nodes,) what the tree, cut back at a complexity, predicts for each leaf of the whole one."""
    values, closed = tree.value[:, 0, 0].copy(), ends <= complexity
    for node, children in enumerate(zip(tree.children_left, tree.children_right, strict=True)):
        if closed[node] and children[0] >= 0:
            values[list(children)], closed[list(children)] = values[node], True
    return values
