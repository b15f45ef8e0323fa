"""Calibration: truth comes back, and what cannot be known is said so.

Catches a wrong residual, Jacobian, weight or bound, and a fit that says it converged where it did
not.
"""

from dataclasses import replace

import numpy as np
import pytest
from example_effects import (
    NOWHERE,
    CubicStiffening,
    JointCentreOffset,
    MarkerError,
    Relaxation,
    loaded,
    scoped,
    spine,
)
from sweeps import sweep

from spinepipe.calibration import Evaluator, MeasuredCase, Problem, fit
from spinepipe.calibration.fit import stand_up
from spinepipe.calibration.uncertainty import uncertainty
from spinepipe.effects import Wrench
from spinepipe.effects.contract import Array
from spinepipe.model import LoadCase, LoadStep, SpineModel
from spinepipe.statics import (
    FreeParameter,
    System,
    follow,
    free_parameters,
    observe,
    with_parameters,
)
from spinepipe.status import Status
from spinepipe.studies.joint_pose_sensitivity.tables import CALIBRATIONS
from spinepipe.tables import to_arrow
from spinepipe.world import Chain

pytestmark = pytest.mark.numeric

ROTATIONS = ("extension_nm_per_rad", "right_bending_nm_per_rad", "left_rotation_nm_per_rad")
READING_SD = np.array([2e-5] * 3 + [1e-3] * 3)
"""(6,) m and rad."""


def measure(
    model: SpineModel, case: LoadCase, free: tuple[FreeParameter, ...], truth: Array
) -> MeasuredCase:
    """What a model with its unknowns moved to the truth would show."""
    model = with_parameters(model, free, truth)
    system = System(Chain(model), model, case)
    return MeasuredCase(
        case, np.stack([observe(system, step.equilibrium.q) for step in follow(system)])
    )


def problem_of(
    model: SpineModel,
    free: tuple[FreeParameter, ...],
    truth: Array,
    reach: float = 3.0,
    case: LoadCase | None = None,
) -> Problem:
    measured = measure(model, case or loaded(model), free, truth)
    bounds = np.full(len(free), reach)
    return Problem(model, (measured,), free, np.ones(6), -bounds, bounds)


def rotations(model: SpineModel, grouping: str = "per_specimen") -> tuple[FreeParameter, ...]:
    return free_parameters(model, 0, ROTATIONS, grouping)


def with_readings(problem: Problem, keep: Array) -> Problem:
    """Only the readings of some of the six coordinates."""
    cases = tuple(replace(c, measured=np.where(keep, c.measured, np.nan)) for c in problem.cases)
    return replace(problem, cases=cases)


@pytest.mark.parametrize("grouping", ["per_specimen", "per_joint"])
def test_exact_data_give_the_truth_from_any_start(grouping: str) -> None:
    model = spine(3)
    free = rotations(model, grouping)
    rng = np.random.default_rng(3)
    truth = rng.uniform(-0.3, 0.6, len(free))
    problem = problem_of(model, free, truth)
    for _ in range(3):
        shift = rng.uniform(-1.5, 2.0, len(free))
        start = replace(
            problem,
            model=with_parameters(model, free, shift),
            lower=problem.lower - shift,
            upper=problem.upper - shift,
        )
        found = fit(start)
        assert found.status is Status.CONVERGED, found.message
        np.testing.assert_allclose(found.x + shift, truth, rtol=0, atol=1e-6)
        springs = with_parameters(model, free, truth).effects[0].values
        expected = [springs[p.rows[0], p.column] for p in free]
        np.testing.assert_allclose(found.values, expected, rtol=1e-6)
        assert found.uncertainty.identifiable.all()
        assert not found.at_bound.any()


def test_many_starts_of_one_problem_are_one_optimum() -> None:
    model = spine(2)
    free = rotations(model)
    found = fit(problem_of(model, free, np.array([0.2, -0.3, 0.4])), starts=4, seed=1)
    assert found.status is Status.CONVERGED
    assert found.evaluations > found.iterations
    np.testing.assert_allclose(found.x, [0.2, -0.3, 0.4], rtol=0, atol=1e-6)
    assert found.n_optima == 1


def test_same_seed_same_fit() -> None:
    model = spine(2)
    problem = problem_of(model, rotations(model), np.array([0.2, -0.3, 0.4]))
    one, same = (fit(problem, starts=3, seed=5) for _ in range(2))
    assert one.x.tobytes() == same.x.tobytes()
    assert one.evaluations == same.evaluations


