"""Motions that cost least: what is seen is found, costs fall together with their slopes."""

from dataclasses import replace

import numpy as np
import pytest
from moving_spine import everywhere, law, markers, sampled, spine, trial_at
from scipy.interpolate import BSpline

from spinepipe.motion.banded import Band, BandFactor, bordered_step
from spinepipe.motion.objective import MotionObjective, ResidualScales, sample_trial
from spinepipe.motion.points import COUNT, marker_places
from spinepipe.motion.posture import postures as fitted_postures
from spinepipe.motion.residual_terms import Markers, MuscleDemand, range_excess
from spinepipe.motion.spline import KnotGrid
from spinepipe.motion.trajectory import Trajectory, _Iterate, law_of, solve
from spinepipe.status import Status

NODES = 6


def bent(frames: int) -> np.ndarray:
    """Forwards and back, most in the lumbar joints."""
    q = np.zeros((frames, 18, 6))
    by = np.sin(np.linspace(0.0, np.pi, frames)) ** 2
    q[:, 1:7, 3] = -0.08 * by[:, None]
    q[:, 7:, 3] = -0.015 * by[:, None]
    q[:, 0, 3] = -0.1 * by
    return q


def test_a_spline_goes_through_its_nodes() -> None:
    grid = KnotGrid(1.0, 0.1, NODES)
    places = np.random.default_rng(0).normal(size=(NODES + 1, 2))
    curve = grid.through(places)
    at, velocity, acceleration = grid.at_nodes(curve)
    np.testing.assert_allclose(at, places, atol=1e-12)
    np.testing.assert_allclose(acceleration[[0, -1]], 0.0, atol=1e-9)
    spline = BSpline(1.0 + 0.1 * np.arange(-3, NODES + 4), curve, 3)
    np.testing.assert_allclose(spline(grid.times_s), places, atol=1e-12)
    np.testing.assert_allclose(spline(grid.times_s, 1), velocity, atol=1e-10)
    np.testing.assert_allclose(spline(grid.times_s[1:-1], 2), acceleration[1:-1], atol=1e-8)


def whole_of(band: Band) -> np.ndarray:
    """The matrix of a band, all of it."""
    count = len(band.blocks)
    found = np.zeros((count, COUNT, count, COUNT))
    for k in range(count):
        for below in range(min(3, count - k)):
            found[k + below, :, k] = band.blocks[k, below]
            found[k, :, k + below] = band.blocks[k, below].T
    return found.reshape(count * COUNT, count * COUNT)


@pytest.mark.numeric
def test_a_bordered_band_is_solved_as_the_whole_matrix_is() -> None:
    """Block Cholesky and the Schur complement beside LAPACK on the whole; five coefficients, so
    that there are some with both neighbours, some with one and one with none below."""
    rng = np.random.default_rng(1)
    nodes, shared, count = 3, 3, 5
    band, size = Band.empty(count, shared), count * COUNT
    whole = np.zeros((size + shared, size + shared))
    right = np.zeros(size + shared)
    for node in range(nodes):
        both, off = rng.normal(size=(400, 3 * COUNT + shared)), rng.normal(size=400)
        at = [*range(node * COUNT, (node + 3) * COUNT), *range(size, size + shared)]
        whole[np.ix_(at, at)] += both.T @ both
        right[at] += both.T @ off
    blocks = whole[:size, :size].reshape(count, COUNT, count, COUNT)
    for k in range(count):
        for below in range(min(3, count - k)):
            band.blocks[k, below] = blocks[k + below, :, k]
    band.border[:] = whole[:size, size:].reshape(count, COUNT, shared)
    band.slope[:] = right[:size].reshape(count, COUNT)
    assert (whole_of(band) == whole[:size, :size]).all(), "nothing reaches further than three"
    factor = BandFactor.of(band, 0.3 * band.diagonal + 1e-3)
    square = whole[size:, size:].copy()
    (step,), params = bordered_step([band], [factor], square, right[size:])
    whole[range(size), range(size)] += 0.3 * np.diag(whole)[:size] + 1e-3
    expected = -np.linalg.solve(whole, right)
    np.testing.assert_allclose(np.append(step, params), expected, atol=1e-8)


