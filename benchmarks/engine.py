"""Equilibrium of T12-S1: spinepipe and OpenSim on the same numbers, one run."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from benchmarks.timing import cpu_seconds
from spinepipe.statics import System, follow
from spinepipe.world import Chain
from tests.reference.bridge import load_case, spine_model
from tests.reference.peers import opensim_peer
from tests.reference.peers.chain import Chain as PeerChain
from tests.reference.peers.chain import Load, t12_s1_chain

MOMENT_NM = 7.5
RUN_S = 1.5
EXTRAPOLATED_FROM_S = 0.01


@dataclass(frozen=True)
class Result:
    """One line of the table: what, ours and the peer's CPU seconds, and their agreement."""

    what: str
    ours_s: float
    peer: str
    peer_s: float
    agreement: str
    note: str = ""

    @property
    def ratio(self) -> float:
        """How many times the peer's time is ours."""
        return self.peer_s / self.ours_s


def with_moments(chain: PeerChain, share: float = 1.0) -> list[PeerChain]:
    """Flexion, right bending, left rotation: a share of the pure moment on the top vertebra."""
    top = chain.n_joints - 1
    axes = (np.array([0.0, 0.0, -1.0]), np.array([1.0, 0.0, 0.0]), np.array([0.0, 1.0, 0.0]))
    point = chain.centres[top]
    return [
        chain.with_loads(Load(top, np.zeros(3), share * MOMENT_NM * axis, point)) for axis in axes
    ]


def _largest_difference(ours: np.ndarray, peer: np.ndarray) -> str:
    return f"{np.rad2deg(np.abs(ours - peer.reshape(-1, 6))[:, 3:].max()):.1e} deg"


def equilibria() -> Iterator[Result]:
    """One equilibrium under 7.5 N m of flexion."""
    peer_chain = with_moments(t12_s1_chain())[0]
    model, case = spine_model(peer_chain), load_case(peer_chain)
    system = System(Chain(model), model, case)
    ours = cpu_seconds(lambda: follow(system), 200)
    pose = follow(system)[-1].equilibrium.q.reshape(-1, 6)

    built = opensim_peer.build(peer_chain)
    start = np.zeros((peer_chain.n_joints, 6))
    static = cpu_seconds(lambda: opensim_peer.equilibrium_of(built, start=start), 20)
    found = opensim_peer.equilibrium_of(built, start=start)
    yield Result(
        "equilibrium T12-S1",
        ours.median,
        "OpenSim static root-find",
        static.median,
        _largest_difference(pose, found),
    )
    settled = opensim_peer.settle(peer_chain, RUN_S)[-1]
    yield Result(
        "equilibrium T12-S1",
        ours.median,
        "OpenSim CPodes, 1.5 s run",
        by_cpodes(peer_chain, 5),
        _largest_difference(pose, settled),
    )
    yield Result(
        "equilibrium T12-S1",
        ours.median,
        "OpenSim default integrator, 1.5 s run",
        by_default_integrator(peer_chain),
        "",
        f"extrapolated from {1000 * EXTRAPOLATED_FROM_S:.0f} ms",
    )


def by_cpodes(chain: PeerChain, repeats: int = 3) -> float:
    """CPU seconds of a run of `RUN_S` with OpenSim's CPodes."""
    return cpu_seconds(lambda: opensim_peer.settle(chain, RUN_S), repeats).median


def by_default_integrator(chain: PeerChain) -> float:
    """CPU seconds of the same with OpenSim's default integrator, extrapolated from its start."""
    short = cpu_seconds(
        lambda: opensim_peer.settle(chain, EXTRAPOLATED_FROM_S, integrator="rkm"), 1, 0
    )
    return short.median * RUN_S / EXTRAPOLATED_FROM_S


def off(found: np.ndarray, truth: np.ndarray) -> str:
    """Largest relative error."""
    return f"{np.abs(found / truth - 1.0).max():.0e}"