@pytest.mark.parametrize(("side", "word"), [(1, "upper"), (-1, "lower")])
def test_a_truth_beyond_a_bound_is_said_to_be_at_it(side: int, word: str) -> None:
    model = spine(2)
    truth = np.array([0.2, side * 0.9, 0.1])
    problem = problem_of(model, rotations(model), truth)
    found = fit(replace(problem, lower=np.full(3, -0.5), upper=np.full(3, 0.5)))
    assert found.status is Status.CONVERGED_AT_BOUND
    assert found.status.usable
    assert found.at_bound.tolist() == [0, side, 0]
    assert found.message == f"right_bending_nm_per_rad at its {word} bound"
    assert found.x[1] == pytest.approx(side * 0.5)
    assert np.isinf(found.uncertainty.standard_error[1])
    assert not found.uncertainty.identifiable[1]
    assert np.isfinite(found.uncertainty.standard_error[[0, 2]]).all()


def test_bounds_are_hit_from_many_places_without_a_stumble() -> None:
    """The optimiser puts unknowns exactly on their bounds, a rounding error from where it was."""
    model = spine(1)
    free = rotations(model)
    measured = problem_of(model, free, np.array([2.0, -1.2, 2.0])).cases
    rng = np.random.default_rng(0)
    for _ in range(15):
        lower, upper = -rng.uniform(0.1, 0.8, 3), rng.uniform(0.1, 0.8, 3)
        found = fit(Problem(model, measured, free, np.ones(6), lower, upper))
        assert found.at_bound.tolist() == [1, -1, 1]


def axial_twist(model: SpineModel) -> LoadCase:
    """Of the weightless upright joint: nothing bends, so nothing tells of bending."""
    turn = Wrench(0, NOWHERE, NOWHERE, np.array([0.0, 2.0, 0.0]))
    return LoadCase("twist", 1, (LoadStep(0, (turn,)),))


def upright_joint() -> SpineModel:
    model = spine(1, gravity=False)
    frame = replace(model.frames[0], rotation=np.eye(3), origin=np.zeros(3))
    return replace(model, frames=(frame,))


def test_an_unknown_without_trace_in_the_data_is_not_identifiable() -> None:
    model = upright_joint()
    problem = problem_of(
        model, rotations(model), np.array([0.0, 0.0, 0.4]), 3.0, axial_twist(model)
    )
    found = fit(problem, noise=READING_SD)
    assert found.uncertainty.identifiable.tolist() == [False, False, True]
    assert np.isinf(found.uncertainty.standard_error[:2]).all()
    assert np.isinf(np.diagonal(found.uncertainty.covariance)[:2]).all()
    assert found.x[2] == pytest.approx(0.4, abs=1e-6)


def test_two_unknowns_of_which_only_the_sum_shows_are_not_identifiable() -> None:
    """A gain of the reading and a stiffness do the same to small motion of a linear joint."""
    model = spine(1, gravity=False, effects=(scoped(MarkerError(), (0,)),))
    model = replace(model, frames=(replace(model.frames[0], rotation=np.eye(3)),))
    free = (
        *free_parameters(model, 0, ROTATIONS[:1], "per_specimen"),
        *free_parameters(model, 1, ["gain"], "per_specimen"),
    )
    bend = Wrench(0, NOWHERE, NOWHERE, np.array([0.0, 0.0, 3.0]))
    case = LoadCase("bend", 1, tuple(LoadStep(i, (bend,)) for i in range(4)))
    problem = problem_of(model, free, np.zeros(2), 0.4, case)
    found = fit(problem, noise=READING_SD)
    assert not found.uncertainty.identifiable.any()
    assert np.isinf(found.uncertainty.standard_error).all()


@pytest.mark.parametrize("noise", [None, READING_SD])
def test_fewer_readings_than_unknowns_determine_no_unknown(noise: Array | None) -> None:
    model = spine(3)
    problem = problem_of(model, rotations(model, "per_joint"), np.zeros(9))
    keep = np.zeros((3, 3, 6), dtype=bool)
    keep[1, 2, 3] = True
    found = fit(with_readings(problem, keep), noise=noise)
    assert found.uncertainty.degrees_of_freedom == -8
    assert not found.uncertainty.identifiable.any()
    assert noise is not None or np.isinf(found.uncertainty.standard_error).all()