@pytest.mark.parametrize("force_cost", ["squared", "minus_gravity", "level_difference"])
def test_slopes_of_the_cost_are_differences(force_cost: str) -> None:
    """Half the gradient, by coefficients and by logarithms of sizes and shapes."""
    fitted = np.zeros((17, 6), dtype=bool)
    fitted[:2, 3:] = True
    low, high = np.full((18, 6), -1e-3), np.full((18, 6), 1e-3)
    ask = MotionObjective(low=low, high=high, passive=law(), force_cost=force_cost, fitted=fitted)  # type: ignore[arg-type]
    seen = sampled(bent(NODES + 1), step_s=0.2)
    rng = np.random.default_rng(2)
    state = _Iterate(
        (rng.normal(0.0, 1e-3, (seen.grid.coefficients, 18, 6)),),
        rng.normal(0.0, 0.2, ask.parameters),
    )
    problem = Trajectory(ask, (seen,))
    asked = problem.normal(state)
    for k in rng.choice(asked.bands[0].slope.size, 12, replace=False):
        step = np.zeros(asked.bands[0].slope.size)
        step[k] = 1e-5
        none = np.zeros(ask.parameters)
        apart = problem.cost(state.plus([step], none))
        apart -= problem.cost(state.plus([-step], none))
        assert asked.bands[0].slope.ravel()[k] == pytest.approx(apart / 4e-5, rel=1e-3, abs=0.1)
    for k in range(ask.parameters):
        step = np.zeros(ask.parameters)
        step[k] = 1e-5
        still = [np.zeros(asked.bands[0].slope.size)]
        apart = problem.cost(state.plus(still, step))
        apart -= problem.cost(state.plus(still, -step))
        assert asked.slope[k] == pytest.approx(apart / 4e-5, rel=1e-3, abs=1e-6)


@pytest.mark.parametrize("force_cost", ["squared", "level_difference"])
def test_curvatures_are_products_of_differences(force_cost: str) -> None:
    """Gauss and Newton's: slopes of all residuals, by differences, times each other."""
    fitted = np.zeros((17, 6), dtype=bool)
    fitted[3:5, 3] = True
    low, high = np.full((18, 6), -1e-3), np.full((18, 6), 1e-3)
    ask = MotionObjective(low=low, high=high, passive=law(), force_cost=force_cost, fitted=fitted)  # type: ignore[arg-type]
    seen = sampled(bent(NODES + 1), step_s=0.2)
    rng, nodes = np.random.default_rng(3), seen.grid.coefficients
    state = _Iterate((rng.normal(0.0, 0.01, (nodes, 18, 6)),), rng.normal(0.0, 0.2, 4))
    problem = Trajectory(ask, (seen,))

    def residuals(there: _Iterate) -> np.ndarray:
        """Everything that costs, each with its share."""
        motion = seen.grid.at_nodes(there.coefficients[0])
        parts = [
            Markers(seen, ask).residuals(motion[0]),
            MuscleDemand.of(seen, ask).residuals(law_of(ask, there.parameters), motion),
            motion[2] / ([2.0] * 3 + [10.0] * 3),
            range_excess(ask, motion[0])[0],
        ]
        worth = np.sqrt(10.0 / (NODES + 1))  # all nodes together are ten frames
        prior = there.parameters / [0.7, 0.7, 0.35, 0.35]
        return np.concatenate([*(worth * part.ravel() for part in parts), prior])

    assert problem.cost(state) == pytest.approx(np.sum(residuals(state) ** 2))
    first = np.array([0, 1, 5, 6 * 4 + 3, 6 * 5 + 3, 6 * 17 + 4])
    columns = np.concatenate([2 * COUNT + first, 3 * COUNT + first[:3], 4 * COUNT + first[3:]])
    slopes, none, small = [], np.zeros(4), 1e-6
    for column in columns:
        step = np.zeros(nodes * COUNT)
        step[column] = small
        there, back = (state.plus([sign * step], none) for sign in (1.0, -1.0))
        slopes.append((residuals(there) - residuals(back)) / (2.0 * small))
    for which in range(4):
        step = small * np.eye(4)[which]
        still = [np.zeros(nodes * COUNT)]
        there, back = (state.plus(still, sign * step) for sign in (1.0, -1.0))
        slopes.append((residuals(there) - residuals(back)) / (2.0 * small))
    expected = np.array(slopes) @ np.array(slopes).T
    asked = problem.normal(state)
    band, count = asked.bands[0], len(columns)
    found = np.zeros_like(expected)
    found[:count, :count] = whole_of(band)[np.ix_(columns, columns)]
    border = band.border.reshape(-1, 4)[columns]
    found[:count, count:], found[count:, :count] = border, border.T
    found[count:, count:] = asked.square
    # rows and columns of N, N m, m and rad: each beside its own size
    size = np.sqrt(np.diag(expected))
    np.testing.assert_allclose(
        found / np.outer(size, size), expected / np.outer(size, size), rtol=0.0, atol=1e-6
    )


