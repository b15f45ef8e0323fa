"""Regression tree: which inputs split an output best, as R's ``rpart`` grows and prunes it."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from sklearn.model_selection import GroupKFold
from sklearn.tree import DecisionTreeRegressor

from spinepipe.sensitivity.pruning import collapse_complexities, pruned_predictions
from spinepipe.statistics import Ended
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
    status: Ended
    message: str = ""


@dataclass(frozen=True)
class _Growth:
    """What every tree of one analysis is grown with."""

    complexity: float
    seed: int

    def grow(self, x: Array, y: Array, complexity: float | None = None) -> DecisionTreeRegressor:
        """The tree of x (n, d), y (n,) pruned at a complexity relative to the variance of y."""
        cost = (self.complexity if complexity is None else complexity) * float(y.var())
        model = DecisionTreeRegressor(
            min_samples_split=FEWEST_TO_SPLIT,
            min_samples_leaf=FEWEST_IN_LEAF,
            ccp_alpha=cost,
            random_state=self.seed,
        )
        return model.fit(x, y)


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
        return _without(tuple(names), complexity, Ended.TOO_FEW, message)
    if (output == output[0]).all():
        return _without(tuple(names), complexity, Ended.CONSTANT, "all outputs are the same")
    # scaled, since scikit-learn takes a variance below 1e-16 or so for none
    output = (output - output.mean()) / output.std()
    growth = _Growth(complexity, seed)
    return _chosen(growth, inputs, output, tuple(names), units, min(folds, n_units))


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


def _without(names: tuple[str, ...], complexity: float, status: Ended, message: str) -> Tree:
    return Tree(names, np.zeros(len(names)), 1, 0, complexity, None, None, status, message)


def _chosen(
    growth: _Growth, x: Array, y: Array, names: tuple[str, ...], units: Groups, folds: int
) -> Tree:
    """The tree after cross-validation of the whole sequence of subtrees."""
    ends = np.unique(collapse_complexities(growth.grow(x, y)))
    ends = np.concatenate(([growth.complexity], ends[ends > growth.complexity]))
    # as in rpart: each subtree is tried at the geometric mean of the ends of its range
    inner = np.append(np.sqrt(ends[:-1] * ends[1:]), BEYOND_ROOT)
    error, standard_error = _cross_validated(growth, x, y, inner, units, folds)
    best = int(np.argmin(error))
    index = int(np.flatnonzero(error <= error[best] + standard_error[best])[-1])
    model = growth.grow(x, y, float(inner[index]))
    message = "no split is worth its leaf" if model.get_n_leaves() == 1 else ""
    return Tree(
        names,
        model.feature_importances_,
        int(model.get_n_leaves()),
        int(model.get_depth()),
        float(ends[index]),
        1.0 - float(error[index]),
        float(model.score(x, y)),
        Ended.DONE,
        message,
    )


def _cross_validated(
    growth: _Growth, x: Array, y: Array, complexities: Array, units: Groups, folds: int
) -> tuple[Array, Array]:
    """Error (k,) in folds left out, as a share of the variance, and its standard error (k,)."""
    squared = np.empty((len(complexities), len(y)))
    splitter = GroupKFold(folds, shuffle=True, random_state=growth.seed)
    for training, left_out in splitter.split(x, y, units):
        model = growth.grow(x[training], y[training])
        predicted = pruned_predictions(model, x[left_out], complexities)
        squared[:, left_out] = (y[left_out] - predicted) ** 2
    _, unit = np.unique(units, return_inverse=True)
    sums = np.array([np.bincount(unit, row) for row in squared])
    whole = len(y) * float(y.var())
    return sums.sum(axis=1) / whole, sums.std(axis=1) * np.sqrt(sums.shape[1]) / whole
