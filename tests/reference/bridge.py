"""The peers' chain as spinepipe's model and load case: the only place where both are known."""

import numpy as np

from spinepipe.effects import Wrench, create
from spinepipe.frames import Pose
from spinepipe.model import Body, LoadCase, LoadStep, ScopedEffect, SpineModel
from spinepipe.statics import Equilibrium, System, follow
from spinepipe.world import Chain as LoadedChain
from tests.reference.peers.chain import Array, Chain


def spine_model(chain: Chain) -> SpineModel:
    """The chain with one linear bushing per joint; joint ``J0`` carries body ``V0``."""
    bushing = ScopedEffect(
        create("linear_bushing"), tuple(range(chain.n_joints)), np.array(chain.stiffness)
    )
    bodies = zip(chain.masses.tolist(), chain.centres, chain.inertias, strict=True)
    return SpineModel(
        specimen="random",
        joints=tuple(f"J{j}" for j in range(chain.n_joints)),
        frames=tuple(map(Pose, chain.rotations, chain.origins)),
        bodies=tuple(Body(f"V{b}", *numbers) for b, numbers in enumerate(bodies)),
        gravity=np.array(chain.gravity),
        damping=np.array(chain.damping),
        effects=(bushing,),
    )


def load_case(chain: Chain, *shares: float, test: str = "test") -> LoadCase:
    """The chain's loads as a case with one step per share of them; one full step by default."""
    steps = tuple(
        LoadStep(
            number,
            tuple(
                Wrench(load.body, load.point, share * load.force, share * load.moment)
                for load in chain.loads
            ),
        )
        for number, share in enumerate(shares or (1.0,))
    )
    return LoadCase(test, 1, steps)


def system(chain: Chain, *shares: float) -> System:
    """The chain loaded into PyBullet, ready to be solved for `load_case`."""
    model = spine_model(chain)
    return System(LoadedChain(model), model, load_case(chain, *shares))


def equilibrium(chain: Chain) -> Equilibrium:
    """spinepipe's equilibrium of the chain under its loads."""
    return follow(system(chain))[-1].equilibrium


def pose(chain: Chain) -> Array:
    """(J, 6) m and rad: spinepipe's equilibrium, which must exist."""
    found = equilibrium(chain)
    assert found.status.usable, found.message
    return found.q.reshape(-1, 6)
