"""Regions of fitted unknowns against closed forms and plain scans of the cost.

Catches a region too narrow, and an end that was not looked for.
"""

from dataclasses import replace

import numpy as np
import pytest
from example_effects import NOWHERE, loaded, spine
from scipy import stats
from scipy.optimize import brentq, minimize_scalar
from sweeps import sweep

from spinepipe.calibration import Evaluator, Fit, MeasuredCase, Problem, fit
from spinepipe.calibration.profile import NEAR, Best, Profile, profile_in_turn
from spinepipe.effects import Wrench
from spinepipe.effects.contract import Array
from spinepipe.frames import Pose
from spinepipe.model import LoadCase, LoadStep, SpineModel
from spinepipe.statics import System, follow, free_parameters, observe
from spinepipe.world import Chain

pytestmark = pytest.mark.numeric

EXTENSION, ANTERIOR = 3, 0
MOMENTS_NM = np.array([1.0, 2.0, 3.0, 4.0, 5.0])
SLACK = NEAR / 2.0
"""An end is found to this share of the way to it: the rise is nearly a square."""


def moments(model: SpineModel, zeroed: bool = False) -> LoadCase:
    """Moments about the right axis on the top vertebra, in some cases after an unloaded step."""
    sizes = [0.0, *MOMENTS_NM] if zeroed else MOMENTS_NM
    top = model.n_joints - 1
    steps = (
        LoadStep(number, (Wrench(top, NOWHERE, NOWHERE, np.array([0.0, 0.0, size])),))
        for number, size in enumerate(sizes)
    )
    return LoadCase("moments", 1, tuple(steps))


def one_spring(readings: Array, reach: float, zeroed: bool = False) -> Problem:
    """A joint under moments, its extension (T,) read in rad: theta = M / k."""
    upright = (Pose(np.eye(3), np.zeros(3)),)
    model = replace(spine(1, gravity=False), frames=upright)
    case = moments(model, zeroed)
    measured = np.full((len(case.steps), 1, 6), np.nan)
    measured[:, 0, EXTENSION] = readings
    free = free_parameters(model, 0, ("extension_nm_per_rad",), "per_joint")
    bounds = np.full(1, reach)
    cases = (MeasuredCase(case, measured, zeroed),)
    return Problem(model, cases, free, np.ones(6), -bounds, bounds)


def region(found: Fit) -> Profile:
    assert found.profile is not None
    return found.profile


def compliances(problem: Problem, moves: Array) -> Array:
    """1 / k of a single spring whose logarithm is moved."""
    start = problem.model.effects[0].values[0, EXTENSION]
    return np.exp(-moves) / start


def noisy(seed: int, stiffness: float, sd: float = 2e-3) -> Array:
    rng = np.random.default_rng(seed)
    return MOMENTS_NM / stiffness + sd * rng.normal(size=len(MOMENTS_NM))


@sweep("seed", range(4))
@sweep("noise", [None, 2e-3])
def test_a_spring_under_moments_has_the_region_of_a_straight_line(
    seed: int, noise: float | None
) -> None:
    """theta = M u is linear in u = 1 / k: u lies within t s / |M| of M theta / M^2."""
    theta = noisy(seed, 60.0)
    problem = one_spring(theta, 8.0)
    sds = None if noise is None else np.full(6, noise)
    found = fit(problem, noise=sds, profiled=True)
    size = float(MOMENTS_NM @ MOMENTS_NM)
    u = float(MOMENTS_NM @ theta) / size
    freedom = len(theta) - 1
    scatter = np.sqrt(np.sum((theta - MOMENTS_NM * u) ** 2) / freedom) if noise is None else noise
    limit = stats.t.ppf(0.975, freedom) if noise is None else stats.norm.ppf(0.975)
    way = limit * scatter / np.sqrt(size)
    seen = region(found)
    ends = compliances(problem, np.concatenate([seen.high, seen.low]))
    np.testing.assert_allclose(ends, [u - way, u + way], rtol=0, atol=SLACK * way)
    assert seen.closed.all()
    assert not seen.lower_cost


