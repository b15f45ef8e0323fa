"""Fits to settling runs: how loads come on, derivatives of the end, and truth that returns.

Catches wrong derivatives of the end of a run, and a course that is not the given one.
"""

from dataclasses import replace

import numpy as np
import pytest
from example_effects import loaded, massless, spine, top_heavy

from spinepipe.calibration import Evaluator, MeasuredCase, Problem, fit, fit_alike
from spinepipe.calibration.solvers import CaseResiduals, Settling
from spinepipe.effects.contract import Array
from spinepipe.model import LoadCase, LoadStep, RefusedModel, SpineModel
from spinepipe.statics import (
    Course,
    FreeParameter,
    Loading,
    System,
    batched,
    free_parameters,
    move,
    with_parameters,
)
from spinepipe.statics.batched import Stack
from spinepipe.statics.transient import END_ONLY
from spinepipe.status import Status
from spinepipe.world import Chain
from tests.reference import bridge
from tests.reference.peers import chain as chains
from tests.reference.peers import opensim_peer as peer
from tests.reference.peers.chain import Load

ROTATIONS = ("extension_nm_per_rad", "right_bending_nm_per_rad", "left_rotation_nm_per_rad")
FINE = 1e-2
"""Coarseness of the runs that truth comes from; the fits' own is 10."""

QUASI_STATIC, RAMPED = Course(0.1), Course(0.2, 0.2, 25.0)
COURSES = pytest.mark.parametrize("course", [QUASI_STATIC, RAMPED], ids=["constant", "ramped"])
READING_ERROR = np.array([2e-5] * 3 + [1e-3] * 3)
"""(6,) m and rad."""


LOADING = Loading(np.array([[0.0, -40.0, 0.0]]), np.array([[0.0, 0.0, 7.5]]), 1.0)


def test_a_course_without_a_ramp_switches_the_load_on() -> None:
    program = Course(1.5).program(LOADING)
    assert program.times == (0.0,)
    for time in (0.0, 1.5):
        assert program.at(time).forces.tolist() == [[0.0, -40.0, 0.0]]
        assert program.at(time).share == 1.0


def test_a_ramp_grows_from_nothing_but_weight_and_is_held() -> None:
    program = Course(1.0, 1.0, 25.0).program(LOADING)
    np.testing.assert_allclose(program.times, [number / 25 for number in range(26)])
    for time, force, moment in ((0.0, 0.0, 0.0), (0.3, -12.0, 2.25), (1.0, -40.0, 7.5)):
        at = program.at(time)
        assert at.forces[0].tolist() == pytest.approx([0.0, force, 0.0])
        assert at.moments[0].tolist() == pytest.approx([0.0, 0.0, moment])
        assert at.share == 1.0
    assert program.at(7.0).moments[0, 2] == 7.5
    assert program.corner_after(0.3) == pytest.approx(0.32)


def test_a_ramp_shorter_than_its_interval_is_one_straight_line() -> None:
    program = Course(1.0, 0.5, 1.0).program(LOADING)
    assert program.times == (0.0, 0.5)
    assert program.at(0.25).forces[0, 1] == pytest.approx(-20.0)


def sampled(model: SpineModel, case: LoadCase, course: Course, coarseness: float = FINE) -> Array:
    """(T, n) poses at the end of each step's course."""
    system = System(Chain(model), model, case)
    programs = [course.program(system.slots.loading(step.wrenches)) for step in case.steps]
    return np.stack(
        [move(system, one, course.duration_s, coarseness=coarseness).q for one in programs]
    )


def test_how_often_a_straight_ramp_is_given_does_not_matter() -> None:
    model = spine(2)
    often, once = (sampled(model, loaded(model, 1), Course(0.2, 0.2, n)) for n in (25.0, 5.0))
    np.testing.assert_allclose(often, once, rtol=0, atol=1e-6)


@COURSES
def test_the_derivative_of_the_end_is_that_of_fine_runs(course: Course) -> None:
    model = spine(2)
    free = free_parameters(model, 0, (*ROTATIONS, "anterior_n_per_m"), "per_specimen")
    case, step = loaded(model, 1), 1e-3
    expected, mixtures = [], np.array([[1.0, 0.6, -0.8, 0.7], [-0.7, 0.9, 0.6, 1.0]])
    for x in step * mixtures:
        after, before = (
            sampled(with_parameters(model, free, s * x), case, course)[0] for s in (1, -1)
        )
        expected.append((after - before) / (2.0 * step))
    found = ends(model, case, free, course).by_x[0] @ mixtures.T
    for kind in (slice(0, 3), slice(3, 6)):
        wanted, there = (a.reshape(2, 6, -1)[:, kind] for a in (np.array(expected).T, found))
        # the end itself is known to 1e-3
        assert np.abs(there - wanted).max() < 1e-3 * np.abs(wanted).max()


