"""Indices of a global analysis: equal to SALib's and scipy's, failures, constants, growing designs.

Catches an index that differs from SALib's, failed runs that count, and an end of a growing design
that comes too soon.
"""

import numpy as np
import pytest
from known_indices import FUNCTIONS, Array
from SALib.analyze import delta, fast, morris, pawn, rbd_fast, sobol
from scipy.integrate import dblquad
from scipy.stats import ks_2samp, norm
from sweeps import sweep

from spinepipe.sensitivity_analysis.global_indices.convergence import convergence
from spinepipe.sensitivity_analysis.global_indices.design import Design, draw
from spinepipe.sensitivity_analysis.global_indices.estimates import (
    IndexStatus,
    SensitivityIndex,
    Settings,
)
from spinepipe.sensitivity_analysis.global_indices.indices import indices

G = FUNCTIONS["g"]
QUICK = Settings(bootstraps=20, delta_bootstraps=5)
PAIR = ("pair", "pair", None, None, None, None)


def problem_of(design: Design) -> dict[str, object]:
    d = len(design.factors)
    groups = list(design.groups)
    problem = {"num_vars": d, "names": list(design.factors), "bounds": [[0.0, 1.0]] * d}
    return problem | ({"groups": groups} if design.groups != design.factors else {})


def by_name(found: tuple[SensitivityIndex, ...]) -> dict[tuple[str, str, str], SensitivityIndex]:
    return {(index.index, index.factor, index.other): index for index in found}


def two_outputs(design: Design) -> Array:
    first = G.values(design.unit[:, :6])
    return np.column_stack([first, 50.0 + np.exp(first) * design.unit[:, 3]])


def with_failures(design: Design, rows: list[int]) -> tuple[Array, np.ndarray]:
    outputs, ok = two_outputs(design), np.ones(design.n, dtype=bool)
    outputs[rows], ok[rows] = np.nan, False
    return outputs, ok


@sweep("groups", [None, PAIR])
@sweep("second_order", [True, False])
def test_sobol_is_salibs(second_order: bool, groups: tuple[str | None, ...] | None) -> None:
    design = draw("sobol", G.factors, 64, 5, groups=groups, second_order=second_order)
    outputs = two_outputs(design)
    found = by_name(indices(design, outputs, settings=QUICK))
    names = design.inputs
    for k in range(2):
        expected = sobol.analyze(problem_of(design), outputs[:, k], second_order, seed=1)
        for at, name in enumerate(names):
            for kind in ("S1", "ST"):
                assert found[kind, name, ""].estimate[k] == pytest.approx(
                    expected[kind][at], abs=1e-12
                )
            for other in range(at + 1, len(names)):
                if second_order:
                    pair = found["S2", name, names[other]].estimate[k]
                    assert pair == pytest.approx(expected["S2"][at, other], abs=1e-12)
    pairs = len(names) * (len(names) - 1) // 2
    assert len(found) == 2 * len(names) + pairs * second_order


def test_sobol_intervals_are_as_wide_as_salibs() -> None:
    design = draw("sobol", G.factors, 256, 5)
    outputs = two_outputs(design)[:, :1]
    found = by_name(indices(design, outputs, settings=Settings(bootstraps=2000)))
    expected = sobol.analyze(problem_of(design), outputs[:, 0], num_resamples=1000, seed=1)
    for at, name in enumerate(design.factors[:4]):
        index = found["ST", name, ""]
        assert (index.high - index.low)[0] / 2 == pytest.approx(expected["ST_conf"][at], rel=0.15)


def test_a_sobol_group_holds_what_its_factors_and_their_interaction_hold() -> None:
    function = FUNCTIONS["linear_gaussian"]
    design = draw("sobol", function.factors, 1024, 5, groups=(None, "g", "g", None, None))
    found = by_name(indices(design, function.values(design.unit)[:, None], settings=QUICK))
    expected = function.truth["S1", "x2", ""] + function.truth["S1", "x3", ""]
    assert found["S1", "g", ""].estimate[0] == pytest.approx(expected, abs=0.01)
    assert found["ST", "g", ""].estimate[0] == pytest.approx(expected, abs=0.01)


