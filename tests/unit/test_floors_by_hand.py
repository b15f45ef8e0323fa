"""Floors and limits of indices where they can be worked out: closed forms, numbers, edges.

Catches a floor or limit of indices that is off at its edge.
"""

from dataclasses import replace

import numpy as np
import pytest
from sweeps import sweep

from spinepipe.sensitivity_analysis.global_indices.convergence import convergence
from spinepipe.sensitivity_analysis.global_indices.design import DUMMY, Design, draw
from spinepipe.sensitivity_analysis.global_indices.estimates import (
    IndexStatus,
    SensitivityIndex,
    Settings,
    masked,
)
from spinepipe.sensitivity_analysis.global_indices.floor import (
    Floor,
    above_floor,
    negligible,
    noise_floor,
)
from spinepipe.sensitivity_analysis.global_indices.indices import complete_blocks, indices, names_of
from spinepipe.sensitivity_analysis.global_indices.structured import (
    elementary_effects,
    fast_indices,
)

QUICK = Settings(bootstraps=5, delta_bootstraps=4)
ALONE = ("a", "b")


def one(index: str, *ends: tuple[float, float, float]) -> SensitivityIndex:
    """An index with estimate, low and high for each output."""
    estimate, low, high = (masked(values, np.isnan(values)) for values in np.array(ends).T)
    done = (IndexStatus.DONE,) * len(ends)
    return SensitivityIndex(index, "a", "", estimate, low, high, 8, 0, done, ("",) * len(ends))


def floors_of(design: Design, outputs: np.ndarray, resolution: float = 0.0, **asked: object):
    settings = replace(QUICK, **asked)
    found = indices(design, outputs, None, settings, resolution)
    return noise_floor(design, outputs, found, None, settings, resolution)


def test_an_index_is_above_its_floor_by_its_nearer_end() -> None:
    floor = {"ST": Floor(masked([0.0] * 4, [0] * 4), masked([0.1] * 4, [0] * 4), 100)}
    index = one("ST", (0.3, 0.2, 0.4), (0.3, 0.1, 0.4), (0.3, 0.05, 0.4), (np.nan,) * 3)
    assert above_floor(index, floor) == (True, False, False, None)
    assert above_floor(replace(index, index="S1"), floor) == (None,) * 4


def test_mu_is_above_its_floor_on_either_side() -> None:
    floor = {"mu": Floor(masked([0.0] * 4, [0] * 4), masked([0.1] * 4, [0] * 4), 100)}
    index = one("mu", (0.3, 0.2, 0.4), (-0.3, -0.4, -0.2), (0.1, -0.4, 0.4), (0.1, 0.05, 0.4))
    assert above_floor(index, floor) == (True, True, False, False)


def test_without_an_interval_the_estimate_is_held_against_the_floor() -> None:
    floor = {"S1": Floor(masked([0.0] * 2, [0] * 2), masked([0.1] * 2, [0] * 2), 33)}
    index = one("S1", (0.3, np.nan, np.nan), (0.05, np.nan, np.nan))
    assert above_floor(index, floor) == (True, False)
    assert negligible(replace(index, index="ST")) == (None, None)


def test_what_is_negligible_ends_below_one_per_cent() -> None:
    index = one("ST", (0.0, 0.0, 0.0099), (0.0, 0.0, 0.01), (0.0, 0.0, 0.0101))
    assert negligible(index) == (True, False, False)
    assert negligible(replace(index, index="S1")) == (None,) * 3


def test_the_floor_of_effects_is_what_a_solver_leaves_open_over_a_step() -> None:
    """Off by u within +-r over a step h: |u| / h has mean r / 2 h, u / h an SD of r / sqrt 3 h."""
    design = draw("morris", ALONE, 400, 20020, dummy=True, levels=6)
    r, h = 1e-3, 6.0 / (2.0 * 5.0)
    floors = floors_of(design, design.unit[:, :1], r)
    for name, expected in (("mu_star", r / (2.0 * h)), ("sigma", r / (np.sqrt(3.0) * h))):
        middle = 0.5 * (floors[name].low[0] + floors[name].high[0])
        assert middle == pytest.approx(expected, rel=0.02)
    # the size of a mean of 400: half of its normal distribution, of which 2.5 % lie beyond 2.24 SD
    of_mean = r / (np.sqrt(3.0 * 400.0) * h)
    assert 0.0 < floors["mu"].low[0] < 0.1 * of_mean
    assert floors["mu"].high[0] == pytest.approx(2.24 * of_mean, rel=0.3)


