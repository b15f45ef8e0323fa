"""Fits of models with effects of every kind: exact Jacobians, and friction that is found back.

Catches a wrong Jacobian of a model with effects, and memory carried from cycle to cycle.
"""

from dataclasses import replace

import numpy as np
import pytest
from example_effects import (
    POINTS,
    CubicStiffening,
    ExtraWeight,
    FollowerLoad,
    JointCentreOffset,
    Laxity,
    MarkerError,
    loaded,
    scoped,
    solved_poses,
    spine,
)
from path_effect_cases import branches, creeping, friction, turning

from spinepipe.calibration import Evaluator, MeasuredCase, Problem, fit
from spinepipe.effects.contract import Array
from spinepipe.model import ScopedEffect, SpineModel
from spinepipe.statics import FreeParameter, free_parameters, with_parameters
from spinepipe.status import Status

EVERYWHERE = (0, 1, 2)
ROTATIONS = ("extension_nm_per_rad", "right_bending_nm_per_rad", "left_rotation_nm_per_rad")
READING_ERROR = np.array([2e-5] * 3 + [np.deg2rad(0.05)] * 3)
"""(6,) m and rad."""

WEIGHTS = 1.0 / np.array([0.02] * 3 + [0.05] * 3) ** 2
"""Of squared errors in mm2 and deg2."""


def everything(on: bool) -> tuple[ScopedEffect, ...]:
    """Effects of all kinds with values that act, or with strengths where they do nothing."""
    share = 1.0 if on else 0.0
    stiff = scoped(CubicStiffening(), EVERYWHERE)
    return (
        *([stiff] if on else []),  # logarithmic: it has no off
        friction(3, 0.5 * share),
        friction(2, 0.3 * share, 2.0, "right_bending"),
        creeping(3, 0.3 * share, 3.0),
        replace(creeping(3, 0.2 * share, 5.0, "left_rotation"), tests=("other",)),
        scoped(Laxity(), EVERYWHERE, (0.1 * share,)),
        scoped(JointCentreOffset(), EVERYWHERE, (0.008 * share, -0.006 * share)),
        *([scoped(ExtraWeight(POINTS), EVERYWHERE)] if on else []),
        scoped(FollowerLoad(2, POINTS[2]), EVERYWHERE, (60.0 * share,)),
        scoped(MarkerError(), EVERYWHERE, (1.0 + 0.1 * share, 0.02 * share)),
    )


def unknowns(model: SpineModel) -> tuple[FreeParameter, ...]:
    """Three stiffnesses, and every parameter of the effects: joint by joint or shared."""
    free = free_parameters(model, 0, ROTATIONS, "per_specimen")
    for number, here in enumerate(model.effects[1:], start=1):
        names = [parameter.name for parameter in here.effect.parameters]
        grouping = "per_joint" if number % 2 and here.effect.per_joint else "per_specimen"
        free += free_parameters(model, number, names, grouping)
    return free


def problem_of(effects: tuple[ScopedEffect, ...], zeroed: bool, correlated: bool) -> Problem:
    """Two cycles of a test and another test, measured anywhere."""
    model, rng = spine(3, effects=effects), np.random.default_rng(5)
    once = loaded(model, 4)
    cases = (once, replace(once, cycle=2), replace(loaded(model, 3), test="other"))
    measured = [0.02 * rng.normal(size=(len(case.steps), 3, 6)) for case in cases]
    measured[0][1, 2] = np.nan
    free = unknowns(model)
    readings = tuple(
        MeasuredCase(case, here - here[0] if zeroed else here, zeroed)
        for case, here in zip(cases, measured, strict=True)
    )
    bounds = np.full(len(free), 1e3)
    return Problem(model, readings, free, WEIGHTS, -bounds, bounds, correlated=correlated)


