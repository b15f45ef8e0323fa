"""Regression tree against rpart's published example, and laws.

Catches a tree that is not rpart's, and poses learnt by heart that are praised.
"""

import numpy as np
import pytest
from sklearn.base import clone
from sklearn.model_selection import GroupKFold
from sweeps import sweep

from spinepipe.sensitivity_analysis.tree import (
    BEYOND_ROOT,
    _cross_validated,
    _cut_back,
    _growth,
    _weakest_links,
    regression_tree,
)
from spinepipe.statistics import ComputationStatus

MILEAGE = np.array(
    [
        *(33, 33, 37, 32, 32, 26, 33, 28, 25, 34, 29, 35, 26, 20, 27, 19, 30, 33, 27, 24),
        *(26, 28, 27, 23, 26, 25, 24, 26, 24, 25, 21, 21, 23, 24, 23, 27, 23, 20, 21, 22),
        *(22, 22, 22, 23, 23, 21, 22, 21, 21, 23, 23, 18, 20, 18, 18, 18, 19, 20, 20, 19),
    ],
    dtype=float,
)
WEIGHT = np.array(
    [
        *(2560, 2345, 1845, 2260, 2440, 2285, 2275, 2350, 2295, 1900, 2390, 2075, 2330, 3320),
        *(2885, 3310, 2695, 2170, 2710, 2775, 2840, 2485, 2670, 2640, 2655, 3065, 2750, 2920),
        *(2780, 2745, 3110, 2920, 2645, 2575, 2935, 2920, 2985, 3265, 2880, 2975, 3450, 3145),
        *(3190, 3610, 2885, 3480, 3200, 2765, 3220, 3480, 3325, 3855, 3850, 3195, 3735, 3665),
        *(3735, 3415, 3185, 3690),
    ],
    dtype=float,
)
"""Fuel consumption (miles per gallon) and weight (lb) of 60 cars: car.test.frame of rpart."""

RPART_SPLITS = (2567.5, 3087.5, 2747.5)
RPART_COMPLEXITIES = (0.595349, 0.134528, 0.012828)
RPART_ERRORS = {1: 1.0, 2: 0.40465, 3: 0.27012, 4: 0.25729}
"""Printed by rpart(Mileage ~ Weight): print.rpart, printcp; error by number of leaves."""


def data(n: int, d: int, seed: int):
    rng = np.random.default_rng(seed)
    x = rng.normal(size=(n, d))
    return x, np.abs(x[:, 0]) + 0.5 * x[:, 1] * (x[:, 2] > 0) + 0.3 * rng.normal(size=n)


def test_the_cars_are_those_of_rpart() -> None:
    assert len(MILEAGE) == len(WEIGHT) == 60
    assert MILEAGE.mean() == pytest.approx(24.58333, abs=5e-6)
    assert ((MILEAGE - MILEAGE.mean()) ** 2).sum() == pytest.approx(1354.583, abs=5e-4)


def test_splits_and_sequence_of_subtrees_are_those_of_rpart() -> None:
    miles = (MILEAGE - MILEAGE.mean()) / MILEAGE.std()
    growth = _growth(complexity=0.01, seed=0)  # rpart's default
    tree = growth.fit(WEIGHT[:, None], miles).tree_
    splits = np.sort(tree.threshold[tree.children_left >= 0])
    np.testing.assert_allclose(splits, np.sort(RPART_SPLITS), rtol=1e-12)
    sequence = growth.cost_complexity_pruning_path(WEIGHT[:, None], miles).ccp_alphas
    np.testing.assert_allclose(sequence[:0:-1], RPART_COMPLEXITIES, atol=5e-7)


@sweep("complexity, leaves", [(0.2, 2), (0.05, 3), (0.6, 1)])
def test_a_split_that_saves_too_little_is_not_made(complexity: float, leaves: int) -> None:
    """rpart's complexities of 0.595, 0.135 and 0.0128 are those of its splits."""
    found = regression_tree(WEIGHT[:, None], MILEAGE, ["weight"], 1, complexity=complexity)
    assert (found.leaves, found.complexity) == (leaves, complexity)


def test_the_pruned_tree_is_one_of_rparts() -> None:
    leaves = []
    for seed in range(5):
        found = regression_tree(WEIGHT[:, None], MILEAGE, ["weight"], seed)
        assert 1.0 - found.r2_training == pytest.approx(RPART_ERRORS[found.leaves], abs=5e-6)
        assert found.complexity == pytest.approx(
            (0.595349, 0.134528, 0.012828, 0.01)[found.leaves - 1], abs=5e-7
        )
        # rpart: 0.45 +- 0.08 for three or four leaves, 0.61 +- 0.11 for two
        assert 0.3 < found.r2_cross_validated < 0.75
        leaves.append(found.leaves)
    # rpart's own folds: 0.44826 + 0.076998 allows 0.45153, three leaves, but not 0.60508
    assert max(set(leaves), key=leaves.count) == 3


