"""Postures of frames: each settles, and is what it would be were its frame alone."""

from dataclasses import replace

import numpy as np
import pytest
from moving_spine import law, markers, postures, sampled, spine, trial_at

from spinepipe.motion.objective import (
    SHAPE,
    MotionObjective,
    ResidualScales,
    SampledTrial,
    sample_trial,
)
from spinepipe.motion.points import marker_places
from spinepipe.motion.posture import postures as fitted
from spinepipe.motion.residual_terms import Markers, MuscleDemand, range_excess
from spinepipe.motion.skeleton import JOINTS

FRAMES = 6
SKIN_M = 1e-3
"""SD of what each marker is off."""

SAME_RAD = 1e-9


def test_frames_of_a_trial_are_as_alone() -> None:
    """The paper's markers, which leave vertebrae between them open: the hardest to settle."""
    q = postures(21, FRAMES, 0.05)
    q[:, 1:, :3] = 0.0
    places = marker_places(spine(), markers(), q)
    places += np.random.default_rng(22).normal(0.0, SKIN_M, places.shape)
    free = np.ones(SHAPE, dtype=bool)
    free[1:, :3] = False
    ask = MotionObjective(free=free, loads=False)

    def found(frames: list[int]):
        return fitted(
            ask, sample_trial(spine(), markers(), trial_at(places[frames]), len(frames) - 1)
        )

    together = found(list(range(FRAMES)))
    assert together.settled.all()
    for frame in range(FRAMES):
        alone = found([frame])
        assert alone.settled.all()
        np.testing.assert_allclose(together.q[frame], alone.q[0], rtol=0.0, atol=SAME_RAD)


def cost(ask: MotionObjective, seen: SampledTrial, q: np.ndarray) -> np.ndarray:
    """(F,) of postures at rest, added up from what each kind of error costs."""
    found = np.sum(Markers(seen, ask).residuals(q) ** 2, axis=1)
    found += np.sum(range_excess(ask, q)[0] ** 2, axis=(1, 2))
    still = np.zeros_like(q)
    if ask.loads:
        return found + np.sum(
            MuscleDemand.of(seen, ask).residuals(ask.passive, (q, still, still)) ** 2, axis=1
        )
    if ask.passive is not None:
        force = ask.passive.forces(q[:, 1:]) / np.array([200.0] * 3 + [10.0] * 3)
        found += np.sum(force**2, axis=(1, 2))
    return found


def narrow(ask: MotionObjective) -> MotionObjective:
    """Ranges that the markers ask to leave: half a degree about another posture."""
    high = np.full(SHAPE, np.inf)
    high[1:, 3:] = 0.01
    return replace(ask, high=high, low=-high)


ROTATIONS = np.broadcast_to(np.arange(6) > 2, SHAPE).copy()
ROTATIONS[0] = True

ASKS = {
    "markers alone, within ranges": narrow(MotionObjective(free=ROTATIONS, loads=False)),
    "springs": MotionObjective(passive=law(), loads=False),
    "loads from joint to joint": MotionObjective(passive=law(), force_cost="level_difference"),
}


@pytest.mark.parametrize("name", ASKS)
def test_a_posture_has_the_least_cost(name: str) -> None:
    """No way that is free leads down: the cost has no slope there, beside that of a step away."""
    ask = ASKS[name]
    q = postures(31, 1, 0.02) * ask.free
    seen = sampled(q)
    found = fitted(ask, seen)
    assert found.settled.all()
    assert not found.q[:, ~ask.free].any()
    at, step = cost(ask, seen, found.q), 1e-4
    assert (at > 1e-3).all()
    for way in np.random.default_rng(5).normal(size=(12, *SHAPE)):
        move = step * way * ask.free * ([0.1] * 3 + [1.0] * 3)
        up, down = cost(ask, seen, found.q + move), cost(ask, seen, found.q - move)
        bend = up + down - 2.0 * at
        assert (bend > 0.0).all()
        # where a parabola through the three is least: a fortieth of the step away at most
        assert (np.abs(up - down) < 0.05 * bend).all()


@pytest.mark.numeric
@pytest.mark.parametrize("name", ["markers alone, within ranges", "springs"])
def test_steps_of_an_articulated_body_are_those_of_the_normal_equations(name: str) -> None:
    """Ratios that leave every coordinate to itself have the equations made and solved as a whole;
    weak markers, one out of sight, far from where they belong, so that no step is short."""
    ask = ASKS[name]
    q = postures(33, 3, 0.1)
    known = sampled(q, replace(markers(), weight=np.linspace(0.2, 2.0, len(markers()))))
    known.weight[1, 4] = 0.0
    each = np.eye(np.prod(SHAPE))[:, ask.free.ravel()]
    for rounds in (1, 4):
        found, expected = (fitted(ask, known, ratios, most_steps=rounds) for ratios in (None, each))
        assert found.steps == expected.steps == rounds
        # what no marker tells is held by a ridge of 1e-8 alone, which leaves half the digits
        np.testing.assert_allclose(found.q, expected.q, rtol=0.0, atol=1e-7)
    assert np.abs(found.q - fitted(ask, known, most_steps=0).q).max() > 0.01


def test_ratios_move_all_joints_as_fewer_numbers_say() -> None:
    """One number bends all joints alike; the pelvis is free."""
    shares = np.zeros((np.prod(SHAPE), 7))
    shares[np.arange(6), np.arange(6)] = 1.0
    shares[6 * np.arange(1, SHAPE[0]) + 3, 6] = 1.0
    q = np.zeros((2, *SHAPE))
    q[:, 0] = [[0.1, 0.2, -0.1, 0.2, -0.1, 0.3], [0.0, 0.1, 0.0, -0.2, 0.05, 0.0]]
    q[:, 1:, 3] = [[-0.03], [0.02]]
    found = fitted(MotionObjective(loads=False), sampled(q), shares)
    np.testing.assert_allclose(found.q, q, atol=1e-7)


def test_what_counts_as_one() -> None:
    """5 mm of a marker; 200 N and 10 N m of muscles; 0.02 rad and 1 mm beyond a range."""
    q = np.zeros((1, *SHAPE))
    one = sampled(q, off=np.array([0.0, 5e-3, 0.0]))
    off = Markers(one, MotionObjective()).residuals(q).reshape(-1, 3)
    np.testing.assert_allclose(np.abs(off), np.tile([0.0, 1.0, 0.0], (len(off), 1)), atol=1e-12)
    held = MotionObjective(low=np.zeros(SHAPE), high=np.zeros(SHAPE))
    bent = np.tile([1e-3, -1e-3, 1e-3, -0.02, 0.02, 0.02], (1, SHAPE[0], 1))
    np.testing.assert_allclose(np.abs(range_excess(held, bent)[0]), 1.0, rtol=1e-14)
    np.testing.assert_allclose(range_excess(held, bent)[0], np.sign(bent), rtol=1e-14)
    still = np.zeros_like(q)
    for loads in (1.0, 4.0, 0.0):
        ask = MotionObjective(sizes=ResidualScales(loads=loads))
        muscles = MuscleDemand.of(one, ask)
        active = muscles.active(None, (q, still, still))
        rows = muscles.residuals(None, (q, still, still)).reshape(len(JOINTS), 6)
        expected = np.sqrt(loads) * active[0] / ([200.0] * 3 + [10.0] * 3)
        np.testing.assert_allclose(rows, expected, rtol=1e-13)
    np.testing.assert_array_equal(ResidualScales().of_accelerations, [2.0] * 3 + [10.0] * 3)