@pytest.mark.parametrize(
    ("on", "zeroed", "correlated"),
    [(True, False, False), (False, True, False), (True, True, True)],
    ids=["acting, as read", "off, zeroed", "acting, whitened"],
)
def test_the_jacobian_is_the_slope_of_the_residuals(
    on: bool, zeroed: bool, correlated: bool
) -> None:
    problem = problem_of(everything(on), zeroed, correlated)
    evaluator, m = Evaluator(problem), len(problem.free)
    jacobian = evaluator.at(np.zeros(m)).jacobian
    size = np.linalg.norm(jacobian, axis=0)
    for unknown, here in zip(problem.free, size, strict=True):
        name = unknown.label.partition("@")[0]
        silent = not on and name in ("yield_angle", "time", "spread")
        # a shape says nothing while it is off, and the bias is gone from what was zeroed
        assert (here == 0.0) == (silent or (zeroed and name == "bias")), unknown.label
    # all unknowns alike in what they do, inwards: most strengths are off at the end of what is
    # allowed; differences of fourth order
    reach = np.minimum(0.02 * problem.scale, 0.5 / np.maximum(size, 1e-9))
    for mixture in np.random.default_rng(7).uniform(0.2, 1.0, (1, m)) * reach:
        at = [evaluator.at(number * mixture).residual for number in range(5)]
        expected = np.tensordot([-25.0, 48.0, -36.0, 16.0, -3.0], at, 1) / 12.0
        scale = np.abs(expected).max()
        np.testing.assert_allclose(jacobian @ mixture, expected, rtol=0, atol=1e-5 * scale)


def test_the_memory_of_a_cycle_does_not_reach_the_next() -> None:
    problem = problem_of(everything(on=True), zeroed=False, correlated=False)
    evaluation = Evaluator(problem).at(np.zeros(len(problem.free)))
    np.testing.assert_array_equal(evaluation.poses[1], evaluation.poses[0])


def with_friction(moment: float, yield_deg: float, stiffer: float = 1.0) -> SpineModel:
    """Three joints with friction in extension."""
    model = spine(3, effects=(friction(3, moment, yield_deg),))
    values = model.effects[0].values * np.repeat([1.0, stiffer], 3)
    return model.with_effects((model.effects[0].with_values(values), model.effects[1]))


def friction_problem(start: SpineModel, truth: SpineModel, noise: Array) -> Problem:
    """Loading, unloading and loading again of one model, to be fitted by another."""
    case = turning(truth, branches(7.5, 10))
    poses = solved_poses(truth, case)
    measured = poses + noise * np.random.default_rng(11).normal(size=poses.shape)
    free = free_parameters(start, 0, ROTATIONS, "per_specimen")
    free += free_parameters(start, 1, ("moment", "yield_angle"), "per_specimen")
    bounds = np.full(len(free), 25.0)
    return Problem(start, (MeasuredCase(case, measured),), free, WEIGHTS, -bounds, bounds)


STARTS = [(0.5, 1.0), (0.05, 1.0), (3.0, 0.2)]
TRUTHS = [(0.8, 0.6), (0.3, 2.0)]


@pytest.mark.parametrize(
    ("truth", "start"),
    [
        (TRUTHS[1], STARTS[1]),
        *(
            pytest.param(truth, start, marks=pytest.mark.full)
            for truth in TRUTHS
            for start in STARTS
            if (truth, start) != (TRUTHS[1], STARTS[1])
        ),
    ],
)
def test_stiffness_and_friction_come_back_from_loading_and_unloading(truth, start) -> None:
    there = with_friction(*truth)
    found = fit(friction_problem(with_friction(*start, stiffer=1.6), there, np.zeros(6)))
    assert found.status is Status.CONVERGED
    np.testing.assert_allclose(np.exp(found.x[:3]) * 1.6, 1.0, rtol=1e-6)
    np.testing.assert_allclose(found.values[3:], [truth[0], np.deg2rad(truth[1])], rtol=1e-5)


def test_friction_in_noisy_readings_is_found_within_its_error() -> None:
    problem = friction_problem(with_friction(0.2, 1.5, 1.6), with_friction(0.5, 1.0), READING_ERROR)
    found = fit(problem, noise=READING_ERROR)
    assert found.status is Status.CONVERGED
    readings = problem.cases[0].measured.size
    assert 0.8 < found.cost / (readings - 5) < 1.2
    truth = with_parameters(problem.model, problem.free, found.x).effects[1].values[0]
    away = [truth[0] - 0.5, np.log(truth[1] / np.deg2rad(1.0))]
    errors = found.uncertainty.standard_error[3:]
    assert (np.abs(away) < 3.5 * errors).all()
    assert (errors < [0.02, 0.1]).all()
