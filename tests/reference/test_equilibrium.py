"""Equilibria against OpenSim, pinocchio and closed forms; loads against energies; stability.

Catches an equilibrium that differs from two other engines', and a tipping one called stable.
"""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import brentq
from sweeps import sweep

from spinepipe.statics import follow
from spinepipe.status import Status
from tests.reference import bridge
from tests.reference.peers import chain as chains
from tests.reference.peers import newton, opensim_peer, pinocchio_peer
from tests.reference.peers.chain import WEIGHTLESS, Array, Chain, Load

ROUND_OFF = 1e-13
"""m and rad: Newton squares its error, so what is left is the rounding of loads, 1e-15 of them,
over stiffness: angles of order 0.1 are good to some 1e-16, less where the chain is nearly loose."""


PEERS = sweep("solve", [opensim_peer.equilibrium, pinocchio_peer.equilibrium])


def upright(stiffness: float = 51.0, mass: float = 0.1, arm: tuple[float, float] = (0.0, 0.0)):
    """One joint in ground axes; ``arm`` is where its centre of mass is, anterior and superior."""
    others = (1e5, 1e6, 1e5, stiffness, 5000.0, 290.0)
    chain = chains.lordotic_chain(np.array([0.0]), mass, others, (1000.0,) * 3 + (2.0,) * 3)
    return replace(chain, centres=np.array([[*arm, 0.0]]))


def random_pose(rng: np.random.Generator, n_joints: int) -> Array:
    shape = (n_joints, 3)
    return np.hstack([rng.normal(0, 2e-3, shape), rng.normal(0, 0.2, shape)]).ravel()


@PEERS
@sweep("seed", range(18))
def test_random_chains_of_one_to_six_joints(solve, seed: int) -> None:
    """Gravity, forces and moments on every body; all six coordinates carry load."""
    chain = chains.random_chain(np.random.default_rng(seed), 1 + seed % 6)
    expected = solve(chain)
    assert np.abs(expected).max() > 0.01  # a chain that hardly moves shows nothing
    np.testing.assert_allclose(bridge.pose(chain), expected, rtol=0, atol=ROUND_OFF)


def long_chain(seed: int, mass_share: float, force_share: float) -> Chain:
    chain = chains.random_chain(np.random.default_rng(seed), 20)
    loads = [
        replace(load, force=force_share * load.force, moment=0.3 * load.moment)
        for load in chain.loads
    ]
    return replace(chain, masses=mass_share * chain.masses).with_loads(*loads)


@PEERS
def test_a_chain_of_twenty_joints(solve) -> None:
    """As many as are allowed; light enough that it does not buckle."""
    chain = long_chain(102, mass_share=0.3, force_share=0.05)
    np.testing.assert_allclose(bridge.pose(chain), solve(chain), rtol=0, atol=ROUND_OFF)


def test_the_load_path_leads_to_the_stable_one_of_two_equilibria() -> None:
    """A slender chain bends under its weight; Newton by itself jumps to the upright pose, which
    has two growing modes and so a positive determinant."""
    chain = long_chain(100, mass_share=1.0, force_share=0.1)
    built, jumped, followed = (
        pinocchio_peer.build(chain),
        pinocchio_peer.equilibrium(chain),
        bridge.pose(chain),
    )
    assert np.abs(built.residual(followed)).max() < 1e-9
    slowest = {}
    for name, q in (("jumped", jumped), ("followed", followed)):
        slope = newton.tangent(built.residual, q.ravel())
        slowest[name] = np.linalg.eigvals(slope / chain.damping.ravel()[:, None]).real.min()
    assert slowest["followed"] > 0.0 > slowest["jumped"]


@sweep("coordinate", range(6))
def test_one_coordinate_moves_by_load_over_stiffness(coordinate: int) -> None:
    """A weightless tilted joint, loaded along one of its own axes at its origin."""
    chain = chains.random_chain(np.random.default_rng(coordinate), 1)
    axis = chain.rotations[0][:, (0, 1, 2, 2, 0, 1)[coordinate]]
    load = Load(0, moment=5.0 * axis)
    if coordinate < 3:
        load = Load(0, force=80.0 * axis, point=chain.origins[0])
    expected = np.zeros((1, 6))
    expected[0, coordinate] = (80.0 if coordinate < 3 else 5.0) / chain.stiffness[0, coordinate]
    pose = bridge.pose(replace(chain, gravity=WEIGHTLESS).with_loads(load))
    np.testing.assert_allclose(pose, expected, rtol=0, atol=ROUND_OFF)


def test_a_planar_moment_bends_each_level_by_moment_over_its_own_stiffness() -> None:
    stiffness = np.array([20.0, 35.0, 51.0, 80.0, 140.0, 300.0])
    chain = replace(chains.t12_s1_chain(), gravity=WEIGHTLESS)
    values = chain.stiffness.copy()
    values[:, 3] = stiffness
    loaded = chain.with_stiffness(values).with_loads(Load(5, moment=np.array([0.0, 0.0, 7.5])))
    expected = np.zeros((6, 6))
    expected[:, 3] = 7.5 / stiffness
    np.testing.assert_allclose(bridge.pose(loaded), expected, rtol=0, atol=ROUND_OFF)


