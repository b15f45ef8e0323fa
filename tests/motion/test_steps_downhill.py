"""Steps of a trajectory's search: what is tried where a step fails, and what is told at its end."""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import pytest
from moving_spine import everywhere, law, markers, spine
from numpy.linalg import LinAlgError

from spinepipe.motion import trajectory
from spinepipe.motion.asked import SHAPE, Ask, watched
from spinepipe.motion.points import marker_places
from spinepipe.motion.skeleton import MarkerSet, Trial
from spinepipe.motion.trajectory import Costs, Solved, _State, _stepped, law_of, solve
from spinepipe.status import Status

NODES = 3


def bent() -> np.ndarray:
    """(N + 1, 18, 6) forwards, most in the lumbar joints."""
    q = np.zeros((NODES + 1, *SHAPE))
    by = np.linspace(0.0, 1.0, NODES + 1)
    q[:, 1:7, 3], q[:, 7:, 3] = -0.05 * by[:, None], -0.01 * by[:, None]
    return q


def solved(ask: Ask, on: MarkerSet, off_m: float = 0.0, **more: Any) -> Solved:
    """From a spine that stands, where it bends; markers are off their places by an SD."""
    places = marker_places(spine(), on, bent())
    places += np.random.default_rng(20031).normal(0.0, off_m, places.shape)
    seen = np.ones(places.shape[:2], dtype=bool)
    trial = Trial("made", "stance", 0.2 * np.arange(NODES + 1), places, seen, "hanging")
    known = watched(spine(), on, trial, NODES)
    return solve(ask, [known], [np.zeros((known.grid.coefficients, *SHAPE))], **more)


class Slope:
    """A cost of one number: each damping, as told, fails, leads up, down or nowhere."""

    def __init__(self, ends: Callable[[float], float | None]) -> None:
        self.ends, self.tried = ends, list[float]()

    def step(self, asked: object, damping: float) -> tuple[list[np.ndarray], np.ndarray]:
        self.tried.append(damping)
        end = self.ends(damping)
        if end is None:
            raise LinAlgError("not definite")
        return [np.array([end])], np.zeros(0)

    def costs(self, state: _State) -> Costs:
        return Costs(float(state.coefficients[0][0]), 0.0, 0.0, 0.0, 0.0)


def one_step(ends: Callable[[float], float | None], damping: float) -> tuple[Slope, Any]:
    """From a cost of 0; where a step ends is what it costs."""
    slope = Slope(ends)
    begin = _State((np.zeros(1),), np.zeros(0))
    return slope, _stepped(slope, begin, slope.costs(begin), None, damping)  # type: ignore[arg-type]


def test_a_step_that_leads_down_is_taken_and_eases_damping() -> None:
    slope, (state, costs, damping, lost) = one_step(lambda _: -2.0, 1e-3)
    assert (costs.total, state.coefficients[0].tolist(), lost) == (-2.0, [-2.0], "")
    assert slope.tried == [1e-3]
    assert damping == pytest.approx(2e-4)


def test_damping_is_eased_to_a_billionth_at_least() -> None:
    assert one_step(lambda _: -1.0, 2e-9)[1][2] == pytest.approx(1e-9)
    assert one_step(lambda _: -1.0, 1e-8)[1][2] == pytest.approx(2e-9)


def test_a_step_that_costs_the_same_is_taken() -> None:
    slope, _ = one_step(lambda _: 0.0, 1e-3)
    assert len(slope.tried) == 1


@pytest.mark.parametrize("uphill", [1.0, float("nan"), float("inf"), float("-inf")])
def test_a_step_that_leads_up_or_nowhere_is_damped_five_times_as_much(uphill: float) -> None:
    slope, (_, costs, _, _) = one_step(lambda d: uphill if d < 0.1 else -1.0, 1e-3)
    np.testing.assert_allclose(slope.tried, [1e-3, 5e-3, 25e-3, 125e-3])
    assert costs.total == -1.0


def test_a_matrix_that_is_not_definite_is_damped_ten_times_as_much() -> None:
    slope, (_, costs, _, lost) = one_step(lambda d: None if d < 0.05 else -1.0, 1e-3)
    np.testing.assert_allclose(slope.tried, [1e-3, 1e-2, 1e-1])
    assert (costs.total, lost) == (-1.0, "")


