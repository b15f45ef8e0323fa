"""What a stack takes for stable, against PyBullet's mass matrix and the rates of all modes.

Catches a tipping or fluttering spine that is proven stable.
"""

from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import eigvalsh
from sweeps import sweep

from spinepipe.effects.contract import Array
from spinepipe.statics import System
from spinepipe.statics.batched import stability
from spinepipe.statics.batched.dynamics import BatchedLUFactors, Moving
from spinepipe.statics.batched.equilibrium import newton
from spinepipe.statics.batched.forward_kinematics import forward_kinematics
from spinepipe.statics.batched.loads import part
from spinepipe.statics.batched.stability_certificate import respond
from spinepipe.statics.batched.stack import Stack
from spinepipe.statics.batched.vectors import lanes as unblocked
from spinepipe.statics.equilibrium import decays
from spinepipe.world import Chain
from tests.reference import bridge
from tests.reference.peers import chain as chains

pytestmark = pytest.mark.numeric

Matrices = tuple[Array, Array]


def loaded(rng: np.random.Generator, n_joints: int, size: float, soft: float) -> chains.Chain:
    """A random chain with so many times its usual loads and share of its stiffness."""
    chain = chains.random_chain(rng, n_joints)
    loads = [replace(one, force=size * one.force, moment=size * one.moment) for one in chain.loads]
    return chain.with_loads(*loads).with_stiffness(soft * np.asarray(chain.stiffness))


def stack_of(made: list[chains.Chain]) -> Stack:
    models = [bridge.spine_model(chain) for chain in made]
    return Stack.of(models, [(n, bridge.load_case(chain)) for n, chain in enumerate(made)])


def by_pybullet(chain: chains.Chain, q: Array) -> Matrices:
    """Mass matrix and tangent at q (J, 6), where damping is one."""
    model = bridge.spine_model(chain)
    system = System(Chain(model), model, bridge.load_case(chain))
    loading = system.slots.loading(system.case.steps[0].wrenches)
    tangent = system.balance(q.ravel(), loading, system.initial_states()).tangent
    scale = 1.0 / np.sqrt(model.damping.ravel())
    both = scale[:, None] * scale
    return system.chain.mass_matrix(q.ravel()) * both, tangent * both


@sweep("n_joints", [1, 3, 6, 17])
def test_tangents_and_mass_matrices_are_pybullet_s(n_joints: int) -> None:
    rng = np.random.default_rng(n_joints)
    chain = loaded(rng, n_joints, 1.0, 1.0)
    stack = stack_of([chain])
    q = rng.normal(0.0, 0.05, (1, n_joints, 6)) * np.array([0.02] * 3 + [1.0] * 3)
    tangents = stack.bound(np.array([0]), {}).joint_forces(q).tangent
    lanes = stability.lanes_of(stack.chains, stack.loads, q, tangents)
    mass, tangent = stability.matrices(lanes)
    expected_mass, expected_tangent = by_pybullet(chain, q[0])
    np.testing.assert_allclose(
        mass, expected_mass, rtol=0, atol=1e-11 * np.abs(expected_mass).max()
    )
    largest = np.abs(expected_tangent).max()
    np.testing.assert_allclose(tangent, expected_tangent, rtol=0, atol=1e-11 * largest)


@sweep("n_joints", [1, 3, 6, 17])
def test_inertia_is_pybullet_s(n_joints: int) -> None:
    """Mass matrices, what inertia asks for at given rates, and the accelerations that answer."""
    rng = np.random.default_rng(20 + n_joints)
    made = [loaded(rng, n_joints, 1.0, 1.0) for _ in range(3)]
    stack = stack_of(made)
    q = rng.normal(0.0, 0.05, (3, n_joints, 6)) * np.array([0.02] * 3 + [1.0] * 3)
    rates, forces = rng.normal(size=q.shape), rng.normal(size=(3, 6 * n_joints))
    tangents = stack.bound(np.arange(3), {}).joint_forces(q).tangent
    seen = forward_kinematics(stack.chains, stack.loads, q, tangents)
    moving = Moving.of(stack.chains, stack.loads.chain, seen)
    inertial, accelerations = moving.velocity_product_forces(rates), moving.accelerations(forces)
    solved = BatchedLUFactors(moving.mass).solve(forces)
    for lane, chain in enumerate(made):
        engine = Chain(bridge.spine_model(chain))
        mass = engine.mass_matrix(q[lane].ravel())
        bias = engine.bias(q[lane].ravel(), rates[lane].ravel(), np.zeros(3))
        for found, expected in ((moving.mass[lane], mass), (inertial[lane].ravel(), bias)):
            tolerance = 1e-12 * np.abs(expected).max()
            np.testing.assert_allclose(found, expected, rtol=0, atol=tolerance)
        for found in (accelerations[lane], solved[lane]):
            np.testing.assert_allclose(mass @ found, forces[lane], rtol=0, atol=1e-9)


