"""Resamples as weights are resamples as repeated rows; intervals by hand; delta's classes.

Catches weights that are not those of repeated rows, and wrong classes of delta.
"""

from collections.abc import Callable
from itertools import pairwise

import numpy as np
import pytest
from SALib.analyze import delta, rbd_fast
from scipy.stats import ks_2samp
from sweeps import sweep

from spinepipe.sensitivity_analysis.global_indices import estimates, given_data, structured
from spinepipe.sensitivity_analysis.global_indices.design import draw
from spinepipe.sensitivity_analysis.global_indices.estimates import (
    Settings,
    masked,
    normal_interval,
    percentile_interval,
    resample_weights,
)

Array = np.ndarray


def sample(n: int, seed: int, resamples: int = 5) -> tuple[Array, Array, Array]:
    """Two factors (n, 2), an output (n,) with ties, and weights (resamples, n) that sum to n."""
    rng = np.random.default_rng(seed)
    unit = rng.random((n, 2))
    output = np.round(8.0 * unit[:, 0] ** 2 + rng.normal(size=n))
    return unit, output, np.concatenate(list(resample_weights(n, resamples, seed)))


def repeated(weights: Array) -> list[Array]:
    """Rows of each resample."""
    return [np.repeat(np.arange(len(row)), row.astype(int)) for row in weights]


def test_weights_are_draws_of_as_many_rows() -> None:
    (weights,) = resample_weights(40, 2000, 20001)
    assert weights.shape == (2000, 40)
    assert (weights.sum(axis=1) == 40).all()
    # each row is in a resample once on average, with variance 1 - 1/40
    np.testing.assert_allclose(weights.mean(axis=0), 1.0, atol=5.0 / np.sqrt(2000))
    assert weights.var() == pytest.approx(1.0 - 1.0 / 40.0, rel=0.05)


@pytest.mark.parametrize(("held", "sizes"), [(8 * 30 * 3, [3, 3, 1]), (1, [1] * 7), (10**6, [7])])
def test_blocks_of_weights_do_not_change_them(
    held: int, sizes: list[int], monkeypatch: pytest.MonkeyPatch
) -> None:
    (whole,) = resample_weights(30, 7, 20002)
    monkeypatch.setattr(estimates, "WEIGHTS_BYTES", held)
    blocks = list(resample_weights(30, 7, 20002))
    assert [len(block) for block in blocks] == sizes
    np.testing.assert_array_equal(np.concatenate(blocks), whole)


def test_ends_of_intervals_by_hand() -> None:
    low, high = percentile_interval(np.arange(1001.0)[:, None], 0.9)
    np.testing.assert_allclose([low[0], high[0]], [50.0, 950.0])
    drawn = np.array([[1.0, 5.0], [3.0, 5.0]])  # SDs of sqrt(2) and 0
    ends = normal_interval(np.array([2.0, 4.0]), drawn, 0.95)
    reach = 1.959963984540054 * np.sqrt(2.0)
    np.testing.assert_allclose(ends, [[2.0 - reach, 4.0], [2.0 + reach, 4.0]])
    above = normal_interval(np.array([2.0, 4.0]), drawn, 0.95, 0.0)
    np.testing.assert_allclose(above, [[0.0, 4.0], [2.0 + reach, 4.0]])


def test_under_a_mask_there_is_nothing() -> None:
    found = masked([1.0, np.nan, 3.0], [False, True, False])
    assert found.tolist() == [1.0, None, 3.0]
    assert found.data.tolist() == [1.0, 0.0, 3.0]


@sweep("change", [{"bootstraps": 1}, {"delta_bootstraps": 1}, {"confidence": 0}, {"confidence": 1}])
def test_one_resample_is_no_interval_and_nothing_is_sure(change: dict[str, int]) -> None:
    with pytest.raises(ValueError, match="at least 2 bootstraps and a confidence between"):
        Settings(**change)
    assert Settings(bootstraps=2, delta_bootstraps=2, confidence=1e-9)


