"""Joint laws against OpenSim's expression forces on tilted chains.

OpenSim's expressions are written here from the published laws with the roundings the effects
state, in OpenSim's own language; nothing of the effects is asked for them.

Catches a law that another engine solves to another pose.
"""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import opensim
import pytest
from scipy.spatial.transform import Rotation
from sweeps import sweep

from spinepipe.effects import create
from spinepipe.model import ScopedEffect
from spinepipe.statics import System, follow
from spinepipe.units import COORDINATES
from spinepipe.world import Chain as LoadedChain
from tests.reference import bridge
from tests.reference.peers import chain as chains
from tests.reference.peers import opensim_peer as peer
from tests.reference.peers.chain import Array, Chain

Values = tuple[float, ...]
Add = Callable[[Any], None]

# Expressions of the whole load of one coordinate with spring k; `#` is the coordinate.
EXPONENTIAL = "k*#*(exp(b*s)-1)/(b*s); s=sqrt(#^2+{rounded}^2); b={0}"
TANGENT = "k*tan(sqrt(g)*#)/sqrt(g); g={0}"
CUBIC = "k*#*(1+g*#^2); g={0}"
NEUTRAL_ZONE = "k*#*(1-(1-r)*(1+u^n)^(-1/n)); u=abs(#)/w; r={0}; w={1}; n={2}"
ASYMMETRY = "k*#*(1+a*(1-2/(exp(2*#/{rounded})+1))); a={0}"
BILINEAR = (
    "k*(#+gain*at*side*(t^2/(4*d)+max(u-1-d,0))); t=min(max(u-1+d,0),2*d); u=abs(#)/at;"
    "side=2*step(#)-1; d=0.1; gain={0}; at={1}"
)
STOP = (
    "k*#+side*c*over*(max(over,1e-12)/{reference})^(p-1); over=t^2/(4*d)+max(x-d,0);"
    "t=min(max(x+d,0),2*d); x=side*#-gap; c={0}; gap={1}; p={2}; d={rounded}; side={side}"
)
SCALED = "k*#*{0}"
LAX = "k*#*(1-{0})"


def on(
    name: str, coordinate: str, values: tuple[Values, ...], law: str, rounded: float = 0.0, **more
) -> Any:
    options = {"coordinate": coordinate, **more}
    sides = {"positive": 1, "negative": -1}
    numbers = {
        "rounded": rounded,
        "side": sides.get(more.get("side", ""), 0),
        "reference": np.deg2rad(2.0),
    }
    label = "-".join([name, coordinate, *more.values()])
    return pytest.param(name, options, values, law, numbers, id=label)


ONE_COORDINATE = [
    *(
        on(
            "nonlinear_stiffening",
            c,
            ((12.0,), (4.0,), (25.0,)),
            EXPONENTIAL,
            1e-4,
            shape="exponential",
        )
        for c in COORDINATES[3:]
    ),
    *(
        on("nonlinear_stiffening", c, ((30.0,), (75.0,), (9.0,)), TANGENT, shape="tangent")
        for c in COORDINATES[3:]
    ),
    *(
        on("nonlinear_stiffening", c, ((50.0,), (20.0,), (400.0,)), CUBIC, shape="cubic")
        for c in COORDINATES[3:]
    ),
    on(
        "nonlinear_stiffening",
        "superior",
        ((500.0,), (200.0,), (900.0,)),
        EXPONENTIAL,
        1e-6,
        shape="exponential",
    ),
    *(
        on("neutral_zone", c, ((0.3, 0.03, 6.0), (0.6, 0.04, 2.0), (0.1, 0.01, 30.0)), NEUTRAL_ZONE)
        for c in COORDINATES[3:]
    ),
    on(
        "neutral_zone",
        "anterior",
        ((0.3, 1e-4, 2.7), (0.6, 2e-4, 6.0), (0.4, 1e-3, 12.0)),
        NEUTRAL_ZONE,
    ),
    on(
        "nonlinear_stiffening",
        "left_rotation",
        ((1.0, 0.018), (3.0, 0.0176), (5.0, 0.02)),
        BILINEAR,
        shape="bilinear",
    ),
    *(
        on("flexion_extension_asymmetry", c, ((0.2,), (-0.4,), (0.7,)), ASYMMETRY, 1.7e-3)
        for c in COORDINATES[3:]
    ),
    *(
        on(
            "facet_contact",
            c,
            ((100.0, 0.01, 1.0), (300.0, 0.005, 1.5), (50.0, 0.0, 3.0)),
            STOP,
            3.5e-3,
            side=side,
        )
        for c in COORDINATES[3:]
        for side in ("positive", "negative")
    ),
    *(on("level_dependence", c, ((1.3,), (0.5,), (2.0,)), SCALED) for c in COORDINATES[2:]),
    *(on("local_laxity", c, ((0.3,), (0.0,), (0.6,)), LAX) for c in COORDINATES[2:]),
]