@sweep(
    "n_joints, size, softest, unstable, share",
    [
        (1, 4.0, 0.02, 0, 0.9),
        (3, 1.5, 0.1, 0, 0.9),
        (6, 1.0, 0.1, 0, 0.9),
        (12, 0.3, 0.05, 0, 0.8),
        (20, 0.12, 0.05, 5, 0.0),
    ],
)
def test_what_is_proven_is_what_decays(
    n_joints: int, size: float, softest: float, unstable: int, share: float
) -> None:
    """Chains that stand well and such as tip over, with moments on every vertebra.

    Where these are few, nearly all proofs do without eigenvalues.
    """
    rng = np.random.default_rng(100 + n_joints)
    made = [loaded(rng, n_joints, size, soft) for soft in np.linspace(softest, 1.0, 24)]
    assert_proven(made, unstable, share)


@sweep(
    "n_joints, size, softest, unstable", [(6, 1.0, 0.1, 0), (12, 0.5, 0.1, 0), (20, 0.3, 0.1, 5)]
)
def test_a_moment_on_one_vertebra_is_proven_without_eigenvalues(
    n_joints: int, size: float, softest: float, unstable: int
) -> None:
    rng = np.random.default_rng(500 + n_joints)
    made = [loaded(rng, n_joints, size, soft) for soft in np.linspace(softest, 1.0, 24)]
    loads = [
        [replace(one, moment=(one.body == n_joints - 1) * 2.0 * one.moment) for one in chain.loads]
        for chain in made
    ]
    made = [chain.with_loads(*own) for chain, own in zip(made, loads, strict=True)]
    assert_proven(made, unstable, 0.9)


def assert_proven(made: list[chains.Chain], unstable: int, share: float) -> None:
    """What is proven is what decays, and the forms prove a share of it."""
    stack, count, n_joints = stack_of(made), len(made), made[0].n_joints
    way = newton(
        stack.chains,
        stack.loads,
        lambda some: stack.bound(some, {}),
        np.zeros((count, n_joints, 6)),
    )
    q, tangents, arrived = way.q, way.tangents, way.arrived
    there = np.flatnonzero(arrived)
    loads = part(stack.loads, there)
    stands = np.array([decays(*by_pybullet(made[n], q[n])) for n in there.tolist()])
    assert len(there) > 10
    assert (~stands).sum() >= unstable
    proven = stability.surely_stable(stack.chains, loads, q[there], tangents[there])
    assert proven.tolist() == stands.tolist()
    lanes = stability.lanes_of(stack.chains, loads, q[there], tangents[there])
    by_forms = stability.proven_by_forms(lanes)
    assert not (by_forms & ~stands).any()
    assert by_forms.sum() >= share * stands.sum()


@sweep("n_joints", [1, 2, 5])
def test_no_mode_lies_below_the_rate_where_the_form_loses_its_sign(n_joints: int) -> None:
    """S - v^2 M is positive up to a v that eigenvalues of the whole matrices tell."""
    rng = np.random.default_rng(20_040 + n_joints)
    made = [loaded(rng, n_joints, size, 1.0) for size in (0.1, 0.3, 1.0)]
    stack, q, tangents = posed(rng, made)
    for lane, chain in enumerate(made):
        mass, tangent = by_pybullet(chain, q[lane])
        highest = np.sqrt(eigvalsh(0.5 * (tangent + tangent.T), mass)[0])
        lanes = stability.lanes_of(
            stack.chains, part(stack.loads, np.array([lane])), q[[lane]], tangents[[lane]]
        )
        for factor, apart in ((1.0 - 1e-6, True), (1.0 + 1e-6, False)):
            assert lanes.is_positive_definite(np.array([factor * highest])).tolist() == [apart]


