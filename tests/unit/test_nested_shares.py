"""Shares of specimens, draws within them and common treatments: mean squares, truth, coverage.

Catches a variance component of wrong size, and intervals that are not the jackknife's.
"""

import numpy as np
import pandas as pd
import pytest
from scipy.special import expit, logit
from scipy.stats import t
from statsmodels.formula.api import ols
from statsmodels.stats.anova import anova_lm
from sweeps import sweep

from spinepipe.designs import latin_hypercube_normal, sample_factors
from spinepipe.sensitivity_analysis.shares import components, nested_shares, variance_shares
from spinepipe.statistics import ComputationStatus

PARTS = ("specimen", "draw", "treatment", "rest")


def normal_grid(rng, shape: tuple[int, int, int], variances) -> np.ndarray:
    """Values (S, P, K) with variances of specimen, draw, treatment, both together, scatter."""
    s, p, k = shape
    sds = np.sqrt(variances)
    return (
        sds[0] * rng.standard_normal((s, 1, 1))
        + sds[1] * rng.standard_normal((s, p, 1))
        + sds[2] * rng.standard_normal((1, 1, k))
        + sds[3] * rng.standard_normal((s, 1, k))
        + sds[4] * rng.standard_normal((s, p, k))
    )


def test_components_follow_from_statsmodels_mean_squares() -> None:
    """Sums of squares over all draws and treatments, which stand for all there is; over the
    specimens less one, and without what they add to the means of treatments."""
    shape = s, p, k = 4, 5, 3
    grid = normal_grid(np.random.default_rng(1), shape, (1.0, 0.5, 2.0, 0.3, 0.2))
    at = np.indices(shape).reshape(3, -1)
    long = pd.DataFrame({"y": grid.ravel(), "s": at[0], "p": at[1], "k": at[2]})
    table = anova_lm(ols("y ~ C(s) + C(s):C(p) + C(k) + C(s):C(k)", long).fit())
    ms = table["sum_sq"] / table["df"]
    error, both = ms["Residual"], ms["C(s):C(k)"]
    pose, treatment, specimen = ms["C(s):C(p)"], ms["C(k)"], ms["C(s)"]
    assert table.loc["C(s):C(p)", "df"] == s * (p - 1)
    expected = [
        specimen / (p * k),
        (p - 1) * pose / (p * k),
        (k - 1) * (treatment - both) / (s * p * k),
        (k - 1) * (both + (p - 1) * error) / (p * k),
    ]
    np.testing.assert_allclose(components(grid), expected, rtol=1e-9)


def test_shares_and_intervals_by_the_long_way() -> None:
    """A jackknife over five specimens: pseudo-values on the logit scale, t with four degrees."""
    grid = normal_grid(np.random.default_rng(20060), (5, 8, 6), (1.0, 0.7, 1.0, 0.1, 0.3))
    whole = components(grid) / components(grid).sum()
    left_out = np.array([components(np.delete(grid, at, 0)) for at in range(5)])
    left_out /= left_out.sum(axis=1, keepdims=True)
    assert left_out.min() > 0.0
    assert left_out.max() < 1.0
    pseudo = 5 * logit(whole) - 4 * logit(left_out)
    half = t.ppf(0.975, 4) * pseudo.std(axis=0, ddof=1) / np.sqrt(5)
    found = nested_shares(grid)
    shares = [getattr(found, part) for part in PARTS]
    np.testing.assert_allclose([share.estimate for share in shares], whole)
    np.testing.assert_allclose([share.low for share in shares], expit(logit(whole) - half))
    np.testing.assert_allclose([share.high for share in shares], expit(logit(whole) + half))
    assert (found.status, found.message) == (ComputationStatus.DONE, "")


def hypercube_grid(rng, shape: tuple[int, int, int], treatments: np.ndarray) -> np.ndarray:
    """Values (S, P, K) of specimens, of 12 factors of a draw, and of a 13th that hangs on the
    treatment; variances 1, 0.5, that of the treatments, and 0.3."""
    s, p, k = shape
    seeds = rng.integers(0, 2**31, s).tolist()
    drawn = np.stack([latin_hypercube_normal(np.zeros(13), np.ones(13), p, seed) for seed in seeds])
    specimen, draw = rng.standard_normal((s, 1, 1)), np.sqrt(0.5 / 12) * drawn[..., :12].sum(axis=2)
    sways = np.sqrt(2.0) * np.cos(np.arange(k) * 2.0 * np.pi / k)  # mean 0, mean square 1
    return specimen + draw[..., None] + treatments + np.sqrt(0.3) * drawn[..., 12:] * sways


