"""Variance shares of a two-factor grid: sums of squares, known truth, coverage, laws.

Catches wrong sums of squares, and intervals that cover too seldom.
"""

import numpy as np
import pandas as pd
import pytest
from scipy.special import expit, logit
from scipy.stats import t
from statsmodels.formula.api import ols
from statsmodels.stats.anova import anova_lm
from sweeps import sweep

from spinepipe.sensitivity_analysis.shares import share_intervals, variance_shares
from spinepipe.statistics import ComputationStatus

PARTS = ("row", "column", "interaction", "total_row", "total_column")


def normal_grid(rng, rows: int, columns: int, variances) -> np.ndarray:
    row, column, rest = np.sqrt(variances)
    return (
        row * rng.standard_normal((rows, 1))
        + column * rng.standard_normal(columns)
        + rest * rng.standard_normal((rows, columns))
    )


def estimates(found) -> np.ndarray:
    return np.array([getattr(found, part).estimate for part in PARTS])


def ends(found) -> np.ndarray:
    return np.array([[getattr(found, part).low, getattr(found, part).high] for part in PARTS])


def naive_shares(grid: np.ndarray) -> np.ndarray:
    """Shares by statsmodels' analysis of variance and the textbook's expected mean squares."""
    rows, columns = grid.shape
    long = pd.DataFrame(
        {
            "y": grid.ravel(),
            "a": np.repeat(np.arange(rows), columns),
            "b": np.tile(np.arange(columns), rows),
        }
    )
    table = anova_lm(ols("y ~ C(a) + C(b)", long).fit())
    ms_row, ms_column, rest = table["sum_sq"] / table["df"]
    row, column = (ms_row - rest) / columns, (ms_column - rest) / rows
    return np.array([row, column, rest, row + rest, column + rest]) / (row + column + rest)


def test_shares_and_intervals_by_the_long_way() -> None:
    grid = normal_grid(np.random.default_rng(2), 6, 5, (1.0, 1.0, 0.3))
    whole = naive_shares(grid)
    by_row = np.array([naive_shares(np.delete(grid, row, 0)) for row in range(6)])
    by_column = np.array([naive_shares(np.delete(grid, column, 1)) for column in range(5)])
    # all inside 0 to 1, so that the logit scale applies
    assert min(by_row.min(), by_column.min()) > 0.0
    assert max(by_row.max(), by_column.max()) < 1.0
    pseudo = [n * logit(whole) - (n - 1) * logit(left) for n, left in ((6, by_row), (5, by_column))]
    squared = [values.var(axis=0, ddof=1) / len(values) for values in pseudo]
    freedom = sum(squared) ** 2 / (squared[0] ** 2 / 5 + squared[1] ** 2 / 4)
    half = t.ppf(0.975, freedom) * np.sqrt(sum(squared))
    found = variance_shares(grid)
    np.testing.assert_allclose(estimates(found), whole, rtol=1e-9)
    np.testing.assert_allclose(ends(found)[:, 0], expit(logit(whole) - half), rtol=1e-8)
    np.testing.assert_allclose(ends(found)[:, 1], expit(logit(whole) + half), rtol=1e-8)


@sweep("edge", [0.0, 1.0])
def test_a_share_that_comes_to_an_end_has_a_plain_interval(edge: float) -> None:
    """Three rows, SD 0.01, and columns that say nothing: variance (3 - 1)^2 / 3 x 0.01^2, freedom
    3 - 1. The other share stays on the logit scale."""
    rows = np.array([[0.0, 0.4], [0.01, 0.5], [0.02, 0.6]])
    rows[:, 0] = np.abs(edge - rows[:, 0])
    columns = np.full((5, 2), 0.5)
    low, high = share_intervals(np.array([0.5, 0.5]), rows, columns)
    half = t.ppf(0.975, 2) * 0.01 * np.sqrt(4.0 / 3.0)
    np.testing.assert_allclose([low[0], high[0]], [0.5 - half, 0.5 + half])
    reach = t.ppf(0.975, 2) * logit(0.6) * np.sqrt(4.0 / 3.0)
    np.testing.assert_allclose([low[1], high[1]], [expit(-reach), expit(reach)])


def test_what_does_not_vary_has_no_width_and_none_lies_outside() -> None:
    still = np.full((4, 3), [0.2, 0.0, 1.0])
    low, high = share_intervals(np.array([0.2, 0.0, 1.0]), still, still)
    np.testing.assert_allclose([low, high], [[0.2, 0.0, 1.0]] * 2)
    wide = share_intervals(np.array([0.5]), np.array([[-1.0], [0.5], [2.0]]), np.full((4, 1), 0.5))
    np.testing.assert_array_equal(wide, [[0.0], [1.0]])


def test_a_sum_has_no_interaction() -> None:
    rows, columns = np.array([0.0, 1.0, 2.0, 5.0]), np.array([0.0, 3.0, 6.0])
    found = variance_shares(rows[:, None] + columns)
    # variances of the rows 14/3 (ddof 1), of the columns 9
    expected = np.array([14 / 3, 9.0]) / (14 / 3 + 9.0)
    assert found.row.estimate == pytest.approx(expected[0], abs=1e-12)
    assert found.column.estimate == pytest.approx(expected[1], abs=1e-12)
    assert found.interaction.estimate == pytest.approx(0.0, abs=1e-12)
    assert found.total_row.estimate == pytest.approx(expected[0], abs=1e-12)