def test_two_optima_are_counted_and_the_better_one_is_taken() -> None:
    """A weight on a centre that lies in front or behind: it sinks alike, but turns the other way.

    Rotation is load times offset over stiffness and lowers the joint by rotation times offset, an
    even function. The reading of the rotation weighs just enough to prefer one of the two.
    """
    model = upright_joint().with_effects(
        (*upright_joint().effects, scoped(JointCentreOffset(), (0,), (0.0, 0.0)))
    )
    free = free_parameters(model, 1, ["forward"], "per_specimen")
    press = Wrench(0, NOWHERE, np.array([0.0, -100.0, 0.0]), NOWHERE)
    case = LoadCase("press", 1, (LoadStep(0, (press,)),))
    problem = problem_of(model, free, np.array([0.02]), 0.04, case)
    problem = replace(problem, weights=np.array([0.0, 1.0, 0.0, 1e-6, 0.0, 0.0]))
    found = fit(problem, starts=8, seed=2)
    assert found.status is Status.CONVERGED
    assert found.x[0] == pytest.approx(0.02, abs=1e-6)
    assert found.n_optima == 2


def test_a_start_that_cannot_stand_is_stiffened_and_says_so() -> None:
    model = spine(2)
    free = free_parameters(
        model, 0, [p.name for p in model.effects[0].effect.parameters], "per_specimen"
    )
    problem = problem_of(model, free, np.zeros(6))
    soft = replace(
        problem,
        model=with_parameters(model, free, np.full(6, np.log(1 / 64))),
        lower=np.full(6, -1.0),
        upper=np.full(6, np.log(1000.0)),
    )
    found = fit(soft)
    assert found.stiffened >= 2
    assert found.status is Status.CONVERGED
    np.testing.assert_allclose(found.x, np.log(64), rtol=0, atol=1e-5)


def test_stiffening_leaves_offsets_where_they_are() -> None:
    model = spine(2, effects=(scoped(JointCentreOffset(), (0, 1), (0.0, 0.0)),))
    free = (*rotations(model), *free_parameters(model, 1, ["forward"], "per_specimen"))
    problem = problem_of(model, free, np.zeros(4))
    soft = replace(
        problem,
        model=with_parameters(model, free, np.array([*np.full(3, np.log(1 / 64)), 0.0])),
        lower=np.array([-1.0, -1.0, -1.0, -0.02]),
        upper=np.array([6.0, 6.0, 6.0, 0.02]),
    )
    start, times = stand_up(soft, Evaluator(soft).at, np.zeros(4))
    assert times > 0
    assert start[3] == 0.0


def test_loads_that_tip_at_any_stiffness_within_bounds_leave_no_number() -> None:
    model = spine(2)
    free = rotations(model)
    case = loaded(model)
    point = model.bodies[1].com + np.array([0.01, 0.05, 0.0])
    press = Wrench(1, point, np.array([0.0, -1e5, 0.0]), NOWHERE)
    case = replace(case, steps=(LoadStep(0, (press,)),))
    problem = Problem(
        model, (MeasuredCase(case, np.zeros((1, 2, 6))),), free, np.ones(6), -np.ones(3), np.ones(3)
    )
    found = fit(problem, starts=2)
    assert found.status is Status.UNSTABLE
    assert not found.status.usable
    assert "tip" in found.message
    assert found.n_optima == 0
    assert not found.uncertainty.identifiable.any()
    assert not np.isnan(found.x).any()
    to_arrow(CALIBRATIONS, row_of(found))


def row_of(found) -> dict[str, list]:
    """A row of the calibrations table as the job writes it for a fit of no use."""
    row: dict[str, object] = {column.name: None for column in CALIBRATIONS.columns}
    row |= {"specimen": "a", "pose": 0, "joint": "*", "status": found.status, "message": ""}
    row |= {"degrees_of_freedom": found.uncertainty.degrees_of_freedom}
    row |= {"iterations": found.iterations, "evaluations": found.evaluations}
    row |= {"n_optima": found.n_optima, "start_stiffened": found.stiffened}
    row["cost"] = found.cost if np.isfinite(found.cost) else None
    return {name: [cell] for name, cell in row.items()}


def noisy(problem: Problem, rng: np.random.Generator) -> Problem:
    cases = tuple(
        replace(c, measured=c.measured + READING_SD * rng.normal(size=c.measured.shape))
        for c in problem.cases
    )
    return replace(problem, cases=cases)


