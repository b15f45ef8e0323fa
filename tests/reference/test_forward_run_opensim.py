"""The emulated forward run against OpenSim's own, which it stands for.

Catches an emulated run that ends elsewhere than OpenSim's own.
"""

import numpy as np
import pytest

from spinepipe.calibration.forward_runs import forward_run
from tests.reference import bridge
from tests.reference.peers import chain as chains
from tests.reference.peers import opensim_peer as peer
from tests.reference.peers.chain import Array, Chain, Load

ACCURACY = 1e-5
BENDING = Load(2, moment=np.array([7.5, 0.0, -3.0]))


def ours(chain: Chain, duration_s: float, accuracy: float = ACCURACY) -> Array:
    end = forward_run(bridge.spine_model(chain), bridge.load_case(chain), duration_s, accuracy)
    assert end is not None
    return end.reshape(-1, 6)


@pytest.mark.parametrize("duration_s", [0.02, 0.3])
def test_it_ends_where_opensim_ends(duration_s: float) -> None:
    chain = chains.l1_l4_chain().with_loads(BENDING)
    expected = peer.settle(chain, duration_s, accuracy=1e-6)[-1]
    found = ours(chain, duration_s, 1e-7)
    for kind in (slice(0, 3), slice(3, 6)):
        off = np.abs(found - expected)[:, kind].max()
        assert off < 1e-3 * np.abs(expected[:, kind]).max()


def test_careful_differences_of_both_are_the_exact_derivative() -> None:
    """Differences over 1e-3 of all stiffnesses against those of equilibria, central and smaller."""
    chain = chains.l1_l4_chain().with_loads(BENDING)
    built = peer.build(chain)

    def theirs(stiffer: Chain) -> Array:
        peer.set_stiffness(built, stiffer.stiffness)
        return peer.settle_of(built, 1.5, accuracy=ACCURACY).reshape(-1, 6)

    poses = [bridge.pose(chain.with_stiffness(s * chain.stiffness)) for s in (1.0001, 0.9999)]
    exact = (poses[0] - poses[1]) / 2e-4
    stiffer = chain.with_stiffness(1.001 * chain.stiffness)
    for run in (lambda chain: ours(chain, 1.5), theirs):
        found = (run(stiffer) - run(chain)) / 1e-3
        for kind in (slice(0, 3), slice(3, 6)):
            off = np.abs(found - exact)[:, kind].max()
            # one-sided: off by half a step times the second derivative, about twice the first
            assert off < 4e-3 * np.abs(exact[:, kind]).max()
