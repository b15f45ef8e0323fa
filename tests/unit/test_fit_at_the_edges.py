"""Fits where honesty is easily lost: at the brink of stability, and on zeroed readings.

Catches a fit called good at the brink of stability, and a zeroed reading that counts.
"""

from dataclasses import replace

import numpy as np
import pytest

from spinepipe.calibration import MeasuredCase, Problem, fit
from spinepipe.calibration.fit import TIPPED, _start_points
from spinepipe.calibration.pooling import PoolMember
from spinepipe.effects import Wrench, create
from spinepipe.frames import Pose
from spinepipe.model import Body, LoadCase, LoadStep, RefusedModel, ScopedEffect, SpineModel
from spinepipe.statics import Program, System, follow, free_parameters, settle
from spinepipe.status import Status
from spinepipe.world import Chain

STIFFNESS = np.array([1e5, 1e6, 1e5, 20.0, 20.0, 20.0])
ANGLES = np.array([0.0, 0.0, 0.0, 1.0, 1.0, 1.0])
ROTATIONS = ("extension_nm_per_rad", "right_bending_nm_per_rad", "left_rotation_nm_per_rad")
TOP = np.array([0.02, 0.1, 0.0])


def joint() -> SpineModel:
    """One weightless joint under a body of 0.1 kg."""
    bushing = ScopedEffect(create("linear_bushing"), (0,), STIFFNESS[None])
    return SpineModel(
        specimen="one",
        joints=("L3L4",),
        frames=(Pose(np.eye(3), np.zeros(3)),),
        bodies=(Body("L3", 0.1, np.array([0.0, 0.03, 0.0]), 1e-5 * np.eye(3)),),
        gravity=np.zeros(3),
        damping=np.array([[1e3] * 3 + [1.4] * 3]),
        effects=(bushing,),
    )


def compression(*shares: float) -> LoadCase:
    """100 N downwards, 20 mm in front of the joint and 100 mm above it, in steps."""
    push = np.array([0.0, -100.0, 0.0])
    steps = [(Wrench(0, TOP, share * push, np.zeros(3)),) for share in shares]
    return LoadCase("flexion", 1, tuple(LoadStep(n, w) for n, w in enumerate(steps)))


def problem(case: LoadCase, extension_deg: list[float], zeroed: bool = False) -> Problem:
    """Extension stiffness to be found from extension angles by load step, NaN: not measured."""
    model = joint()
    measured = np.full((len(extension_deg), 1, 6), np.nan)
    measured[:, 0, 3] = np.deg2rad(extension_deg)
    free = free_parameters(model, 0, ["extension_nm_per_rad"], "per_specimen")
    reach = np.array([np.log(1000.0)])
    return Problem(model, (MeasuredCase(case, measured, zeroed),), free, ANGLES, -reach, reach)


def test_a_coordinate_that_is_not_fitted_and_gives_way_is_named() -> None:
    """100 N at 0.1 m bend more than 2 N m/rad bear, however stiff in extension the joint is."""
    asked = problem(compression(0.1, 1.0), [0.2, 2.0])
    soft = STIFFNESS.copy()
    soft[4] = 2.0
    bushing = asked.model.effects[0].with_values(soft[None])
    asked = replace(asked, model=replace(asked.model, effects=(bushing,)))
    gives_way = "(tips over under the load of step 1: right bending of L3L4 loses stability"
    found = fit(asked)
    assert found.status is Status.UNSTABLE
    assert found.message.startswith(f"{TIPPED} {gives_way}")
    member = PoolMember(asked, np.zeros(1), None)
    assert member.result(np.zeros(1), np.eye(1), 0.0).message == found.message