def test_with_second_derivatives_curvatures_are_differences_of_slopes() -> None:
    """Of what passive elements do, the rest being straight: these bodies have no mass, and markers
    count nothing."""
    masses = spine().masses
    weightless = replace(masses, kg=0.0 * masses.kg, about_com=0.0 * masses.about_com)
    fitted = np.zeros((17, 6), dtype=bool)
    fitted[3:5, 3] = fitted[8, 1] = True
    free = np.ones((18, 6), dtype=bool)
    free[6, :3] = False
    ask = MotionObjective(free=free, passive=law(), force_cost="level_difference", fitted=fitted)
    seen = replace(sampled(bent(4), step_s=0.2), skeleton=replace(spine(), masses=weightless))
    seen = replace(seen, weight=np.zeros_like(seen.weight))
    rng, size, shared = np.random.default_rng(3), seen.grid.coefficients * COUNT, ask.parameters
    state = _Iterate(
        (rng.normal(0.0, 1e-2, (seen.grid.coefficients, 18, 6)) * ([0.1] * 3 + [1.0] * 3) * free,),
        rng.normal(0.0, 0.2, shared),
    )
    problem, small = Trajectory(ask, (seen,)), 1e-6
    asked, plain = problem.normal(state, newton=True), problem.normal(state)
    assert (asked.scales[0] == plain.bands[0].diagonal).all()
    assert (asked.scale == np.diag(plain.square)).all()

    def slopes(there: _Iterate) -> np.ndarray:
        found = problem.normal(there)
        return np.concatenate([found.bands[0].slope.ravel(), found.slope])

    count = int(free.sum())
    places = np.flatnonzero(np.tile(free.ravel(), seen.grid.coefficients))
    for k in [*rng.choice(len(places), 10, replace=False), *len(places) + np.arange(shared)]:
        move, turn = np.zeros(size), np.zeros(shared)
        if k < len(places):
            move[places[k]] = small
        else:
            turn[k - len(places)] = small
        ahead = slopes(state.plus([move], turn))
        expected = (ahead - slopes(state.plus([-move], -turn))) / (2.0 * small)
        band, column = asked.bands[0], k - len(places)
        if column < 0:
            node, at = divmod(int(k), count)
            found = np.zeros((seen.grid.coefficients, count))
            for below in range(min(3, seen.grid.coefficients - node)):
                found[node + below] = band.blocks[node, below][:, at]
            for above in range(1, min(3, node + 1)):
                found[node - above] = band.blocks[node - above, above][at]
            whole = np.concatenate([found.ravel(), band.border[node, at]])
        else:
            whole = np.concatenate([band.border[..., column].ravel(), asked.square[:, column]])
        np.testing.assert_allclose(whole, expected, rtol=0.0, atol=1e-5 * np.abs(expected).max())