@sweep(
    "method, samples, replicates",
    [
        ("latin_hypercube", 60, {"PAWN": 100, "KS_low": 100, "S1_RBD": 100, "delta": 20}),
        ("morris", 10, {"mu": 100, "mu_star": 100, "sigma": 100}),
        ("sobol", 16, {"S1": 100, "ST": 100, "S2": 2}),
        # frequencies from 3/4 of the dummy's, (1025 - 1) / (2 x 4), up to it
        ("fast", 1025, {"S1": 128 - 96 + 1, "ST": 33}),
    ],
)
def test_as_many_factors_without_effect_as_the_documentation_says(
    method: str, samples: int, replicates: dict[str, int]
) -> None:
    design = draw(method, ALONE, samples, 20021, dummy=True)
    floors = floors_of(design, np.exp(design.unit[:, :1]), wanted=tuple(replicates))
    assert {name: floor.replicates for name, floor in floors.items()} == replicates


def test_the_floor_of_a_tail_is_that_of_as_many_runs() -> None:
    """95 of 100 outputs are alike: all of them are as low as the lowest quarter, so that 5 stand
    against 95 there. None is lower than the highest quarter's edge: that tail is all runs."""
    design = draw("latin_hypercube", ALONE, 100, 20022, dummy=True)
    outputs = (np.arange(100) % 20 == 3).astype(float)[:, None]
    floors = floors_of(design, outputs, wanted=("KS_low", "KS_high"))
    # Kolmogorov's 97.5 % limit of 1.48 over the square root of 5 x 95 / 100
    assert floors["KS_low"].high[0] == pytest.approx(1.48 / np.sqrt(4.75), rel=0.15)
    assert floors["KS_high"].high[0] == 0.0


def test_a_design_that_varies_only_where_factors_are_exchanged_has_no_floor() -> None:
    """As its indices, which are shares of the variance of A and B."""
    design = draw("sobol", ALONE, 16, 20023, dummy=True)
    outputs = np.random.default_rng(20023).normal(size=(16, design.block))
    outputs[:, [0, -1]] = 0.0
    outputs = outputs.reshape(-1, 1)
    found = indices(design, outputs, settings=QUICK)
    assert {float(index.estimate[0]) for index in found} == {0.0}
    floors = floors_of(design, outputs, 1e-3)
    assert floors["S1"].high.tolist() == floors["ST"].high.tolist() == [0.0]


def test_without_an_index_there_is_no_floor() -> None:
    design = draw("morris", ALONE, 10, 20024, dummy=True)
    assert noise_floor(design, design.unit[:, :1], ()) == {}
    constant = floors_of(design, np.ones((design.n, 1)))
    assert [floor.high.tolist() for floor in constant.values()] == [[None]] * 3
    assert {floor.replicates for floor in constant.values()} == {0}


def test_pairs_without_numbers_have_a_floor_without() -> None:
    design = draw("sobol", (*ALONE, "c"), 16, 20025, dummy=True)
    varied = np.exp(design.unit[:, 0] + design.unit[:, 1] ** 2 * design.unit[:, 2])
    outputs = np.column_stack([varied, np.ones(design.n)])
    found = indices(design, outputs, settings=QUICK)
    pairs = [i for i in found if i.index == "S2" and DUMMY in (i.factor, i.other)]
    for order in (found, found[::-1]):
        floor = noise_floor(design, outputs, order)["S2"]
        assert floor.low.tolist() == [min(pair.low[0] for pair in pairs), None]
        assert floor.high.tolist() == [max(pair.high[0] for pair in pairs), None]


@sweep("method, fewest", [("sobol", 8), ("morris", 4), ("latin_hypercube", 50)])
def test_the_fewest_whole_blocks_with_an_index(method: str, fewest: int) -> None:
    design = draw(method, ALONE, 64, 20026)
    outputs = np.exp(design.unit[:, :1])
    for samples, status in ((fewest, IndexStatus.DONE), (fewest - 1, IndexStatus.TOO_FEW)):
        part = design.first(samples)
        found = indices(part, outputs[: part.n], settings=replace(QUICK, wanted=None))
        assert {index.status for index in found} == {(status,)}