def test_a_product_of_centred_effects_is_all_interaction() -> None:
    found = variance_shares(np.outer([-1.0, 0.0, 1.0, 2.0, -2.0], [-1.0, 0.0, 1.0]))
    assert estimates(found).tolist() == [0.0, 0.0, 1.0, 1.0, 1.0]
    assert found.message == "negative row and column component set to 0"
    assert found.status is ComputationStatus.DONE


def test_columns_alone_are_all_of_the_variance() -> None:
    found = variance_shares(np.tile([1.0, 2.0, 4.0, 8.0], (5, 1)))
    np.testing.assert_allclose(estimates(found), [0.0, 1.0, 0.0, 0.0, 1.0], atol=1e-12)
    assert np.isfinite(ends(found)).all()


def test_a_transposed_grid_exchanges_rows_and_columns() -> None:
    grid = normal_grid(np.random.default_rng(5), 12, 6, (0.1, 0.6, 0.3))
    one, other = variance_shares(grid), variance_shares(grid.T)
    swap = [1, 0, 2, 4, 3]
    np.testing.assert_allclose(estimates(other), estimates(one)[swap], rtol=1e-9)
    np.testing.assert_allclose(ends(other), ends(one)[swap], rtol=1e-9, atol=1e-12)


@sweep("scale, shift", [(1e-9, 0.0), (-1e150, 0.0), (1e-3, 5.0), (1.0, 1e6)])
def test_unit_and_zero_do_not_matter(scale: float, shift: float) -> None:
    grid = normal_grid(np.random.default_rng(6), 20, 8, (0.3, 0.3, 0.4))
    one, other = variance_shares(grid), variance_shares(scale * grid + shift)
    np.testing.assert_allclose(estimates(other), estimates(one), rtol=1e-8)
    np.testing.assert_allclose(ends(other), ends(one), rtol=1e-7, atol=1e-10)


def test_shares_add_up_and_lie_in_their_intervals() -> None:
    rng = np.random.default_rng(7)
    for variances in ((0.0, 0.5, 0.5), (0.0, 0.0, 1.0), (0.02, 0.02, 0.96), (0.6, 0.39, 0.01)):
        for rows, columns in ((3, 3), (4, 9), (50, 10)):
            found = variance_shares(normal_grid(rng, rows, columns, variances))
            row, column, rest, total_row, total_column = estimates(found)
            assert row + column + rest == pytest.approx(1.0, abs=1e-12)
            assert (total_row, total_column) == pytest.approx((row + rest, column + rest))
            low, high = ends(found).T
            assert (low >= 0.0).all()
            assert (low <= estimates(found)).all()
            assert (estimates(found) <= high).all()
            assert (high <= 1.0).all()


def test_a_constant_grid_has_no_shares() -> None:
    found = variance_shares(np.full((5, 4), 0.1))
    assert (found.status, found.row, found.total_column) == (ComputationStatus.CONSTANT, None, None)
    assert (found.n_rows, found.n_columns) == (5, 4)


@sweep("where", [(0, 0), (4, 2), (slice(None), 1), (2, slice(None))])
def test_variance_in_one_row_or_column_only_cannot_be_shared(where) -> None:
    grid = np.full((5, 4), 0.1)
    grid[where] += np.arange(1.0, 1.0 + grid[where].size).reshape(np.shape(grid[where]))
    found = variance_shares(grid)
    assert (found.status, found.row) == (ComputationStatus.CONSTANT, None)
    assert "but for one" in found.message
    grid[3, 0] += 1.0
    grid[1, 3] += 1.0
    assert variance_shares(grid).status is ComputationStatus.DONE


@sweep("shape", [(2, 10), (10, 2)])
def test_two_rows_or_columns_are_too_few(shape) -> None:
    found = variance_shares(np.random.default_rng(8).normal(size=shape))
    assert (found.status, found.interaction) == (ComputationStatus.TOO_FEW, None)
    assert (found.n_rows, found.n_columns) == shape
    assert found.message.startswith(f"grid of {shape[0]} x {shape[1]};")


@sweep("grid", [np.ones(5), np.full((4, 4), np.nan)])
def test_what_is_no_full_grid_is_refused(grid) -> None:
    with pytest.raises(ValueError, match="full grid"):
        variance_shares(grid)


def test_no_share_exceeds_the_whole() -> None:
    """Sums of shares that round above 1 were refused by the table."""
    rng = np.random.default_rng(5)
    for size in ((8, 3), (10, 3), (459, 10)):
        found = variance_shares(
            rng.normal(size=(size[0], 1)) * np.ones(size) + 1e-9 * rng.normal(size=size)
        )
        assert found.total_row is not None
        assert found.total_row.estimate <= 1.0
        assert found.total_row.high <= 1.0