def test_importance_is_the_share_of_the_variance_taken() -> None:
    first, second = np.repeat([0.0, 1.0], 40), np.tile([0.0, 1.0], 40)
    y = 3.0 * first + second
    x = np.stack([second, np.ones(80), first], axis=1)
    found = regression_tree(x, y, ["second", "none", "first"], seed=1)
    # variances 1/4 and 9/4
    np.testing.assert_allclose(found.importance, [0.1, 0.0, 0.9], atol=1e-9)
    assert (found.leaves, found.depth) == (4, 2)
    assert found.r2_training == pytest.approx(1.0, abs=1e-9)
    assert found.r2_cross_validated == pytest.approx(1.0, abs=1e-9)
    assert found.names == ("second", "none", "first")
    assert (found.complexity, found.message) == (0.01, "")


def test_noise_is_left_one_leaf() -> None:
    rng = np.random.default_rng(2)
    found = regression_tree(rng.normal(size=(200, 3)), rng.normal(size=200), "abc", seed=3)
    assert (found.leaves, found.depth, found.status) == (1, 0, ComputationStatus.DONE)
    assert found.importance.tolist() == [0.0, 0.0, 0.0]
    assert found.r2_training == pytest.approx(0.0, abs=1e-12)
    # the mean of nine tenths predicts a little worse than that of all
    assert -0.1 < found.r2_cross_validated < 0.0
    assert "no split" in found.message


def test_a_pose_learnt_by_heart_is_not_praised() -> None:
    """40 poses with ten rows each and an output that nothing but the pose itself explains."""
    rng = np.random.default_rng(4)
    poses, groups = rng.normal(size=(40, 3)), np.repeat(np.arange(40), 10)
    y = np.repeat(rng.normal(size=40), 10) + 0.1 * rng.normal(size=400)
    split = regression_tree(poses[groups], y, "xyz", seed=1)
    together = regression_tree(poses[groups], y, "xyz", seed=1, groups=groups)
    assert split.r2_cross_validated > 0.8
    assert together.r2_cross_validated < 0.2
    assert together.leaves < split.leaves


def test_repeated_rows_of_a_group_do_not_sharpen_the_standard_error() -> None:
    """At a complexity where the tree is its mean, which repeating does not move."""
    x, y = data(50, 3, seed=13)
    growth, root = _growth(0.01, seed=1), np.array([BEYOND_ROOT])
    folds = GroupKFold(5, shuffle=True, random_state=1)
    once = _cross_validated(growth, folds, x, y, root, np.arange(50))
    often = [np.tile(values, reps) for values, reps in ((x, (4, 1)), (y, 4), (np.arange(50), 4))]
    repeated = _cross_validated(growth, folds, *often[:2], root, often[2])
    np.testing.assert_allclose(repeated, once, rtol=1e-9)
    # by leaving one out, where (y - mean of the others) = n / (n - 1) (y - mean)
    error, standard_error = _cross_validated(growth, GroupKFold(50), x, y, root, np.arange(50))
    squared = (50 / 49 * (y - y.mean())) ** 2 / y.var()
    assert error[0] == pytest.approx(squared.mean())
    assert standard_error[0] == pytest.approx(squared.std() / np.sqrt(50))


def test_fewer_groups_than_folds_are_left_out_one_by_one() -> None:
    x, y = data(60, 2 + 1, seed=5)
    few = regression_tree(x, y, "abc", seed=1, folds=10, groups=np.arange(60) % 3)
    three = regression_tree(x, y, "abc", seed=1, folds=3, groups=np.arange(60) % 3)
    assert few.r2_cross_validated == three.r2_cross_validated


def test_same_seed_same_tree() -> None:
    x, y = data(300, 4, seed=6)
    one, same, other = (regression_tree(x, y, "abcd", seed) for seed in (7, 7, 8))
    assert one.importance.tobytes() == same.importance.tobytes()
    assert one.r2_cross_validated == same.r2_cross_validated != other.r2_cross_validated


@sweep("scale", [1e-12, 1e9])
def test_the_unit_of_the_output_does_not_matter(scale: float) -> None:
    x, y = data(300, 3, seed=9)
    one, other = (regression_tree(x, factor * y, "abc", 1) for factor in (1.0, scale))
    assert other.leaves == one.leaves > 1
    np.testing.assert_allclose(other.importance, one.importance, rtol=1e-6)
    assert other.r2_cross_validated == pytest.approx(one.r2_cross_validated, rel=1e-6)