def test_readings_zeroed_alike_have_the_region_of_their_standard_error() -> None:
    """They share the error of step 0; the line's slope has the sandwich's SD, whatever the end."""
    theta = np.concatenate([[0.0], noisy(5, 60.0)])
    problem = one_spring(theta, 8.0, zeroed=True)
    found = fit(problem, profiled=True)
    sd = float(found.uncertainty.standard_error[0])
    u = compliances(problem, found.x)[0]
    way = stats.t.ppf(0.975, found.uncertainty.degrees_of_freedom) * sd * u
    ends = compliances(problem, np.concatenate([region(found).high, region(found).low]))
    np.testing.assert_allclose(ends, [u - way, u + way], rtol=0, atol=SLACK * way)


def test_a_joint_too_stiff_for_its_readings_is_open_above() -> None:
    """Its compliance may be zero: the region has no upper end, though the fit has an error."""
    theta = noisy(1, 2000.0)
    problem = one_spring(theta, 8.0)
    found = fit(problem, profiled=True)
    seen = region(found)
    assert np.isfinite(found.uncertainty.standard_error[0])
    assert (seen.open_below[0], seen.open_above[0]) == (False, True)
    assert seen.high[0] == problem.upper[0]
    assert np.isfinite(seen.low[0])
    assert seen.low[0] < found.x[0]


def test_from_its_upper_bound_the_lower_end_is_found() -> None:
    """Readings that turn against the moments: the best 1 / k would be negative, the fit is at its
    bound, and its lower end lies far below."""
    theta = noisy(0, 1e6) - 1e-4 * MOMENTS_NM
    size = float(MOMENTS_NM @ MOMENTS_NM)
    u = float(MOMENTS_NM @ theta) / size
    assert u < 0.0
    problem = one_spring(theta, 9.0)
    found = fit(problem, profiled=True)
    seen = region(found)
    at = compliances(problem, problem.upper)[0]
    freedom = len(theta) - 1
    scatter = np.sqrt(np.sum((theta - MOMENTS_NM * at) ** 2) / freedom)
    way = stats.t.ppf(0.975, freedom) * scatter / np.sqrt(size)
    end = u + np.hypot(at - u, way)  # the cost rises from what it is at the bound
    assert found.at_bound.tolist() == [1]
    assert (seen.open_below[0], seen.open_above[0]) == (False, True)
    assert end > 50.0 * at
    assert compliances(problem, seen.low)[0] == pytest.approx(end, abs=SLACK * way)


def test_exact_readings_leave_no_room() -> None:
    """No scatter, no region: both ends are the fitted value."""
    seen = region(fit(one_spring(MOMENTS_NM / 60.0, 8.0), profiled=True))
    assert seen.closed.all()
    np.testing.assert_allclose(seen.high - seen.low, 0.0, atol=1e-6)


def test_a_cost_that_rises_slowly_is_followed_to_its_end() -> None:
    """The upper end lies 20 times as far as the error says: 1 / k comes close to zero there."""
    theta = noisy(2, 240.0)
    size = float(MOMENTS_NM @ MOMENTS_NM)
    u = float(MOMENTS_NM @ theta) / size
    scatter = np.sqrt(np.sum((theta - MOMENTS_NM * u) ** 2) / (len(theta) - 1))
    way = stats.t.ppf(0.975, len(theta) - 1) * scatter / np.sqrt(size)
    problem = one_spring(MOMENTS_NM * (1.02 * way) + theta - MOMENTS_NM * u, 12.0)
    seen = region(fit(problem, profiled=True))
    assert not seen.open_above[0]
    assert compliances(problem, seen.high)[0] == pytest.approx(0.02 * way, abs=SLACK * way)


def test_an_unknown_without_trace_is_open_on_both_sides() -> None:
    problem = one_spring(noisy(0, 60.0), 3.0)
    more = free_parameters(
        problem.model, 0, ("extension_nm_per_rad", "right_bending_nm_per_rad"), "per_joint"
    )
    bounds = np.full(2, 3.0)
    found = fit(replace(problem, free=more, lower=-bounds, upper=bounds), profiled=True)
    seen = region(found)
    assert seen.closed.tolist() == [True, False]
    assert (seen.open_below[1], seen.open_above[1]) == (True, True)
    assert (seen.low[1], seen.high[1]) == (-3.0, 3.0)


