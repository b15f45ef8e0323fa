"""Rigid-body terms of the loaded chain against pinocchio, on random states of random chains.

Every chain has all six joint types, tilted frames and full inertia tensors. Both engines work in
double precision, so they differ by rounding only: some hundred operations of 1e-16 each, on
numbers that differ in size between rows. Errors are therefore held against the largest number of
the same kind (translations, rotations), not entry by entry.

Catches a wrong mass matrix, bias or Jacobian of the loaded chain.
"""

from dataclasses import replace

import numpy as np
import pytest
from sweeps import sweep

from spinepipe.model import RefusedModel
from spinepipe.world import Chain as LoadedChain
from spinepipe.world import StaleChain
from tests.reference.bridge import spine_model
from tests.reference.peers import chain as chains
from tests.reference.peers import pinocchio_peer
from tests.reference.peers.chain import Array, Chain

ROUND_OFF = 1e-12
"""Of the largest entry; rotational inertia about a joint is a small difference of larger terms."""

BODY_COUNTS = (1, 2, 3, 6, 12, 20)


def random_state(rng: np.random.Generator, n_joints: int) -> tuple[Array, Array]:
    """Pose and rate (n,): several mm and tens of degrees, m/s and rad/s."""
    pose = np.hstack([rng.normal(0, 5e-3, (n_joints, 3)), rng.normal(0, 0.4, (n_joints, 3))])
    rate = np.hstack([rng.normal(0, 0.2, (n_joints, 3)), rng.normal(0, 2.0, (n_joints, 3))])
    return pose.ravel(), rate.ravel()


def assert_same(found: Array, expected: Array) -> None:
    """Equal to rounding, translational and rotational rows each by their own size."""
    for rows in (slice(0, 3), slice(3, 6)):
        ours = found.reshape(-1, 6, *found.shape[1:])[:, rows]
        theirs = expected.reshape(-1, 6, *expected.shape[1:])[:, rows]
        scale = np.abs(theirs).max()
        np.testing.assert_allclose(ours, theirs, rtol=0, atol=ROUND_OFF * scale)


@pytest.fixture(params=BODY_COUNTS)
def case(request: pytest.FixtureRequest) -> tuple[Chain, np.random.Generator]:
    """A random chain with frames tilted up to 60 degrees, and the generator."""
    rng = np.random.default_rng(1000 + request.param)
    return chains.random_chain(rng, request.param, tilt_deg=60.0), rng


def test_mass_matrix(case) -> None:
    chain, rng = case
    loaded, peer = LoadedChain(spine_model(chain)), pinocchio_peer.build(chain)
    for _ in range(3):
        pose, _ = random_state(rng, chain.n_joints)
        found, expected = loaded.mass_matrix(pose), peer.mass_matrix(pose)
        assert_same(found, expected)


def test_bias_with_gravity_in_any_direction(case) -> None:
    chain, rng = case
    for gravity in (np.zeros(3), chains.EARTH, rng.normal(0, 10, 3)):
        chain = replace(chain, gravity=gravity)
        loaded, peer = LoadedChain(spine_model(chain)), pinocchio_peer.build(chain)
        pose, rate = random_state(rng, chain.n_joints)
        assert_same(loaded.bias(pose, rate, gravity), peer.bias(pose, rate))


def test_mass_velocity_times_gravity_is_the_weight(case) -> None:
    chain, rng = case
    chain = replace(chain, gravity=rng.normal(0, 10, 3))
    loaded, peer = LoadedChain(spine_model(chain)), pinocchio_peer.build(chain)
    pose, _ = random_state(rng, chain.n_joints)
    assert_same(-loaded.mass_velocity(pose) @ chain.gravity, peer.gravity_load(pose))


def test_jacobian_of_points_far_from_the_centre_of_mass(case) -> None:
    chain, rng = case
    loaded, peer = LoadedChain(spine_model(chain)), pinocchio_peer.build(chain)
    for body in rng.integers(0, chain.n_joints, 4).tolist():
        pose, _ = random_state(rng, chain.n_joints)
        point = chain.origins[body] + rng.normal(0, 0.1, 3)
        linear, angular = loaded.jacobian(pose, body, loaded.local_point(body, point))
        expected = peer.point_jacobian(pose, body, point)
        # lengths are below 2 m and axes are unit vectors
        np.testing.assert_allclose(linear.T, expected[:3], rtol=0, atol=ROUND_OFF)
        np.testing.assert_allclose(angular.T, expected[3:], rtol=0, atol=ROUND_OFF)


