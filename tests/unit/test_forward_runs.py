"""The published way of fitting: its runs, its derivatives, and the rows of fits that fail.

Catches an emulation of the published fit that hides a failed fit or differs from its own runs.
"""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from example_effects import NOWHERE, Relaxation, loaded, massless, scoped, spine
from study_cases import STUDY, Size, project, results

from spinepipe.calibration import MeasuredCase, Problem, forward_runs
from spinepipe.calibration.forward_runs import (
    ForwardFit,
    differenced_gradient,
    exact_gradient,
    fit_by_forward_runs,
    forward_run,
    relative_error,
)
from spinepipe.effects import Wrench
from spinepipe.effects.contract import Array
from spinepipe.model import LoadCase, LoadStep, RefusedModel, SpineModel
from spinepipe.statics import (
    Course,
    Program,
    System,
    follow,
    free_parameters,
    settle,
    with_parameters,
)
from spinepipe.status import Status
from spinepipe.studies.joint_pose_sensitivity import fit_by_method
from spinepipe.tables import read_frame
from spinepipe.world import Chain

TRUTH = np.array([np.log(1.6), np.log(0.7)])
SANE = 1e-3


def one_step(model: SpineModel) -> LoadCase:
    return loaded(model, steps=1)


def problem(model: SpineModel | None = None, truth: Array = TRUTH) -> Problem:
    """Superior and extension stiffness to be found from the equilibrium of a stiffer spine."""
    model = spine(1) if model is None else model
    case = one_step(model)
    free = free_parameters(model, 0, ["superior_n_per_m", "extension_nm_per_rad"], "per_specimen")
    stiffer = with_parameters(model, free, truth)
    pose = follow(System(Chain(stiffer), stiffer, case))[0].equilibrium.q.reshape(-1, 6)
    reach = np.full(2, np.log(1000.0))
    return Problem(model, (MeasuredCase(case, pose[None]),), free, np.ones(6), -reach, reach)


def test_a_run_follows_the_closed_form_of_one_joint() -> None:
    """inertia a'' + damping a' + stiffness a = moment, a body turning about its centre of mass."""
    model = spine(1, gravity=False)
    body = replace(model.bodies[0], com=model.frames[0].origin)
    model = replace(model, bodies=(body,))
    axis = model.frames[0].rotation[:, 2]
    case = LoadCase("test", 1, (LoadStep(0, (Wrench(0, NOWHERE, NOWHERE, 5.0 * axis),)),))
    inertia, damping = float(axis @ body.inertia @ axis), float(model.damping[0, 3])
    stiffness = float(model.effects[0].values[0, 3])
    one, other = np.roots([inertia, damping, stiffness])
    decay = (one * np.exp(other * 0.02) - other * np.exp(one * 0.02)) / (one - other)
    found = forward_run(model, case, 0.02, 1e-9)
    assert found is not None
    assert found[3] == pytest.approx(5.0 / stiffness * (1.0 - decay), rel=1e-5)


@pytest.mark.parametrize("duration_s", [0.02, 1.5])
def test_a_run_ends_where_settling_ends(duration_s: float) -> None:
    model = spine(3)
    system = System(Chain(model), model, one_step(model))
    loading = system.slots.loading(system.case.steps[0].wrenches)
    expected = settle(system, Program.constant(loading), duration_s).q
    found = forward_run(model, system.case, duration_s, 1e-5)
    assert found is not None
    for kind in (slice(0, 3), slice(3, 6)):  # m, then rad
        there, here = expected.reshape(-1, 6)[:, kind], found.reshape(-1, 6)[:, kind]
        np.testing.assert_allclose(here, there, rtol=0, atol=2e-3 * np.abs(there).max())


@pytest.mark.full
def test_noiseless_motion_and_a_sane_step_give_the_truth() -> None:
    """Most of the time: one fit in some is stopped early by the noise of the runs."""
    off = []
    for shift in (0.02, -0.03, 0.05):
        truth = TRUTH + shift
        found = fit_by_forward_runs(problem(truth=truth), 1.5, SANE)
        assert found.claims_success
        assert found.status is Status.CONVERGED
        start = np.array([problem().model.effects[0].values[0, column] for column in (1, 3)])
        np.testing.assert_allclose(found.values, start * np.exp(found.x), rtol=1e-12)
        off.append(np.abs(found.x - truth).max())
    # one-sided differences are off by half a step, which moves the optimum by that share
    assert np.median(off) < SANE


def test_in_raw_units_the_stiffer_unknown_stays_at_its_start() -> None:
    """A step of one newton per metre is no step: no noise is needed to lose a fit."""
    near = problem(truth=np.array([np.log(1.05), np.log(0.9)]))
    found = fit_by_forward_runs(near, 1.5, SANE, raw_units=True)
    assert found.claims_success
    assert found.x[1] == pytest.approx(np.log(0.9), abs=5e-3)
    assert abs(np.exp(found.x[0]) - 1.0) < 1e-3  # the truth is 5 % away


def test_the_start_s_derivative_is_that_of_the_run() -> None:
    found = fit_by_forward_runs(problem(), 1.5, SANE, most_evaluations=3)
    exact = exact_gradient(problem(), Course(1.5))
    error = relative_error(found.start_gradient, exact)
    assert error is not None
    assert 1e-5 < error < 5e-3  # the cost is curved over the step, and no more than that


