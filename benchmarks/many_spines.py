"""Equilibria of many spines at once beside the engine and OpenSim, by number of joints."""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from benchmarks.engine import by_cpodes, by_default_integrator, with_moments
from benchmarks.timing import cpu_seconds
from spinepipe.effects import create
from spinepipe.model import ScopedEffect
from spinepipe.statics import System, follow
from spinepipe.statics.batched import Cases, Spines, Stack, solve_many
from spinepipe.world import Chain
from tests.cases.random_stacks import values
from tests.reference.bridge import load_case, spine_model
from tests.reference.peers import opensim_peer
from tests.reference.peers.chain import Chain as PeerChain
from tests.reference.peers.chain import t12_s1_chain

JOINTS = (3, 6, 10, 17)
BENT_JOINTS = 6
"""Up to this many joints bear the whole moment; longer spines less, to bend by as much."""
COUNT = 1000
CHECKED = 20


@dataclass(frozen=True)
class Growth:
    """CPU seconds of one equilibrium under a flexing moment, a new spine each time.

    Attributes
    ----------
    together_s : among many at once. engine_s : by the engine of record, the model loaded first.
    static_s : OpenSim's static root-find on a model that is built already.
    cpodes_s, default_s : 1.5 s of OpenSim's forward dynamics, the latter extrapolated.
    difference : largest between the first two, m or rad. by_engine : share that was handed on.
    """

    joints: int
    together_s: float
    engine_s: float
    static_s: float
    cpodes_s: float
    default_s: float
    difference: float
    by_engine: float


def growth() -> Iterator[Growth]:
    """One row for each number of joints."""
    for joints in JOINTS:
        yield _row(joints)


@dataclass(frozen=True)
class Remembering:
    """CPU seconds of one equilibrium of 6 joints that stiffen and remember, steps one by one.

    Attributes
    ----------
    steps : of a test that goes up and back.
    together_s, engine_s : among many at once, and by the engine of record.
    difference : largest between the two, m or rad. by_engine : share that was handed on.
    """

    steps: int
    together_s: float
    engine_s: float
    difference: float
    by_engine: float


MEMORY = ("hysteresis", "nonlinear_stiffening")
UP_AND_BACK = np.concatenate([np.linspace(0.0, 1.0, 11), np.linspace(0.9, -1.0, 10)])


def remembering() -> Remembering:
    """T12-S1 in flexion, hysteresis and stiffening laws at every joint, each spine of its own."""
    chain = chain_of(6)
    plain, case = spine_model(chain), load_case(chain, *UP_AND_BACK)
    rng = np.random.default_rng(1)
    models = [plain.with_effects((*plain.effects, *_laws(rng))) for _ in range(COUNT // 5)]
    stack = Stack.of(models, [(number, case) for number in range(len(models))])
    found = stack.solve()
    few = models[:CHECKED]
    poses = [[one.equilibrium.q for one in follow(System(Chain(m), m, case))] for m in few]
    first = found.q[: stack.first[len(few)]].reshape(len(few), len(UP_AND_BACK), -1)
    both = len(models) * len(UP_AND_BACK)
    engine = cpu_seconds(lambda: [follow(System(Chain(m), m, case)) for m in few], 3).median
    return Remembering(
        len(UP_AND_BACK),
        cpu_seconds(stack.solve, 5).median / both,
        engine / (len(few) * len(UP_AND_BACK)),
        float(np.abs(first - np.array(poses)).max()),
        float(found.by_engine.mean()),
    )


def _laws(rng: np.random.Generator) -> list[ScopedEffect]:
    """Both laws at all joints."""
    effects, joints = (create(name, {}) for name in MEMORY), tuple(range(BENT_JOINTS))
    return [ScopedEffect(one, joints, values(one, BENT_JOINTS, rng), ("*",)) for one in effects]


def chain_of(joints: int) -> PeerChain:
    """T12-S1, cut short or with its joints repeated upwards; it always bends by about 50 deg."""
    chain = with_moments(t12_s1_chain(), min(1.0, BENT_JOINTS / joints))[0]
    return chain if joints == chain.n_joints else stacked(chain, joints)


def stacked(chain: PeerChain, joints: int) -> PeerChain:
    """Levels of a chain one above the other, again and again, without loads but a moment on top."""
    order = np.arange(joints) % chain.n_joints
    turn = np.arange(joints) // chain.n_joints
    rise = (chain.origins[-1] - chain.origins[0]) * chain.n_joints / (chain.n_joints - 1)
    up = turn[:, None] * rise
    load = chain.loads[0]
    made = replace(
        chain,
        rotations=chain.rotations[order],
        origins=chain.origins[order] + up,
        stiffness=chain.stiffness[order],
        damping=chain.damping[order],
        masses=chain.masses[order],
        centres=chain.centres[order] + up,
        inertias=chain.inertias[order],
        loads=(),
    )
    return made.with_loads(replace(load, body=joints - 1, point=made.centres[joints - 1]))


def _row(joints: int) -> Growth:
    chain = chain_of(joints)
    model, case = spine_model(chain), load_case(chain)
    spines = _varied(Spines.of(model, COUNT))
    cases = Cases.of(case, COUNT)
    found = solve_many(spines, cases)
    models = [spines.model(number) for number in range(CHECKED)]
    poses = [follow(System(Chain(one), one, case))[-1].equilibrium.q for one in models]
    worst = max(
        float(np.abs(found.q[number, -1] - pose.reshape(-1, 6)).max())
        for number, pose in enumerate(poses)
    )
    built = opensim_peer.build(chain)
    start = np.zeros((joints, 6))
    repeats = 11 if joints <= BENT_JOINTS else 3
    return Growth(
        joints,
        cpu_seconds(lambda: solve_many(spines, cases), repeats).median / COUNT,
        cpu_seconds(lambda: [follow(System(Chain(m), m, case)) for m in models], repeats).median
        / CHECKED,
        cpu_seconds(lambda: opensim_peer.equilibrium_of(built, start=start), 5).median,
        by_cpodes(chain),
        by_default_integrator(chain),
        worst,
        float(found.by_engine.mean()),
    )


def _varied(spines: Spines) -> Spines:
    """Every spine with frames and stiffness of its own."""
    rng = np.random.default_rng(1)
    stiffness = spines.values[0] * np.exp(rng.normal(0.0, 0.2, spines.values[0].shape))
    origins = spines.origins + rng.normal(0.0, 1e-3, spines.origins.shape)
    return replace(spines, origins=origins, values=(stiffness,))
