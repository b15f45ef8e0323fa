"""Geometry and load effects against OpenSim models built with the real thing, and energies.

A displaced joint centre is an OpenSim joint that stands there, a tilt of axes a joint tilted so, a
left-out weight a heavier body, a follower load a path actuator under constant tension.

Catches an effect that is not the real thing it stands for.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import opensim
import pytest
from scipy.spatial.transform import Rotation
from sweeps import sweep

from spinepipe.effects import create
from spinepipe.model import ScopedEffect
from spinepipe.statics import System, follow, observe
from spinepipe.world import Chain as LoadedChain
from tests.reference import bridge
from tests.reference.peers import chain as chains
from tests.reference.peers import opensim_peer
from tests.reference.peers.chain import WEIGHTLESS, Array, Chain, Load

ROUND_OFF = 1e-13
"""m and rad; poses of order 0.1 from two engines, re-expressed."""

SEEDS = sweep("seed", range(4))


def random_chain(seed: int, n_joints: int = 4) -> Chain:
    return chains.random_chain(np.random.default_rng(seed), n_joints)


def pose(chain: Chain, name: str, values: Array, options: dict[str, str] | None = None) -> Array:
    """(J, 6) reported by spinepipe for the chain with one more effect on all joints."""
    model = bridge.spine_model(chain)
    scope = ScopedEffect(create(name, options), tuple(range(chain.n_joints)), np.atleast_2d(values))
    model = replace(model, effects=(*model.effects, scope))
    system = System(LoadedChain(model), model, bridge.load_case(chain))
    found = follow(system)[-1].equilibrium
    assert found.status.usable, found.message
    return observe(system, found.q)


def assert_moved(found: Array, chain: Chain) -> None:
    """The effect does something: more than 0.05 deg somewhere."""
    assert np.rad2deg(np.abs(found - bridge.pose(chain))[:, 3:].max()) > 0.05


@SEEDS
def test_a_displaced_centre_is_a_joint_that_stands_there(seed: int) -> None:
    chain = random_chain(seed)
    offset = np.random.default_rng(seed).uniform(-0.01, 0.01, (4, 3))
    stand = chain.origins + np.einsum("jxy,jy->jx", chain.rotations, offset)
    q = opensim_peer.equilibrium(replace(chain, origins=stand))
    # the stated centre s is at -c from the true one: it moves by t + (R - 1)(-c)
    turned = Rotation.from_euler("ZXY", q[:, 3:]).apply(-offset)
    expected = np.hstack([q[:, :3] + turned + offset, q[:, 3:]])
    found = pose(chain, "joint_centre_offset", offset)
    np.testing.assert_allclose(found, expected, rtol=0, atol=ROUND_OFF)
    assert_moved(found, chain)


def seen_from(tilt: Rotation, q: Array) -> Array:
    """(J, 6) coordinates of motions (J, 6) in axes tilted by rotations, one for each joint."""
    angles = (tilt.inv() * Rotation.from_euler("ZXY", q[:, 3:]) * tilt).as_euler("ZXY")
    return np.hstack([tilt.inv().apply(q[:, :3]), angles])


@SEEDS
def test_tilted_axes_are_a_tilted_joint(seed: int) -> None:
    chain = random_chain(seed)
    tilts = np.random.default_rng(seed).uniform(-0.2, 0.2, (4, 3))
    tilt = Rotation.from_euler("ZXY", tilts)
    tilted = replace(chain, rotations=chain.rotations @ tilt.as_matrix())
    expected = seen_from(tilt.inv(), opensim_peer.equilibrium(tilted))
    found = pose(chain, "axes_tilt", tilts)
    np.testing.assert_allclose(found, expected, rtol=0, atol=ROUND_OFF)
    assert_moved(found, chain)


@SEEDS
def test_tilted_markers_report_the_motion_in_tilted_axes(seed: int) -> None:
    chain = random_chain(seed)
    tilts = np.random.default_rng(seed).uniform(-0.1, 0.1, (4, 3))
    expected = seen_from(Rotation.from_euler("ZXY", tilts), opensim_peer.equilibrium(chain))
    found = pose(chain, "marker_bias", tilts, {"form": "tilt"})
    np.testing.assert_allclose(found, expected, rtol=0, atol=ROUND_OFF)
    assert_moved(found, chain)


@SEEDS
@sweep("where", ["each", "top"])
def test_a_weight_left_out_is_a_heavier_body(seed: int, where: str) -> None:
    chain = random_chain(seed)
    more = np.full(4, 2.0) if where == "each" else np.array([0.0, 0.0, 0.0, 2.0])
    expected = opensim_peer.equilibrium(replace(chain, masses=chain.masses + more))
    found = pose(chain, "segment_weight", np.array([2.0]), {"where": where})
    np.testing.assert_allclose(found, expected, rtol=0, atol=ROUND_OFF)
    assert_moved(found, chain)


def turned_loads(chain: Chain, axes: tuple[int, int], tilts: tuple[float, float]) -> Chain:
    first, second = (
        Rotation.from_rotvec(t * np.eye(3)[a]) for t, a in zip(tilts, axes, strict=True)
    )
    moved = (replace(load, moment=(first * second).apply(load.moment)) for load in chain.loads)
    return chain.with_loads(*moved)


@SEEDS
def test_a_misaligned_load_is_a_turned_one(seed: int) -> None:
    """With forces and moments on every body, and the main axis that of all moments together."""
    chain = random_chain(seed)
    main = int(np.argmax(np.sum([np.abs(load.moment) for load in chain.loads], axis=0)))
    axes = {0: (1, 2), 1: (2, 0), 2: (0, 1)}[main]
    expected = opensim_peer.equilibrium(turned_loads(chain, axes, (0.08, -0.05)))
    found = pose(chain, "load_misalignment", np.array([0.08, -0.05]))
    np.testing.assert_allclose(found, expected, rtol=0, atol=ROUND_OFF)
    assert_moved(found, chain)


@SEEDS
def test_gain_and_offset_are_other_loads(seed: int) -> None:
    chain, extra = random_chain(seed), np.array([0.3, -0.2, 0.4])
    larger = (replace(w, force=1.05 * w.force, moment=1.05 * w.moment) for w in chain.loads)
    cases = (
        (chain.with_loads(*larger), "load_gain", np.array([0.05])),
        (chain.with_loads(*chain.loads, Load(3, moment=extra)), "load_offset", extra),
    )
    for other, name, values in cases:
        found = pose(chain, name, values)
        np.testing.assert_allclose(found, opensim_peer.equilibrium(other), rtol=0, atol=ROUND_OFF)
        assert_moved(found, chain)


def through_joints(chain: Chain) -> Array:
    """(1 + J, 3) the joints of all bodies, and a point 30 mm above the last."""
    return np.vstack([chain.origins, chain.origins[-1] + 0.03 * chain.rotations[-1][:, 1]])


def through_centres(chain: Chain) -> Array:
    """(1 + J, 3) all centres of mass, and below the lowest joint as far as the first is above."""
    return np.vstack([2.0 * chain.origins[0] - chain.centres[0], chain.centres])


def ahead(chain: Chain, by: float) -> Array:
    """(1 + J, 3) m along the anterior axis of each body's joint, of ground the lowest's."""
    axes = chain.rotations[:, :, 0]
    return by * np.vstack([axes[:1], axes])


CABLES = {"joints": through_joints, "centres": through_centres}


def with_cable(peer, chain: Chain, tension: float, guides: Array):
    """The chain in OpenSim with a path actuator from ground through all bodies, pulling always."""
    built = peer.build(chain, ramp_time=1.0)
    cable = opensim.PathActuator()
    cable.setName("cable")
    cable.setOptimalForce(tension)
    frames = [
        built.model.getGround(),
        *(built.model.getBodySet().get(b) for b in range(chain.n_joints)),
    ]
    for number, (frame, guide) in enumerate(zip(frames, guides, strict=True)):
        cable.addNewPathPoint(f"guide_{number}", frame, opensim.Vec3(*map(float, guide)))
    built.model.addForce(cable)
    pull = opensim.PiecewiseLinearFunction()  # with the loads, from 0 to all of it in a second
    for time, share in ((0.0, 0.0), (1.0, 1.0), (2.0, 1.0)):
        pull.addPoint(time, share)
    controller = opensim.PrescribedController()
    controller.addActuator(cable)
    controller.prescribeControlForActuator("cable", pull)
    built.model.addController(controller)
    return peer._ready(built.model, list(built.coordinates), 1.0)


@SEEDS
@sweep("tension", [60.0, 300.0])
@sweep("guides, anterior", [*((g, 0.0) for g in CABLES), ("joints", -0.01)])
def test_a_follower_load_is_a_path_actuator(
    seed: int, tension: float, guides: str, anterior: float
) -> None:
    chain = random_chain(seed)
    points = CABLES[guides](chain) + ahead(chain, anterior)
    cable = with_cable(opensim_peer, chain, tension, points)
    expected = opensim_peer.equilibrium_of(cable).reshape(-1, 6)
    found = pose(chain, "follower_load", np.array([tension, anterior]), {"guides": guides})
    np.testing.assert_allclose(found, expected, rtol=0, atol=ROUND_OFF)
    shortened = found[:, 1] - bridge.pose(chain)[:, 1]
    assert np.all(shortened < 0.0)
    assert shortened.min() < -1e-5


Law = Callable[[Array], Array]


def energy(chain: Chain, seen: Law, q: Array) -> float:
    """J: springs on the coordinates the law sees, less the work of the forces; no moments."""
    carried = chains.displacements(chain, q)
    work = sum(
        load.force @ (carried[load.body] @ np.append(load.point, 1.0))[:3] for load in chain.loads
    )
    return 0.5 * float(np.sum(chain.stiffness * seen(q) ** 2)) - float(work)


def migrated(q: Array) -> Array:
    """A centre that moves 40 mm/rad forwards and 60 mm/rad down."""
    centre = np.outer(q[:, 3], [0.04, -0.06, 0.0])
    turned = Rotation.from_euler("ZXY", q[:, 3:]).apply(centre)
    return np.hstack([q[:, :3] + turned - centre, q[:, 3:]])


def about_x_first(q: Array) -> Array:
    bending, rotation, extension = Rotation.from_euler("ZXY", q[:, 3:]).as_euler("XYZ").T
    return np.column_stack([q[:, :3], extension, bending, rotation])


@SEEDS
@sweep(
    "name, values, seen",
    [
        pytest.param("joint_centre_migration", (0.04, -0.06), migrated, id="migration"),
        pytest.param("rotation_order", (1.0,), about_x_first, id="order"),
    ],
)
def test_a_spine_rests_where_its_energy_is_level(seed: int, name: str, values, seen: Law) -> None:
    chain = replace(random_chain(seed, 3), gravity=WEIGHTLESS)
    chain = chain.with_loads(
        *(replace(w, force=2.0 * w.force, moment=np.zeros(3)) for w in chain.loads)
    )
    found = pose(chain, name, np.tile(values, (3, 1)))
    assert_moved(found, chain)
    # differences of an energy of some 10 J over 1e-4 are good to 1e-10; loads are 1 to 200
    np.testing.assert_allclose(level(chain, seen, found), 0.0, rtol=0, atol=1e-8)


def level(chain: Chain, seen: Law, q: Array) -> Array:
    """(n,) slope of the energy by fourth-order differences, so that it vanishes at rest."""
    flat, slopes = np.ravel(q), []
    for direction in 1e-4 * np.eye(flat.size):
        at = [energy(chain, seen, (flat + k * direction).reshape(-1, 6)) for k in (-2, -1, 1, 2)]
        slopes.append((at[0] - 8.0 * at[1] + 8.0 * at[2] - at[3]) / 12e-4)
    return np.array(slopes)