def test_exact_derivatives_are_those_of_careful_differences() -> None:
    error = relative_error(exact_gradient(problem()), differenced_gradient(problem()))
    assert error is not None
    assert error < 1e-8


@pytest.mark.parametrize(
    ("gradient", "exact", "expected"),
    [([3.0, 5.0], [3.0, 4.0], 0.2), (None, [1.0], None), ([1.0], None, None), ([1.0], [0.0], None)],
)
def test_errors_of_derivatives_are_relative(
    gradient: list[float] | None, exact: list[float] | None, expected: float | None
) -> None:
    found = relative_error(*(None if v is None else np.array(v) for v in (gradient, exact)))
    assert found == (None if expected is None else pytest.approx(expected))


def test_a_fit_whose_linear_algebra_gives_up_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    def gives_up(cost: Callable[[Array], float], start: Array, **_: object) -> None:
        cost(start)
        raise np.linalg.LinAlgError("SVD did not converge")

    monkeypatch.setattr(forward_runs, "minimize", gives_up)
    found = fit_by_forward_runs(problem(), 0.1, SANE)
    assert (found.status, found.message) == (Status.NOT_CONVERGED, "SVD did not converge")
    assert not found.claims_success
    np.testing.assert_array_equal(found.x, 0.0)


def test_a_fit_that_runs_out_of_runs_says_so() -> None:
    found = fit_by_forward_runs(problem(), 0.1, SANE, most_evaluations=5)
    assert (found.status, found.evaluations) == (Status.NOT_CONVERGED, 5)
    assert not found.claims_success
    assert "5 runs" in found.message


def test_a_lost_start_is_unstable(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(forward_runs, "forward_run", lambda *_: None)
    found = fit_by_forward_runs(problem(), 1.5)
    assert (found.status, found.claims_success) == (Status.UNSTABLE, False)
    assert found.start_gradient is None


def test_a_lost_run_turns_the_optimiser_back(monkeypatch: pytest.MonkeyPatch) -> None:
    """Nothing stands beyond 1.4 times the start, short of the truth."""

    def run(model: SpineModel, *rest: object) -> Array | None:
        ratio = model.effects[0].values[0, 1] / spine(1).effects[0].values[0, 1]
        return None if ratio > 1.4 else forward_run(model, *rest)

    monkeypatch.setattr(forward_runs, "forward_run", run)
    found = fit_by_forward_runs(problem(), 1.5, SANE, most_evaluations=40)
    start = fit_by_forward_runs(problem(), 1.5, SANE, most_evaluations=3)
    assert found.cost < start.cost
    assert found.x[0] < np.log(1.4)


def relaxing() -> SpineModel:
    return spine(1, effects=(scoped(Relaxation(), (0,), (20.0, 3.0)),))


@pytest.mark.parametrize(
    ("model", "reason"), [(massless(), "mass and inertia"), (relaxing(), "path effects")]
)
def test_what_cannot_move_in_time_is_refused(model: SpineModel, reason: str) -> None:
    with pytest.raises(RefusedModel, match=reason):
        fit_by_forward_runs(problem(model), 1.5)


def row(folder: Path, method: str, size: Size) -> dict[str, object]:
    """What the job writes of pose 0 of a cohort without masses."""
    root = project(folder, size)
    poses, output = results(root, size) / "poses.parquet", folder / f"{method}.parquet"
    fit_by_method.run(str(root), STUDY, str(poses), "a", "0", method, str(output))
    (only,) = read_frame(output).to_dict("records")
    return only


def test_the_job_fits_exactly(tmp_path: Path) -> None:
    found = row(tmp_path, "exact", Size())
    assert found["status"] == "converged"
    assert found["derivative_error"] < 1e-8
    assert found["extension_nm_per_rad"] > 0.0
    assert found["near_start_all"] is False


@pytest.mark.parametrize("method", ["forward_run_default_step", "forward_run_raw_units"])
def test_the_job_refuses_runs_without_masses(tmp_path: Path, method: str) -> None:
    found = row(tmp_path, method, Size())
    assert (found["status"], found["evaluations"]) == ("refused", 0)
    assert "mass and inertia" in str(found["message"])
    assert np.isnan(found["cost"])


def test_the_job_compares_shared_stiffness_only(tmp_path: Path) -> None:
    found = row(tmp_path, "exact", Size(grouping="per_joint"))
    assert found["status"] == "refused"
    assert found["message"] == "it needs one stiffness shared by all joints"


def test_the_job_shows_what_a_capped_fit_came_to(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    x = np.array([np.log(1.005), np.log(1.5)])
    ended = ForwardFit(
        x, np.exp(x), 2.0, 300, False, Status.NOT_CONVERGED, "no optimum", np.ones(2)
    )
    monkeypatch.setattr(fit_by_method, "fit_by_forward_runs", lambda *_, **__: ended)
    monkeypatch.setattr(fit_by_method, "exact_gradient", lambda *_: np.array([1.0, 0.0]))
    found = row(tmp_path, "forward_run_sane_step", Size())
    assert (found["status"], found["cost"], found["evaluations"]) == ("not_converged", 2.0, 300)
    assert (found["near_start_any"], found["near_start_all"]) == (True, False)
    assert found["superior_n_per_m"] == pytest.approx(1.005 * 110000.0)
    assert found["derivative_error"] == 1.0
