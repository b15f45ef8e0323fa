"""The exported .osim file, opened in OpenSim, against spinepipe and against pinocchio.

Catches an exported model that OpenSim moves otherwise.
"""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import ClassVar

import numpy as np
import pytest
from sweeps import sweep

from spinepipe.effects import EffectKind, Parameter
from spinepipe.model import LoadCase, RefusedModel, ScopedEffect
from spinepipe.model.osim import osim
from tests.reference import bridge
from tests.reference.peers import chain as chains
from tests.reference.peers import opensim_peer, pinocchio_peer
from tests.reference.peers.chain import WEIGHTLESS, Array, Chain, Load


@dataclass(frozen=True)
class Foreign:
    """An effect that OpenSim knows nothing of."""

    name: ClassVar[str] = "foreign"
    kind: ClassVar[EffectKind] = EffectKind.JOINT_LAW
    per_joint: ClassVar[bool] = False
    parameters: ClassVar[tuple[Parameter, ...]] = ()


@pytest.fixture(params=range(6))
def chain(request: pytest.FixtureRequest) -> Chain:
    rng = np.random.default_rng(50 + request.param)
    return chains.random_chain(rng, 1 + request.param, tilt_deg=60.0)


def opened(tmp_path: Path, chain: Chain, loads: LoadCase | None = None):
    path = tmp_path / "model.osim"
    path.write_text(osim(bridge.spine_model(chain), loads), encoding="utf-8")
    assert [file.name for file in tmp_path.iterdir()] == ["model.osim"]
    return opensim_peer.load_osim(path)


def in_file_order(built, chain: Chain, values: Array) -> Array:
    names = [f"J{j}_{c}" for j in range(chain.n_joints) for c in opensim_peer.COORDINATES]
    assert sorted(names) == sorted(built.coordinates)
    return np.ravel(values)[[names.index(name) for name in built.coordinates]]


def test_equilibrium_under_loads_added_in_opensim(tmp_path: Path, chain: Chain) -> None:
    path = tmp_path / "model.osim"
    path.write_text(osim(bridge.spine_model(chain)), encoding="utf-8")
    found = opensim_peer.equilibrium_of_file(
        path, [(f"V{load.body}", load) for load in chain.loads]
    )
    for joint, pose in enumerate(bridge.pose(chain)):
        for name, value in zip(opensim_peer.COORDINATES, pose, strict=True):
            # both at rounding, see test_equilibrium
            assert found[f"J{joint}_{name}"] == pytest.approx(value, abs=1e-13)


def test_bushings_are_the_law_at_any_pose_and_rate(tmp_path: Path, chain: Chain) -> None:
    """k_i q_i + c_i dq_i/dt on top of pinocchio's rigid-body terms."""
    rng = np.random.default_rng(chain.n_joints)
    shape, n = (chain.n_joints, 3), 6 * chain.n_joints
    pose = np.hstack([rng.normal(0, 5e-3, shape), rng.normal(0, 0.3, shape)]).ravel()
    rate, acceleration = rng.normal(0, 1, (2, n))
    law = chain.stiffness.ravel() * pose + chain.damping.ravel() * rate
    rigid = pinocchio_peer.build(chain).inverse_dynamics(pose, rate, acceleration)
    built = opened(tmp_path, chain)
    state = (in_file_order(built, chain, values) for values in (pose, rate, acceleration))
    found = opensim_peer.inverse_dynamics(built, *state)
    # loads reach 1e4 N at these poses
    expected = in_file_order(built, chain, law + rigid)
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-10)


def test_loads_of_one_step_are_written_as_constants(tmp_path: Path, chain: Chain) -> None:
    built = opened(tmp_path, chain, bridge.load_case(chain))
    found = opensim_peer.equilibrium_of(built)
    expected = in_file_order(built, chain, bridge.pose(chain))
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-13)


@sweep("recorded", [True, False])
def test_loads_of_several_steps_follow_the_time(tmp_path: Path, recorded: bool) -> None:
    chain = chains.random_chain(np.random.default_rng(1), 2)
    case = bridge.load_case(chain, 0.0, 1.0, -0.5)
    times = (2.0, 4.0, 5.0) if recorded else (0.0, 1.0, 2.0)
    if recorded:
        steps = (replace(s, time=t) for s, t in zip(case.steps, times, strict=True))
        case = replace(case, steps=tuple(steps))
    built = opened(tmp_path, chain, case)
    peer, rest = pinocchio_peer.build(chain), np.zeros(12)
    halfway = 0.5 * (times[1] + times[2])
    for time, share in ((times[0] - 3.0, 0.0), (times[1], 1.0), (halfway, 0.25), (99.0, -0.5)):
        found = opensim_peer.residual(built._replace(ramp_time=1.0), rest, factor=time)
        expected = in_file_order(built, chain, peer.residual(rest, factor=share))
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-10)


def test_bodies_without_mass_get_a_token_one_and_stay_where_they_are(tmp_path: Path) -> None:
    chain = chains.l1_l4_chain()
    chain = replace(
        chain, gravity=WEIGHTLESS, masses=np.zeros(3), inertias=np.zeros((3, 3, 3))
    ).with_loads(Load(2, moment=np.array([3.0, -2.0, -7.5])))
    built = opened(tmp_path, chain, bridge.load_case(chain))
    expected = in_file_order(built, chain, bridge.pose(chain))
    np.testing.assert_allclose(opensim_peer.equilibrium_of(built), expected, rtol=0, atol=1e-13)
    assert "1 g here: V0, V1, V2" in built.model.getCredits()
    # and OpenSim can move it: at rest after 1.5 s, but for its accuracy
    settled = opensim_peer.settle_of(built, 1.5)[-1]
    np.testing.assert_allclose(settled, expected, rtol=0, atol=1e-5)


def test_two_bushings_on_a_joint_add_up() -> None:
    model = bridge.spine_model(chains.l1_l4_chain())
    (bushing,) = model.effects
    halves = (
        bushing.with_values(0.25 * bushing.values),
        bushing.with_values(0.75 * bushing.values),
    )
    assert osim(model.with_effects(halves)) == osim(model)


def test_an_effect_of_one_test_needs_to_be_told_the_test() -> None:
    chain = chains.l1_l4_chain()
    model = bridge.spine_model(chain)
    (bushing,) = model.effects
    scoped = model.with_effects((bushing, replace(bushing, tests=("flexion",))))
    with pytest.raises(RefusedModel, match="linear_bushing acts in flexion only"):
        osim(scoped)
    other, flexion = (bridge.load_case(chain, test=name) for name in ("bending", "flexion"))
    assert osim(scoped, other) == osim(model, other)
    assert osim(scoped, flexion) != osim(model, flexion)


def test_what_opensim_cannot_say_is_refused_by_name() -> None:
    model = bridge.spine_model(chains.l1_l4_chain())
    foreign = ScopedEffect(Foreign(), (0, 1, 2), np.zeros((1, 0)))
    with pytest.raises(RefusedModel, match="effect foreign"):
        osim(model.with_effects((*model.effects, foreign)))
    with pytest.raises(RefusedModel, match="the name 'my spine'"):
        osim(replace(model, specimen="my spine"))
