"""What a held-out proof says of chi2 that is given."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from sweeps import sweep
from test_held_out import row
from test_held_out_linear import linear_model

from spinepipe.studies.discrepancy.proof import held_out
from spinepipe.studies.discrepancy.proof.fold_linear import FoldPrediction, _bounded
from spinepipe.studies.discrepancy.proof.fold_models import Predictions
from spinepipe.studies.discrepancy.proof.folds import (
    SPECIMEN,
    STEPS,
    TEST,
    folds_by_specimen,
    folds_by_test,
    only,
    step_fold,
)
from spinepipe.studies.discrepancy.proof.held_out import (
    HeldOutMotion,
    fill,
    pool_folds,
)
from spinepipe.studies.discrepancy.search.gaps import Gap

# Margins


def worse_by(drop: float, moved: float, expected: float) -> bool:
    """Ten readings: the effects' chi2 is larger by that; predictions differ by ``moved``."""
    one = row("a", 100.0, 100.0 + drop, 0.0)
    return replace(one, moved=moved, expected=expected).worse


@sweep(
    "moved, expected, sd",
    [
        (9.0, 10.0, 6.0),  # of 2 n d with noise n of SD one: 2 |d|
        (9.0, 40.0, 12.0),  # nuisances that are left open are noise too
        (9.0, 5.0, 6.0),  # noise is never less than itself
        (0.0, 10.0, 0.0),
    ],
)
def test_a_fold_is_worse_where_noise_would_make_it_so_once_in_160(
    moved: float, expected: float, sd: float
) -> None:
    """Two and a half SDs: one side of a normal has 0.62 % beyond."""
    assert worse_by(2.501 * sd + 1e-9, moved, expected)
    assert not worse_by(2.499 * sd, moved, expected)
    assert not worse_by(-2.6 * sd - 1.0, moved, expected)  # better


def test_what_was_not_scored_is_not_worse() -> None:
    one = replace(row("a", 10.0, 900.0, 0.0), moved=1.0)
    assert one.worse
    assert not replace(one, base=None).worse
    assert not replace(one, with_effects=None).worse


def test_a_model_beats_another_by_any_margin_and_equals_do_not() -> None:
    for effects, beats in ((99.0, True), (100.0, False), (101.0, False)):
        assert pool_folds([row("a", 100.0, effects, 0.0)], {}).beats_base is beats


@sweep("differs, tells", [(2e-6, True), (-2e-6, True), (5e-7, False)])
def test_folds_tell_where_predictions_differ_by_a_millionth(differs: float, tells: bool) -> None:
    found = pool_folds([row("a", 100.0, 100.0 * (1.0 - differs), 0.0)], {})
    assert found.tells is tells


def test_the_share_closed_is_of_what_is_above_what_is_expected() -> None:
    """With chi2 of 100 in 10 readings and 20 expected, 60 close half."""
    one = replace(row("a", 100.0, 60.0, 0.0), expected=20.0)
    assert one.closed == pytest.approx(0.5)
    assert replace(one, with_effects=Gap(140.0, 10.0, 10)).closed == pytest.approx(-0.5)
    assert replace(one, expected=100.0).closed is None
    assert replace(one, expected=99.0).closed == 1.0
    assert replace(one, base=None).closed is None
    assert replace(one, with_effects=None).closed is None


def test_of_the_base_alone_there_is_nothing_that_beats_it() -> None:
    one = np.zeros((1, 1, 6))
    sheet = HeldOutMotion((np.zeros((1, 1, 6), dtype=int),), (one,), (one + 1.0,))
    found = pool_folds([row("a", 100.0, 12.0, 30.0)], {"a": sheet}).of_base()
    assert found.with_effects == found.base
    assert found.folds[0].with_effects == found.folds[0].base
    assert found.motion["a"].with_effects[0] is found.motion["a"].base[0]


# What is entered, and whitened


def test_a_reading_is_entered_by_the_first_fold_that_predicts_it() -> None:
    """Two readings; the first fold scores one of them, the second both."""
    shape = (1, 1, 2)
    nan = np.full(shape, np.nan)
    sheet = HeldOutMotion((np.full(shape, -1),), (nan.copy(),), (nan.copy(),))

    def predicted(scored: list[bool], base: float, effects: float) -> Predictions:
        placed = [FoldPrediction({"a": (np.full(shape, v),)}, {}) for v in (base, effects)]
        return Predictions({"a": (np.array(scored).reshape(shape),)}, *placed, None, 0.0)

    fill({"a": sheet}, 0, predicted([True, False], 1.0, 2.0))
    assert sheet.fold[0].ravel().tolist() == [0, -1]
    assert np.isnan(sheet.base[0].ravel()).tolist() == [False, True]
    fill({"a": sheet}, 1, predicted([True, True], 3.0, 4.0))
    assert sheet.fold[0].ravel().tolist() == [0, 1]
    assert sheet.base[0].ravel().tolist() == [1.0, 3.0]
    assert sheet.with_effects[0].ravel().tolist() == [2.0, 4.0]


