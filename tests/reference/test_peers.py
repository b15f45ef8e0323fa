"""The peers against closed forms and against each other, before anything is measured by them.

Catches a peer that is wrong itself, by which agreement would mean nothing.
"""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.optimize import brentq
from sweeps import sweep

from tests.reference.peers import chain as chains
from tests.reference.peers import newton, opensim_calibration, opensim_peer, pinocchio_peer
from tests.reference.peers.chain import WEIGHTLESS, Chain, Load

Array = NDArray[np.float64]

EQUILIBRIUM = {
    "opensim": opensim_peer.equilibrium,
    "opensim bushing": lambda chain: opensim_peer.equilibrium(chain, law="bushing"),
    "pinocchio": pinocchio_peer.equilibrium,
}

ROUND_OFF = 1e-13
"""m and rad: loads are good to 1e-13 of their size, and angles are of order 0.1."""

LOAD_ROUND_OFF = 1e-10
"""N and N m: the random poses call up to 1e4, so this is 1e-14 of the load."""


def one_joint(rng: np.random.Generator) -> Chain:
    """A weightless tilted joint with its centre of mass at its origin."""
    chain = chains.random_chain(rng, 1)
    return replace(chain, centres=chain.origins, gravity=WEIGHTLESS, loads=())


def random_pose(rng: np.random.Generator, chain: Chain) -> Array:
    shape = (chain.n_joints, 3)
    return np.hstack([rng.normal(0, 2e-3, shape), rng.normal(0, 0.2, shape)])


@pytest.fixture(params=range(4))
def case(request: pytest.FixtureRequest) -> tuple[Chain, Array, np.random.Generator]:
    """A random chain of 1 to 6 joints, a random pose of it, and the generator."""
    rng = np.random.default_rng(request.param)
    chain = chains.random_chain(rng, (1, 2, 4, 6)[request.param])
    return chain, random_pose(rng, chain), rng


@sweep("peer", EQUILIBRIUM)
@sweep("coordinate", range(6))
def test_one_coordinate_moves_by_load_over_stiffness(peer: str, coordinate: int) -> None:
    chain = one_joint(np.random.default_rng(coordinate))
    axis = chain.rotations[0][:, (0, 1, 2, 2, 0, 1)[coordinate]]
    if coordinate < 3:
        load = Load(0, force=80.0 * axis, point=chain.origins[0])
    else:
        load = Load(0, moment=5.0 * axis)
    expected = np.zeros((1, 6))
    expected[0, coordinate] = (80.0 if coordinate < 3 else 5.0) / chain.stiffness[0, coordinate]
    pose = EQUILIBRIUM[peer](chain.with_loads(load))
    np.testing.assert_allclose(pose, expected, rtol=0, atol=ROUND_OFF)


@sweep("peer", EQUILIBRIUM)
def test_pure_flexion_moment_bends_every_level_alike(peer: str) -> None:
    flexion = Load(5, moment=np.array([0.0, 0.0, -7.5]))
    chain = replace(chains.t12_s1_chain(), gravity=WEIGHTLESS).with_loads(flexion)
    pose = EQUILIBRIUM[peer](chain)
    expected = np.zeros((6, 6))
    expected[:, 3] = -7.5 / 51.0
    np.testing.assert_allclose(pose, expected, rtol=0, atol=ROUND_OFF)
    assert np.rad2deg(pose[0, 3]) == pytest.approx(-8.42585, abs=5e-6)


@sweep("peer", EQUILIBRIUM)
def test_a_weight_in_front_of_one_joint(peer: str) -> None:
    """Moment balance k angle = -m g arm(angle); translations do not change the arm."""
    mass, weight_arm, stiffness = 8.0, np.array([0.05, 0.10, 0.0]), 51.0
    chain = chains.lordotic_chain(
        np.array([0.0]), mass, (1e5, 1e6, 1e5, stiffness, 70.0, 290.0), (1.0,) * 6
    )
    chain = replace(chain, centres=weight_arm[None])

    def missing(angle: float) -> float:
        arm = weight_arm[0] * np.cos(angle) - weight_arm[1] * np.sin(angle)
        return stiffness * angle + mass * 9.81 * arm

    expected = [0.0, -mass * 9.81 / 1e6, 0.0, brentq(missing, -1.0, 1.0, xtol=1e-15), 0.0, 0.0]
    np.testing.assert_allclose(EQUILIBRIUM[peer](chain), [expected], rtol=0, atol=ROUND_OFF)


def test_points_are_where_the_written_out_kinematics_say(case) -> None:
    chain, pose, rng = case
    opensim_chain, pinocchio_chain = opensim_peer.build(chain), pinocchio_peer.build(chain)
    carried = chains.displacements(chain, pose)
    for body in range(chain.n_joints):
        point = rng.normal(0, 0.1, 3)
        expected = (carried[body] @ np.append(point, 1.0))[:3]
        found = opensim_peer.point_position(opensim_chain, pose, f"body_{body}", point)
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-14)
        found = pinocchio_chain.point_position(pose, body, point)
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-14)