def test_the_covariance_is_that_of_many_noisy_experiments() -> None:
    model = spine(1)
    problem = problem_of(model, rotations(model), np.zeros(3), case=loaded(model, 1))
    # millimetres and degrees weighed by their noise: what least squares is best at
    problem = replace(problem, weights=np.array([2.0] * 3 + [0.3] * 3))
    rng = np.random.default_rng(8)
    fits = [fit(noisy(problem, rng), noise=READING_SD) for _ in range(80)]
    found = np.cov(np.array([f.x for f in fits]).T)
    expected = fits[0].uncertainty.covariance
    scale = np.sqrt(np.outer(np.diagonal(expected), np.diagonal(expected)))
    # a variance from 80 draws is known to 16 %: three of these
    np.testing.assert_allclose(found / scale, expected / scale, rtol=0, atol=0.48)
    inside = [np.abs(f.x) < 1.96 * f.uncertainty.standard_error for f in fits]
    assert 0.90 < np.mean(inside) < 0.99


def test_scatter_stands_in_for_undeclared_noise() -> None:
    model = spine(2)
    problem = problem_of(model, rotations(model), np.zeros(3), case=loaded(model, 9))
    keep = np.array([False] * 3 + [True] * 3)
    problem = noisy(with_readings(problem, keep), np.random.default_rng(4))
    declared, scatter = fit(problem, noise=READING_SD), fit(problem)
    assert scatter.uncertainty.degrees_of_freedom == 9 * 2 * 3 - 3
    ratio = scatter.uncertainty.standard_error / declared.uncertainty.standard_error
    np.testing.assert_allclose(ratio, 1.0, rtol=0, atol=0.3)  # three of its own SDs, 51 dof
    assert np.ptp(ratio) < 1e-9


@sweep("order, kept", [((2, 0, 1), [0, 2]), ((0, 1, 2), [0, 1, 2])])
def test_unread_steps_and_unweighted_readings_change_nothing(order, kept: list[int]) -> None:
    """Loads of 0.3, 0.6 and 1.0 go straight through the second step, of 0.6, 1.0 and 0.3 turn."""
    model = replace(spine(2), gravity=np.zeros(3))
    free, truth = rotations(model), np.array([0.2, -0.3, 0.4])
    problem = problem_of(model, free, truth)
    one = problem.cases[0]
    measured = one.measured[list(order)]
    measured[1] = np.nan
    measured[2, 0, :3] = 17.0  # nonsense, but its weight is zero
    weights = np.array([0.0, 0.0, 0.0, 1.0, 1.0, 1.0])
    case = replace(one.case, steps=tuple(one.case.steps[place] for place in order))
    found = fit(
        replace(problem, cases=(replace(one, case=case, measured=measured),), weights=weights)
    )
    np.testing.assert_allclose(found.x, truth, rtol=0, atol=1e-6)
    assert len(found.poses[0]) == len(found.cases[0].case.steps) == len(kept)
    np.testing.assert_array_equal(found.cases[0].measured, measured[kept])


def test_steps_on_the_way_are_kept_for_path_effects() -> None:
    model = spine(2, effects=(scoped(Relaxation(), (0, 1)),))
    free, truth = rotations(model), np.array([0.2, -0.3, 0.4])
    problem = problem_of(model, free, truth)
    measured = problem.cases[0].measured.copy()
    measured[:2] = np.nan
    found = fit(replace(problem, cases=(replace(problem.cases[0], measured=measured),)))
    np.testing.assert_allclose(found.x, truth, rtol=0, atol=1e-6)
    assert len(found.poses[0]) == 3


def test_zeroed_measurements_are_met_by_zeroed_predictions() -> None:
    model = spine(2)
    free, truth = rotations(model), np.array([0.2, -0.3, 0.4])
    problem = problem_of(model, free, truth)
    measured = problem.cases[0].measured
    zeroed = replace(problem.cases[0], measured=measured - measured[0], zeroed=True)
    found = fit(replace(problem, cases=(zeroed,)))
    np.testing.assert_allclose(found.x, truth, rtol=0, atol=1e-6)