@sweep("groups", [None, PAIR])
def test_morris_is_salibs(groups: tuple[str | None, ...] | None) -> None:
    design = draw("morris", G.factors, 12, 5, groups=groups, levels=6)
    outputs = two_outputs(design)
    found = by_name(indices(design, outputs, settings=QUICK))
    for k in range(2):
        expected = morris.analyze(problem_of(design), design.unit, outputs[:, k], num_levels=6)
        for at, name in enumerate(expected["names"]):
            kinds = ("mu_star",) if name == "pair" else ("mu", "mu_star", "sigma")
            assert sorted(key[0] for key in found if key[1] == name) == sorted(kinds)
            for kind in kinds:
                value = found[kind, name, ""].estimate[k]
                assert value == pytest.approx(expected[kind][at], abs=1e-12)


def test_fast_is_salibs_without_intervals() -> None:
    design = draw("fast", G.factors, 513, 5)
    outputs = two_outputs(design)
    found = by_name(indices(design, outputs, settings=QUICK))
    for k in range(2):
        with pytest.warns(UserWarning, match="unreliable"):
            expected = fast.analyze(problem_of(design), outputs[:, k])
        for kind in ("S1", "ST"):
            for at, name in enumerate(design.factors):
                index = found[kind, name, ""]
                assert index.estimate[k] == pytest.approx(expected[kind][at], abs=1e-12)
                assert index.low.tolist() == index.high.tolist() == [None, None]
                assert index.message[k].startswith("FAST has no interval")


def test_given_data_indices_are_salibs_and_scipys() -> None:
    design = draw("latin_hypercube", G.factors, 211, 5)
    outputs = two_outputs(design)
    wanted = ("S1_RBD", "PAWN", "KS_low", "KS_high")
    found = by_name(indices(design, outputs, settings=Settings(bootstraps=20, wanted=wanted)))
    assert {key[0] for key in found} == set(wanted)
    for k in range(2):
        y = outputs[:, k]
        first = rbd_fast.analyze(problem_of(design), design.unit, y, num_resamples=2)["S1"]
        median = pawn.analyze(problem_of(design), design.unit, y)["median"]
        high = y >= np.quantile(y, 0.75)
        low = y <= np.quantile(y, 0.25)
        for at, name in enumerate(design.factors):
            x = design.unit[:, at]
            expected = {
                "S1_RBD": first[at],
                "PAWN": median[at],
                "KS_low": ks_2samp(x[low], x[~low]).statistic,
                "KS_high": ks_2samp(x[high], x[~high]).statistic,
            }
            for kind, value in expected.items():
                assert found[kind, name, ""].estimate[k] == pytest.approx(value, abs=1e-12)


def test_distances_of_tied_outputs_are_scipys() -> None:
    design = draw("latin_hypercube", G.factors, 200, 5)
    tied = np.round(3.0 * G.values(design.unit))
    found = by_name(indices(design, tied[:, None], settings=Settings(20, wanted=("PAWN",))))
    expected = pawn.analyze(problem_of(design), design.unit, tied)["median"]
    for at, name in enumerate(design.factors):
        assert found["PAWN", name, ""].estimate[0] == pytest.approx(expected[at], abs=1e-12)


