"""How large nuisances are in a cohort, which readings of a fold count, and where its fit starts."""

from collections.abc import Mapping
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from held_out_cases import SD, grounds, noise, read
from sweeps import sweep
from test_held_out_linear import TESTS, Dense, linear_model

from spinepipe.effects.contract import Array
from spinepipe.studies.discrepancy.proof import fold_models
from spinepipe.studies.discrepancy.proof.fold_linear import LinearModel, tangent
from spinepipe.studies.discrepancy.proof.fold_models import FoldModels, nuisance_size
from spinepipe.studies.discrepancy.proof.folds import (
    SPECIMEN,
    TEST,
    Fold,
    FoldFit,
    folds_by_test,
)
from spinepipe.studies.discrepancy.search.baseline import BaselineFit

pytestmark = pytest.mark.numeric

# How large nuisances are

MOVES = 40.0
"""Noise SDs by which one prior SD of a nuisance moves what is read."""


def left(errors: Mapping[str, Array]) -> Any:
    """Grounds whose fits leave that much of readings, in noise SD; nuisances move all but two."""
    grounds: Any = SimpleNamespace(readings={}, plain={}, setting=SimpleNamespace(whitenings={}))
    grounds.fit = SimpleNamespace(predicted={})
    for name, one in errors.items():
        mean = np.append(np.linspace(3.0, 9.0, len(one) + 2), np.nan)
        grounds.readings[name] = SimpleNamespace(tests=[SimpleNamespace(mean=mean)])
        grounds.fit.predicted[name] = [mean + np.array([*one, 70.0, -70.0, 0.0])]
        grounds.plain[name] = SimpleNamespace(noise_only=lambda rows: rows[0])
        directions = np.eye(len(one) + 3, len(one))
        sizes = np.full(len(one), MOVES)
        grounds.setting.whitenings[name] = SimpleNamespace(directions=directions, sizes=sizes)
    return grounds


def most_likely_at(size: float) -> float:
    """What is left of a reading, in noise SD, where its variance is that of such nuisances."""
    return float(np.sqrt(1.0 + (size * MOVES) ** 2))


@sweep("size", [0.03, 0.1, 0.2, 0.35, 0.6, 1.0])
def test_nuisances_are_as_large_as_what_is_left_says(size: float) -> None:
    errors = most_likely_at(size) * np.array([1.0, -1.0, 1.0])
    assert nuisance_size(left({"a": errors})) == size


def test_nuisances_are_no_larger_than_supposed_and_never_none() -> None:
    assert nuisance_size(left({"a": np.full(3, 9.0 * MOVES)})) == 1.0
    assert nuisance_size(left({"a": np.zeros(3)})) == 0.03


def test_all_readings_of_all_specimens_say_how_large() -> None:
    """Squares of 1.8 and 0.6 times as much in one and two directions: as much in the mean."""
    much = most_likely_at(0.2)
    few, many = np.sqrt(1.8) * much * np.ones(1), np.sqrt(0.6) * much * np.ones(2)
    assert nuisance_size(left({"a": few, "b": many})) == 0.2
    assert nuisance_size(left({"b": many, "a": few})) == 0.2
    assert nuisance_size(left({"a": np.sqrt(9.0) * much * np.ones(2), "b": many})) > 0.2


# Which readings count


def told(errors: Mapping[str, Array], kind: str) -> tuple[Array, FoldModels]:
    """Flags of one test's readings (SD 2, the last one not read), models with these errors."""
    models = FoldModels.__new__(FoldModels)
    sd = np.array([2.0, 2.0, 2.0, 0.0]).reshape(4, 1, 1)
    models.chosen = SimpleNamespace(sd=lambda specimen, test: sd)  # type: ignore[assignment]
    models.named = len(errors) > 1
    for name, one in errors.items():
        of_test = {"a": (one.reshape(4, 1, 1),)}
        setattr(models, name, SimpleNamespace(standard_errors=lambda part, of=of_test: of))
    steps = {"a": (np.array([True, True, False, True]),)}
    part = FoldFit({}, steps)
    return models._scored(Fold("f", kind, (part,)), part)["a"][0].ravel(), models