@pytest.mark.parametrize(("above_mm", "stiffness"), [(0.0, 149.0), (20.0, 107.0)])
def test_translations_are_those_of_the_origin(above_mm: float, stiffness: float) -> None:
    """As docs/cohort-format.md has it: a point above it moves by what the joint turns, too."""
    model, push = joint(), np.array([10.0, 0.0, 0.0])
    values = np.array([[149e3, 1e6, 1e5, 152.0, 20.0, 20.0]])
    model = replace(model, effects=(model.effects[0].with_values(values),))
    wrench = Wrench(0, np.array([0.0, 0.02, 0.0]), push, np.zeros(3))
    measured = np.full((1, 1, 6), np.nan)
    measured[0, 0, 0] = 10.0 / 149e3 + 10.0 * 0.02 / 152.0 * above_mm / 1e3  # m
    case = MeasuredCase(LoadCase("shear", 1, (LoadStep(0, (wrench,)),)), measured)
    free = free_parameters(model, 0, ["anterior_n_per_m"], "per_specimen")
    found = fit(Problem(model, (case,), free, 1.0 - ANGLES, np.array([-3.0]), np.array([3.0])))
    assert found.values[0] / 1e3 == pytest.approx(stiffness, abs=0.5)


def test_further_starts_are_a_latin_hypercube_that_hangs_on_the_seed() -> None:
    """One in each slice of what bounds leave of a factor of 30, for every unknown."""
    model, many = joint(), 8
    free = free_parameters(model, 0, ROTATIONS, "per_joint")
    low, high = np.log([0.5, 1e-4, 0.01]), np.log([1e4, 2.0, 50.0])
    case = MeasuredCase(compression(1.0), np.zeros((1, 1, 6)))
    spread = Problem(model, (case,), free, ANGLES, low, high)
    first, *further = _start_points(spread, many + 1, seed=5)
    assert not first.any()
    within = np.log([0.5, 1.0 / 30.0, 1.0 / 30.0]), np.log([30.0, 2.0, 30.0])
    slices = np.floor(many * (np.array(further) - within[0]) / (within[1] - within[0]))
    np.testing.assert_array_equal(np.sort(slices, axis=0), np.tile(np.arange(many)[:, None], 3))
    again, other = (_start_points(spread, many + 1, seed=seed)[1:] for seed in (5, 6))
    np.testing.assert_array_equal(again, further)
    assert np.abs(np.array(other) - further).min() > 0.0
    assert len(_start_points(spread, 1, seed=5)) == 1


def test_the_brink_of_stability_is_no_optimum() -> None:
    """The measured angle is beyond any stable pose: softer always fits better, then it tips."""
    found = fit(problem(compression(1.0), [-85.0]))
    assert found.status is Status.NOT_CONVERGED
    assert "tip" in found.message


def test_the_zero_of_a_zeroed_step_is_no_reading() -> None:
    found = fit(problem(compression(0.0, 1.0), [0.0, -7.0], zeroed=True))
    assert found.status is Status.CONVERGED
    assert found.uncertainty.degrees_of_freedom == 0
    assert not found.uncertainty.identifiable.any()


def test_a_zeroed_case_without_another_reading_is_refused() -> None:
    with pytest.raises(RefusedModel, match="no reading enters the cost"):
        fit(problem(compression(0.0, 1.0), [0.0, np.nan], zeroed=True))


def test_noise_of_zeroed_readings_is_refused() -> None:
    """Zeroing correlates the errors of a cycle; independent ones would be too small."""
    zeroed = problem(compression(0.0, 1.0), [0.0, -7.0], zeroed=True)
    with pytest.raises(ValueError, match="correlated"):
        fit(zeroed, noise=np.full(6, 1e-3))


def test_settling_where_nothing_moves_ends_converged() -> None:
    model = joint()
    system = System(Chain(model), model, compression(0.0))
    loading = system.slots.loading(system.case.steps[0].wrenches)
    end = settle(system, Program.constant(loading), 1.5)
    assert end.status is Status.CONVERGED
    np.testing.assert_array_equal(end.q, follow(system)[0].equilibrium.q)
