"""Motions seen from elsewhere, in a mirror, begun elsewhere or on other nodes are the same."""

from collections.abc import Callable
from functools import cache

import numpy as np
import pytest
from moving_spine import law, markers, spine, trial_at
from scipy.spatial.transform import Rotation

from spinepipe.motion.objective import ForceCost, MotionObjective, SampledTrial, sample_trial
from spinepipe.motion.points import marker_places
from spinepipe.motion.skeleton import MarkerSet
from spinepipe.motion.trajectory import solve

FRAMES, STEP_S = 101, 0.04
COSTS: tuple[ForceCost, ...] = ("minus_gravity", "level_difference")
"""Squared loads have several least sums, see `test_squared_loads_fall_into_several_hollows`."""
MIRROR = np.array([1.0, 1.0, -1.0])
SIGNS = np.array([1.0, 1.0, -1.0, 1.0, -1.0, -1.0])


def moved() -> np.ndarray:
    """(F, 18, 6) forwards, to the right and back; every level a little otherwise."""
    by = np.sin(np.linspace(0.0, np.pi, FRAMES)) ** 2
    q = np.zeros((FRAMES, 18, 6))
    share = 1.0 + 0.3 * np.sin(np.arange(17))
    q[:, 1:7, 3] = -0.07 * by[:, None] * share[:6]
    q[:, 7:, 3] = -0.015 * by[:, None] * share[6:]
    q[:, 1:, 4] = 0.012 * by[:, None] * share[::-1]
    q[:, 0, 3] = -0.05 * by
    return q


@cache
def seen() -> np.ndarray:
    """(F, K, 3) m, of markers that are 2 mm off their places all the time."""
    off = np.random.default_rng(6).normal(0.0, 2e-3, (len(markers()), 3))
    return marker_places(spine(), markers(), moved()) + off


def at_nodes(places: np.ndarray, on: MarkerSet, intervals: int) -> SampledTrial:
    return sample_trial(spine(), on, trial_at(places, STEP_S), intervals)


def joints(
    cost: ForceCost, trial: SampledTrial, pelvis: np.ndarray, begin: float = 0.0
) -> np.ndarray:
    """(N + 1, 17, 6) from joints that are all at an angle, the pelvis where it is said to be."""
    q = np.zeros((trial.grid.intervals + 1, 18, 6))
    q[:, 0] = pelvis
    q[:, 1:, 3:] = begin
    found = solve(MotionObjective(passive=law(), force_cost=cost), [trial], [trial.grid.through(q)])
    return trial.grid.at_nodes(found.coefficients[0])[0][:, 1:]


def degrees_apart(first: np.ndarray, second: np.ndarray) -> float:
    return float(np.rad2deg(np.abs(first[..., 3:] - second[..., 3:])).max())


@cache
def plain(cost: ForceCost, intervals: int) -> np.ndarray:
    return joints(cost, at_nodes(seen(), markers(), intervals), np.zeros(6))


@pytest.mark.parametrize("cost", COSTS)
def test_where_the_laboratory_stands_changes_nothing(cost: ForceCost) -> None:
    """Turned about the vertical and shifted: gravity pulls along the same axis."""
    turn = Rotation.from_euler("y", 35.0, degrees=True)
    shift = np.array([0.4, 0.1, -0.7])
    there = turn.apply(seen().reshape(-1, 3)).reshape(seen().shape) + shift
    pelvis = np.concatenate([shift, [0.0, 0.0, np.deg2rad(35.0)]])
    found = joints(cost, at_nodes(there, markers(), 20), pelvis)
    assert degrees_apart(found, plain(cost, 20)) < 0.05
    np.testing.assert_allclose(found[..., :3], plain(cost, 20)[..., :3], atol=1e-4)


@pytest.mark.parametrize("cost", COSTS)
def test_a_mirrored_trial_is_moved_in_the_mirror(cost: ForceCost) -> None:
    on = markers()
    other = MarkerSet(on.names, on.body, on.at * MIRROR, on.weight, on.cluster)
    found = joints(cost, at_nodes(seen() * MIRROR, other, 20), np.zeros(6))
    assert degrees_apart(found, plain(cost, 20) * SIGNS) < 1e-3


@pytest.mark.parametrize("begin", [-0.05, 0.04])
def test_where_the_search_begins_changes_nothing(begin: float) -> None:
    found = joints("level_difference", at_nodes(seen(), markers(), 20), np.zeros(6), begin)
    assert degrees_apart(found, plain("level_difference", 20)) < 0.1


@pytest.mark.slow
@pytest.mark.parametrize("cost", COSTS)
def test_more_nodes_change_little(
    cost: ForceCost, record_property: Callable[[str, object], None]
) -> None:
    """And make nothing vibrate: accelerations stay about as large as those of the truth."""
    few, more, most = (plain(cost, n) for n in (25, 50, 100))
    assert degrees_apart(few, more[::2]) < 0.3
    assert degrees_apart(more, most[::2]) < 0.3
    sizes = [_rms(found, (FRAMES - 1) * STEP_S) for found in (few, more, most)]
    record_property("acceleration_rms_deg_per_s2", [round(size, 2) for size in sizes])
    assert max(sizes) < 1.5 * _rms(moved()[:, 1:], (FRAMES - 1) * STEP_S)


def _rms(q: np.ndarray, long_s: float) -> float:
    """deg/s2, of all joints' rotations by second differences."""
    step_s = long_s / (len(q) - 1)
    bent = np.diff(np.rad2deg(q[..., 3:]), 2, axis=0) / step_s**2
    return float(np.sqrt(np.mean(bent**2)))


def test_squared_loads_fall_into_several_hollows() -> None:
    """A known failure: weight buckles a soft spine either way, and where the search begins decides.

    If this test fails, squared loads have become as good as the others, and docs are to say so.
    """
    trial = at_nodes(seen(), markers(), 10)
    first, second = (joints("squared", trial, np.zeros(6), begin) for begin in (0.0, -0.05))
    assert degrees_apart(first, second) > 1.0