def test_a_reading_counts_where_its_prediction_is_surer_than_itself() -> None:
    sure, unsure = np.array([1.9, 2.0, 0.1, 0.0]), np.array([0.1, 0.1, 0.1, 0.0])
    assert told({"base": sure}, TEST)[0].tolist() == [True, False, False, False]
    assert told({"base": unsure}, TEST)[0].tolist() == [True, True, False, False]


def test_a_reading_counts_where_both_models_are_sure_of_it() -> None:
    one, other = np.array([9.0, 0.1, 0.1, 0.1]), np.array([0.1, 0.1, 0.1, 0.1])
    for errors in ({"base": one, "final": other}, {"base": other, "final": one}):
        assert told(errors, TEST)[0].tolist() == [False, True, False, False]


def test_all_that_was_read_counts_of_an_unseen_specimen() -> None:
    assert told({"base": np.full(4, 9.0)}, SPECIMEN)[0].tolist() == [True, True, False, False]


# Fits of a fold


def lin(at: BaselineFit) -> LinearModel:
    return tangent(at, 1.0)


@pytest.fixture(scope="module")
def two() -> BaselineFit:
    return grounds(read({"a": 40.0, "b": 60.0}, TESTS, zone=False))


def everything(at: BaselineFit) -> FoldFit:
    steps = {
        name: tuple(np.full(len(case.steps), True) for case in one.cases)
        for name, one in at.readings.items()
    }
    return FoldFit(steps, steps)


def test_a_fit_to_everything_ends_where_the_full_fit_did(two: BaselineFit) -> None:
    """Wherever it begins; what is held stays where it was put."""
    names, count = list(two.readings), len(two.fit.x)
    away = 0.2 * np.cos(np.arange(count))
    x, fit = fold_models._fitted(two, lin(two), everything(two), names, np.arange(count), away)
    assert x == pytest.approx(np.zeros(count), abs=1e-4)
    assert fit.chi2 == pytest.approx(two.fit.chi2, rel=1e-6)
    own = np.array(two.fit.hypothesis.members["b"].numbers)
    x, _ = fold_models._fitted(two, lin(two), everything(two), ["b"], own, away)
    others = np.setdiff1d(np.arange(count), own)
    assert (x[others] == away[others]).all()
    assert x[own] == pytest.approx(np.zeros(len(own)), abs=1e-4)


def test_bounds_and_priors_stay_where_they_are_as_fits_start_elsewhere(two: BaselineFit) -> None:
    """An unknown is its start and its move: what bounds one less far has that much more to go."""
    fit, model = two.fit, lin(two)
    away = 0.1 * np.sin(1.0 + np.arange(len(fit.x)))
    again = fold_models._again(
        fit, model, ["b"], np.array(fit.hypothesis.members["b"].numbers), away
    )
    for number, one in zip(fit.hypothesis.members["b"].numbers, again.unknowns, strict=True):
        before = fit.hypothesis.unknowns[number]
        gone = fit.x[number] + away[number]
        assert one.mean == pytest.approx(before.mean - gone, abs=1e-12)
        assert one.low == pytest.approx(before.low - gone, abs=1e-12)
        assert one.high == pytest.approx(before.high - gone, abs=1e-12)
    member = fit.hypothesis.members["b"]
    stiffness = again.members["b"].model.effects[0].values
    for parameter, number in zip(member.free, member.numbers, strict=True):
        row = parameter.rows[0]
        full = fit.models["b"].effects[0].values[row, parameter.column]
        moved = stiffness[row, parameter.column]
        assert moved == pytest.approx(full * np.exp(away[number]))  # moves are of logarithms


def test_nuisances_are_as_the_training_has_them_beside_the_fit() -> None:
    """By the covariance of the training's readings, written out."""
    model, readings = linear_model(("a",))
    (part,) = folds_by_test(readings, TESTS)[1].parts
    one = model.members["a"]
    at: Any = SimpleNamespace(readings=readings, noise=noise())
    fit: Any = SimpleNamespace(predicted={"a": one.predicted})
    found = fold_models._nuisances(at, model, part, "a", fit)
    z = Dense(one, readings["a"], part.training["a"]).nuisances(np.zeros(len(one.numbers)))
    for added, by_z in zip(found, one.nuisances, strict=True):
        assert added == pytest.approx(by_z @ z, rel=1e-9, abs=1e-9 * SD)
