"""Held-out folds of chains whose motion is known: moment over stiffness at every joint."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from held_out_cases import (
    CYCLES,
    JOINTS,
    MOMENTS_NM,
    NONE,
    SD,
    found,
    grounds,
    read,
    serial,
)
from scipy.spatial.transform import Rotation
from sweeps import sweep

from spinepipe.effects import PlaceSpread
from spinepipe.effects.contract import Array
from spinepipe.studies.discrepancy.proof import fold_models
from spinepipe.studies.discrepancy.proof.held_out import (
    NO_FIT,
    NOT_DETERMINED,
    SCORED,
    Asked,
    FoldRow,
    held_out,
    pool_folds,
)
from spinepipe.studies.discrepancy.search.gaps import Gap
from spinepipe.studies.discrepancy.search.joint_fit import joint_fit
from spinepipe.studies.discrepancy.search.readings import Repeats, SpecimenReadings
from spinepipe.studies.discrepancy.store import at_once
from spinepipe.studies.discrepancy.verdict import share_of_gap

STEPS = len(MOMENTS_NM)
EXTENSION, BENDING = 3, 4
GAIN = replace(NONE, load_gain=0.05)


def compliance(mean: Array, moments: Array) -> float:
    """Least squares of readings (T, J) over moments (T,), by hand."""
    weight = np.linalg.inv(serial(len(moments)))
    return float((moments @ weight @ mean).sum() / (JOINTS * moments @ weight @ moments))


def only_driven(one: SpecimenReadings) -> SpecimenReadings:
    """Only the driven coordinate was read, and not in the first step."""
    driven = {"flexion": EXTENSION, "extension": EXTENSION, "bending": BENDING}
    tests = []
    for test in one.tests:
        cycles = np.full_like(test.cycles, np.nan)
        at = driven[test.case.test]
        cycles[:, 1:, :, at] = test.cycles[:, 1:, :, at]
        tests.append(Repeats(test.case, cycles))
    return replace(one, tests=tuple(tests))


@sweep("refit", [False, True])
def test_unseen_flexion_follows_the_stiffness_in_extension(refit: bool) -> None:
    readings = read({"a": 40.0}, ("flexion", "extension", "bending"), zone=False)
    result = held_out(found(grounds(readings), False), Asked(refit=refit), at_once)
    flexion, extension = (test.mean for test in readings[0].tests[:2])
    by_hand = -MOMENTS_NM * compliance(extension[..., EXTENSION], MOMENTS_NM)
    predicted = result.motion["a"].base[0]
    assert predicted[..., EXTENSION] == pytest.approx(np.tile(by_hand[:, None], JOINTS), rel=2e-4)
    missed = flexion[..., 3:] - np.stack([by_hand, 0 * by_hand, 0 * by_hand], -1)[:, None]
    precision = CYCLES / SD**2 * np.linalg.inv(serial(STEPS))
    chi2 = np.einsum("tjk,tu,ujk->", missed, precision, missed)
    row = result.folds[0]
    assert (row.name, row.kind, row.status) == ("flexion", "test", SCORED)
    assert row.base is not None
    assert row.base.chi2 == pytest.approx(chi2, rel=1e-3)
    assert row.readings == row.left_out == STEPS * JOINTS * 3


def test_a_reading_that_no_other_test_determines_is_not_scored() -> None:
    readings = read({"a": 40.0, "b": 60.0}, ("flexion", "extension", "bending"), zone=False)
    result = held_out(found(grounds(readings), False), Asked(specimens=False), at_once)
    row = result.folds[2]
    loaded = (STEPS - 1) * JOINTS * 2  # bending under load, in two specimens
    assert (row.left_out, row.readings) == (STEPS * JOINTS * 6, STEPS * JOINTS * 6 - loaded)
    held = result.motion["a"]
    assert (held.fold[2][1:, :, BENDING] == -1).all()
    assert np.isnan(held.base[2][1:, :, BENDING]).all()
    assert (held.fold[2][:, :, EXTENSION] == 2).all()
    assert "determine" in row.message


def test_steps_are_halved_where_one_specimen_has_no_test_that_others_determine() -> None:
    readings = [only_driven(one) for one in read({"a": 40.0}, ("flexion", "bending"), zone=False)]
    result = held_out(found(grounds(readings), False), Asked(), at_once)
    kinds = [(row.kind, row.status, row.readings) for row in result.folds]
    test = ("test", NOT_DETERMINED, 0)
    assert kinds == [test, test, ("steps", SCORED, 2 * JOINTS * (STEPS - 1))]
    mean = readings[0].tests[0].mean[..., EXTENSION]
    odd, even = np.arange(1, STEPS, 2), np.arange(2, STEPS, 2)  # none of step 0
    weight = np.linalg.inv(serial(STEPS)[np.ix_(even, even)])
    m = -MOMENTS_NM[even]
    by_hand = (m @ weight @ mean[even]).sum() / (JOINTS * m @ weight @ m)
    predicted = result.motion["a"].base[0][odd, :, EXTENSION]
    assert predicted == pytest.approx(np.outer(-MOMENTS_NM[odd], [by_hand] * JOINTS), rel=2e-4)


def test_a_left_out_specimen_has_the_others_zone_and_its_own_stiffness() -> None:
    specimens = {"a": 40.0, "b": 60.0}
    readings = read(specimens, ("flexion", "extension", "bending"), zone=True)
    base = grounds(readings)
    result = held_out(found(base, True), Asked(tests=False), at_once)
    assert [(row.kind, row.name) for row in result.folds] == [("specimen", n) for n in specimens]
    assert all(row.readings == 3 * STEPS * JOINTS * 3 for row in result.folds)
    assert result.base is not None
    assert result.base.rms > 2.0
    assert result.with_effects is not None
    assert result.with_effects.rms < 1.25  # to first order a corner moves less well than refitted
    assert result.closed is not None
    assert result.closed > 0.9
    assert result.beats_base
    for row in result.folds:
        assert row.surrogate is not None
        assert row.with_effects is not None
        assert row.with_effects.chi2 < row.surrogate.chi2
    other = held_out(found(base, True), Asked(tests=False, refit=True), at_once)
    assert other.with_effects is not None
    assert result.with_effects.rms == pytest.approx(other.with_effects.rms, abs=0.15)
    assert other.with_effects.rms < 1.15


@sweep("spread", [PlaceSpread.BY_SPECIMEN, PlaceSpread.EACH])
def test_strengths_of_a_left_out_specimen_start_where_the_full_fit_has_them(
    spread: PlaceSpread,
) -> None:
    # not where the other specimens leave them: switched off, at a bound, and there to stay
    readings = read({"a": 40.0, "b": 60.0}, ("flexion", "bending"), zone=True)
    search = found(grounds(readings), True, spread)
    linear, refit = (
        held_out(search, Asked(tests=False, refit=anew), at_once) for anew in (False, True)
    )
    for one, other in zip(linear.folds, refit.folds, strict=True):
        assert one.with_effects is not None
        assert other.with_effects is not None
        assert other.with_effects.rms == pytest.approx(one.with_effects.rms, abs=0.15)
        assert other.with_effects.rms < 1.2


def test_with_nothing_named_the_base_stands_in_for_the_model_with_effects() -> None:
    readings = read({"a": 40.0, "b": 60.0}, ("flexion", "extension"), zone=False)
    result = held_out(found(grounds(readings), False), Asked(), at_once)
    assert len(result.folds) == 4
    assert all(row.with_effects == row.base for row in result.folds)
    assert (result.closed, result.beats_base) == (None, False)
    assert result.over_base == 0.0
    assert (result.motion["b"].fold[0][..., 3:] == 0).all()  # the test's fold, not the specimen's


@sweep("shown, size", [(0.08, 1.0), (0.0, 0.03)])
def test_a_load_gain_found_in_one_test_says_nothing_of_another(shown: float, size: float) -> None:
    """Gains of 8 % are as large as a prior SD of 5 % and more; of none, the least size is left."""
    readings = read({"a": 40.0}, ("flexion", "extension"), zone=False)
    gains = (1.0 + shown, 1.0 - shown)
    tests = [replace(t, cycles=g * t.cycles) for t, g in zip(readings[0].tests, gains, strict=True)]
    readings = (replace(readings[0], tests=tuple(tests)),)
    result = held_out(found(grounds(readings, GAIN), False), Asked(), at_once)
    # a gain of 5 % in the unseen test: 0.05 x motion, in noise SDs of the mean
    signed = zip((-1.0, 1.0), readings[0].tests, strict=True)
    both = np.mean([compliance(t.mean[..., 3], side * MOMENTS_NM) for side, t in signed])
    motion = size * 0.05 * MOMENTS_NM * both
    precision = CYCLES / SD**2 * np.linalg.inv(serial(STEPS))
    left_open = JOINTS * motion @ precision @ motion
    row = result.folds[0]
    assert row.expected - row.readings == pytest.approx(left_open, rel=0.05)


@sweep("refit", [False, True])
def test_a_tilt_that_the_training_shows_is_foreseen_in_the_unseen_test(refit: bool) -> None:
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
        row = held_out(found(there, False), Asked(refit=refit), at_once).folds[0]
        assert row.base is not None
        assert (row.base.rms < 1.3) is foreseen


def test_a_fold_without_a_fit_says_why(monkeypatch: pytest.MonkeyPatch) -> None:
    def refused(*args: Any) -> Any:
        return replace(joint_fit(*args), residuals={}, status="no stable pose")

    readings = read({"a": 40.0}, ("flexion", "extension"), zone=False)
    without = found(grounds(readings), False)
    monkeypatch.setattr(fold_models, "joint_fit", refused)
    result = held_out(without, Asked(refit=True), at_once)
    assert [(one.status, one.message) for one in result.folds[:2]] == [
        (NO_FIT, "no stable pose")
    ] * 2
    assert result.base is None
    assert (result.motion["a"].fold[0] == -1).all()


def row(name: str, base: float, effects: float, other: float) -> FoldRow:
    gaps = [Gap(chi2, 10.0, 10) for chi2 in (base, effects, other)]
    return FoldRow(name, "test", 10, 10, *gaps, 11.0, SCORED, "")


def test_folds_are_pooled_by_their_sums() -> None:
    rows = [row("a", 100.0, 12.0, 30.0), row("b", 60.0, 9.0, 8.0), row("c", 80.0, 15.0, 40.0)]
    result = pool_folds(rows, {})
    assert result.base == Gap(240.0, 30.0, 30)
    # noise and open nuisances make 11 of each fold's chi2
    assert result.closed == pytest.approx((240.0 - 36.0) / (240.0 - 33.0))
    assert rows[1].closed == 1.0  # no more than all of it
    assert result.over_base == 204.0
    nothing = pool_folds([], {})
    assert (nothing.over_base, nothing.beats_base, nothing.tells) == (None, False, False)


def test_tests_and_specimens_left_out_are_told_apart() -> None:
    rows = [row("a", 100.0, 50.0, 30.0), row("b", 60.0, 30.0, 8.0)]
    rows += [
        replace(row("s", 80.0, 40.0, 30.0), kind="specimen"),
        replace(rows[0], base=None, with_effects=None, surrogate=None),
    ]
    found = pool_folds(rows, {}).by_kind()
    assert list(found) == ["test", "specimen"]
    assert found["test"].closed == pytest.approx((160.0 - 80.0) / (160.0 - 22.0))
    assert found["specimen"].closed == pytest.approx(40.0 / 69.0)
    assert len(found["test"].folds) == 2


@sweep("before, after, told", [(4.27, 2.83, 0.34), (1.31, 0.23, 0.82)])
def test_a_share_of_the_excess_is_none_of_the_gap(before: float, after: float, told: float) -> None:
    """The gap is the root of the excess over what is expected."""
    base, effects = (10.0 * (1.0 + gap**2) for gap in (before, after))
    one = replace(row("a", base, effects, 0.0), expected=10.0)
    assert one.base is not None
    assert one.base.against(10.0).gap == pytest.approx(before)
    assert one.closed == pytest.approx(1.0 - (after / before) ** 2)
    assert share_of_gap(one.closed) == pytest.approx(1.0 - after / before)
    assert share_of_gap(one.closed) == pytest.approx(told, abs=0.005)
    assert [share_of_gap(share) for share in (0.0, 1.0, -3.0)] == [0.0, 1.0, -1.0]


def test_nothing_is_closed_where_the_base_misses_no_more_than_it_may() -> None:
    assert row("a", 11.0, 9.0, 9.0).closed is None  # noise
    assert replace(row("a", 100.0, 12.0, 30.0), expected=101.0).closed is None  # nuisances
