"""Designs of a global analysis: structure, counts, seeds, groups, and values at their points."""

import numpy as np
import pytest
from scipy.special import erf, erfinv
from scipy.stats import spearmanr

from spinepipe.sensitivity.global_indices.design import DUMMY, design_problems, draw, run_count
from spinepipe.sensitivity.global_indices.spread import (
    LogNormal,
    LogUniform,
    Normal,
    Uniform,
    values_of,
)

FACTORS = ("a", "b", "c", "d")
GROUPS = ("left", None, "left", None)
SIZES = {"sobol": 8, "latin_hypercube": 20, "morris": 6, "fast": 193}


@pytest.mark.parametrize("method", SIZES)
def test_the_same_seed_gives_the_same_design_and_another_another(method: str) -> None:
    first, again, other = (draw(method, FACTORS, SIZES[method], seed) for seed in (0, 0, 1))
    assert first.unit.tobytes() == again.unit.tobytes()
    assert not np.array_equal(first.unit, other.unit)


@pytest.mark.parametrize("method", SIZES)
@pytest.mark.parametrize("dummy", [False, True])
def test_runs_are_counted_before_they_are_drawn(method: str, dummy: bool) -> None:
    samples = 257 if method == "fast" else SIZES[method]
    design = draw(method, FACTORS, samples, 3, dummy=dummy)
    assert design.n == run_count(method, 4 + dummy, samples)
    assert design.unit.shape == (design.n, 4 + dummy)
    assert (design.factors[-1] == DUMMY) == dummy
    assert design.unit.min() >= 0.0
    assert design.unit.max() <= 1.0


@pytest.mark.parametrize(("second_order", "runs"), [(True, 8 * 8), (False, 8 * 5)])
def test_a_sobol_block_exchanges_one_group_at_a_time(second_order: bool, runs: int) -> None:
    design = draw("sobol", FACTORS, 8, 3, groups=GROUPS, second_order=second_order)
    assert design.inputs == ("left", "b", "d")
    assert design.n == runs == run_count("sobol", 3, 8, second_order)
    blocks = design.unit.reshape(8, design.block, 4)
    a, b = blocks[:, 0], blocks[:, -1]
    assert (a != b).all()
    for at, columns in enumerate(([0, 2], [1], [3])):
        expected = a.copy()
        expected[:, columns] = b[:, columns]
        np.testing.assert_array_equal(blocks[:, 1 + at], expected)
        if second_order:
            expected = b.copy()
            expected[:, columns] = a[:, columns]
            np.testing.assert_array_equal(blocks[:, 4 + at], expected)


def test_a_morris_trajectory_moves_each_group_once_by_the_step() -> None:
    design = draw("morris", FACTORS, 30, 3, groups=GROUPS, levels=6)
    steps = np.abs(np.diff(design.unit.reshape(30, 4, 4), axis=1))
    step = 6 / (2 * 5)
    np.testing.assert_allclose(steps.sum(axis=1), step, rtol=1e-12)
    np.testing.assert_allclose(steps[:, :, 0], steps[:, :, 2], atol=1e-12)
    levels = np.unique(design.unit.round(12))
    np.testing.assert_allclose(levels, np.arange(6) / 5, atol=1e-12)


def test_a_latin_hypercube_has_a_point_in_each_stratum_and_independent_factors() -> None:
    design = draw("latin_hypercube", FACTORS, 500, 3)
    np.testing.assert_array_equal(
        np.sort((design.unit * 500).astype(int), axis=0)[:, 0], range(500)
    )
    ranks = spearmanr(design.unit).statistic
    assert np.abs(ranks - np.eye(4)).max() < 0.2


def test_fast_factors_of_a_curve_do_not_move_as_one() -> None:
    curve = draw("fast", FACTORS, 193, 3).unit[:193]
    ranks = spearmanr(curve).statistic
    assert np.abs(ranks - np.eye(4)).max() < 0.3
    with pytest.raises(ValueError, match="at least 193 samples"):
        draw("fast", FACTORS, 192, 3)