def test_effects_and_stiffness_are_found_together() -> None:
    """Unknowns of several kinds and units in one fit: N m/rad, N m/rad^3, s, m and rad."""
    effects = (
        scoped(CubicStiffening(), (0, 1, 2)),
        scoped(Relaxation(), (0, 1, 2)),
        scoped(JointCentreOffset(), (0, 1, 2), (0.0, 0.0)),
        scoped(MarkerError(), (0, 1, 2)),
    )
    model = spine(3, effects=effects)
    free = (
        *rotations(model),
        *free_parameters(model, 1, ["rise"], "per_specimen"),
        *free_parameters(model, 2, ["spring", "time"], "per_specimen"),
        *free_parameters(model, 3, ["forward", "up"], "per_specimen"),
        *free_parameters(model, 4, ["bias"], "per_joint"),
    )
    truth = np.array([0.2, -0.2, 0.1, 0.3, 0.2, -0.3, 0.004, -0.006, 0.01, -0.02, 0.005])
    measured = measure(model, loaded(model, 9), free, truth)
    reach = np.where([p.logarithmic for p in free], 2.0, 0.04)
    found = fit(Problem(model, (measured,), free, np.ones(6), -reach, reach))
    assert found.status is Status.CONVERGED, found.message
    np.testing.assert_allclose(found.x, truth, rtol=0, atol=1e-6)


def test_the_jacobian_is_the_slope_of_the_residuals() -> None:
    model = spine(3, effects=(scoped(MarkerError(), (0, 2), (1.1, 0.02)),))
    free = (*rotations(model, "per_joint"), *free_parameters(model, 1, ["gain"], "per_joint"))
    problem = problem_of(model, free, np.zeros(11))
    problem = replace(problem, cases=(replace(problem.cases[0], zeroed=True),))
    evaluator, rng = Evaluator(problem), np.random.default_rng(6)
    x, along = 0.1 * rng.normal(size=(2, 11))
    ends = [evaluator.at(x + h * along).residual for h in (-1e-3, 1e-3)]
    expected = (ends[1] - ends[0]) / 2e-3
    found = evaluator.at(x).jacobian @ along
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-5 * np.abs(expected).max())


def test_a_loss_is_changed_in_one_place(monkeypatch: pytest.MonkeyPatch) -> None:
    """One reading of the stack's extension is wrong by 40 deg: a Cauchy loss gives it no say."""

    def cauchy(residuals: Array) -> tuple[Array, Array]:
        size = np.maximum(np.abs(residuals), 1e-12)
        counts = np.sqrt(np.log1p(size**2))
        return np.sign(residuals) * counts, size / ((1.0 + size**2) * counts)

    model = spine(3)
    free, truth = rotations(model), np.full(3, 0.2)
    problem = problem_of(model, free, truth)
    wrong = problem.cases[0].measured.copy()
    wrong[-1, 1, 3] += np.deg2rad(40.0)
    problem = replace(problem, cases=(replace(problem.cases[0], measured=wrong),))
    assert abs(fit(problem).x[0] - truth[0]) > 0.1
    monkeypatch.setattr("spinepipe.calibration.problem.counted", cauchy)
    robust = fit(problem)
    assert robust.x == pytest.approx(truth, abs=5e-3)
    evaluator, step = Evaluator(problem), np.array([1e-4, 0.0, 0.0])
    ends = [evaluator.at(0.3 + side * step).residual for side in (-1.0, 1.0)]
    slope = evaluator.at(np.full(3, 0.3)).jacobian[:, 0]
    assert slope == pytest.approx((ends[1] - ends[0]) / 2e-4, rel=1e-4, abs=1e-6)


def test_uncertainty_of_a_known_jacobian_in_closed_form() -> None:
    """Two readings, one unknown: weighted least squares by hand."""
    model = spine(1)
    free = rotations(model)[:1]
    problem = replace(problem_of(model, free, np.zeros(1)), weights=np.array([0, 0, 0, 4.0, 1, 1]))
    evaluation = replace(
        Evaluator(problem).at(np.zeros(1)),
        residual=np.zeros(2),
        jacobian=np.array([[6.0], [8.0]]),
        coordinate=np.array([3, 4]),
        sharing=np.full(2, -1),
    )
    noise = np.deg2rad(np.full(6, 0.5))
    found = uncertainty(problem, evaluation, np.zeros(1, dtype=int), 1.0, noise)
    # x = (6 e1 + 8 e2) / 100 with e1 = 2 x 0.5 deg and e2 = 1 x 0.5 deg
    expected = np.hypot(0.06 * 1.0, 0.08 * 0.5)
    assert found.standard_error[0] == pytest.approx(expected, rel=1e-12)
