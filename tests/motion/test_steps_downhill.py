"""Steps of a trajectory's search: what is tried where a step fails, and what is told at its end."""

from collections.abc import Callable

import numpy as np
import pytest
from moving_spine import everywhere, law, markers, sampled
from numpy.linalg import LinAlgError

from spinepipe.motion import trajectory
from spinepipe.motion.objective import SHAPE, MotionObjective
from spinepipe.motion.skeleton import MarkerSet
from spinepipe.motion.trajectory import (
    _FOUND,
    SMALL,
    OptimalMotions,
    _Iterate,
    _MotionSearch,
    _take_step,
    law_of,
    solve,
)
from spinepipe.status import Status

NODES = 3


def bent() -> np.ndarray:
    """(N + 1, 18, 6) forwards, most in the lumbar joints."""
    q = np.zeros((NODES + 1, *SHAPE))
    by = np.linspace(0.0, 1.0, NODES + 1)
    q[:, 1:7, 3], q[:, 7:, 3] = -0.05 * by[:, None], -0.01 * by[:, None]
    return q


def solved(ask: MotionObjective, on: MarkerSet, off_m: float = 0.0) -> OptimalMotions:
    """From a spine that stands, where it bends; markers are off their places by an SD."""
    off = np.random.default_rng(20031).normal(0.0, off_m, (NODES + 1, len(on), 3))
    known = sampled(bent(), on, off, 0.2)
    return solve(ask, [known], [np.zeros((known.grid.coefficients, *SHAPE))])


class Slope:
    """A cost of one number: a damping fails, or leads to a cost and predicts a gain, as told."""

    def __init__(
        self,
        ends: Callable[[float], float | None],
        gains: Callable[[float], float] = lambda _: 1.0,
        elements: bool = True,
    ) -> None:
        self.ends, self.gains, self.ask = (
            ends,
            gains,
            MotionObjective(passive=law() if elements else None),
        )
        self.tried = list[float]()

    def normal(self, state: _Iterate, newton: bool) -> None:
        """Nothing hangs on it here."""

    def step(self, asked: object, damping: float) -> tuple[list[np.ndarray], np.ndarray, float]:
        self.tried.append(damping)
        end = self.ends(damping)
        if end is None:
            raise LinAlgError("not definite")
        return [np.array([end])], np.zeros(0), self.gains(damping)

    def cost(self, state: _Iterate) -> float:
        return float(state.coefficients[0][0])


def one_step(slope: Slope, damping: float = 1e-3, newton: bool = True) -> _MotionSearch:
    """From a cost of 0; where a step ends is what it costs."""
    begin = _Iterate((np.zeros(1),), np.zeros(0))
    return _take_step(slope, _MotionSearch(begin, slope.cost(begin), damping, newton))  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("gained", "eased"),
    [(1.0, 0.1), (1.4, 0.1), (0.75, 0.875), (0.5, 1.0), (0.3, 1.064), (1e-9, 2.0)],
)
def test_damping_follows_the_share_of_the_predicted_gain(gained: float, eased: float) -> None:
    """Nielsen's 1 - (2 r - 1)^3, a tenth at least, and a billionth in all."""
    slope = Slope(lambda _: -gained)
    found = one_step(slope)
    assert (found.cost, found.ended, slope.tried) == (-gained, "", [1e-3])
    assert found.damping == pytest.approx(1e-3 * eased)
    for before, after in ((2e-9, 1e-9), (2e-8, 2e-9)):
        assert one_step(Slope(lambda _: -1.0), before).damping == pytest.approx(after)


@pytest.mark.parametrize("uphill", [0.0, 1.0, float("nan"), float("inf"), float("-inf"), None])
def test_steps_that_gain_nothing_are_damped_twice_and_then_more_and_more(
    uphill: float | None,
) -> None:
    """Also where the matrix is not definite."""
    slope = Slope(lambda d: uphill if d < 0.1 else -1.0)
    found = one_step(slope)
    np.testing.assert_allclose(slope.tried, [1e-3, 2e-3, 8e-3, 64e-3, 1.024])
    assert (found.cost, found.ended) == (-1.0, "")


@pytest.mark.parametrize(("end", "cost"), [(-0.2, -0.2), (-0.3, -0.3), (1.0, 0.0)])
def test_second_derivatives_count_once_a_step_gains_little(end: float, cost: float) -> None:
    """Less than a quarter of what was predicted; a step uphill is not damped before they do."""
    slope = Slope(lambda _: end)
    found = one_step(slope, newton=False)
    assert found.newton is (end > -0.25)
    assert (found.cost, slope.tried) == (cost, [1e-3])


def test_without_passive_elements_second_derivatives_never_count() -> None:
    slope = Slope(lambda d: 1.0 if d < 5e-3 else -0.1, elements=False)
    found = one_step(slope, newton=False)
    assert (found.newton, found.cost) == (False, -0.1)


