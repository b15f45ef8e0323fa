"""Folds of a linear model against the same fit by dense covariance matrices."""

from dataclasses import replace

import numpy as np
import pytest
from held_out_cases import cases, noise, noisy, serial

from spinepipe.effects.contract import Array
from spinepipe.studies.discrepancy.proof.fold_linear import LinearFolds, LinearModel, Tangent
from spinepipe.studies.discrepancy.proof.folds import (
    ChosenSteps,
    FoldFit,
    folds_by_specimen,
    folds_by_test,
    step_fold,
)
from spinepipe.studies.discrepancy.search.readings import Repeats, SpecimenReadings

pytestmark = pytest.mark.numeric

TESTS = ("flexion", "bending")
SHARED, OWN, NUISANCES = 2, 2, 3
SD = noise().sd[3]


def linear_model(specimens: tuple[str, ...]) -> tuple[LinearModel, dict[str, SpecimenReadings]]:
    """Random columns; the unknowns of all first, then two of each specimen; a broken cycle."""
    rng = np.random.default_rng(7)
    members, readings = {}, {}
    for number, name in enumerate(specimens):
        shapes = [(len(case.steps), 2, 6) for case in cases(TESTS)]
        own = SHARED + OWN * number + np.arange(OWN)
        columns = [SD * rng.normal(size=(*shape, SHARED + OWN + NUISANCES)) for shape in shapes]
        members[name] = Tangent(
            tuple(SD * rng.normal(size=shape) for shape in shapes),
            tuple(c[..., : SHARED + OWN] for c in columns),
            np.r_[np.arange(SHARED), own],
            tuple(c[..., SHARED + OWN :] for c in columns),
        )
        tests = [
            Repeats(case, noisy(2.0 * SD * rng.normal(size=shape), rng))
            for case, shape in zip(cases(TESTS), shapes, strict=True)
        ]
        tests[0].cycles[1, 3:, 0, 3] = np.nan
        readings[name] = SpecimenReadings(name, (), tuple(tests))
    count = SHARED + OWN * len(specimens)
    free = np.full(count, np.inf)
    prior = rng.normal(size=count), rng.uniform(0.5, 2.0, count)
    return LinearModel(members, *prior, -free, free), readings


class Dense:
    """One specimen's chosen readings with their covariance written out."""

    def __init__(self, one: Tangent, readings: SpecimenReadings, steps: tuple[Array, ...]) -> None:
        rows, blocks = [], []
        for test, chosen in enumerate(steps):
            repeats = readings.tests[test]
            for joint in range(2):
                for at in (3, 4, 5):
                    t = np.flatnonzero(chosen)
                    rows += [(test, step, joint, at) for step in t]
                    size = SD / np.sqrt(repeats.count[t, joint, at])
                    blocks.append(serial(len(chosen))[np.ix_(t, t)] * np.outer(size, size))
        self.noise = np.zeros((len(rows), len(rows)))
        start = 0
        for block in blocks:
            end = start + len(block)
            self.noise[start:end, start:end] = block
            start = end

        def taken(per_test: tuple[Array, ...]) -> Array:
            return np.array([per_test[test][step, j, at] for test, step, j, at in rows])

        self.x, self.z = taken(one.by_x), taken(one.nuisances)
        self.misfit = taken(tuple(t.mean for t in readings.tests)) - taken(one.predicted)
        self.whole = self.noise + self.z @ self.z.T

    def nuisances(self, move: Array) -> Array:
        left = self.misfit - self.x @ move
        return self.z.T @ np.linalg.solve(self.whole, left)


def explicit(
    model: LinearModel, dense: dict[str, Dense], free: Array, x: Array, with_nuisances: bool = True
) -> tuple[Array, Array]:
    """Most likely values of the free unknowns and their covariance."""
    precision, drive = np.diag(model.sd**-2.0), model.mean * model.sd**-2.0
    for name, one in dense.items():
        block = np.zeros((len(one.misfit), len(x)))
        block[:, model.members[name].numbers] = one.x
        weight = np.linalg.inv(one.whole if with_nuisances else one.noise)
        precision = precision + block.T @ weight @ block
        drive = drive + block.T @ weight @ one.misfit
    fixed = np.setdiff1d(np.arange(len(x)), free)
    drive = drive[free] - precision[np.ix_(free, fixed)] @ x[fixed]
    inside = precision[np.ix_(free, free)]
    moved = x.copy()
    moved[free] = np.linalg.solve(inside, drive)
    return moved, np.linalg.inv(inside)


