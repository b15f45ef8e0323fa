"""Which readings are outliers, and when repeats tell their noise, on both sides of each limit."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from sweeps import sweep

from spinepipe.effects.contract import Array
from spinepipe.model import LoadCase, LoadStep
from spinepipe.studies.discrepancy.search.noise import (
    _deviations,
    estimated_noise,
    noise_of_residuals,
    without_outliers,
)
from spinepipe.studies.discrepancy.search.readings import Repeats, SpecimenReadings
from spinepipe.studies.discrepancy.verdict import DECLARED, REPEATS

TYPICAL = 0.67449
"""Of a normal distribution of SD one, half lies within."""


def read(cycles: Array, test: str = "flexion") -> SpecimenReadings:
    """Readings (C, T, J) of one coordinate."""
    case = LoadCase(test, 1, tuple(LoadStep(n, ()) for n in range(cycles.shape[1])))
    whole = np.full((*cycles.shape, 6), np.nan)
    whole[..., 3] = cycles
    return SpecimenReadings("a", (), (Repeats(case, whole),))


def dropped(cycles: Array) -> list[list[int]]:
    """Cycle, step and joint of what was left out."""
    (one,), count = without_outliers([read(cycles)])
    left = np.isfinite(cycles) & ~np.isfinite(one.tests[0].cycles[..., 3])
    assert int(left.sum()) == count
    return np.argwhere(left).tolist()


def steps(count: int, row: Sequence[float]) -> Array:
    """(C, T, 1) cycles that are alike at all steps."""
    return np.tile(np.array(row, dtype=float)[:, None, None], (1, count, 1))


SPREAD = (-TYPICAL, 0.0, 0.0, TYPICAL)
"""Of four cycles; their robust SD is one, their median nought."""


@sweep("sign", [1.0, -1.0])
def test_a_reading_four_sds_from_the_median_is_an_outlier(sign: float) -> None:
    for away, out in ((3.99, []), (4.01, [[3, 7, 0]])):
        cycles = steps(20, SPREAD)
        cycles[3, 7] = away
        assert dropped(sign * cycles + 5.0) == out


@sweep("extra, known", [(0, False), (1, True)])
def test_thirty_deviations_tell_what_is_far(extra: int, known: bool) -> None:
    """Two of each of 14 steps that are not the median itself, one of the next, and one more."""
    cycles = steps(15 + extra, SPREAD)
    cycles[0, 14:] = 0.0
    cycles[3, 7] = 90.0
    assert bool(dropped(cycles)) is known


@sweep("away, out", [(4.99, False), (5.01, True)])
def test_a_cycle_five_sds_from_the_others_is_one_as_a_whole(away: float, out: bool) -> None:
    """Its readings by themselves are not: they go 10 up and down."""
    joints, swing = 15, 10.0 * np.array([1.0, -1.0, 1.0, -1.0])
    cycles = np.zeros((4, 4, joints))
    cycles += np.array(SPREAD)[:, None, None]
    cycles[0] -= swing[:, None]
    cycles[3] += swing[:, None]
    cycles[3, :, 6] += away - TYPICAL
    found = dropped(cycles)
    assert found == ([[3, step, 6] for step in range(4)] if out else [])


def test_where_fewer_than_three_agree_none_is_kept() -> None:
    four, three = steps(20, SPREAD), steps(40, SPREAD[1:])
    four[3, 7], three[2, 7] = 90.0, 90.0
    assert dropped(four) == [[3, 7, 0]]
    assert dropped(three) == [[0, 7, 0], [1, 7, 0], [2, 7, 0]]


def test_of_two_cycles_none_is_nearer_the_truth() -> None:
    cycles = steps(20, SPREAD[2:])
    cycles[1, 7] = 90.0
    assert dropped(cycles) == []
    test = read(cycles).tests[0]
    assert np.isnan(_deviations(test)).all()
    of_three = _deviations(read(steps(2, (1.0, 2.0, 5.0))).tests[0])
    assert of_three[:, 0, 0, 3].tolist() == [-1.0, 0.0, 3.0]


# When repeats tell


@sweep("count, source", [(29, DECLARED), (30, REPEATS)])
def test_thirty_differences_between_cycles_tell_the_noise(count: int, source: str) -> None:
    rng = np.random.default_rng(20031)
    cycles = rng.normal(size=(2, count, 1))
    declared = np.full(6, 0.5)
    found = estimated_noise([read(cycles)], declared, False, 3)
    assert found is not None
    assert (found.source, found.outliers, found.zeroed) == (source, 3, False)
    assert found.differences.tolist() == [0, 0, 0, count, 0, 0]
    assert np.isnan(np.delete(found.sd, 3)).all()
    if source == DECLARED:
        assert found.sd[3] == pytest.approx(1.2 * 0.5)  # doubted by a fifth
        assert found.correlation == 0.0
        assert estimated_noise([read(cycles)], None, False, 0) is None


def test_an_accuracy_alone_is_the_whole_error_of_a_reading() -> None:
    """Nobody says how much of it all readings of a test share: half of the variance."""
    found = estimated_noise([read(np.zeros((1, 4, 1)))], np.full(6, np.nan), False, 0, np.ones(6))
    assert found is not None
    assert (found.sd[3] / 1.2) ** 2 + found.accuracy[3] ** 2 == pytest.approx(1.0)
    assert found.accuracy[3] ** 2 == pytest.approx(0.5)


@sweep("told, assumed", [(2.0, False), (np.nan, True)])
def test_what_all_cycles_share_is_no_smaller_in_their_mean(told: float, assumed: bool) -> None:
    cycles = np.random.default_rng(20031).normal(size=(2, 40, 1))
    alone = estimated_noise([read(cycles)], None, False, 0)
    found = estimated_noise([read(cycles)], None, False, 0, np.full(6, told))
    assert alone is not None
    assert found is not None
    assert (found.sd[3], found.correlation) == (alone.sd[3], alone.correlation)
    assert found.assumed is assumed
    assert found.accuracy[3] == pytest.approx(np.deg2rad(0.1) if assumed else told)
    # a drift changes over the length 0.3 of a test: the Gaussian of a lag of 1 in 10 steps
    assert found.drift(11)[0, 1] == pytest.approx(np.exp(-0.5 * (0.1 / 0.3) ** 2))
    zeroed = replace(found, zeroed=True).drift(11)
    assert np.abs(zeroed[0]).max() == 0.0


def test_three_cycles_have_two_differences_a_step() -> None:
    cycles = np.random.default_rng(20032).normal(size=(3, 15, 1))
    found = estimated_noise([read(cycles)], None, False, 0)
    assert found is not None
    assert found.differences[3] == 30
    cycles[2, 4] = np.nan  # only whole cycles count
    assert estimated_noise([read(cycles)], None, False, 0) is None


def test_cycles_of_unequal_loads_tell_by_what_a_fit_leaves_of_them() -> None:
    """Two histories of a test: their residuals are its cycles; noise and outliers as of these."""
    rng = np.random.default_rng(20033)
    noise = rng.uniform(-1.0, 1.0, (3, 60, 1))  # none is far
    ones = [read(noise[k : k + 1] + 10.0 * k) for k in range(3)]
    both = SpecimenReadings("a", (), tuple(one.tests[0] for one in ones))
    predicted = {"a": [np.full((60, 1, 6), 10.0 * k) for k in range(3)]}
    declared = estimated_noise([both], np.ones(6), False, 2)
    assert declared is not None
    clean, found = noise_of_residuals({"a": both}, predicted, declared)
    assert (found.source, found.outliers) == (REPEATS, 2)
    assert found.sd[3] == pytest.approx(1.0 / np.sqrt(3.0), rel=0.15)  # of 120 differences
    for after, before in zip(clean["a"].tests, both.tests, strict=True):
        np.testing.assert_array_equal(after.cycles, before.cycles)
    few = SpecimenReadings("a", (), both.tests[:1])
    assert noise_of_residuals({"a": few}, predicted, declared)[1] is declared


def test_an_outlier_of_residuals_is_left_out_of_its_own_history() -> None:
    rows = np.tile(np.array(SPREAD)[:, None, None], (1, 20, 1))
    rows[3, 7] = 9.0
    tests = tuple(read(rows[k : k + 1] + 10.0 * k).tests[0] for k in range(4))
    predicted = {"a": [np.full((20, 1, 6), 10.0 * k) for k in range(4)]}
    both = SpecimenReadings("a", (), tests)
    declared = estimated_noise([both], np.ones(6), False, 0)
    assert declared is not None
    clean, found = noise_of_residuals({"a": both}, predicted, declared)
    assert found.outliers == 1
    lost = [np.argwhere(~np.isfinite(one.cycles[0, :, 0, 3])).tolist() for one in clean["a"].tests]
    assert lost == [[], [], [], [[7]]]