def test_delta_is_near_its_integral_and_without_the_bias_of_an_idle_factor() -> None:
    """Half the mean distance of densities, Borgonovo 2007, doi:10.1016/j.ress.2006.04.015; smoothed
    densities and six classes leave the estimate some 15 % low."""

    def off(y: float, x: float) -> float:
        return abs(norm.pdf(y, 0, 2**0.5) - norm.pdf(y, x, 1.0)) * norm.pdf(x) / 2

    design = draw("latin_hypercube", ("a", "b", "idle"), 512, 5)
    output = norm.ppf(design.unit[:, :2]).sum(axis=1)
    settings = Settings(delta_bootstraps=20, wanted=("delta",))
    a, b, idle = indices(design, output[:, None], settings=settings)
    expected = dblquad(off, -5, 5, -7, 7, epsabs=1e-3)[0]
    assert a.estimate[0] == pytest.approx(expected, rel=0.2)
    assert b.estimate[0] == pytest.approx(expected, rel=0.2)
    grid, classes = np.linspace(output.min(), output.max(), 100), np.linspace(0, 512, 6)
    biased = delta.calc_delta(output, grid, design.unit[:, 2], classes)
    assert abs(idle.estimate[0]) < 0.03 < biased


@sweep("method", ["sobol", "morris", "latin_hypercube"])
def test_a_failed_run_takes_its_block_and_nothing_else(method: str) -> None:
    design = draw(method, G.factors, 64, 5)
    failed = [3, 4, 5 * design.block, 20 * design.block + design.block // 2]
    outputs, ok = with_failures(design, failed)
    found = indices(design, outputs, ok, QUICK)
    blocks = {row // design.block for row in failed}
    rows = [row for row in range(design.n) if row // design.block not in blocks]
    left = Design(**{**vars(design), "unit": design.unit[rows], "samples": 64 - len(blocks)})
    expected = indices(left, two_outputs(left), settings=QUICK)
    for index, other in zip(found, expected, strict=True):
        assert index.estimate.tolist() == other.estimate.tolist()
        assert index.low.tolist() == other.low.tolist()
        assert (index.runs, index.failed) == (len(rows), 4)
        assert index.message[0].startswith(f"4 failed runs: {len(blocks)} of 64 ")
        assert other.message[0] == ""


def test_a_broken_fast_curve_costs_its_factor_alone() -> None:
    design = draw("fast", G.factors, 513, 5)
    outputs, ok = with_failures(design, [2 * 513 + 7])
    found = by_name(indices(design, outputs, ok))
    whole = by_name(indices(design, two_outputs(design)))
    for key, index in found.items():
        if key[1] == "x3":
            assert set(index.status) == {IndexStatus.TOO_MANY_FAILED}
            assert index.estimate.tolist() == [None, None]
            assert "1 of 6 curves left out, x3's among them" in index.message[0]
        else:
            assert set(index.status) == {IndexStatus.DONE}
            assert index.estimate.tolist() == whole[key].estimate.tolist()


@sweep("method", ["sobol", "morris", "latin_hypercube"])
def test_too_many_failures_leave_no_index(method: str) -> None:
    design = draw(method, G.factors, 64, 5)
    outputs, ok = with_failures(design, [row * design.block for row in range(13)])  # 20.3 %
    for index in indices(design, outputs, ok, QUICK):
        assert set(index.status) == {IndexStatus.TOO_MANY_FAILED}
        assert index.estimate.tolist() == index.low.tolist() == [None, None]
        assert "at most 20% may be lost" in index.message[0]


@sweep("method", ["sobol", "morris", "latin_hypercube", "fast"])
def test_all_failed_is_no_error(method: str) -> None:
    design = draw(method, G.factors, 513 if method == "fast" else 64, 5)
    outputs = np.full((design.n, 2), np.nan)
    found = indices(design, outputs, np.zeros(design.n, dtype=bool))
    assert {status for index in found for status in index.status} == {IndexStatus.TOO_MANY_FAILED}


def test_too_few_points_leave_no_index() -> None:
    design = draw("latin_hypercube", G.factors, 30, 5)
    found = indices(design, two_outputs(design), settings=QUICK)
    assert {status for index in found for status in index.status} == {IndexStatus.TOO_FEW}
    assert "30 points; at least 50 are needed" in found[0].message[0]


@sweep("method", ["sobol", "morris", "latin_hypercube", "fast"])
def test_a_constant_output_has_no_indices_and_leaves_the_others_alone(method: str) -> None:
    design = draw(method, G.factors, 513 if method == "fast" else 64, 5)
    both = two_outputs(design)
    rounding = 1e3 + 1e-12 * both[:, 0]
    tiny = 1e-9 * both[:, 0]
    outputs = np.column_stack([np.zeros(design.n), both[:, 0], rounding, tiny, both[:, 1]])
    found = indices(design, outputs, settings=QUICK, resolution=[0, 0, 0, 1e-8, 0])
    alone = indices(design, both, settings=QUICK)
    constant, done = IndexStatus.CONSTANT, IndexStatus.DONE
    for index, other in zip(found, alone, strict=True):
        assert index.status == (constant, done, constant, constant, done)
        assert index.estimate.compressed().tolist() == other.estimate.tolist()
        assert np.isfinite(index.estimate.data).all()


@sweep("method", ["sobol", "morris", "latin_hypercube", "fast"])
def test_an_output_of_one_run_alone_gives_numbers(method: str) -> None:
    """Resamples without that run are constant."""
    design = draw(method, G.factors, 513 if method == "fast" else 64, 5)
    outputs = np.zeros((design.n, 2))
    outputs[7, 0] = outputs[0, 1] = 1.0
    for index in indices(design, outputs, settings=Settings(bootstraps=50, delta_bootstraps=20)):
        assert set(index.status) == {IndexStatus.DONE}
        assert np.isfinite([index.estimate.data, index.low.data, index.high.data]).all()


def test_scale_and_shift_of_an_output_change_nothing() -> None:
    design = draw("sobol", G.factors, 128, 5)
    values = two_outputs(design)[:, :1]
    for index in indices(design, np.hstack([values, 1e-6 * values - 3.0]), settings=QUICK):
        assert index.estimate[0] == pytest.approx(index.estimate[1], abs=1e-8)
        assert index.low[0] == pytest.approx(index.low[1], abs=1e-8)


def test_seeds_of_resamples_repeat_and_zero_is_one() -> None:
    design = draw("sobol", G.factors, 64, 5)
    outputs = two_outputs(design)
    first, again, other = (
        indices(design, outputs, settings=Settings(bootstraps=20, seed=seed)) for seed in (0, 0, 1)
    )
    assert [index.low.tolist() for index in first] == [index.low.tolist() for index in again]
    assert first[0].low.tolist() != other[0].low.tolist()


def test_outputs_that_do_not_fit_are_refused() -> None:
    design = draw("sobol", G.factors, 8, 5)
    outputs = two_outputs(design)
    with pytest.raises(ValueError, match=r"112 runs need outputs \(112, K\)"):
        indices(design, outputs[1:])
    outputs[3, 0] = np.nan
    with pytest.raises(ValueError, match="finite where a run succeeded"):
        indices(design, outputs)
    with pytest.raises(ValueError, match="no index S3"):
        Settings(wanted=("S3",))


def test_sobol_settles_on_powers_of_two_of_the_base_sample() -> None:
    function = FUNCTIONS["ishigami"]
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


def test_parts_of_a_latin_hypercube_are_random_and_repeat() -> None:
    function = FUNCTIONS["ishigami"]
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


def test_failures_count_in_the_part_they_are_in() -> None:
    function = FUNCTIONS["ishigami"]
    design = draw("morris", function.factors, 32, 5)
    outputs, ok = function.values(design.unit)[:, None], np.ones(design.n, dtype=bool)
    outputs[-1], ok[-1] = np.nan, False
    stages = convergence(design, outputs, ok, Settings(bootstraps=20), sizes=9)
    assert [stage.samples for stage in stages] == [4, 8, 16, 32]
    assert [stage.indices[0].failed for stage in stages] == [0, 0, 0, 1]
    assert stages[-1].indices[0].runs == design.n - design.block


def test_fast_has_one_stage() -> None:
    function = FUNCTIONS["ishigami"]
    design = draw("fast", function.factors, 513, 5)
    stages = convergence(design, function.values(design.unit)[:, None])
    assert [(stage.samples, stage.runs) for stage in stages] == [(513, 3 * 513)]