def test_distance_from_the_rest_is_scipys_of_repeated_rows() -> None:
    unit, output, weights = sample(60, 20003)
    region = np.stack([output >= 6.0, output <= 1.0], axis=1)
    found = given_data.regional(unit, region, weights)
    for r, rows in enumerate(repeated(weights)):
        for k in range(2):
            inside = region[rows, k]
            for d in range(2):
                x = unit[rows, d]
                expected = ks_2samp(x[inside], x[~inside]).statistic
                assert found[r, d, k] == pytest.approx(expected, abs=1e-12)


def test_pawn_of_weights_is_that_of_repeated_rows_in_the_same_slices() -> None:
    unit, output, weights = sample(61, 20004)
    found = given_data.pawn(unit, output, weights, 4)
    for d in range(2):
        edges = np.quantile(unit[:, d], [0.0, 0.25, 0.5, 0.75, 1.0])
        for r, rows in enumerate(repeated(weights)):
            x, y = unit[rows, d], output[rows]
            parts = [(x >= a) & (x < b) for a, b in pairwise(edges)]
            expected = np.median([ks_2samp(y[part], y).statistic for part in parts])
            assert found[r, d] == pytest.approx(expected, abs=1e-12)


def test_resamples_all_in_or_out_of_a_part_are_no_distance_away() -> None:
    values, part = np.array([3.0, 1.0, 2.0, 4.0]), np.array([True, True, False, False])
    weights = np.array([[1, 1, 0, 0], [0, 0, 1, 1], [1, 1, 1, 1.0]])
    ordered = given_data.WeightedSample(values, weights)
    np.testing.assert_allclose(ordered.share(part), [1.0, 0.0, 0.5])
    # of all four: after 1 half of the part and a quarter of all
    np.testing.assert_allclose(ordered.distance(part), [0.0, 0.0, 0.25])
    from_rest = given_data.regional(values[:, None], part[:, None], weights)
    np.testing.assert_allclose(from_rest[:, 0, 0], [0.0, 0.0, 0.5])


@sweep("n", [50, 51])
def test_rbd_fast_of_weights_is_salibs_of_repeated_rows(n: int) -> None:
    unit, output, weights = sample(n, 20005)
    found = given_data.rbd_fast_resampled(unit, output[:, None], weights)
    for r, rows in enumerate(repeated(weights)):
        for d in range(2):
            order = np.argsort(unit[rows, d], kind="stable")
            there_and_back = np.concatenate([order[::2], order[1::2][::-1]])
            raw = rbd_fast.compute_first_order(output[rows][there_and_back], 10)
            expected = rbd_fast.unskew_S1(raw, 10, n)
            assert found[r, d, 0] == pytest.approx(expected, abs=1e-12)


def test_a_resample_that_does_not_vary_has_no_harmonics() -> None:
    """The correction of the bias of nothing: -l / (1 - l), with l = 2 x 10 harmonics / n."""
    once = np.ones((1, 50))
    found = given_data.rbd_fast_resampled(
        np.random.default_rng(20006).random((50, 1)), once.T, once
    )
    assert found[0, 0, 0] == pytest.approx(-(20 / 50) / (1 - 20 / 50))


def test_first_orders_may_end_below_nothing_and_distances_not() -> None:
    rng = np.random.default_rng(20007)
    unit, outputs = rng.random((60, 1)), rng.normal(size=(60, 1))
    settings = Settings(bootstraps=50, confidence=1.0 - 1e-12)
    first, pawn = (given_data._one(name, unit, outputs, settings) for name in ("S1_RBD", "PAWN"))
    assert first[1, 0, 0] < 0.0
    assert pawn[1, 0, 0] == 0.0
    assert 2.0 * pawn[0, 0, 0] < pawn[2, 0, 0], "as far below the estimate is less than nothing"