def test_as_many_may_be_lost_as_is_said() -> None:
    design = draw("morris", ALONE, 8, 20027)
    ok = np.ones(design.n, dtype=bool)
    ok[[0, -1]] = False
    assert complete_blocks(design, ok).lost == 0.25
    for most, status in ((0.25, IndexStatus.DONE), (0.24, IndexStatus.TOO_MANY_FAILED)):
        found = indices(design, design.unit[:, :1], ok, replace(QUICK, most_failed=most))
        assert {index.status for index in found} == {(status,)}


@sweep("resolution, status", [(0.4, IndexStatus.DONE), (1.0, IndexStatus.CONSTANT)])
def test_outputs_closer_than_the_resolution_are_alike(
    resolution: float, status: IndexStatus
) -> None:
    """Levels of two: the outputs are 0 and 1, no further apart than 1."""
    design = draw("morris", ALONE, 8, 20028, levels=2)
    assert set(design.unit[:, 0].tolist()) == {0.0, 1.0}
    found = indices(design, design.unit[:, :1], None, QUICK, resolution)
    assert {index.status for index in found} == {(status,)}


def test_effects_of_a_group_have_a_size_and_no_sign() -> None:
    """Output 2 a - 3 b, with b and c moved together."""
    design = draw("morris", ("a", "b", "c"), 12, 20029, groups=(None, "g", "g"))
    outputs = design.unit @ [[2.0], [-3.0], [0.0]]
    found = elementary_effects(design, outputs)
    assert found.shape == (12, 2, 1)
    np.testing.assert_allclose(found[:, 0], 2.0)
    np.testing.assert_allclose(found[:, 1], 3.0)
    assert names_of(design) == [
        *[("mu", "a", ""), ("mu_star", "a", ""), ("mu_star", "g", ""), ("sigma", "a", "")]
    ]


def test_a_fast_curve_that_varies_a_half_at_most_has_numbers() -> None:
    """Nothing on one curve; on the other, one output that differs of which no harmonic is left."""
    design = draw("fast", ALONE, 65, 20030)
    outputs = np.zeros((130, 1))
    outputs[65 + np.arange(65), 0] = (-1.0) ** np.arange(65)
    found = fast_indices(design, outputs, np.array([True, True]))
    assert found.names == (("S1", "a", ""), ("S1", "b", ""), ("ST", "a", ""), ("ST", "b", ""))
    assert found.estimate[[0, 2], 0].tolist() == [0.0, 0.0]
    assert np.isfinite(found.estimate).all()


def test_a_design_settles_in_eight_parts_at_most() -> None:
    design = draw("morris", ALONE, 1024, 20031)
    outputs = np.exp(design.unit[:, :1])
    stages = convergence(design, outputs, settings=QUICK)
    assert [stage.samples for stage in stages] == [8 * 2**step for step in range(8)]
    whole = convergence(design, outputs, settings=QUICK, sizes=1)
    assert [stage.samples for stage in whole] == [1024]


def test_nothing_is_too_fine_where_no_resolution_is_told() -> None:
    design = draw("morris", ALONE, 16, 20033)
    outputs = 1e-3 * np.exp(design.unit[:, :1])
    for resolution, status in (
        ({}, IndexStatus.DONE),
        ({"resolution": 0.01}, IndexStatus.CONSTANT),
    ):
        (stage,) = convergence(design, outputs, settings=QUICK, sizes=1, **resolution)
        assert {index.status for index in stage.indices} == {(status,)}


def test_a_design_too_small_for_indices_is_one_stage_that_says_so() -> None:
    design = draw("latin_hypercube", ALONE, 30, 20032)
    (stage,) = convergence(design, np.exp(design.unit[:, :1]), settings=QUICK)
    assert (stage.samples, stage.runs) == (30, 30)
    assert {index.status for index in stage.indices} == {(IndexStatus.TOO_FEW,)}
    assert {index.index for index in stage.indices} == {
        *("S1_RBD", "PAWN", "KS_low", "KS_high", "delta")
    }