def test_one_row_that_differs_makes_no_tree() -> None:
    """The fold that leaves it out has nothing to learn from."""
    y = np.zeros(50)
    y[17] = 1.0
    found = regression_tree(np.arange(50.0)[:, None], y, ["x"], seed=1)
    assert (found.status, found.leaves) == (ComputationStatus.DONE, 1)


@sweep(
    "n, groups, status",
    [(19, None, ComputationStatus.TOO_FEW), (40, np.zeros(40, int), ComputationStatus.TOO_FEW)],
)
def test_too_few_rows_or_groups(n: int, groups, status: ComputationStatus) -> None:
    x, y = data(n, 3, seed=10)
    found = regression_tree(x, y, "abc", 1, groups=groups)
    assert (found.status, found.leaves, found.depth) == (status, 1, 0)
    assert (found.r2_cross_validated, found.r2_training) == (None, None)


@sweep("rows, leaves", [(19, 1), (20, 2)])
def test_twenty_rows_are_split_into_leaves_of_seven_at_least(rows: int, leaves: int) -> None:
    """``minsplit`` and ``minbucket`` of ``rpart.control``. The first six rows are alike."""
    x, y = np.arange(float(rows))[:, None], (np.arange(rows) < 6).astype(float)
    tree = _growth(complexity=0.01, seed=0).fit(x, (y - y.mean()) / y.std()).tree_
    assert tree.n_leaves == leaves
    assert tree.threshold[0] == (6.5 if leaves == 2 else -2.0)


def test_twenty_rows_in_two_groups_are_enough_for_a_tree() -> None:
    x, y = data(20, 3, seed=20040)
    assert (
        regression_tree(x, y, "abc", 1, groups=np.arange(20) % 2).status is ComputationStatus.DONE
    )


@sweep("folds, same", [(10, True), (9, False), (11, False)])
def test_ten_folds_where_none_are_named(folds: int, same: bool) -> None:
    x, y = data(60, 3, seed=20041)
    one, other = regression_tree(x, y, "abc", 1), regression_tree(x, y, "abc", 1, folds=folds)
    assert (one.r2_cross_validated == other.r2_cross_validated) is same


@sweep("folds", [2, 3])
def test_a_step_is_one_split_however_few_folds(folds: int) -> None:
    """It saves all of the variance: the cost of a leaf that would undo it is 1."""
    found = regression_tree(np.arange(60)[:, None], np.arange(60) < 25, "x", 1, folds)
    assert (found.leaves, found.depth, found.complexity) == (2, 1, 0.01)
    assert found.r2_training == pytest.approx(1.0, abs=1e-9)
    assert found.importance.tolist() == [1.0]


def test_a_constant_output_has_no_tree() -> None:
    found = regression_tree(data(50, 3, seed=11)[0], np.full(50, 0.1), "abc", 1)
    assert (found.status, found.r2_training) == (ComputationStatus.CONSTANT, None)
    assert found.importance.tolist() == [0.0, 0.0, 0.0]


@sweep(
    "change, message",
    [
        ({"names": "ab"}, "shapes"),
        ({"names": "abcd"}, "shapes"),
        ({"y": np.ones(29)}, "shapes"),
        ({"y": np.ones(31)}, "shapes"),
        ({"x": np.ones(30), "names": ""}, "shapes"),
        ({"x": np.ones((30, 3, 1))}, "shapes"),
        ({"groups": np.ones((30, 1), int)}, "shapes"),
        ({"groups": np.ones(29, int)}, "shapes"),
        ({"groups": np.ones(31, int)}, "shapes"),
        ({"y": np.full(30, np.nan)}, "finite"),
        ({"folds": 1}, "folds"),
        ({"complexity": 0.0}, "complexity"),
        ({"complexity": 1.0}, "complexity"),
    ],
)
def test_what_cannot_be_grown_is_refused(change, message) -> None:
    x, y = data(30, 3, seed=12)
    with pytest.raises(ValueError, match=message):
        regression_tree(**({"x": x, "y": y, "names": "abc", "seed": 1} | change))


def test_a_tree_that_is_cut_back_is_the_one_that_scikit_learn_prunes() -> None:
    x, y = data(400, 4, seed=3)
    y = (y - y.mean()) / y.std()
    growth = _growth(complexity=1e-3, seed=5)
    whole = growth.fit(x, y)
    ends, leaves = _weakest_links(whole.tree_), whole.apply(x)
    path = whole.cost_complexity_pruning_path(x, y).ccp_alphas
    assert len(path) > 10
    for complexity in (0.0, *(0.5 * (path[:-1] + path[1:])), BEYOND_ROOT):
        pruned = clone(growth).set_params(ccp_alpha=complexity).fit(x, y).predict(x)
        np.testing.assert_array_equal(_cut_back(whole.tree_, ends, complexity)[leaves], pruned)