@sweep("principal", [(0.0, 0.0, 0.0), (2e-4, 2e-4, 2e-4), (1e-4, 1e-4, 1.5e-4), (1e-8, 2e-4, 2e-4)])
def test_special_inertia_tensors(principal: tuple[float, float, float]) -> None:
    """Equal principal moments leave the principal axes open; PyBullet reports some all the same."""
    rng = np.random.default_rng(5)
    chain = chains.random_chain(rng, 3)
    tensors = [axes @ np.diag(principal) @ axes.T for axes in chain.rotations[::-1]]
    chain = replace(chain, inertias=np.array(tensors))
    loaded, peer = LoadedChain(spine_model(chain)), pinocchio_peer.build(chain)
    pose, rate = random_state(rng, 3)
    assert_same(loaded.mass_matrix(pose), peer.mass_matrix(pose))
    assert_same(loaded.bias(pose, rate, chain.gravity), peer.bias(pose, rate))
    linear, _ = loaded.jacobian(pose, 2, loaded.local_point(2, np.array([0.1, 0.2, -0.1])))
    expected = peer.point_jacobian(pose, 2, np.array([0.1, 0.2, -0.1]))[:3]
    np.testing.assert_allclose(linear.T, expected, rtol=0, atol=ROUND_OFF)


def test_an_inertia_that_no_body_has_is_refused() -> None:
    """PyBullet would put zero in its place and go on."""
    chain = chains.random_chain(np.random.default_rng(6), 2)
    impossible = np.diag([1e-4, 1e-4, 3e-4])
    with pytest.raises(RefusedModel, match="body V1"):
        LoadedChain(spine_model(replace(chain, inertias=np.stack([np.eye(3), impossible]))))


def test_many_models_in_one_process_leave_nothing_behind() -> None:
    """PyBullet keeps dynamics of removed bodies, and files by name: each model must be its own."""
    rng = np.random.default_rng(7)
    for number in range(40):
        chain = chains.random_chain(rng, 1 + number % 4)
        loaded, peer = LoadedChain(spine_model(chain)), pinocchio_peer.build(chain)
        pose, rate = random_state(rng, chain.n_joints)
        found, expected = loaded.mass_matrix(pose), peer.mass_matrix(pose)
        assert_same(found, expected)
        found, expected = loaded.bias(pose, rate, chain.gravity), peer.bias(pose, rate)
        assert_same(found, expected)
        body = chain.n_joints - 1
        linear, _ = loaded.jacobian(pose, body, loaded.local_point(body, chain.centres[body]))
        expected = peer.point_jacobian(pose, body, chain.centres[body])[:3]
        np.testing.assert_allclose(linear.T, expected, rtol=0, atol=ROUND_OFF)


def test_same_geometry_with_other_masses_is_another_model() -> None:
    rng = np.random.default_rng(8)
    chain = chains.random_chain(rng, 2)
    pose, _ = random_state(rng, 2)
    for mass in rng.uniform(0.1, 5.0, 10):
        chain = replace(chain, masses=np.full(2, mass))
        found = LoadedChain(spine_model(chain)).mass_matrix(pose)
        expected = pinocchio_peer.build(chain).mass_matrix(pose)
        assert_same(found, expected)


@sweep(
    "ask",
    [
        lambda loaded: loaded.mass_matrix(np.zeros(12)),
        lambda loaded: loaded.bias(np.zeros(12), np.zeros(12), chains.EARTH),
        lambda loaded: loaded.mass_velocity(np.zeros(12)),
        lambda loaded: loaded.jacobian(np.zeros(12), 1, np.zeros(3)),
    ],
)
def test_a_chain_replaced_by_another_is_refused(ask) -> None:
    model = spine_model(chains.random_chain(np.random.default_rng(9), 2))
    first = LoadedChain(model)
    ask(first)
    second = LoadedChain(model)
    with pytest.raises(StaleChain, match="another model"):
        ask(first)
    ask(second)