def check(
    model: LinearModel, readings: dict[str, SpecimenReadings], part: FoldFit, x: Array
) -> None:
    predicted = LinearFolds(model, ChosenSteps(readings, noise())).predict(part)
    assert set(predicted.motion) == set(part.scored)
    for name in part.scored:
        one = model.members[name]
        dense = Dense(one, readings[name], part.training[name])
        move = x[one.numbers]
        z = dense.nuisances(move)
        for test in range(len(TESTS)):
            motion = one.predicted[test] + one.by_x[test] @ move
            assert predicted.motion[name][test] == pytest.approx(motion, rel=1e-9, abs=1e-12)
            added = one.nuisances[test] @ z
            assert predicted.nuisances[name][test] == pytest.approx(added, rel=1e-9, abs=1e-12)


def trained(
    model: LinearModel, readings: dict[str, SpecimenReadings], part: FoldFit
) -> dict[str, Dense]:
    return {
        name: Dense(one, readings[name], part.training[name]) for name, one in model.members.items()
    }


def test_a_left_out_test_is_fitted_without_it() -> None:
    model, readings = linear_model(("a", "b"))
    for fold in folds_by_test(readings, TESTS):
        (part,) = fold.parts
        every, none = np.arange(len(model.mean)), np.zeros(len(model.mean))
        x, _ = explicit(model, trained(model, readings, part), every, none)
        check(model, readings, part, x)


def test_a_left_out_specimen_fits_its_own_values_beside_those_of_the_others() -> None:
    model, readings = linear_model(("a", "b", "c"))
    fold = folds_by_specimen(readings)[1]
    assert (fold.name, len(fold.parts)) == ("b", 2)
    for part in fold.parts:
        dense = trained(model, readings, part)
        assert all(np.all(steps) for steps in part.training["a"])
        for training, scored in zip(part.training["b"], part.scored["b"], strict=True):
            assert (training ^ scored).all()
        others = {name: one for name, one in dense.items() if name != "b"}
        every, none = np.arange(len(model.mean)), np.zeros(len(model.mean))
        x, _ = explicit(model, others, every, none)
        own = np.arange(SHARED + OWN, SHARED + 2 * OWN)
        x, _ = explicit(model, {"b": dense["b"]}, own, x)
        check(model, readings, part, x)


def test_halves_of_the_steps_fit_everything_to_one_half() -> None:
    model, readings = linear_model(("a",))
    for part in step_fold(readings).parts:
        every, none = np.arange(len(model.mean)), np.zeros(len(model.mean))
        x, _ = explicit(model, trained(model, readings, part), every, none)
        check(model, readings, part, x)


def test_standard_errors_and_open_nuisances_are_those_of_the_training() -> None:
    model, readings = linear_model(("a", "b"))
    (part,) = folds_by_test(readings, TESTS)[0].parts
    dense = trained(model, readings, part)
    every, none = np.arange(len(model.mean)), np.zeros(len(model.mean))
    _, covariance = explicit(model, dense, every, none, with_nuisances=False)
    folds = LinearFolds(model, ChosenSteps(readings, noise()))
    for name, one in model.members.items():
        own = covariance[np.ix_(one.numbers, one.numbers)]
        se = np.sqrt(np.einsum("tjkm,mn,tjkn->tjk", one.by_x[0], own, one.by_x[0]))
        assert folds.standard_errors(part)[name][0] == pytest.approx(se)
        z, whole = dense[name].z, dense[name].whole
        left = np.eye(NUISANCES) - z.T @ np.linalg.solve(whole, z)
        assert folds.left_open(part)[name] == pytest.approx(left)


def test_unknowns_stay_inside_their_bounds_and_the_others_make_up_for_it() -> None:
    model, readings = linear_model(("a",))
    (part, _) = step_fold(readings).parts
    dense = trained(model, readings, part)
    every, none = np.arange(len(model.mean)), np.zeros(len(model.mean))
    x, _ = explicit(model, dense, every, none)
    low, high = model.low.copy(), model.high.copy()
    low[1], high[1] = (-10.0, 0.5 * x[1]) if x[1] > 0.0 else (0.5 * x[1], 10.0)
    at_bound = np.zeros(len(x))
    at_bound[1] = 0.5 * x[1]
    x, _ = explicit(model, dense, np.array([0, 2, 3]), at_bound)
    check(replace(model, low=low, high=high), readings, part, x)