AGREEMENT = 1e-12
"""m and rad: both solve to rounding; these laws move the chains by 1e-5 and more."""

SEEDS = pytest.mark.parametrize(
    ("seed", "n_joints"), [(37, 3), pytest.param(9, 2, marks=pytest.mark.full)]
)
"""Chains all of whose angles move by a degree or so at least."""


def chain_of(seed: int, n_joints: int) -> Chain:
    """Tilted joints, every coordinate loaded."""
    return chains.random_chain(np.random.default_rng(seed), n_joints)


def solved(chain: Chain, *effects: ScopedEffect) -> Array:
    """(J, 6) spinepipe's equilibrium of the chain with more effects after its springs."""
    model = bridge.spine_model(chain)
    model = model.with_effects((*model.effects, *effects))
    system = System(LoadedChain(model), model, bridge.load_case(chain))
    found = follow(system)[-1].equilibrium
    assert found.status.usable, found.message
    return found.q.reshape(-1, 6)


def scoped(name: str, options: dict[str, Any], values: tuple[Values, ...]) -> ScopedEffect:
    return ScopedEffect(create(name, options), tuple(range(len(values))), np.array(values))


def in_opensim(chain: Chain, springs: Array, add: Add) -> Array:
    """(J, 6) OpenSim's equilibrium with these springs and more forces."""
    built = peer.build(chain.with_stiffness(springs), ramp_time=1.0)
    add(built.model)
    built = built._replace(state=built.model.initSystem())
    return peer.equilibrium_of(built).reshape(-1, 6)


def check(chain: Chain, effect: ScopedEffect, springs: Array, add: Add) -> None:
    """Same equilibrium in spinepipe with the effect and in OpenSim, under loads of both signs."""
    changes = []
    for way in (1.0, -1.0):
        loads = [replace(w, force=way * w.force, moment=way * w.moment) for w in chain.loads]
        here = chain.with_loads(*loads)
        found, expected = solved(here, effect), in_opensim(here, springs, add)
        np.testing.assert_allclose(found, expected, rtol=0, atol=AGREEMENT)
        changes.append(np.abs(found - solved(here)).max())
    assert max(changes) > 1e-5  # the law does something here


def nothing(model: Any) -> None:
    """No more forces."""


@SEEDS
@sweep("name, options, values, law, numbers", ONE_COORDINATE)
def test_a_law_of_one_coordinate(seed, n_joints, name, options, values, law, numbers) -> None:
    chain = chain_of(seed, n_joints)
    values = values[: chain.n_joints]
    at = COORDINATES.index(options["coordinate"])
    springs = chain.stiffness.copy()
    springs[:, at] = 0.0
    texts = [
        f"{law.format(*row, **numbers)}; k={chain.stiffness[joint, at]}".replace("#", "q")
        for joint, row in enumerate(values)
    ]

    def add(model: Any) -> None:
        for joint, text in enumerate(texts):
            add_law(model, f"{options['coordinate']}_{joint}", text)

    check(chain, scoped(name, options, values), springs, add)


