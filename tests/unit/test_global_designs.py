"""Designs of a global analysis: structure, counts, seeds, groups, and values at their points.

Catches designs of wrong structure, count or group, and draws that change with the seed unchanged.
"""

import numpy as np
import pytest
from scipy.special import erf, erfinv
from scipy.stats import spearmanr
from sweeps import sweep

from spinepipe.sensitivity_analysis.global_indices.design import DUMMY, design_problems, draw
from spinepipe.sensitivity_analysis.global_indices.spread import (
    LogNormal,
    LogUniform,
    Normal,
    Uniform,
    values_of,
)

FACTORS = ("a", "b", "c", "d")
GROUPS = ("left", None, "left", None)
SIZES = {"sobol": 8, "latin_hypercube": 20, "morris": 6, "fast": 193}


@sweep("method", SIZES)
def test_the_same_seed_gives_the_same_design_and_another_another(method: str) -> None:
    first, again, other = (draw(method, FACTORS, SIZES[method], seed) for seed in (0, 0, 1))
    assert first.unit.tobytes() == again.unit.tobytes()
    assert not np.array_equal(first.unit, other.unit)


BLOCKS = {"sobol": 2 * 4 + 2, "latin_hypercube": 1, "morris": 4 + 1, "fast": 193}
"""Runs that stand or fall together, of four factors."""


@sweep("method", SIZES)
def test_as_many_runs_as_the_methods_need(method: str) -> None:
    design = draw(method, FACTORS, SIZES[method], 3)
    assert design.block == BLOCKS[method]
    assert design.n == BLOCKS[method] * (4 if method == "fast" else SIZES[method])
    assert design.factors == design.inputs == FACTORS


@sweep("method", SIZES)
@sweep("dummy", [False, True])
def test_a_dummy_is_a_factor_like_others(method: str, dummy: bool) -> None:
    samples = 257 if method == "fast" else SIZES[method]
    design = draw(method, FACTORS, samples, 3, dummy=dummy)
    assert design.unit.shape == (design.n, 4 + dummy)
    assert (design.factors[-1] == DUMMY) == dummy
    assert design.unit.min() >= 0.0
    assert design.unit.max() <= 1.0


@sweep("second_order, runs", [(True, 8 * 8), (False, 8 * 5)])
def test_a_sobol_block_exchanges_one_group_at_a_time(second_order: bool, runs: int) -> None:
    design = draw("sobol", FACTORS, 8, 3, groups=GROUPS, second_order=second_order)
    assert design.inputs == ("left", "b", "d")
    assert design.n == runs
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


@sweep(
    "method, samples, groups, said",
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
    assert design_problems("sobol", (), (), 8) == ["a design needs at least one factor"]
    found = design_problems("morris", ("a", "a"), (None, None), 10, levels=3)
    assert len(found) == 2
    with pytest.raises(ValueError, match="same name: dummy"):
        draw("sobol", ("a", DUMMY), 8, 3, dummy=True)
    with pytest.raises(ValueError, match="'best' is not a valid Method"):
        draw("best", FACTORS, 8, 3)


@sweep(
    "method, factors, least",
    [
        ("sobol", 4, 2),
        ("latin_hypercube", 4, 2),
        ("morris", 4, 2),
        ("fast", 1, 4 * 4**2 + 1),
        ("fast", 2, 4 * 4**2 + 1),
        ("fast", 4, 3 * 4 * 4**2 + 1),
    ],
)
def test_the_fewest_samples_of_a_method(method: str, factors: int, least: int) -> None:
    """Of FAST: Saltelli et al. 1999, doi:10.1080/00401706.1999.10485594, and a frequency each."""
    names, alone = FACTORS[:factors], (None,) * factors
    assert design_problems(method, names, alone, least) == []
    assert len(design_problems(method, names, alone, least - 1)) == 1
    drawn = draw(method, names, least, 3)
    assert len(np.unique(drawn.unit.round(9), axis=0)) > 1


@sweep("levels, wrong", [(0, 1), (1, 1), (2, 0), (3, 1), (4, 0), (7, 1)])
def test_levels_of_morris_are_even(levels: int, wrong: int) -> None:
    assert len(design_problems("morris", FACTORS, (None,) * 4, 10, levels=levels)) == wrong


@sweep("harmonics, least", [(1, 13), (6, 433)])
def test_more_harmonics_need_more_samples(harmonics: int, least: int) -> None:
    for samples, wrong in ((least, 0), (least - 1, 1)):
        found = design_problems("fast", FACTORS, (None,) * 4, samples, harmonics=harmonics)
        assert len(found) == wrong
    assert len(design_problems("fast", FACTORS, (None,) * 4, 1000, harmonics=0)) == 1


def test_a_part_is_the_first_blocks() -> None:
    design = draw("sobol", FACTORS, 16, 3)
    part = design.first(4)
    np.testing.assert_array_equal(part.unit, design.unit[:40])
    assert (part.samples, part.block) == (4, design.block)
    for samples in (0, 17):
        with pytest.raises(ValueError, match="1 to 16"):
            design.first(samples)
    np.testing.assert_array_equal(design.first(16).unit, design.unit)
    np.testing.assert_array_equal(design.first(1).unit, design.unit[:10])
    curves = draw("fast", FACTORS, 193, 3)
    np.testing.assert_array_equal(curves.first(193).unit, curves.unit)
    with pytest.raises(ValueError, match="no curve"):
        draw("fast", FACTORS, 193, 3).first(100)


@sweep(
    "spread, share, value",
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


@sweep("spread", [Normal(0.0, 1.0), LogNormal(1.0, 1.0), Normal(0.0, 1.0, low=0)])
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


@sweep(
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