def uniform(sets: int, seed: int, variance: float) -> np.ndarray:
    """(K,) of one factor of stiffness sets, uniform on the logarithmic scale."""
    logs = np.log(sample_factors(3.0, 6, sets + 1, seed)[1:, 0])
    return np.sqrt(3.0 * variance) / np.log(3.0) * logs


@sweep("sets", [3, 4, 9])
def test_a_hypercube_of_few_treatments_is_not_taken_for_independent_draws(sets: int) -> None:
    """Half of the variance from a factor of few sets: over K - 1 it would be 1.45 times as much of
    3 and 1.31 of 4, and the half told as 0.57 to 0.59."""
    rng = np.random.default_rng(sets)
    found = np.mean(
        [
            components(hypercube_grid(rng, (6, 9, sets), uniform(sets, seed, 0.8)))
            for seed in range(40)
        ],
        axis=0,
    )
    # one in each of K strata: their mean varies by 1 / K^3 of what they do
    np.testing.assert_allclose(found[1:], [0.5, 0.8 * (1.0 - sets**-3.0), 0.3], rtol=0.12)
    assert found[2] / found[1:].sum() == pytest.approx(0.5, abs=0.03)


def test_one_specimen_of_two_hypercubes_has_the_same_shares_and_no_sets_left_out() -> None:
    rng, rows = np.random.default_rng(31), []
    for seed in range(60):
        (grid,) = hypercube_grid(rng, (1, 9, 4), uniform(4, seed, 0.8))
        found = variance_shares(grid, hypercubes=True)
        rows.append([found.row.estimate, found.column.estimate, found.interaction.estimate])
    # medians: shares lean to one side
    np.testing.assert_allclose(np.median(rows, axis=0), [0.5 / 1.6, 0.5, 0.3 / 1.6], atol=0.06)
    whole = np.array(rows[-1])
    left = np.array([_parts(np.delete(grid, at, axis=0)) for at in range(9)])
    np.testing.assert_allclose(whole, _parts(grid))
    pseudo = 9 * logit(whole) - 8 * logit(left)
    half = t.ppf(0.975, 8) * pseudo.std(axis=0, ddof=1) / 3.0
    ends = [(one.low, one.high) for one in (found.row, found.column, found.interaction)]
    np.testing.assert_allclose(ends, expit([logit(whole) - half, logit(whole) + half]).T)


def _parts(grid: np.ndarray) -> np.ndarray:
    """Shares of the sum of squares."""
    row, column = (grid.mean(axis=at, keepdims=True) - grid.mean() for at in (1, 0))
    parts = [np.mean(part**2) for part in (row, column, grid - grid.mean() - row - column)]
    return np.array(parts) / np.sum(parts)


def test_shares_do_not_hang_on_unit_or_origin() -> None:
    grid = normal_grid(np.random.default_rng(3), (5, 4, 4), (1.0, 1.0, 1.0, 0.1, 0.1))
    one, other = nested_shares(grid), nested_shares(1e-6 * grid - 0.3)
    for part in PARTS:
        a, b = getattr(one, part), getattr(other, part)
        np.testing.assert_allclose(
            [a.estimate, a.low, a.high], [b.estimate, b.low, b.high], rtol=1e-6
        )
        assert a.low <= a.estimate <= a.high


def test_what_has_no_shares_says_why() -> None:
    few = nested_shares(np.random.default_rng(5).normal(size=(3, 2, 3)))
    assert (few.status, few.specimen) == (ComputationStatus.TOO_FEW, None)
    assert "3 x 2 x 3" in few.message
    assert nested_shares(np.full((3, 3, 3), 0.1)).status is ComputationStatus.CONSTANT
    rounded = np.full((3, 3, 3), 0.1)
    rounded[0, 0, 0] += 1e-16
    assert nested_shares(rounded).status is ComputationStatus.CONSTANT
    single = np.zeros((3, 3, 3))
    single[1] = np.random.default_rng(6).normal(size=(3, 3))
    assert nested_shares(single).status is ComputationStatus.CONSTANT
    with pytest.raises(ValueError, match="full grid"):
        nested_shares(np.full((3, 3, 3), np.nan))


def test_a_negative_component_is_told_and_set_to_zero() -> None:
    """Treatments that differ less than the specimens drawn would make them."""
    grid = normal_grid(np.random.default_rng(7), (6, 6, 4), (1.0, 1.0, 0.0, 0.5, 0.1))
    grid -= grid.mean(axis=(0, 1))
    found = nested_shares(grid)
    assert found.treatment is not None
    assert found.treatment.estimate == 0.0
    assert found.message == "negative treatment component set to 0"
    shares = [getattr(found, part) for part in PARTS]
    assert sum(share.estimate for share in shares) == pytest.approx(1.0)
    assert all(share.low <= share.estimate <= share.high for share in shares)