@pytest.mark.numeric
@pytest.mark.parametrize("held", [None, (False, True, False, True)])
@pytest.mark.parametrize("damping", [0.0, 0.3])
def test_a_step_is_that_of_the_whole_damped_matrix(
    damping: float, held: tuple[bool, ...] | None
) -> None:
    """Marquardt's: every diagonal by so much larger; parameters that are held do not move."""
    fitted = np.zeros((17, 6), dtype=bool)
    fitted[3:5, 3] = True
    ask = MotionObjective(passive=law(), fitted=fitted)
    seen = sampled(bent(4), step_s=0.2)
    rng, size = np.random.default_rng(6), seen.grid.coefficients * COUNT
    coefficients = rng.normal(0.0, 0.01, (seen.grid.coefficients, 18, 6))
    loose = np.ones(4, dtype=bool) if held is None else ~np.array(held)
    given = None if held is None else np.array(held)
    problem = Trajectory(ask, (seen,), given)
    asked = problem.normal(_Iterate((coefficients,), rng.normal(0.0, 0.2, 4)))
    band, whole = asked.bands[0], np.zeros((size + 4, size + 4))
    whole[:size, :size] = whole_of(band)
    border = band.border.reshape(size, 4)
    whole[:size, size:], whole[size:, :size] = border, border.T
    whole[size:, size:] = asked.square
    whole += damping * np.diag(np.diag(whole))
    whole[range(size), range(size)] += 1e-9 * band.diagonal.max()
    moves = np.concatenate([np.ones(size, dtype=bool), loose])
    expected = np.zeros(size + 4)
    down = np.concatenate([band.slope.ravel(), asked.slope])
    expected[moves] = -np.linalg.solve(whole[np.ix_(moves, moves)], down[moves])
    (step,), shared, gain = problem.step(asked, damping)
    # beside what nothing asks about, which is 1e9 times as soft
    found = np.concatenate([step.ravel(), shared])
    np.testing.assert_allclose(found, expected, rtol=0.0, atol=1e-5 * np.abs(expected).max())
    assert not shared[~loose].any()
    # what the quadratic form falls by: half slopes and half curvatures both count twice
    whole[range(size + 4), range(size + 4)] -= damping / (1.0 + damping) * np.diag(whole)
    assert gain == pytest.approx(-2.0 * down @ expected - expected @ whole @ expected, rel=1e-4)


def test_what_markers_show_is_found_when_nothing_else_costs() -> None:
    q = bent(9)
    seen = sampled(q, everywhere(), step_s=0.2)
    ask = MotionObjective(loads=False, smooth=False)
    found = fitted_postures(ask, seen)
    assert found.settled.all()
    np.testing.assert_allclose(found.q, q, atol=1e-6)
    solved = solve(ask, [seen], [seen.grid.through(np.zeros_like(q))])
    assert solved.status is Status.CONVERGED
    np.testing.assert_allclose(seen.grid.at_nodes(solved.coefficients[0])[0], q, atol=1e-4)


def test_true_elements_beat_wrong_ones() -> None:
    """Held still by passive elements alone: the truth costs less than stiffer or softer ones."""
    free = MotionObjective(passive=law(), sizes=ResidualScales(marker_m=1e-4, loads=1.0))
    nothing = sampled(np.zeros((1, 18, 6)))
    # a posture in which the true elements carry all weight: no markers, loads alone
    unseen = replace(nothing, weight=np.zeros_like(nothing.weight))
    hung = fitted_postures(free, unseen)
    seen = sampled(hung.q)
    apart = {
        stiffer: np.abs(
            np.rad2deg(fitted_postures(replace(free, passive=law(stiffer)), seen).q - hung.q)
        )[:, 1:, 3:].max()
        for stiffer in (1.0, 0.3, 3.0)
    }
    assert apart[1.0] < 0.05
    assert apart[0.3] > 2.0 * apart[1.0]
    assert apart[3.0] > 2.0 * apart[1.0]


def test_nodes_lie_between_frames_and_gaps_count_nothing() -> None:
    q = bent(41)
    made = trial_at(marker_places(spine(), markers(), q), 0.01)
    hidden = made.seen.copy()
    hidden[:, 3] = False
    hidden[::2, 5] = False
    seen = sample_trial(spine(), markers(), replace(made, seen=hidden), 10)
    assert not seen.weight[:, 3].any()
    assert seen.weight[:, 5].all()
    assert np.isfinite(seen.places).all()
    whole = sample_trial(spine(), markers(), made, 10)
    np.testing.assert_allclose(whole.places, made.places[::4], atol=1e-12)
    np.testing.assert_allclose(seen.places[:, 5], made.places[::4, 5], atol=2e-3)