@pytest.mark.parametrize(
    ("method", "samples", "groups", "said"),
    [
        ("sobol", 100, None, "power of two"),
        ("morris", 1, None, "at least 2 samples"),
        ("latin_hypercube", 100, GROUPS, "no indices of groups"),
        ("fast", 193, GROUPS, "no indices of groups"),
        ("sobol", 8, ("x", None), "4 factors but 2 groups"),
        ("sobol", 8, ("b", None, None, None), "'b' is also a factor"),
    ],
)
def test_what_cannot_be_drawn_is_said(
    method: str, samples: int, groups: tuple[str | None, ...] | None, said: str
) -> None:
    with pytest.raises(ValueError, match=said):
        draw(method, FACTORS, samples, 3, groups=groups)


def test_all_problems_are_told_at_once() -> None:
    found = design_problems("morris", ("a", "a"), (None, None), 10, levels=3)
    assert len(found) == 2
    with pytest.raises(ValueError, match="same name: dummy"):
        draw("sobol", ("a", DUMMY), 8, 3, dummy=True)
    with pytest.raises(ValueError, match="'best' is not a valid Method"):
        run_count("best", 3, 8)


def test_a_part_is_the_first_blocks() -> None:
    design = draw("sobol", FACTORS, 16, 3)
    part = design.first(4)
    np.testing.assert_array_equal(part.unit, design.unit[:40])
    assert (part.samples, part.block) == (4, design.block)
    with pytest.raises(ValueError, match="1 to 16"):
        design.first(17)
    with pytest.raises(ValueError, match="no curve"):
        draw("fast", FACTORS, 193, 3).first(100)


@pytest.mark.parametrize(
    ("spread", "share", "value"),
    [
        (Uniform(-5.0, 5.0), 0.75, 2.5),
        (LogUniform(0.5, 2.0), 0.5, 1.0),
        (LogUniform(0.5, 2.0), 1.0, 2.0),
        (Normal(1.0, 2.0), 0.975, 1.0 + 2.0 * 1.959963984540054),
        (Normal(0.0, 1.0, -1.0, 1.0), 0.0, -1.0),
        (Normal(3.0, 1.0, 3.0, 4.0), 0.5, 3.0 + 2**0.5 * erfinv(erf(0.5**0.5) / 2)),
        (LogNormal(2.0, 0.5), 0.8413447460685429, 2.0 * np.exp(0.5)),
        (LogNormal(1.0, 0.3, 0.5, 2.0), 1.0, 2.0),
    ],
)
def test_quantiles(spread: Uniform | Normal, share: float, value: float) -> None:
    np.testing.assert_allclose(spread.values(np.array([share])), value, rtol=1e-6)


@pytest.mark.parametrize("spread", [Normal(0.0, 1.0), LogNormal(1.0, 1.0), Normal(0.0, 1.0, low=0)])
def test_endless_spreads_stay_finite_at_the_ends(spread: Normal | LogNormal) -> None:
    ends = spread.values(np.array([0.0, 1.0]))
    assert np.isfinite(ends).all()
    assert ends[0] < ends[1]


def test_levels_of_morris_reach_the_ends_or_the_stated_quantiles() -> None:
    design = draw("morris", ("a", "b", "c"), 20, 3)
    spreads = (Uniform(2.0, 4.0), Normal(0.0, 1.0), Normal(0.0, 1.0, -1.5, 1.5))
    values = values_of(design, spreads)
    np.testing.assert_allclose(values.min(axis=0), [2.0, -2.575829303548901, -1.5])
    np.testing.assert_allclose(values.max(axis=0), [4.0, 2.575829303548901, 1.5])
    with pytest.raises(ValueError, match="shorter"):
        values_of(design, spreads[:2])


@pytest.mark.parametrize(
    "make",
    [
        lambda: Uniform(1.0, 1.0),
        lambda: LogUniform(0.0, 1.0),
        lambda: Normal(0.0, 0.0),
        lambda: Normal(0.0, 1.0, 1.0, -1.0),
        lambda: LogNormal(0.0, 1.0),
        lambda: LogNormal(1.0, 1.0, -1.0),
    ],
)
def test_impossible_spreads_are_refused(make: type) -> None:
    with pytest.raises(ValueError, match="found"):
        make()
