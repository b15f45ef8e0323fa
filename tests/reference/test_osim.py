"""The exported .osim file, opened in OpenSim, against spinepipe and against pinocchio.

Catches an exported model that OpenSim moves otherwise.
"""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import ClassVar

import numpy as np
import opensim
import pandas as pd
import pytest
from study_cases import STUDY, Size, project
from sweeps import sweep

from spinepipe.cli import main
from spinepipe.effects import EffectKind, Parameter
from spinepipe.model import LoadCase, RefusedModel, ScopedEffect
from spinepipe.model.osim import osim
from tests.reference import bridge
from tests.reference.peers import chain as chains
from tests.reference.peers import opensim_peer, pinocchio_peer
from tests.reference.peers.chain import WEIGHTLESS, Array, Chain, Load
from tests.reference.peers.newton import root as root_of


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


def test_loads_of_one_step_are_constant(tmp_path: Path, chain: Chain) -> None:
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


def test_an_effect_of_one_test_is_in_the_file_of_that_test_alone() -> None:
    chain = chains.l1_l4_chain()
    model = bridge.spine_model(chain)
    (bushing,) = model.effects
    scoped = model.with_effects((bushing, replace(bushing, tests=("flexion",))))
    assert "In the model and not in this file: linear_bushing." in osim(scoped)
    other, flexion = (bridge.load_case(chain, test=name) for name in ("bending", "flexion"))
    assert osim(scoped, other) == osim(model, other)
    assert osim(scoped, flexion) != osim(model, flexion)


def test_what_opensim_cannot_say_is_told_or_refused_by_name() -> None:
    model = bridge.spine_model(chains.l1_l4_chain())
    foreign = ScopedEffect(Foreign(), (0, 1, 2), np.zeros((1, 0)))
    told = osim(model.with_effects((*model.effects, foreign)))
    assert "In the model and not in this file: foreign." in told
    with pytest.raises(RefusedModel, match="the name 'my spine'"):
        osim(replace(model, specimen="my spine"))


LOADS = """specimen,test,step,time_s,vertebra,fx_n,fy_n,fz_n,mx_nm,my_nm,mz_nm,px_mm,py_mm,pz_mm
*,flexion,0,0,V1,0,0,0,0,0,0,0,85,0
*,flexion,1,2,V1,5,-20,8,1,0.5,-2,10,85,-4
*,flexion,2,5,V1,10,-40,-16,2,1.5,-4,10,85,-4
*,flexion,2,5,V2,-6,0,3,0,0,0,0,40,0
"""


def test_a_test_is_exported_with_its_loads_and_its_motion(tmp_path: Path) -> None:
    """OpenSim's own equilibria under the loads in the file are the motion in the file beside it."""
    root = project(tmp_path, Size())
    (root / "config/cohorts/straight/loads.csv").write_text(LOADS)
    file = tmp_path / "m.osim"
    command = ["--root", str(root), "export", STUDY, "a", "--start", "--test", "flexion"]
    assert main([*command, "-o", str(file)]) == 0
    built = opensim_peer.load_osim(file)
    motion = opensim.Storage(str(file.with_suffix(".mot")))
    names = [motion.getColumnLabels().get(k) for k in range(motion.getColumnLabels().getSize())]
    assert names[0] == "time"
    assert sorted(names[1:]) == sorted(built.coordinates)
    assert motion.isInDegrees()
    built.model.getSimbodyEngine().convertDegreesToRadians(motion)
    columns = []
    for name in ("time", *built.coordinates):
        cells = opensim.ArrayDouble()
        motion.getTimeColumn(cells) if name == "time" else motion.getDataColumn(name, cells)
        columns.append([cells.get(k) for k in range(cells.getSize())])
    times, *rest = columns
    assert times == [0.0, 2.0, 5.0]
    told = np.array(rest).T
    assert np.abs(told).max() > 0.05  # rad
    for time, q in zip(times, told, strict=True):
        at = built._replace(ramp_time=time)
        found = root_of(lambda x, _, at=at: opensim_peer.residual(at, x), np.zeros(q.shape), 1e-12)
        np.testing.assert_allclose(found, q, rtol=0, atol=1e-12)


def test_landmarks_are_markers_and_vertebrae_are_drawn(tmp_path: Path) -> None:
    root = project(tmp_path, Size())
    file = tmp_path / "m.osim"
    assert main(["--root", str(root), "export", STUDY, "a", "--start", "-o", str(file)]) == 0
    model = opensim.Model(str(file))
    state = model.initSystem()
    rows = pd.read_csv(root / "config/cohorts/straight/landmarks.csv").query("specimen == 'a'")
    markers, bodies = model.getMarkerSet(), model.getBodySet()
    assert markers.getSize() == len(rows)
    for row in rows.itertuples():
        one = markers.get(f"{row.vertebra}_{row.landmark}")
        at = np.array([row.x_mm, row.y_mm, row.z_mm]) / 1000.0
        np.testing.assert_allclose(one.getLocationInGround(state).to_numpy(), at, atol=1e-15)
        assert one.getParentFrameName().endswith("ground" if row.vertebra == "V3" else row.vertebra)
    # joints are where the lower vertebra's upper endplate meets the upper one's lower: every 36 mm
    heights = []
    for name in ("V2", "V1"):
        drawn = opensim.PhysicalFrame.safeDownCast(bodies.get(name).getComponent("drawn"))
        heights.append(drawn.getPositionInGround(state).to_numpy()[1])
        shape = opensim.Ellipsoid.safeDownCast(drawn.get_attached_geometry(0))
        assert 0.010 < shape.get_radii().get(1) < 0.018
    assert np.diff(heights) == pytest.approx(0.036)