@sweep("n_joints", [1, 2, 5])
def test_a_vertebra_swings_as_whole_matrices_tell(n_joints: int) -> None:
    """The skew part of PyBullet's tangent is of the turns U that the moment has its rank from.

    And U' (S - w^2 M + i w)^-1 U and x* M x are those of the whole matrices.
    """
    rng = np.random.default_rng(700 + n_joints)
    chain = loaded(rng, n_joints, 0.3, 1.0)
    top = n_joints // 2
    chain = chain.with_loads(
        *(replace(one, moment=(one.body == top) * one.moment) for one in chain.loads)
    )
    stack, q, tangents = posed(rng, [chain])
    lanes = stability.lanes_of(stack.chains, stack.loads, q, tangents)
    single, body, moment = lanes.moment()
    assert single.tolist() == [True]
    assert body.tolist() == [top]
    size = np.linalg.norm(moment)
    across = np.linalg.svd(moment)[2][1:][None]
    mass, tangent = by_pybullet(chain, q[0])
    turns = np.zeros((6 * n_joints, 3))
    turns[: 6 * (top + 1)] = lanes.seen.axes[0, : top + 1, :, :3].reshape(-1, 3)
    turns = turns / np.sqrt(lanes.damping.reshape(-1, 1)) @ across[0].T
    skew = 0.5 * size * (turns[:, :1] @ turns[:, 1:].T - turns[:, 1:] @ turns[:, :1].T)
    sign = np.sign(np.linalg.det(np.vstack([moment, across[0]])))
    scale = np.abs(skew).max()
    np.testing.assert_allclose(0.5 * (tangent - tangent.T), sign * skew, rtol=0, atol=1e-9 * scale)
    whole, inertia = 0.5 * (tangent + tangent.T), unblocked(lanes.inertia, 1)
    seen = (lanes.seen.axes, lanes.seen.rows, lanes.seen.stiff, lanes.seen.slopes)
    for rate in (3.0, 30.0, 300.0):
        compliance, moving = np.empty((1, 2, 2), complex), np.empty(1)
        asked = (np.array([0]), np.array([rate]))
        respond(seen, inertia, lanes.damping, (body, across), asked, compliance, moving)
        x = np.linalg.solve(whole - rate**2 * mass + 1j * rate * np.eye(len(mass)), turns)
        np.testing.assert_allclose(compliance[0], turns.T @ x, rtol=0, atol=1e-9 * abs(x).max())
        assert moving[0] == pytest.approx(np.trace(x.conj().T @ mass @ x).real, rel=1e-9)


def posed(rng: np.random.Generator, made: list[chains.Chain]) -> tuple[Stack, Array, Array]:
    """A stack of chains, bent poses of theirs, and the joints' tangents there."""
    stack, shape = stack_of(made), (len(made), made[0].n_joints, 6)
    q = rng.normal(0.0, 0.1, shape) * np.array([0.02] * 3 + [1.0] * 3)
    return stack, q, stack.bound(np.arange(len(made)), {}).joint_forces(q).tangent


def growth(mass: Array, tangent: Array) -> float:
    """Largest real part of the rates l of M l^2 + l + K, over that of all their sizes."""
    n = len(mass)
    inverse = np.linalg.inv(mass)
    rates = np.linalg.eigvals(
        np.block([[np.zeros((n, n)), np.eye(n)], [-inverse @ tangent, -inverse]])
    )
    return float(rates.real.max() / np.abs(rates).max())


def fluttering(mass: Array, tangent: Array, share: float) -> float | None:
    """A factor for the damping at which motion grows; None where springs do not hold, or none does.

    That factor is ``share`` of the one from which on motion decays, found by halving.
    """
    if np.linalg.eigvalsh(tangent + tangent.T).min() <= 0.0:
        return None
    grows, decaying = 1e-6, 1e3
    if growth(mass / grows, tangent / grows) <= 0.0:
        return None
    for _ in range(40):
        middle = np.sqrt(grows * decaying)
        if growth(mass / middle, tangent / middle) > 0.0:
            grows = middle
        else:
            decaying = middle
    factor = float(share * grows)  # with little damping a spine may stand again
    return factor if growth(mass / factor, tangent / factor) > 1e-6 else None


@pytest.mark.slow
@sweep("share", [0.9, 0.3, 1e-3])
@sweep("n_joints", [1, 2, 4])
def test_what_flutters_is_never_proven(n_joints: int, share: float) -> None:
    """Springs hold, and moments that keep their direction in ground feed a growing motion.

    There is a little less damping than it takes: only the tangent's skew part tells such a spine
    from a stable one.
    """
    rng = np.random.default_rng(300 + n_joints)
    made, models, places = [], [], []
    for size in np.geomspace(0.5, 20.0, 60):
        chain = loaded(rng, n_joints, size, 1.0)
        q = rng.normal(0.0, 0.1, (n_joints, 6)) * np.array([0.02] * 3 + [1.0] * 3)
        factor = fluttering(*by_pybullet(chain, q), share)
        if factor is not None:
            model = bridge.spine_model(chain)
            made.append(chain)
            models.append(replace(model, damping=factor * model.damping))
            places.append(q)
    assert len(made) >= 3
    stack = Stack.of(models, [(n, bridge.load_case(chain)) for n, chain in enumerate(made)])
    all_q = np.array(places)
    tangents = stack.bound(np.arange(len(made)), {}).joint_forces(all_q).tangent
    assert not stability.surely_stable(stack.chains, stack.loads, all_q, tangents).any()
    lanes = stability.lanes_of(stack.chains, stack.loads, all_q, tangents)
    assert not stability.proven_by_forms(lanes).any()