@sweep("arm", [(0.05, 0.10), (-0.08, 0.02), (0.03, -0.15)])
def test_a_cantilevered_weight(arm: tuple[float, float]) -> None:
    """Moment balance k angle = -m g arm(angle); translations do not change the arm."""
    chain = upright(mass=8.0, arm=arm)

    def missing(angle: float) -> float:
        return 51.0 * angle + 8.0 * 9.81 * (arm[0] * np.cos(angle) - arm[1] * np.sin(angle))

    angle = brentq(missing, -1.0, 1.0, xtol=1e-15)
    expected = [[0.0, -8.0 * 9.81 / 1e6, 0.0, angle, 0.0, 0.0]]
    np.testing.assert_allclose(bridge.pose(chain), expected, rtol=0, atol=ROUND_OFF)


def pressed(share_of_critical: float, push: float = 0.0) -> Chain:
    """A vertical load P at height h on one rotational spring k; P h = k is its limit."""
    height, stiffness = 0.2, 51.0
    force = np.array([-push, -share_of_critical * stiffness / height, 0.0])
    point = np.array([0.0, height, 0.0])
    weightless = replace(upright(stiffness), gravity=WEIGHTLESS)
    return weightless.with_loads(Load(0, force=force, point=point))


@sweep("share", [0.5, 0.999, 1 - 1e-6])
def test_a_vertical_load_below_its_limit_stands(share: float) -> None:
    pose = bridge.pose(pressed(share))
    assert pose[0, 1] == pytest.approx(-share * 51.0 / 0.2 / 1e6, rel=1e-12)
    np.testing.assert_array_equal(pose[0, [0, 2, 3, 4, 5]], 0.0)


@sweep("share", [1 + 1e-6, 1.001, 1.5, 3.0])
def test_a_vertical_load_beyond_its_limit_is_unstable(share: float) -> None:
    found = bridge.equilibrium(pressed(share))
    assert found.status is Status.UNSTABLE
    assert "stability" in found.message
    # the last stable share of the load, known to the smallest increment it was cut into
    assert found.reached == pytest.approx(1.0 / share, abs=2.0 / 1024.0)
    assert np.isfinite(found.q).all()


def test_beyond_the_limit_a_push_leads_to_the_bent_pose() -> None:
    """k angle = P h sin(angle) + F h cos(angle): past buckling, on the side of the push."""
    share, push = 1.2, 3.0
    pose = bridge.pose(pressed(share, push))

    def missing(angle: float) -> float:
        return 51.0 * (angle - share * np.sin(angle)) - push * 0.2 * np.cos(angle)

    assert pose[0, 3] == pytest.approx(brentq(missing, 0.1, 1.5, xtol=1e-15), abs=1e-12)


@sweep("force", [3e3, 3e4, 3e6])
def test_a_load_that_tips_the_segment_is_unstable_and_without_nan(force: float) -> None:
    tipping = Load(5, force=np.array([0.1 * force, -force, 0.0]), point=np.array([0.0, 0.25, 0.0]))
    steps = follow(bridge.system(chains.t12_s1_chain().with_loads(tipping), 0.0, 1.0, 0.5))
    resting, tipped, after = (step.equilibrium for step in steps)
    assert resting.status is Status.CONVERGED
    assert tipped.status is after.status is Status.UNSTABLE
    assert tipped.message
    assert "earlier" in after.message
    assert all(np.isfinite(step.equilibrium.q).all() for step in steps)


@sweep("seed", range(4))
def test_loads_without_moments_are_the_slope_of_an_energy(seed: int) -> None:
    """The energy is built on kinematics written out apart from spinepipe."""
    rng = np.random.default_rng(seed)
    chain = chains.random_chain(rng, (1, 2, 4, 6)[seed])
    chain = chain.with_loads(*(replace(load, moment=np.zeros(3)) for load in chain.loads))

    def energy(q: Array) -> Array:
        carried = chains.displacements(chain, q.reshape(-1, 6))
        centres = np.einsum("bij,bj->bi", carried[:, :3, :3], chain.centres) + carried[:, :3, 3]
        stored = 0.5 * np.sum(chain.stiffness.ravel() * q**2)
        weight = np.sum(chain.masses[:, None] * centres * chain.gravity)
        moved = [carried[load.body] @ np.append(load.point, 1.0) for load in chain.loads]
        work = sum(load.force @ p[:3] for load, p in zip(chain.loads, moved, strict=True))
        return np.array([stored - weight - work])

    q = random_pose(rng, chain.n_joints)
    prepared = bridge.system(chain)
    loading = prepared.slots.loading(prepared.case.steps[0].wrenches)
    found = prepared.balance(q, loading, prepared.initial_states())
    # a central difference of an energy of order 10 J over 1e-6
    slope = newton.tangent(energy, q)[0]
    np.testing.assert_allclose(found.residual, slope, rtol=1e-8, atol=1e-7)
    # without moments the loads are conservative: the tangent is symmetric, bit for bit
    np.testing.assert_array_equal(found.tangent, found.tangent.T)


@sweep("seed", range(4))
def test_the_tangent_is_the_slope_of_the_peers_residual(seed: int) -> None:
    """With moments, far from equilibrium: residual and slope both from pinocchio."""
    rng = np.random.default_rng(seed)
    chain = chains.random_chain(rng, (1, 2, 4, 6)[seed])
    q = random_pose(rng, chain.n_joints)
    prepared, built = bridge.system(chain), pinocchio_peer.build(chain)
    loading = prepared.slots.loading(prepared.case.steps[0].wrenches)
    found = prepared.balance(q, loading, prepared.initial_states())
    expected = built.residual(q)
    # loads reach 1e4 N; a central difference over 1e-6 magnifies their rounding to 1e-5
    np.testing.assert_allclose(found.residual, expected, rtol=0, atol=1e-10)
    slope = newton.tangent(built.residual, q)
    np.testing.assert_allclose(found.tangent, slope, rtol=1e-8, atol=1e-5)