def test_loads_without_moments_are_the_slope_of_an_energy(case) -> None:
    chain, pose, _ = case
    chain = chain.with_loads(*(replace(load, moment=np.zeros(3)) for load in chain.loads))

    def energy(q: Array) -> Array:
        carried = chains.displacements(chain, q.reshape(-1, 6))
        centres = np.einsum("bij,bj->bi", carried[:, :3, :3], chain.centres) + carried[:, :3, 3]
        stored = 0.5 * np.sum(chain.stiffness.ravel() * q**2)
        weight = np.sum(chain.masses[:, None] * centres * chain.gravity)
        work = sum(
            load.force @ (carried[load.body] @ np.append(load.point, 1.0))[:3]
            for load in chain.loads
        )
        return np.array([stored - weight - work])

    slope = newton.tangent(energy, pose.ravel())[0]
    found = pinocchio_peer.build(chain).residual(pose)
    # a central difference of an energy of order 10 J over 1e-6
    np.testing.assert_allclose(found, slope, rtol=1e-8, atol=1e-7)


@sweep("law", ["coordinate", "bushing"])
def test_both_engines_miss_the_same_load_for_equilibrium(case, law: opensim_peer.Law) -> None:
    chain, pose, _ = case
    found = opensim_peer.residual(opensim_peer.build(chain, law=law), pose)
    expected = pinocchio_peer.build(chain).residual(pose)
    np.testing.assert_allclose(found, expected, rtol=0, atol=LOAD_ROUND_OFF)


def test_both_engines_scale_the_loads_alike(case) -> None:
    chain, pose, _ = case
    found = opensim_peer.residual(opensim_peer.build(chain, ramp_time=2.0), pose, factor=0.3)
    expected = pinocchio_peer.build(chain).residual(pose, factor=0.3)
    np.testing.assert_allclose(found, expected, rtol=0, atol=LOAD_ROUND_OFF)


def test_both_engines_weigh_alike(case) -> None:
    chain, pose, _ = case
    bare = replace(chain, stiffness=0.0 * chain.stiffness, loads=())
    found = opensim_peer.residual(opensim_peer.build(bare), pose)
    expected = pinocchio_peer.build(bare).gravity_load(pose)
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-13)


def test_both_engines_have_the_same_inertia(case) -> None:
    chain, pose, _ = case
    found = opensim_peer.mass_matrix(opensim_peer.build(chain), pose)
    expected = pinocchio_peer.build(chain).mass_matrix(pose)
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-14)


def test_both_engines_ask_the_same_load_of_a_motion(case) -> None:
    chain, pose, rng = case
    bare = replace(chain, stiffness=0.0 * chain.stiffness, loads=())
    speed, rate = rng.normal(0, 1, (2, 6 * chain.n_joints))
    peer = pinocchio_peer.build(bare)
    damped = chain.damping.ravel() * speed
    expected = peer.bias(pose, speed) + peer.mass_matrix(pose) @ rate + damped
    found = opensim_peer.inverse_dynamics(opensim_peer.build(bare), pose, speed, rate)
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-11)
    rigid = peer.inverse_dynamics(pose, speed, rate) + damped
    np.testing.assert_allclose(rigid, expected, rtol=0, atol=1e-11)


def test_point_jacobian_is_the_slope_of_the_point(case) -> None:
    chain, pose, rng = case
    peer, body, point = pinocchio_peer.build(chain), chain.n_joints - 1, rng.normal(0, 0.1, 3)
    slope = newton.tangent(lambda q: peer.point_position(q, body, point), pose.ravel())
    found = peer.point_jacobian(pose, body, point)
    np.testing.assert_allclose(found[:3], slope, rtol=0, atol=1e-9)


def test_both_engines_find_the_same_equilibrium(case) -> None:
    chain, _, _ = case
    found = {peer: solve(chain) for peer, solve in EQUILIBRIUM.items()}
    assert np.abs(found["pinocchio"]).max() > 0.02  # a chain that hardly moves shows nothing
    np.testing.assert_allclose(found["opensim"], found["pinocchio"], rtol=0, atol=ROUND_OFF)
    np.testing.assert_allclose(found["opensim bushing"], found["pinocchio"], rtol=0, atol=ROUND_OFF)


@sweep("law", ["coordinate", "bushing"])
def test_a_file_has_the_equilibrium_of_its_chain(tmp_path, case, law: opensim_peer.Law) -> None:
    """Half of the loads go through the file, the others are added to it."""
    chain, _, _ = case
    in_file, added = chain.loads[::2], [(f"body_{load.body}", load) for load in chain.loads[1::2]]
    path = tmp_path / "chain.osim"
    opensim_peer.build(chain.with_loads(*in_file), law=law).model.printToXML(str(path))
    found = opensim_peer.equilibrium_of_file(path, added)
    expected = opensim_peer.equilibrium(chain)
    assert len(found) == expected.size
    for level, pose in enumerate(expected):
        for name, value in zip(opensim_peer.COORDINATES, pose, strict=True):
            assert found[f"{name}_{level}"] == pytest.approx(value, abs=1e-11)