def bent(seed: int) -> Problem:
    """A spine of two joints under its loads and weight, noisy readings of two coordinates."""
    model = spine(2)
    case = loaded(model)
    steps = follow(System(Chain(model), model, case))
    seen = np.stack([observe(System(Chain(model), model, case), s.equilibrium.q) for s in steps])
    rng = np.random.default_rng(seed)
    seen = seen + rng.normal(size=seen.shape) * np.array([2e-4] * 3 + [2e-3] * 3)
    keep = np.isin(np.arange(6), [ANTERIOR, EXTENSION])
    free = free_parameters(model, 0, ("anterior_n_per_m", "extension_nm_per_rad"), "per_specimen")
    bounds = np.full(2, 5.0)
    cases = (MeasuredCase(case, np.where(keep, seen, np.nan)),)
    return Problem(model, cases, free, np.ones(6), -bounds, bounds)


@sweep("seed", [0, 1])
@sweep("unknown", [0, 1])
def test_ends_lie_where_a_scan_of_the_cost_has_them(seed: int, unknown: int) -> None:
    problem = bent(seed)
    found = fit(problem, profiled=True)
    evaluator = Evaluator(problem)
    seen, m = region(found), 2
    best = evaluator.at(found.x)
    assert best.residual is not None
    cost = float(best.residual @ best.residual)
    freedom = len(best.residual) - m
    allowed = stats.t.ppf(0.975, freedom) ** 2 * cost / freedom
    for end, is_open in (
        (seen.low[unknown], seen.open_below[unknown]),
        (seen.high[unknown], seen.open_above[unknown]),
    ):
        rise = scanned(evaluator, unknown, float(end), found.x) - cost
        if is_open:
            assert rise < allowed
        else:
            assert rise == pytest.approx(allowed, rel=1.5 * NEAR)


def scanned(evaluator: Evaluator, unknown: int, value: float, near: Array) -> float:
    """Least cost with an unknown of two held, the other looked for by golden section."""

    def cost(other: float) -> float:
        x = np.full(2, value)
        x[1 - unknown] = other
        residual = evaluator.at(x).residual
        return np.inf if residual is None else float(residual @ residual)

    around = float(near[1 - unknown])
    found = minimize_scalar(cost, bounds=(around - 2.0, around + 2.0), method="bounded")
    return float(found.fun)


def test_a_stiffness_reaches_from_one_end_of_its_region_to_the_other() -> None:
    """k = 1 / u, so its ends are 1 / (u + way) and, where the data have one, 1 / (u - way)."""
    size = float(MOMENTS_NM @ MOMENTS_NM)
    for stiffness, is_open in ((60.0, False), (8000.0, True)):
        theta = noisy(1, stiffness)
        u = float(MOMENTS_NM @ theta) / size
        way = stats.norm.ppf(0.975) * 2e-3 / np.sqrt(size)
        found = fit(one_spring(theta, 8.0), noise=np.full(6, 2e-3), profiled=True)
        reach = found.reach(0, float(found.values[0]))
        assert reach is not None
        assert (reach.open_below, reach.open_above) == (False, is_open)
        assert reach.low == pytest.approx(1.0 / (u + way), rel=2.0 * SLACK)
        if is_open:
            assert reach.high is None
        else:
            assert reach.high == pytest.approx(1.0 / (u - way), rel=2.0 * SLACK)
        assert found.identifiable(0) is not is_open


def test_a_fit_without_regions_identifies_nothing() -> None:
    found = fit(one_spring(noisy(0, 60.0), 8.0))
    assert found.profile is None
    assert found.reach(0, 60.0) is None
    assert not found.identifiable(0)


def test_an_end_before_a_wall_is_found_though_the_cost_hardly_rises_on_the_way() -> None:
    """A residual 0.2 x + (x / 3)^15: a straight one would end at 9.8, this one ends near 3."""

    def point(x: Array) -> tuple[Array, Array]:
        slope = 0.2 + 5.0 * (x / 3.0) ** 14
        return 0.2 * x + (x / 3.0) ** 15, slope[:, None]

    start, far = np.zeros(1), np.full(1, 50.0)
    straight = np.zeros(1, dtype=bool)
    best = Best(start, *point(start), -far, far, np.ones(1), straight)
    seen = profile_in_turn(best, point, [0])
    end = brentq(lambda x: float(point(np.array([x]))[0][0]) - stats.norm.ppf(0.975), 1.0, 9.0)
    assert seen.closed.all()
    for found in (seen.high[0], -seen.low[0]):
        assert end <= found < 1.2 * end
