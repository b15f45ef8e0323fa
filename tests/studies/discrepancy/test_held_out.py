"""Held-out folds of chains whose motion is known: moment over stiffness at every joint."""

from dataclasses import replace

import numpy as np
import pytest
from held_out_cases import CYCLES, JOINTS, MOMENTS_NM, NONE, SD, found, grounds, read, serial
from scipy.spatial.transform import Rotation
from sweeps import sweep

from spinepipe.effects.contract import Array
from spinepipe.studies.discrepancy.proof.held_out import (
    SPECIMEN,
    STEPS,
    TEST,
    FoldRow,
    HeldOut,
    held_out,
)
from spinepipe.studies.discrepancy.proof.linear_model import nuisance_size
from spinepipe.studies.discrepancy.search.gaps import Gap
from spinepipe.studies.discrepancy.search.readings import Repeats, SpecimenReadings
from spinepipe.studies.discrepancy.verdict import share_of_gap

LOAD_STEPS = len(MOMENTS_NM)
EXTENSION, BENDING = 3, 4
PRECISION = CYCLES / SD**2 * np.linalg.inv(serial(LOAD_STEPS))


def proof(readings: tuple[SpecimenReadings, ...], zone: bool = False) -> HeldOut:
    search = found(grounds(readings), zone)
    return held_out(search.base, search.final)


def compliance(mean: Array) -> tuple[float, float]:
    """Least squares of readings (T, J) over the moments by hand, and its variance."""
    own = JOINTS * MOMENTS_NM @ PRECISION @ MOMENTS_NM
    return float((MOMENTS_NM @ PRECISION @ mean).sum() / own), 1.0 / own


def test_unseen_flexion_follows_the_stiffness_in_extension() -> None:
    readings = read({"a": 40.0}, ("flexion", "extension", "bending"), zone=False)
    row = proof(readings).folds[0]
    flexion, extension = (test.mean for test in readings[0].tests[:2])
    size, variance = compliance(extension[..., EXTENSION])
    missed = (
        flexion[..., 3:]
        - np.stack([-MOMENTS_NM * size, 0 * MOMENTS_NM, 0 * MOMENTS_NM], axis=-1)[:, None]
    )
    chi2 = np.einsum("tjk,tu,ujk->", missed, PRECISION, missed)
    # along the motion the prediction is as unsure as the reading: the same moments in both tests
    along = float((MOMENTS_NM @ PRECISION @ missed[..., 0]).sum() ** 2 * variance)
    assert (row.name, row.kind, row.left_out) == ("flexion", TEST, LOAD_STEPS * JOINTS * 3)
    assert row.base is not None
    assert row.base.chi2 == pytest.approx(chi2 - 0.5 * along, rel=0.02)


def test_what_no_other_test_determines_is_not_scored() -> None:
    readings = read({"a": 40.0, "b": 60.0}, ("flexion", "extension", "bending"), zone=False)
    row = proof(readings).folds[2]
    assert (row.left_out, row.readings) == (LOAD_STEPS * JOINTS * 6, LOAD_STEPS * JOINTS * 6 - 2)
    assert "determine" in row.message
    assert row.base is not None
    assert row.base.rms < 1.3


def only_driven(one: SpecimenReadings) -> SpecimenReadings:
    """Only the driven coordinate was read, and not in the first step."""
    tests = []
    for test in one.tests:
        cycles = np.full_like(test.cycles, np.nan)
        at = BENDING if test.case.test == "bending" else EXTENSION
        cycles[:, 1:, :, at] = test.cycles[:, 1:, :, at]
        tests.append(Repeats(test.case, cycles))
    return replace(one, tests=tuple(tests))


@sweep("tests", [("flexion",), ("flexion", "bending")])
def test_load_steps_of_a_single_specimen_are_halved(tests: tuple[str, ...]) -> None:
    given = tuple(only_driven(one) for one in read({"a": 40.0}, tests, zone=True))
    result = proof(given, zone=True)
    assert [row.kind for row in result.folds] == [TEST] * (len(tests) > 1) * len(tests) + [STEPS]
    halves = result.by_kind()[STEPS]
    assert halves.closed is not None
    assert halves.closed > 0.9
    assert result.beats_base


def test_a_zone_that_other_tests_show_is_foreseen() -> None:
    readings = read({"a": 40.0, "b": 60.0}, ("flexion", "extension"), zone=True)
    result = proof(readings, zone=True)
    assert [(row.kind, row.name) for row in result.folds] == [
        (TEST, "flexion"),
        (TEST, "extension"),
        (SPECIMEN, "a"),
        (SPECIMEN, "b"),
    ]
    assert result.base is not None
    assert result.base.rms > 2.0
    assert result.with_effects is not None
    assert result.with_effects.rms < 1.25  # to first order a corner moves less well than refitted
    assert result.closed is not None
    assert result.closed > 0.9
    assert result.beats_base


def test_with_nothing_named_the_base_stands_in_for_the_model_with_effects() -> None:
    result = proof(read({"a": 40.0, "b": 60.0}, ("flexion", "extension"), zone=False))
    assert all(row.with_effects == row.base for row in result.folds)
    assert (result.beats_base, result.tells, result.over_base) == (False, False, 0.0)


def test_a_specimen_is_predicted_from_the_others_and_half_of_its_own_load_steps() -> None:
    """The zone is shared: with others less of a stays open than by half of its steps alone."""
    readings = read({"a": 40.0, "b": 60.0, "c": 50.0}, ("flexion",), zone=True)
    alone, all_three = proof(readings[:1], zone=True), proof(readings, zone=True)
    assert [(row.kind, row.name) for row in all_three.folds] == [(SPECIMEN, n) for n in "abc"]
    assert all_three.folds[0].left_out == LOAD_STEPS * JOINTS * 3
    assert all_three.folds[0].readings > alone.folds[0].readings
    closed = all_three.by_kind()[SPECIMEN].closed
    assert closed is not None
    assert closed > 0.9