LITTLE, MUCH = 0.9 * SMALL, 2.0 * SMALL


@pytest.mark.parametrize(
    ("undamped", "gain", "newton", "ended", "cost", "tried"),
    [
        (-1e-5, LITTLE, True, _FOUND, -1e-5, [1.0, 0.0]),
        (1e-9, LITTLE, True, _FOUND, 0.0, [1.0, 0.0]),  # taken where it gains
        (-1e-5, MUCH, True, "", -1e-5, [1.0, 0.0]),  # short for its damping alone
        (None, LITTLE, True, "", -1e-5, [1.0, 0.0]),  # not definite without
        (-1e-5, LITTLE, False, "", 0.0, [1.0]),  # second derivatives are asked before
    ],
)
def test_the_end_is_where_an_undamped_step_would_gain_nearly_nothing(
    undamped: float | None, gain: float, newton: bool, ended: str, cost: float, tried: list[float]
) -> None:
    slope = Slope(lambda d: -1e-5 if d else undamped, lambda d: LITTLE if d else gain)
    found = one_step(slope, 1.0, newton)
    assert (found.ended, found.cost, slope.tried) == (ended, cost, tried)
    assert found.newton


@pytest.mark.parametrize(("end", "says"), [(1.0, "though its slope"), (None, "definite")])
def test_where_no_damping_leads_down_that_is_told(end: float | None, says: str) -> None:
    slope = Slope(lambda _: end)
    found = one_step(slope, 1.0)
    assert (found.cost, found.state.coefficients[0].tolist()) == (0.0, [0.0])
    assert says in found.ended
    assert 1e9 > max(slope.tried) > 1e6


def test_equations_that_cannot_be_solved_are_no_least_cost(monkeypatch) -> None:
    def fails(*_: object) -> None:
        raise LinAlgError

    monkeypatch.setattr(trajectory.BandFactor, "of", fails)
    found = solved(MotionObjective(loads=False, smooth=False), markers())
    assert found.status is Status.NOT_CONVERGED
    assert "definite" in found.message
    assert found.steps == 1


def test_steps_that_run_out_are_told(monkeypatch) -> None:
    monkeypatch.setattr(trajectory, "MOST_STEPS", 2)
    found = solved(MotionObjective(loads=False, smooth=False), everywhere())
    assert (found.status, found.steps) == (Status.NOT_CONVERGED, 2)
    assert found.message == "still falling after 2 steps"


def test_a_least_cost_is_found_in_few_steps() -> None:
    """Markers are off by 1 mm and nothing else costs: Gauss and Newton's steps, hardly damped."""
    found = solved(MotionObjective(loads=False, smooth=False), everywhere(), 1e-3)
    assert found.status is Status.CONVERGED
    assert found.message == ""
    assert found.steps < 8
    assert found.law is None


def test_coordinates_that_are_not_there_stay_at_nought() -> None:
    """The motion turns joints alone, so that it is found without their translations."""
    free = np.ones(SHAPE, dtype=bool)
    free[1:, :3] = False
    found = solved(MotionObjective(free=free, loads=False, smooth=False), everywhere())
    at = found.coefficients[0]
    assert not at[:, ~free].any()
    nodes = (at[:-2] + 4.0 * at[1:-1] + at[2:]) / 6.0
    np.testing.assert_allclose(nodes, bent(), atol=1e-4)


def test_a_start_in_coordinates_that_are_not_there_is_not_taken() -> None:
    free = np.ones(SHAPE, dtype=bool)
    free[3] = False
    known, start = sampled(np.zeros((1, *SHAPE))), np.full((3, *SHAPE), 0.01)
    found = solve(MotionObjective(free=free, loads=False, smooth=False), [known], [start])
    assert not found.coefficients[0][:, 3].any()


def test_fitted_elements_are_sizes_first_and_then_shapes() -> None:
    """In the order of joints and coordinates; others stay as they are."""
    fitted = np.zeros((17, 6), dtype=bool)
    fitted[2, 3] = fitted[5, 4] = True
    ask = MotionObjective(passive=law(), fitted=fitted)
    found = law_of(ask, np.log([2.0, 3.0, 5.0, 7.0]))
    assert found is not None
    np.testing.assert_allclose(found.a[2, 3] / law().a[2, 3], 2.0)
    np.testing.assert_allclose(found.a[5, 4] / law().a[5, 4], 3.0)
    np.testing.assert_allclose(found.b[2, 3] / law().b[2, 3], 5.0)
    np.testing.assert_allclose(found.b[5, 4] / law().b[5, 4], 7.0)
    assert (found.a != law().a).any(axis=-1).sum() == (found.b != law().b).any(axis=-1).sum() == 2
    assert law_of(ask, np.zeros(0)) is ask.passive
    assert law_of(MotionObjective(), np.zeros(0)) is None
