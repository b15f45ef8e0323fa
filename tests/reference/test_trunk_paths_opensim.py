"""Lengths and lever arms of a trunk's fascicles against OpenSim's, bodies and points the same.

The made-up trunk bends in all seven joints, that of myo-sim too.

Catches a lever arm that is not OpenSim's.
"""

import numpy as np
import pytest
from trunk_cases import made_up_trunk
from trunk_posture import lengths, lever_arms, random_bends

from spinepipe.muscles.myo_sim import source_of_myo_sim
from tests.reference.peers import opensim_trunk as peers

ROUND_OFF_M = 1e-12
"""Lengths of half a metre, summed from nine differences of coordinates."""

DIFFERENCE_M = 1e-9
"""A central difference over 1e-5 rad of lengths good to 1e-15 m; its own error is about 1e-11."""

POSTURES = (np.zeros((7, 3)), random_bends(5))


@pytest.fixture(scope="module", params=["made up", "myo-sim"])
def both(request: pytest.FixtureRequest):
    """A trunk and the same in OpenSim."""
    trunk = source_of_myo_sim().trunk if request.param == "myo-sim" else made_up_trunk()
    return trunk, peers.build(trunk)


@pytest.mark.parametrize("bends", POSTURES, ids=["at rest", "bent"])
def test_paths_are_as_long_as_opensims(both, bends) -> None:
    trunk, peer = both
    np.testing.assert_allclose(
        lengths(trunk, bends), peers.lengths(peer, bends), rtol=0.0, atol=ROUND_OFF_M
    )


@pytest.mark.parametrize("bends", POSTURES, ids=["at rest", "bent"])
def test_lever_arms_are_opensims(both, bends) -> None:
    """A muscle that shortens as a joint extends pulls it into extension."""
    trunk, peer = both
    expected = peers.lever_arms(peer, bends)
    assert np.abs(expected).max() > 0.05
    np.testing.assert_allclose(-lever_arms(trunk, bends), expected, rtol=0.0, atol=DIFFERENCE_M)
