"""Postures of frames: each settles, and is what it would be were its frame alone."""

import numpy as np
from moving_spine import markers, postures, spine

from spinepipe.motion.asked import SHAPE, Ask, watched
from spinepipe.motion.points import marker_places
from spinepipe.motion.posture import postures as fitted
from spinepipe.motion.skeleton import Trial

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
    ask = Ask(free=free, loads=False)

    def found(frames: list[int]):
        seen = np.ones((len(frames), len(markers())), dtype=bool)
        times = 0.1 * np.arange(len(frames))
        trial = Trial("made", "stance", times, places[frames], seen, "hanging")
        return fitted(ask, watched(spine(), markers(), trial, len(frames) - 1))

    together = found(list(range(FRAMES)))
    assert together.settled.all()
    for frame in range(FRAMES):
        alone = found([frame])
        assert alone.settled.all()
        np.testing.assert_allclose(together.q[frame], alone.q[0], rtol=0.0, atol=SAME_RAD)