def test_a_run_that_cannot_take_the_steps_of_another_is_lost() -> None:
    standing, tipping_over = spine(1), top_heavy()
    case = loaded(tipping_over, 1)
    stack = Stack.of([standing, tipping_over], [(0, case), (1, case)])
    found = batched.settle(stack, Course(3.0), np.array([0, 0]))
    assert list(found.trouble) == [1]
    assert "tips over" in found.trouble[1]
    assert np.isnan(found.q[1]).all()
    alone = batched.settle(Stack.of([standing], [(0, case)]), Course(3.0), np.array([0]))
    np.testing.assert_array_equal(found.q[0], alone.q[0])
    assert found.sizes == alone.sizes


def test_a_chain_that_tips_over_has_no_solution() -> None:
    model = top_heavy()
    free = free_parameters(model, 0, ROTATIONS, "per_specimen")
    found = Settling(model, [loaded(model, 1)], free, Course(3.0)).solve([(0, np.zeros(3))])[0]
    assert isinstance(found, str)
    assert "tips over" in found


@COURSES
def test_ends_are_those_of_the_engine_of_record(course: Course) -> None:
    """Chosen steps, poses and readings of several joints; and again over the very same steps."""
    model = spine(3)
    case = loaded(model, 2)
    free = free_parameters(model, 0, ROTATIONS, "per_specimen")
    solver = Settling(model, [case, twice(case)], free, course)
    seen = solver.solve([(0, np.zeros(3))])[0]
    assert isinstance(seen, CaseResiduals)
    expected = sampled(model, case, course, END_ONLY)
    np.testing.assert_allclose(seen.poses[0], expected, rtol=0, atol=1e-11)
    np.testing.assert_array_equal(seen.poses[1], np.repeat(seen.poses[0], 2, axis=0))
    np.testing.assert_array_equal(seen.readings[0], seen.poses[0].reshape(2, -1, 6))
    record = solver.record(np.zeros(3))
    assert record is not None
    np.testing.assert_allclose(record[0], seen.poses[0], rtol=0, atol=1e-13)


def ends(
    model: SpineModel, case: LoadCase, free: tuple[FreeParameter, ...], course: Course
) -> CaseResiduals:
    """What a fit sees of a case."""
    found = Settling(model, [case], free, course).solve([(0, np.zeros(len(free)))])[0]
    assert isinstance(found, CaseResiduals)
    return found


def twice(case: LoadCase) -> LoadCase:
    """Each step two times."""
    steps = [step for step in case.steps for _ in range(2)]
    return replace(case, steps=tuple(replace(s, step=n) for n, s in enumerate(steps)))


def with_errors(ends: Array) -> Array:
    """(2T, J, 6) two readings of each end, off by as much to either side: least squares is exact.

    Their cost at the truth is 2 (error)^2 for each end and coordinate.
    """
    readings = ends.reshape(len(ends), -1, 6)
    pairs = np.stack([readings + READING_ERROR, readings - READING_ERROR], axis=1)
    return pairs.reshape(-1, *readings.shape[1:])


def problem_of(
    model: SpineModel, case: LoadCase, measured: Array, free: tuple[FreeParameter, ...], **options
) -> Problem:
    bounds = np.full(len(free), 3.0)
    return Problem(
        model, (MeasuredCase(case, measured),), free, np.ones(6), -bounds, bounds, **options
    )


COST_PER_JOINT = 2 * (3 * 0.02**2 + 3 * np.rad2deg(1e-3) ** 2)
"""mm2 and deg2 of two readings."""


@COURSES
def test_a_truth_made_by_settling_comes_back(course: Course) -> None:
    model = spine(2)
    free = free_parameters(model, 0, ROTATIONS, "per_specimen")
    truth, case = np.array([0.3, -0.2, 0.1]), loaded(model, 1)
    measured = with_errors(sampled(with_parameters(model, free, truth), case, course))
    found = fit(problem_of(model, twice(case), measured, free, course=course))
    assert found.status is Status.CONVERGED, found.message
    np.testing.assert_allclose(found.x, truth, rtol=0, atol=2e-3)
    assert found.cost == pytest.approx(2 * COST_PER_JOINT, rel=1e-2)
    at_rest = fit(problem_of(model, twice(case), measured, free))
    assert np.abs(at_rest.x - truth).max() > 0.02  # what lags is not at rest


@pytest.mark.parametrize("course", [None, QUASI_STATIC])
def test_fits_side_by_side_are_those_of_each_alone(course: Course | None) -> None:
    """Of two starts, one with three times the damping: were models exchanged, ends would differ."""
    model = spine(2)
    free = free_parameters(model, 0, ROTATIONS, "per_specimen")
    case = loaded(model, 1)
    truth = with_parameters(model, free, np.array([0.3, -0.2, 0.1]))
    measured = with_errors(sampled(truth, case, QUASI_STATIC))
    other = replace(with_parameters(model, free, np.full(3, 0.2)), damping=3.0 * model.damping)
    problems = [
        problem_of(one, twice(case), measured, free, course=course) for one in (model, other)
    ]
    for found, alone in zip(fit_alike(problems), map(fit, problems), strict=True):
        np.testing.assert_allclose(found.values, alone.values, rtol=1e-9)
        assert (found.cost, found.status) == (pytest.approx(alone.cost, rel=1e-9), alone.status)
        assert (found.evaluations, found.message) == (alone.evaluations, alone.message)