@sweep("integrator", ["cpodes", "rkm"])
def test_settling_of_one_joint_follows_its_closed_form(integrator: str) -> None:
    """Overdamped: inertia a'' + damping a' + stiffness a = moment, from rest."""
    chain = one_joint(np.random.default_rng(3))
    axis, moment = chain.rotations[0][:, 2], 5.0
    inertia = axis @ chain.inertias[0] @ axis
    damping, stiffness = 0.3, chain.stiffness[0, 3]
    chain = replace(chain, damping=np.array([[50.0, 50.0, 50.0, damping, damping, damping]]))
    times = np.array([0.0005, 0.002, 0.01])
    fast, slow = np.roots([inertia, damping, stiffness])
    share = (fast * np.exp(slow * times) - slow * np.exp(fast * times)) / (fast - slow)
    expected = moment / stiffness * (1.0 - share)
    loaded = chain.with_loads(Load(0, moment=moment * axis))
    found = opensim_peer.settle(loaded, 0.01, integrator, times, accuracy=1e-7)
    np.testing.assert_allclose(found[:, 0, 3], expected, rtol=0, atol=1e-6)


def test_settling_ends_in_the_equilibrium_whatever_the_ramp() -> None:
    chain = chains.t12_s1_chain().with_loads(Load(5, moment=np.array([0.0, 7.5, 0.0])))
    expected = opensim_peer.equilibrium(chain)
    for ramp_time in (0.0, 0.5):
        reached = opensim_peer.settle(chain, 1.5, ramp_time=ramp_time)[-1]
        # ten times the accuracy asked of one integration step
        np.testing.assert_allclose(reached, expected, rtol=0, atol=1e-6)


def test_a_load_on_its_ramp_is_followed_quasi_statically() -> None:
    chain = chains.t12_s1_chain().with_loads(Load(5, moment=np.array([7.5, 0.0, 0.0])))
    halfway = opensim_peer.settle(chain, 10.0, times=[5.0], ramp_time=10.0)[0]
    half_load = chain.with_loads(Load(5, moment=np.array([3.75, 0.0, 0.0])))
    # it lags behind by damping over stiffness, here below 0.1 s of 10 s: 1 % of 6 degrees
    np.testing.assert_allclose(halfway, opensim_peer.equilibrium(half_load), rtol=0, atol=1e-3)


def test_cpodes_refuses_what_it_would_never_finish() -> None:
    with pytest.raises(ValueError, match="CPodes"):
        opensim_peer.settle(chains.l1_l4_chain(), 0.1, accuracy=1e-9)


def test_static_calibration_finds_the_stiffness_back() -> None:
    start = chains.t12_s1_chain()
    moments = 7.5 * np.array([[0.0, 0.0, -1.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]])
    cases = [(Load(5, moment=moment),) for moment in moments]
    truth = start.stiffness * np.array([1.0, 1.0, 1.0, 0.6, 1.3, 0.8])
    seen = [pinocchio_peer.equilibrium(start.with_stiffness(truth).with_loads(*c)) for c in cases]
    fit = opensim_calibration.calibrate(
        opensim_calibration.static_predictor(start, cases),
        start.stiffness,
        np.array(seen),
        opensim_calibration.one_per_axis(6),
    )
    assert fit.success
    np.testing.assert_allclose(fit.stiffness, truth, rtol=1e-9)


def test_forward_calibration_finds_the_stiffness_back_with_a_coarse_step() -> None:
    start = one_joint(np.random.default_rng(5))
    cases = [(Load(0, moment=5.0 * start.rotations[0][:, 2]),)]
    truth = start.stiffness * np.array([1.0, 1.0, 1.0, 0.7, 1.0, 1.0])
    seen = [pinocchio_peer.equilibrium(start.with_stiffness(truth).with_loads(*cases[0]))]
    groups = np.full((1, 6), opensim_calibration.FIXED)
    groups[0, 3] = 0
    fit = opensim_calibration.calibrate(
        opensim_calibration.forward_predictor(start, cases),
        start.stiffness,
        np.array(seen),
        groups,
        difference_step=1e-3,
    )
    np.testing.assert_allclose(fit.stiffness, truth, rtol=1e-5)


def test_a_load_beyond_the_chain_is_refused() -> None:
    """Six soft joints under far too much weight: no equilibrium to be found near the load path."""
    soft = replace(chains.t12_s1_chain(), masses=np.full(6, 500.0))
    soft = replace(soft, stiffness=soft.stiffness * 1e-3)
    with pytest.raises(newton.NoEquilibriumError):
        pinocchio_peer.equilibrium(soft)