def test_tails_hold_what_is_at_their_edge() -> None:
    outputs = np.array([[4.0, 0.0], [3.0, 0.0], [2.0, 0.0], [1.0, 0.0], [0.0, 9.0]])
    low, high = (given_data.tail_of(outputs, 0.25, highest) for highest in (False, True))
    assert low.T.tolist() == [[False, False, False, True, True], [True] * 4 + [False]]
    assert high.T.tolist() == [[True, True, False, False, False], [True] * 5]


SIZES = (50, 256, 700, 1024, 1500, 2000, 3000, 200_000)


@pytest.mark.parametrize("n", SIZES)
def test_delta_has_salibs_classes(n: int, monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[tuple[Array, Array]] = []

    def seen(_: Array, grid: Array, __: Array, edges: Array, *___: object) -> tuple[float, ...]:
        asked.append((grid, edges))
        return 0.0, 0.0, ()

    unit = np.linspace(0.0, 1.0, n)
    monkeypatch.setattr(delta, "bias_reduced_delta", seen)
    problem = {"num_vars": 1, "names": ["a"], "bounds": [[0.0, 1.0]]}
    delta.analyze(problem, unit[:, None], unit, method="delta")
    monkeypatch.setattr(delta, "calc_delta", lambda *given: seen(*given)[0])
    given_data._delta_of(unit, unit)
    (grid, edges), (own_grid, own_edges) = asked[0], asked[-1]
    np.testing.assert_array_equal(own_grid, grid)
    np.testing.assert_array_equal(own_edges, edges)


def test_the_bias_of_delta_is_taken_out_by_its_resamples() -> None:
    """Equation 30 of Plischke et al. 2013: twice the estimate less the resamples' mean."""
    unit, output, weights = sample(80, 20008)
    reduced, drawn = given_data.delta_indices(unit, output, weights)
    np.testing.assert_allclose(drawn.mean(axis=0), reduced)
    once = given_data.delta_indices(unit, output, weights[:1])[1][0]
    np.testing.assert_allclose(once[0] - drawn[0, 0], 0.0, atol=0.05)  # ties are dealt by chance
    plain = [given_data._delta_of(output, values) for values in unit.T]
    mean_of_resamples = 2.0 * np.array(plain) - reduced
    by_rows = [
        [given_data._delta_of(output[rows], unit[rows, d]) for d in range(2)]
        for rows in repeated(weights)
    ]
    np.testing.assert_allclose(mean_of_resamples, np.mean(by_rows, axis=0), atol=0.03)


def test_weighted_effects_are_those_of_repeated_trajectories() -> None:
    rng = np.random.default_rng(20009)
    effects = rng.normal(3.0, 1.0, size=(9, 2))
    weights = np.concatenate(list(resample_weights(9, 4, 20009)))
    found = structured._indices(weights / 9.0, effects).reshape(4, 2, 3)
    for r, rows in enumerate(repeated(weights)):
        some = effects[rows]
        np.testing.assert_allclose(found[r, :, 0], some.mean(axis=0))
        np.testing.assert_allclose(found[r, :, 1], np.abs(some).mean(axis=0))
        np.testing.assert_allclose(found[r, :, 2], some.std(axis=0, ddof=1))


@sweep("of", [structured.sobol_indices, structured.morris_indices])
def test_intervals_of_structured_designs_are_of_what_is_asked(of: Callable[..., object]) -> None:
    """A wider confidence has wider ends, and all resamples lie within that of nearly 1."""
    method = "sobol" if of is structured.sobol_indices else "morris"
    design = draw(method, ("a", "b", "c"), 16, 20010)
    outputs = np.exp(design.unit @ [[2.0], [1.0], [0.5]])
    half, most = (of(design, outputs, Settings(200, confidence=c)) for c in (0.5, 0.999))
    assert (half.ends[0] <= half.ends[1]).all()
    assert (most.ends[0] <= half.ends[0]).all()
    assert (half.ends[1] <= most.ends[1]).all()
    assert (most.ends[0] <= most.estimate).all()
    assert (most.estimate <= most.ends[1]).all()