def test_zeroed_readings_are_met_by_zeroed_ends() -> None:
    model = spine(2)
    free = free_parameters(model, 0, ROTATIONS, "per_specimen")
    truth, case = np.array([0.3, -0.2, 0.1]), loaded(model, 1)
    steps = (LoadStep(0, ()), *(replace(s, step=s.step + 1) for s in twice(case).steps))
    zeroed = replace(case, steps=steps)
    ends = sampled(
        with_parameters(model, free, truth), replace(case, steps=steps[:2]), QUASI_STATIC
    )
    readings = np.concatenate([np.zeros((1, 2, 6)), with_errors(ends[1:] - ends[0])])
    problem = problem_of(model, zeroed, readings, free, course=QUASI_STATIC)
    problem = replace(problem, cases=(replace(problem.cases[0], zeroed=True),))
    found = fit(problem)
    assert found.status is Status.CONVERGED, found.message
    np.testing.assert_allclose(found.x, truth, rtol=0, atol=2e-3)


def pushed_segment() -> chains.Chain:
    """L1-L4 in flexion, pushed backwards and down."""
    chain = chains.l1_l4_chain()
    force, moment = np.array([-150.0, -200.0, 0.0]), np.array([0.0, 0.0, -7.5])
    return chain.with_loads(Load(2, force, moment, chain.centres[2]))


SAGITTAL = ("anterior_n_per_m", "superior_n_per_m", "extension_nm_per_rad")
FACTORS = np.array([1.5, 0.6, 1.0, 1.35, 1.0, 1.0])
"""Of stiffness, between a model and what was measured."""


@pytest.mark.parametrize(
    "course",
    [QUASI_STATIC, pytest.param(RAMPED, marks=pytest.mark.full)],
    ids=["constant", "ramped"],
)
def test_a_truth_made_by_opensim_comes_back(course: Course) -> None:
    """CPodes' end of the segment with other stiffness, within 1 %."""
    chain = pushed_segment()
    stiff = chain.with_stiffness(chain.stiffness * FACTORS)
    ends = peer.settle(stiff, course.duration_s, accuracy=1e-6, ramp_time=course.ramp_s)
    model, case = bridge.spine_model(chain), bridge.load_case(chain)
    free = free_parameters(model, 0, SAGITTAL, "per_specimen")
    found = fit(problem_of(model, twice(case), with_errors(ends), free, course=course))
    assert found.status is Status.CONVERGED, found.message
    np.testing.assert_allclose(found.values, (chain.stiffness * FACTORS)[0, [0, 1, 3]], rtol=1e-2)


def test_an_optimum_without_cost_is_one() -> None:
    """Its slope is no share of its cost: there is next to none."""
    chain, published_weights = pushed_segment(), np.array([10.0, 100.0, 1.0, 1.0, 0.0, 0.0])
    model, case = bridge.spine_model(chain), bridge.load_case(chain)
    free = free_parameters(model, 0, SAGITTAL, "per_specimen")
    truth = np.log(FACTORS[[0, 1, 3]])
    measured = sampled(with_parameters(model, free, truth), case, QUASI_STATIC).reshape(1, -1, 6)
    problem = problem_of(model, case, measured, free, course=QUASI_STATIC)
    found = fit(replace(problem, weights=published_weights))
    np.testing.assert_allclose(found.x, truth, rtol=0, atol=1e-3)
    assert found.status is Status.CONVERGED


def test_no_more_readings_than_unknowns_are_met_exactly() -> None:
    """One joint, three readings, three unknowns: the cost goes to zero at the truth."""
    model = spine(1)
    free = free_parameters(model, 0, ROTATIONS, "per_specimen")
    truth, case = np.array([0.3, -0.2, 0.1]), loaded(model, 1)
    measured = sampled(with_parameters(model, free, truth), case, QUASI_STATIC).reshape(1, 1, 6)
    measured[..., :3] = np.nan
    found = fit(problem_of(model, case, measured, free, course=QUASI_STATIC))
    np.testing.assert_allclose(found.x, truth, rtol=0, atol=2e-3)
    assert found.status is Status.CONVERGED, found.message


def test_a_chain_without_mass_is_refused_before_any_run() -> None:
    model = massless()
    free = free_parameters(model, 0, ROTATIONS, "per_specimen")
    problem = problem_of(model, loaded(model, 1), np.full((1, 1, 6), 0.01), free)
    assert np.isfinite(Evaluator(problem).at(np.zeros(3)).residual).all()
    with pytest.raises(RefusedModel, match="mass and inertia"):
        fit(replace(problem, course=QUASI_STATIC))