def whitened(rows: list[Any]) -> Any:
    return 2.0 * np.concatenate([one.ravel() for one in rows])


def test_models_differ_by_what_both_predict_and_nuisances_are_part_of_it() -> None:
    """Noise of SD one half: residuals count twice, squares four times."""
    shape = (1, 1, 2)
    motion = np.array([1.0, 2.0]).reshape(shape)
    base = FoldPrediction({"a": (motion,)}, {"a": (0.5 * motion,)})
    other = FoldPrediction({"a": (motion + 1.0,)}, {"a": (0.0 * motion,)})
    chosen: Any = SimpleNamespace(
        mean=lambda name, test: np.full(shape, 4.0),
        whitening=lambda name, test, there: SimpleNamespace(noise_only=whitened),
    )
    scored = {"a": (np.ones(shape, dtype=bool),)}
    part = Predictions(scored, base, other, None, 0.0)
    gap = held_out.scored_gap(chosen, [(scored, base)])
    assert gap == Gap(4.0 * ((4.0 - 1.5) ** 2 + (4.0 - 3.0) ** 2), 2.0, 2)
    # 1.5 and 3 by the base, 2 and 3 by the other
    assert held_out._moved(chosen, part) == pytest.approx(4.0 * 0.25)
    none = {"a": (np.zeros(shape, dtype=bool),)}
    assert held_out.scored_gap(chosen, [(none, base)]) == Gap(0.0, 0.0, 0)
    assert held_out._moved(chosen, replace(part, scored=none)) == 0.0


# Folds


def test_what_is_left_out_needs_something_that_trains() -> None:
    _, readings = linear_model(("a", "b"))
    alone = {"a": readings["a"]}
    assert folds_by_test(readings, ("flexion",)) == ()
    assert folds_by_specimen(alone) == ()
    assert [f.kind for f in folds_by_test(readings, ("flexion", "bending"))] == [TEST, TEST]
    assert [f.kind for f in folds_by_specimen(readings)] == [SPECIMEN, SPECIMEN]
    assert step_fold(alone).kind == STEPS


def test_halves_are_even_steps_and_odd_ones() -> None:
    _, readings = linear_model(("a", "b"))
    first, second = step_fold(readings).parts
    for name in readings:
        for test in range(2):
            assert np.flatnonzero(first.training[name][test]).tolist() == [0, 2, 4]
            assert np.flatnonzero(first.scored[name][test]).tolist() == [1, 3, 5]
            assert (first.training[name][test] == second.scored[name][test]).all()
    of_b = folds_by_specimen(readings)[1]
    for part, trains in zip(of_b.parts, ([0, 2, 4], [1, 3, 5]), strict=True):
        assert part.apart == "b"
        assert set(part.scored) == {"b"}
        assert np.flatnonzero(part.training["b"][0]).tolist() == trains
        assert np.flatnonzero(~part.scored["b"][0]).tolist() == trains
        assert all(steps.all() for steps in part.training["a"])


def test_some_readings_of_a_test_are_kept_by_step_or_by_place() -> None:
    _, readings = linear_model(("a",))
    test = readings["a"].tests[1]
    steps = np.array([True, False, True, False, False, True])
    kept = np.isfinite(only(test, steps).cycles[..., 3])
    assert (kept == steps[:, None]).all()
    places = np.zeros(test.count.shape, dtype=bool)
    places[2, 1, 4] = True
    assert np.argwhere(np.isfinite(only(test, places).cycles[0])).tolist() == [[2, 1, 4]]


@sweep("units", [1.0, 1e6])
def test_a_minimum_inside_bounds_is_that_of_the_other_unknown_alone(units: float) -> None:
    """x'Ax / 2 - d'x with A = [[2, 1], [1, 2]], d = (3, 3): (1, 1); at x0 = 0.5, x1 is 1.25."""
    scale = np.diag([1.0, units])
    matrix, drive = scale @ np.array([[2.0, 1.0], [1.0, 2.0]]) @ scale, scale @ np.full(2, 3.0)
    wide = np.full(2, 1e9)
    assert scale @ _bounded(matrix, drive, -wide, wide) == pytest.approx([1.0, 1.0])
    below, above = np.array([0.5, 1e9]), np.array([1.4, -1e9])
    assert scale @ _bounded(matrix, drive, -wide, below) == pytest.approx([0.5, 1.25])
    assert scale @ _bounded(matrix, drive, above, wide) == pytest.approx([1.4, 0.8])
