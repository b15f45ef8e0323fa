"""Where the search for postures begins, how it goes on, and when it ends."""

from dataclasses import replace

import numpy as np
import pytest
from moving_spine import everywhere, markers, postures, sampled

from spinepipe.motion.objective import SHAPE, MotionObjective, SampledTrial
from spinepipe.motion.posture import MOST_STEPS
from spinepipe.motion.posture import postures as fitted

MARKERS_ALONE = MotionObjective(loads=False)
SHIFT = np.array([0.3, 0.1, -0.2])


def begun(trial: SampledTrial) -> np.ndarray:
    """Postures before the first step."""
    found = fitted(MARKERS_ALONE, trial, most_steps=0)
    assert found.steps == 0
    assert not found.settled.any()
    return found.q


def test_the_search_begins_where_the_pelvis_is_seen() -> None:
    """Whatever the trunk does above."""
    q = np.zeros((2, *SHAPE))
    q[:, 0, :3] = SHIFT
    q[:, 1:, 3] = [[-0.02], [0.03]]
    expected = np.zeros_like(q)
    expected[:, 0, :3] = SHIFT
    np.testing.assert_allclose(begun(sampled(q)), expected, atol=1e-14)


def test_where_the_pelvis_is_not_seen_it_begins_from_the_others_and_else_from_nought() -> None:
    """The trunk stands 10 mm higher than a neutral one on the pelvis; three frames."""
    q = np.zeros((3, *SHAPE))
    q[:, 0, :3] = SHIFT
    higher = np.where((markers().body > 0)[:, None], [0.0, 0.01, 0.0], 0.0)
    trial = sampled(q, off=higher)
    weight = trial.weight.copy()
    weight[1, markers().body == 0] = 0.0
    weight[2] = 0.0
    found = begun(replace(trial, weight=weight))[:, 0, :3]
    expected = [SHIFT, SHIFT + np.array([0.0, 0.01, 0.0]), np.zeros(3)]
    np.testing.assert_allclose(found, expected, atol=1e-14)


def test_the_mean_is_over_markers_that_were_seen() -> None:
    """Two of four on the pelvis, 4 and 8 mm ahead of where it stands."""
    off = np.zeros((len(markers()), 3))
    pelvis = np.flatnonzero(markers().body == 0)
    off[pelvis[:2], 0] = 0.004, 0.008
    off[pelvis[2:]] = 5.0
    trial = sampled(np.zeros((1, *SHAPE)), off=off)
    weight = trial.weight.copy()
    weight[:, pelvis[2:]] = 0.0
    found = begun(replace(trial, weight=weight))[0, 0, :3]
    np.testing.assert_allclose(found, [0.006, 0.0, 0.0], atol=1e-14)


@pytest.mark.parametrize("axis", range(3))
def test_a_trunk_turned_as_a_whole_is_met_before_its_joints_may_move(axis: int) -> None:
    """Then nothing is left: the first step of all coordinates is short, and the last."""
    q = np.zeros((1, *SHAPE))
    q[0, 0, 3 + axis] = 1.0
    q[0, 0, :3] = SHIFT
    found = fitted(MARKERS_ALONE, sampled(q, everywhere()))
    assert found.settled.all()
    assert found.steps == 1
    np.testing.assert_allclose(found.q, q, atol=1e-7)


def test_a_few_rounds_are_enough() -> None:
    """Gauss and Newton's steps shorten by squares where markers fit: eased damping lets them."""
    q = postures(41, 4, 0.1)
    found = fitted(MARKERS_ALONE, sampled(q, everywhere()))
    assert found.settled.all()
    assert 3 < found.steps < 11
    np.testing.assert_allclose(found.q, q, atol=1e-8)


def test_rounds_that_run_out_leave_frames_unsettled() -> None:
    q = postures(42, 2, 0.1)
    q[1] = 0.0
    found = fitted(MARKERS_ALONE, sampled(q, everywhere()), most_steps=2)
    assert found.steps == 2
    np.testing.assert_array_equal(found.settled, [False, True])
    assert MOST_STEPS > 100


def test_what_no_marker_tells_stays_where_it_was() -> None:
    """Only the pelvis is seen, and turns: joints above it stay straight."""
    q = np.zeros((1, *SHAPE))
    q[0, 0] = [*SHIFT, 0.2, -0.1, 0.4]
    trial = sampled(q)
    trial = replace(trial, weight=np.where(markers().body == 0, 1.0, 0.0)[None])
    found = fitted(MARKERS_ALONE, trial)
    assert found.settled.all()
    np.testing.assert_allclose(found.q, q, atol=1e-6)
