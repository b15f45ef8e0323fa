"""Known indices lie in their intervals, and indices settle as a design grows.

Catches intervals that miss known indices, and an end of a growing design that comes too soon.
"""

import numpy as np
import pytest
from known_indices import FUNCTIONS, KnownFunction, morris_truth

from spinepipe.sensitivity.global_indices.convergence import convergence
from spinepipe.sensitivity.global_indices.design import draw
from spinepipe.sensitivity.global_indices.estimates import Settings
from spinepipe.sensitivity.global_indices.indices import indices

SEEDS = range(40)


@pytest.mark.full
@pytest.mark.parametrize("name", FUNCTIONS)
def test_known_sobol_indices_lie_in_their_intervals(name: str) -> None:
    function = FUNCTIONS[name]
    inside = []
    for seed in SEEDS:
        design = draw("sobol", function.factors, 128, seed)
        outputs = function.values(design.unit)[:, None]
        for index in indices(design, outputs, settings=Settings(bootstraps=300, seed=seed)):
            truth = function.truth[index.index, index.factor, index.other]
            inside.append(index.low[0] - 1e-12 <= truth <= index.high[0] + 1e-12)
    assert len(inside) == len(SEEDS) * len(function.truth)
    assert np.mean(inside) >= 0.9


@pytest.mark.full
@pytest.mark.parametrize("name", FUNCTIONS)
def test_known_first_order_lies_in_the_intervals_of_rbd_fast(name: str) -> None:
    function = FUNCTIONS[name]
    inside = []
    for seed in SEEDS:
        design = draw("latin_hypercube", function.factors, 256, seed)
        outputs = function.values(design.unit)[:, None]
        settings = Settings(bootstraps=200, seed=seed, wanted=("S1_RBD",))
        for index in indices(design, outputs, settings=settings):
            truth = function.truth["S1", index.factor, ""]
            inside.append(index.low[0] <= truth <= index.high[0])
    assert np.mean(inside) >= 0.9


@pytest.mark.full
@pytest.mark.parametrize("name", FUNCTIONS)
def test_known_elementary_effects_lie_in_their_intervals(name: str) -> None:
    function = FUNCTIONS[name]
    truth = morris_truth(function)
    inside = []
    for seed in SEEDS:
        design = draw("morris", function.factors, 30, seed)
        outputs = function.values(design.unit)[:, None]
        for index in indices(design, outputs, settings=Settings(bootstraps=300, seed=seed)):
            value = truth[index.index, index.factor, ""]
            slack = 1e-9 * max(1.0, abs(value))
            inside.append(index.low[0] - slack <= value <= index.high[0] + slack)
    assert np.mean(inside) >= 0.9


def test_fast_is_near_the_truth() -> None:
    function = FUNCTIONS["ishigami"]
    design = draw("fast", function.factors, 1025, 5)
    for index in indices(design, function.values(design.unit)[:, None]):
        truth = function.truth[index.index, index.factor, ""]
        assert index.estimate[0] == pytest.approx(truth, abs=0.06)


@pytest.fixture(scope="module")
def function() -> KnownFunction:
    return FUNCTIONS["ishigami"]


def test_sobol_settles_on_powers_of_two_of_the_base_sample(function: KnownFunction) -> None:
    design = draw("sobol", function.factors, 1024, 5)
    outputs = function.values(design.unit)[:, None]
    settings = Settings(bootstraps=50)
    stages = convergence(design, outputs, settings=settings, sizes=5)
    assert [stage.samples for stage in stages] == [64, 128, 256, 512, 1024]
    assert [stage.runs for stage in stages] == [8 * stage.samples for stage in stages]
    assert {index.other for stage in stages for index in stage.indices} == {""}
    whole = {(i.index, i.factor): i for i in indices(design, outputs, settings=settings)}
    widths = []
    for index in stages[-1].indices:
        assert index.estimate[0] == pytest.approx(whole[index.index, index.factor].estimate[0])
    for stage in stages:
        widths.append(np.mean([(index.high - index.low)[0] for index in stage.indices]))
    assert widths[-1] < 0.4 * widths[0]  # 1 / sqrt(16) if samples were drawn one by one


def test_parts_of_a_latin_hypercube_are_random_and_repeat(function: KnownFunction) -> None:
    design = draw("latin_hypercube", function.factors, 400, 5)
    order = np.argsort(design.unit[:, 0])  # a first part in this order would see low x1 alone
    design = type(design)(**{**vars(design), "unit": design.unit[order]})
    outputs = function.values(design.unit)[:, None]
    settings = Settings(bootstraps=20, wanted=("S1_RBD",))
    first, again = (convergence(design, outputs, settings=settings) for _ in range(2))
    assert [stage.samples for stage in first] == [50, 100, 200, 400]
    assert [index.estimate.tolist() for stage in first for index in stage.indices] == [
        index.estimate.tolist() for stage in again for index in stage.indices
    ]
    half = first[2].indices[0].estimate[0]
    assert half == pytest.approx(function.truth["S1", "x1", ""], abs=0.15)


def test_failures_count_in_the_part_they_are_in(function: KnownFunction) -> None:
    design = draw("morris", function.factors, 32, 5)
    outputs, ok = function.values(design.unit)[:, None], np.ones(design.n, dtype=bool)
    outputs[-1], ok[-1] = np.nan, False
    stages = convergence(design, outputs, ok, Settings(bootstraps=20), sizes=9)
    assert [stage.samples for stage in stages] == [4, 8, 16, 32]
    assert [stage.indices[0].failed for stage in stages] == [0, 0, 0, 1]
    assert stages[-1].indices[0].runs == design.n - design.block


def test_fast_has_one_stage(function: KnownFunction) -> None:
    design = draw("fast", function.factors, 513, 5)
    stages = convergence(design, function.values(design.unit)[:, None])
    assert [(stage.samples, stage.runs) for stage in stages] == [(513, 3 * 513)]