def test_where_every_step_leads_up_nothing_moves_and_nothing_is_lost() -> None:
    """A least cost, up to rounding."""
    slope, (state, costs, damping, lost) = one_step(lambda _: 1.0, 1.0)
    assert (costs.total, state.coefficients[0].tolist(), lost) == (0.0, [0.0], "")
    assert damping >= 1e9 > max(slope.tried) > 1e8


def test_where_no_damping_gives_a_step_that_is_told() -> None:
    _, (state, _, _, lost) = one_step(lambda _: None, 1.0)
    assert state.coefficients[0].tolist() == [0.0]
    assert "definite" in lost


def test_equations_that_cannot_be_solved_are_no_least_cost(monkeypatch) -> None:
    def fails(*_: object) -> None:
        raise LinAlgError

    monkeypatch.setattr(trajectory.Factor, "of", fails)
    found = solved(Ask(loads=False, smooth=False), markers())
    assert found.status is Status.NOT_CONVERGED
    assert "definite" in found.message
    assert found.steps == 1


def test_steps_that_run_out_are_told(monkeypatch) -> None:
    monkeypatch.setattr(trajectory, "MOST_STEPS", 2)
    said: list[str] = []
    found = solved(Ask(loads=False, smooth=False), everywhere(), say=said.append)
    assert (found.status, found.steps) == (Status.NOT_CONVERGED, 2)
    assert found.message == "still falling after 2 steps"
    assert [line.split(",")[0] for line in said] == ["step 1", "step 2"]
    assert said[-1].endswith(f"cost {found.costs.total:.5g}")


def test_a_least_cost_is_found_in_few_steps() -> None:
    """Markers are off by 1 mm and nothing else costs: Gauss and Newton's steps, hardly damped."""
    found = solved(Ask(loads=False, smooth=False), everywhere(), 1e-3)
    assert found.status is Status.CONVERGED
    assert found.message == ""
    assert found.steps < 8
    assert found.costs.total == pytest.approx(found.costs.markers)
    assert (found.costs.loads, found.costs.accelerations, found.costs.prior) == (0.0, 0.0, 0.0)
    assert found.law is None


def test_coordinates_that_are_not_there_stay_at_nought() -> None:
    """The motion turns joints alone, so that it is found without their translations."""
    free = np.ones(SHAPE, dtype=bool)
    free[1:, :3] = False
    found = solved(Ask(free=free, loads=False, smooth=False), everywhere())
    at = found.coefficients[0]
    assert not at[:, ~free].any()
    nodes = (at[:-2] + 4.0 * at[1:-1] + at[2:]) / 6.0
    np.testing.assert_allclose(nodes, bent(), atol=1e-4)


def test_a_start_in_coordinates_that_are_not_there_is_not_taken() -> None:
    free = np.ones(SHAPE, dtype=bool)
    free[3] = False
    places = marker_places(spine(), markers(), np.zeros((1, *SHAPE)))
    whole = np.ones(places.shape[:2], dtype=bool)
    trial = Trial("made", "stance", np.zeros(1), places, whole, "hanging")
    known, start = watched(spine(), markers(), trial, 0), np.full((3, *SHAPE), 0.01)
    found = solve(Ask(free=free, loads=False, smooth=False), [known], [start])
    assert not found.coefficients[0][:, 3].any()


def logs(of: Sequence[float]) -> np.ndarray:
    return np.log(np.array(of))


def test_fitted_elements_are_sizes_first_and_then_shapes() -> None:
    """In the order of joints and coordinates; others stay as they are."""
    fitted = np.zeros((17, 6), dtype=bool)
    fitted[2, 3] = fitted[5, 4] = True
    ask = Ask(passive=law(), fitted=fitted)
    found = law_of(ask, logs([2.0, 3.0, 5.0, 7.0]))
    assert found is not None
    np.testing.assert_allclose(found.a[2, 3] / law().a[2, 3], 2.0)
    np.testing.assert_allclose(found.a[5, 4] / law().a[5, 4], 3.0)
    np.testing.assert_allclose(found.b[2, 3] / law().b[2, 3], 5.0)
    np.testing.assert_allclose(found.b[5, 4] / law().b[5, 4], 7.0)
    assert (found.a != law().a).any(axis=-1).sum() == (found.b != law().b).any(axis=-1).sum() == 2
    assert law_of(ask, np.zeros(0)) is ask.passive
    assert law_of(Ask(), np.zeros(0)) is None