def test_an_effect_of_one_specimen_alone_does_not_carry_over() -> None:
    """A zone that only one of three has, shared by all, predicts the other two worse."""
    (zone,) = read({"a": 40.0}, ("flexion", "extension"), zone=True)
    others = read({"b": 60.0, "c": 50.0}, ("flexion", "extension"), zone=False, seed=2)
    result = proof((zone, *others), zone=True)
    rows = {row.name: row for row in result.folds}
    assert [rows[name].worse for name in "abc"] == [False, True, True]


@sweep("shown, size", [(0.08, 1.0), (0.0, 0.03)])
def test_nuisances_are_as_large_as_the_cohort_shows_them(shown: float, size: float) -> None:
    """Gains of 8 % are as large as a prior SD of 5 % and more; of none, the least size is left."""
    readings = read({"a": 40.0}, ("flexion", "extension"), zone=False)
    gains = (1.0 + shown, 1.0 - shown)
    tests = [replace(t, cycles=g * t.cycles) for t, g in zip(readings[0].tests, gains, strict=True)]
    there = grounds((replace(readings[0], tests=tuple(tests)),), replace(NONE, load_gain=0.05))
    assert nuisance_size(there) == size


def test_a_tilt_that_the_training_shows_is_foreseen_in_the_unseen_test() -> None:
    """Read about axes turned by 3 degrees, extension shows bending, and so will flexion."""
    readings = read({"a": 40.0}, ("flexion", "extension"), zone=False)
    turn = Rotation.from_rotvec([0.0, 0.0, np.deg2rad(3.0)]).as_matrix()
    tests = []
    for test in readings[0].tests:
        parts = test.cycles[..., :3], test.cycles[..., 3:] @ turn.T
        tests.append(replace(test, cycles=np.concatenate(parts, axis=-1)))
    readings = (replace(readings[0], tests=tuple(tests)),)
    for prior, foreseen in ((0.0, False), (np.deg2rad(3.0), True)):
        there = grounds(readings, replace(NONE, registration=prior))
        row = held_out(there, there).folds[0]
        assert row.base is not None
        assert (row.base.rms < 1.3) is foreseen


# Folds of given chi2, each of ten readings ---------------------------------------------------


def row(name: str, base: float, effects: float, moved: float = 0.0) -> FoldRow:
    return FoldRow(name, TEST, 10, *(Gap(chi2, 10.0, 10) for chi2 in (base, effects)), moved)


UNTOLD = FoldRow("c", TEST, 10, None, None)


def test_folds_are_pooled_by_their_sums() -> None:
    rows = (row("a", 100.0, 12.0), row("b", 60.0, 9.0), UNTOLD)
    result = HeldOut(rows)
    assert result.base == Gap(160.0, 20.0, 20)
    assert result.closed == pytest.approx((160.0 - 21.0) / (160.0 - 20.0))
    assert rows[1].closed == 1.0  # no more than all of it
    assert result.over_base == 139.0
    nothing = HeldOut((UNTOLD,))
    assert (nothing.over_base, nothing.beats_base, nothing.tells) == (None, False, False)
    assert (nothing.closed, UNTOLD.worse, UNTOLD.readings) == (None, False, 0)
    assert result.of_base().with_effects == result.base


def test_kinds_are_told_apart() -> None:
    specimen = replace(row("s", 80.0, 40.0), kind=SPECIMEN)
    kinds = HeldOut((row("a", 100.0, 50.0), specimen, UNTOLD)).by_kind()
    assert {kind: of.over_base for kind, of in kinds.items()} == {TEST: 50.0, SPECIMEN: 40.0}


@sweep("before, after, told", [(4.27, 2.83, 0.34), (1.31, 0.23, 0.82)])
def test_a_share_of_the_excess_is_none_of_the_gap(before: float, after: float, told: float) -> None:
    """The gap is the root of the excess over what is expected."""
    one = row("a", *(10.0 * (1.0 + gap**2) for gap in (before, after)))
    assert one.base is not None
    assert one.base.gap == pytest.approx(before)
    assert one.closed == pytest.approx(1.0 - (after / before) ** 2)
    assert share_of_gap(one.closed) == pytest.approx(1.0 - after / before)
    assert share_of_gap(one.closed) == pytest.approx(told, abs=0.005)
    assert [share_of_gap(share) for share in (0.0, 1.0, -3.0)] == [0.0, 1.0, -1.0]


def test_nothing_is_closed_where_the_base_misses_no_more_than_noise() -> None:
    assert row("a", 11.0, 9.0).closed is None


@sweep("moved, sd", [(9.0, 6.0), (0.0, 0.0)])
def test_a_fold_is_worse_where_noise_would_make_it_so_once_in_160(moved: float, sd: float) -> None:
    """Two and a half SDs of 2 n d with noise n of SD one: one side of a normal has 0.62 %."""
    assert row("a", 100.0, 100.0 + 2.501 * sd + 1e-9, moved).worse
    assert not row("a", 100.0, 100.0 + 2.499 * sd, moved).worse
    assert not row("a", 100.0, 99.0 - 2.6 * sd, moved).worse


@sweep("differs, tells", [(2e-6, True), (-2e-6, True), (5e-7, False)])
def test_folds_tell_where_predictions_differ_by_a_millionth(differs: float, tells: bool) -> None:
    assert HeldOut((row("a", 100.0, 100.0 * (1.0 - differs)),)).tells is tells
