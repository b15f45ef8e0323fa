"""Equilibrium and calibration on T12-S1: spinepipe and OpenSim on the same numbers, one run."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from benchmarks.timing import cpu_seconds
from spinepipe.calibrate import MeasuredCase, Problem, fit
from spinepipe.model import LoadCase, SpineModel
from spinepipe.statics import Chain, System, follow, free_parameters, moved
from spinepipe.units import STIFFNESS_COLUMNS
from tests.reference.bridge import load_case, spine_model
from tests.reference.peers import opensim_calibration, opensim_peer
from tests.reference.peers.chain import Chain as PeerChain
from tests.reference.peers.chain import Load, t12_s1_chain

ROTATIONS = list(STIFFNESS_COLUMNS[3:])
MOMENT_NM = 7.5
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
        "equilibrium T12-S1", ours.median, "OpenSim static root-find", static.median,
        _largest_difference(pose, found),
    )  # fmt: skip
    run = cpu_seconds(lambda: opensim_peer.settle(peer_chain, 1.5), 5)
    settled = opensim_peer.settle(peer_chain, 1.5)[-1]
    yield Result(
        "equilibrium T12-S1", ours.median, "OpenSim CPodes, 1.5 s run", run.median,
        _largest_difference(pose, settled),
    )  # fmt: skip
    short = cpu_seconds(
        lambda: opensim_peer.settle(peer_chain, EXTRAPOLATED_FROM_S, integrator="rkm"), 1, 0
    )
    yield Result(
        "equilibrium T12-S1", ours.median, "OpenSim default integrator, 1.5 s run",
        short.median * 1.5 / EXTRAPOLATED_FROM_S, "",
        f"extrapolated from {1000 * EXTRAPOLATED_FROM_S:.0f} ms",
    )  # fmt: skip


def calibrations() -> Iterator[Result]:
    """Rotational stiffness from three load cases with exact data: 3 shared and 18 per level."""
    chain = t12_s1_chain()
    loaded = with_moments(chain)
    rng = np.random.default_rng(5)
    for grouping, groups, repeats in (
        ("per_specimen", opensim_calibration.one_per_axis(chain.n_joints), 3),
        ("per_joint", opensim_calibration.one_per_joint_and_axis(chain.n_joints), 1),
    ):
        factors = np.append(np.exp(rng.normal(0.0, 0.3, groups.max() + 1)), 1.0)
        truth = chain.stiffness * factors[groups]
        problem = _problem(chain, loaded, grouping, truth)
        ours = cpu_seconds(lambda problem=problem: fit(problem), 20)
        found = moved(problem.model, problem.free, fit(problem).x).effects[0].values
        observed = np.concatenate([case.measured for case in problem.cases])
        predict = opensim_calibration.static_predictor(chain, [case.loads for case in loaded])
        fits = []
        peer = cpu_seconds(
            lambda p=predict, g=groups, o=observed, f=fits: f.append(
                opensim_calibration.calibrate(p, chain.stiffness, o, g)
            ),
            repeats,
            warm_up=0,
        )
        yield Result(
            f"calibration of {groups.max() + 1} stiffnesses, three load cases",
            ours.median,
            "OpenSim static root-find + least squares",
            peer.median,
            f"off truth by {off(found, truth)}, OpenSim by {off(fits[-1].stiffness, truth)}",
        )


def off(found: np.ndarray, truth: np.ndarray) -> str:
    """Largest relative error."""
    return f"{np.abs(found / truth - 1.0).max():.0e}"


def _problem(
    chain: PeerChain, loaded: list[PeerChain], grouping: str, truth: np.ndarray
) -> Problem:
    """Exact motion of a spine of the true stiffness, to be fitted from the chain's own."""
    cases = [load_case(case, test=str(number)) for number, case in enumerate(loaded)]
    true_model = spine_model(chain.with_stiffness(truth))
    measured = tuple(_measured(true_model, case) for case in cases)
    model = spine_model(chain)
    free = free_parameters(model, 0, ROTATIONS, grouping)
    reach = np.full(len(free), np.log(1000.0))
    return Problem(model, measured, free, np.array([0, 0, 0, 1, 1, 1.0]), -reach, reach)


def _measured(model: SpineModel, case: LoadCase) -> MeasuredCase:
    solved = follow(System(Chain(model), model, case))
    return MeasuredCase(case, np.stack([s.equilibrium.q.reshape(-1, 6) for s in solved]))
