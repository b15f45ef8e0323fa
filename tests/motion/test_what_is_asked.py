"""Trials at nodes: which frames a node counts, how much, and what one frame is; sizes of errors."""

from dataclasses import replace

import numpy as np
import pytest
from moving_spine import markers, spine, trial_at

from spinepipe.motion.objective import SHAPE, MotionObjective, ResidualScales, sample_trial
from spinepipe.motion.points import marker_places
from spinepipe.motion.skeleton import MarkerTrial
from spinepipe.motion.spline import KnotGrid
from spinepipe.studies.tracking.approaches import residual_scales
from spinepipe.studies.tracking.settings import Scales


def standing(times: np.ndarray, hidden: dict[int, list[int]]) -> MarkerTrial:
    """A trial at rest; of each marker named, the frames that see it."""
    places = np.repeat(marker_places(spine(), markers(), np.zeros((1, *SHAPE))), len(times), axis=0)
    trial = replace(trial_at(places), time_s=times)
    for marker, frames in hidden.items():
        trial.seen[:, marker] = False
        trial.seen[frames, marker] = True
    return trial


def test_a_marker_counts_at_nodes_within_half_a_step_of_a_frame_that_saw_it() -> None:
    """Nodes at 2, 2.5 and 3 s; half a step itself still counts."""
    trial = standing(2.0 + 0.25 * np.arange(5), {0: [1], 1: [0], 2: [4], 3: [0, 4]})
    weight = sample_trial(spine(), markers(), trial, 2).weight
    np.testing.assert_array_equal(weight[:, 0], [1.0, 1.0, 0.0])
    np.testing.assert_array_equal(weight[:, 1], [1.0, 0.0, 0.0])
    np.testing.assert_array_equal(weight[:, 2], [0.0, 0.0, 1.0])
    np.testing.assert_array_equal(weight[:, 3], [1.0, 0.0, 1.0])
    assert (weight[:, 4:] == 1.0).all()


def test_a_little_more_than_half_a_step_does_not_count() -> None:
    trial = standing(np.array([0.0, 0.49, 0.51, 1.0]), {0: [1], 1: [2]})
    weight = sample_trial(spine(), markers(), trial, 1).weight
    np.testing.assert_array_equal(weight[:, 0], [1.0, 0.0])
    np.testing.assert_array_equal(weight[:, 1], [0.0, 1.0])


def test_markers_count_by_their_weights() -> None:
    share = np.linspace(0.5, 3.0, len(markers()))
    heavy = replace(markers(), weight=share)
    weight = sample_trial(spine(), heavy, standing(np.arange(3.0), {}), 2).weight
    np.testing.assert_array_equal(weight, np.tile(share, (3, 1)))


def test_one_frame_is_one_node() -> None:
    """A step of one second, so that what is asked per second is defined."""
    one = sample_trial(spine(), markers(), standing(np.array([4.0]), {}), 30)
    assert one.grid == KnotGrid(4.0, 1.0, 0)
    assert one.places.shape[0] == 1


def test_nodes_reach_from_the_first_frame_to_the_last() -> None:
    one = sample_trial(spine(), markers(), standing(3.0 + 0.1 * np.arange(21), {}), 8)
    np.testing.assert_allclose(one.grid.times_s, np.linspace(3.0, 5.0, 9), rtol=1e-14)


def test_sizes_are_those_of_a_study_that_changes_none() -> None:
    """600 deg/s2 is 10 rad/s2 but for rounding to a round number."""
    ours, theirs = vars(ResidualScales()), vars(residual_scales(Scales()))
    assert ours.keys() == theirs.keys()
    for name, value in ours.items():
        within = 0.05 if name == "turn_rad_per_s2" else 1e-12
        assert value == pytest.approx(theirs[name], rel=within), name


def test_a_mean_load_costs_by_its_force_alone() -> None:
    """Four times as much of loads halves their sizes; none makes them endless."""
    np.testing.assert_allclose(ResidualScales().of_common, [2000.0] * 3 + [np.inf] * 3)
    np.testing.assert_allclose(ResidualScales(loads=4.0).of_common[:3], 1000.0)
    assert np.isinf(ResidualScales(loads=0.0).of_loads).all()


def test_everything_is_free_and_nothing_is_fitted_unless_asked() -> None:
    ask = MotionObjective()
    assert ask.free.all()
    assert ask.parameters == 0
    assert not ask.fitted.any()
    assert (ask.low == -np.inf).all()
    assert (ask.high == np.inf).all()
    assert ask.loads
    assert ask.smooth
    some = np.zeros((17, 6), dtype=bool)
    some[2:4, 3:] = True
    assert MotionObjective(fitted=some).parameters == 12