def add_law(model: Any, coordinate: str, text: str) -> None:
    """OpenSim's force is what acts on the coordinate, the opposite of what holds it."""
    held, where = text.split(";", 1)
    force = opensim.ExpressionBasedCoordinateForce(coordinate, f"-({held});{where}")
    force.setName(f"law_{coordinate}")
    model.addForce(force)


# A bushing's own axes are the joint's z, x, y.
ANGLE = {"extension": "theta_x", "right_bending": "theta_y", "left_rotation": "theta_z"}


def add_bushing(model: Any, chain: Chain, joint: int, moments: dict[str, str]) -> None:
    """OpenSim's expression bushing about the joint's axes; it negates its expressions itself."""
    axes = Rotation.from_matrix(chain.rotations[joint] @ peer.BUSHING_AXES).as_euler("XYZ")
    place = [opensim.Vec3(*map(float, v)) for v in (chain.origins[joint], axes)]
    bodies = model.getBodySet()
    below = bodies.get(f"body_{joint - 1}") if joint else model.getGround()
    force = opensim.ExpressionBasedBushingForce(
        f"moments_{joint}", below, *place, bodies.get(f"body_{joint}"), *place
    )
    for coordinate, expression in moments.items():
        getattr(force, f"setM{ANGLE[coordinate][-1]}Expression")(expression)
    model.addForce(force)


@SEEDS
@sweep(
    "pair",
    [
        ("extension", "right_bending"),
        ("extension", "left_rotation"),
        ("right_bending", "left_rotation"),
    ],
)
def test_coupling_of_two_rotations(seed: int, n_joints: int, pair: tuple[str, str]) -> None:
    chain = chain_of(seed, n_joints)
    first, second = pair
    values = ((12.0,), (-9.0,), (15.0,))[: chain.n_joints]

    def add(model: Any) -> None:
        for joint, (c,) in enumerate(values):
            moments = {first: f"{c}*{ANGLE[second]}", second: f"{c}*{ANGLE[first]}"}
            add_bushing(model, chain, joint, moments)

    check(chain, scoped("bending_rotation_coupling", {"pair": pair}, values), chain.stiffness, add)


@SEEDS
@sweep("coordinate", [*ANGLE, "rotations"])
def test_preload_stiffening(seed: int, n_joints: int, coordinate: str) -> None:
    """Moments that grow with the joint's own compression, -k q along superior (delta_z)."""
    chain = chain_of(seed, n_joints)
    values = ((2e-3,), (5e-3,), (1e-3,))[: chain.n_joints]

    def moments(joint: int, rise: float) -> dict[str, str]:
        compression = f"(-{chain.stiffness[joint, 1]}*delta_z)"
        return {
            name: f"{rise}*{compression}*{chain.stiffness[joint, at]}*{ANGLE[name]}"
            for at, name in enumerate(ANGLE, start=3)
            if coordinate in (name, "rotations")
        }

    def add(model: Any) -> None:
        for joint, (rise,) in enumerate(values):
            add_bushing(model, chain, joint, moments(joint, rise))

    effect = scoped("preload_stiffening", {"coordinate": coordinate}, values)
    check(chain, effect, chain.stiffness, add)


@SEEDS
@sweep("name, factor", [("level_dependence", 1.0), ("local_laxity", -1.0)])
def test_all_rotations_scaled(seed: int, n_joints: int, name: str, factor: float) -> None:
    chain, changes = chain_of(seed, n_joints), np.array([0.3, 0.5, 0.7])
    changes = changes[: chain.n_joints]
    values = 1.0 + changes if factor > 0 else changes
    springs = chain.stiffness.copy()
    springs[:, 3:] *= 1.0 + factor * changes[:, None]
    effect = scoped(name, {"coordinate": "rotations"}, tuple((v,) for v in values))
    check(chain, effect, springs, nothing)
