"""The cohorts with a hidden truth: spinepipe reads them, and without effects it moves like them.

Catches made-up cohorts whose truth is not what they say, so that tests on them prove nothing.
"""

import json
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import opensim
import pytest
from scipy.optimize import least_squares

from spinepipe.cohort import read
from spinepipe.cohort.measured import measured_cycles
from spinepipe.cohort.specimen import joint_frames, load_cases, spine_model
from spinepipe.effects import create
from spinepipe.model import ScopedEffect
from spinepipe.problems import InputError
from spinepipe.statics import System, follow
from spinepipe.world import Chain as LoadedChain
from tests.generators.hidden import (
    CATALOGUE,
    KNOWN,
    UNKNOWN,
    USUAL,
    Recipe,
    draw,
    draw_hidden,
    make,
    recipe_from,
)
from tests.generators.hidden.noise import drawn
from tests.generators.hidden.rigid import Spine, together
from tests.generators.hidden.scene import scene
from tests.generators.hidden.scene import with_effect as with_the_effect
from tests.generators.hidden.solve import solve
from tests.generators.hidden.world import Now
from tests.reference.peers import opensim_peer
from tests.reference.peers.chain import Chain, Load

VOCABULARY = {
    *("nonlinear_stiffening", "neutral_zone", "flexion_extension_asymmetry"),
    *("bending_rotation_coupling", "facet_contact", "level_dependence", "local_laxity"),
    *("preload_stiffening", "joint_centre_offset", "joint_centre_migration", "segment_weight"),
    *("follower_load", "load_misalignment", "load_offset", "hysteresis", "creep", "marker_bias"),
    *("soft_tissue_artefact", "neutral_pose_drift"),
}
SMALL = Recipe(seed=5, n_specimens=2)
DAMPING = np.ones(6)
SD_RAD = np.deg2rad(0.1)


def with_effect(name: str, recipe: Recipe, **given: object) -> Recipe:
    return replace(recipe, hidden=(draw_hidden(name, recipe, **given),))


def test_the_vocabulary_is_all_there() -> None:
    assert set(KNOWN) == VOCABULARY
    assert len(UNKNOWN) >= 5


@pytest.mark.parametrize("preload", [200.0, pytest.param(0.0, marks=pytest.mark.full)])
def test_spinepipe_finds_the_same_null_motion_from_the_files(
    tmp_path: Path, preload: float
) -> None:
    recipe = Recipe(
        seed=3, n_specimens=2, noise="none", translations=True, preload_n=preload, unloading=True
    )
    truth = make(recipe, tmp_path / "null_set")
    cohort = read(tmp_path / "null_set")
    for number, name in enumerate(cohort.specimen_names):
        stiffness = np.tile(truth.stiffness[number], (6, 1))
        bushing = ScopedEffect(create("linear_bushing"), tuple(range(6)), stiffness)
        frames = joint_frames(cohort, name)
        model = spine_model(cohort, name, frames, (bushing,), DAMPING)
        chain = LoadedChain(model)
        cases = load_cases(cohort, name, cohort.tests, np.zeros(3))
        told = measured_cycles(cohort, name, cases)
        for case, measured in zip(cases, told, strict=True):
            steps = follow(System(chain, model, case))
            assert all(step.usable for step in steps)
            found = np.stack([step.equilibrium.q.reshape(6, 6) for step in steps])
            np.testing.assert_allclose(measured.measured, found, rtol=0, atol=1e-8)


def test_opensims_own_forces_hold_the_same_pose() -> None:
    """Weight, springs and loads by OpenSim's force elements."""
    stage = scene(replace(SMALL, preload_n=150.0))
    world = stage.plain(0)
    found = solve(world, Spine(world.bones), np.zeros((6, 7, 6, 6))).q
    free = np.zeros((6, 6))
    chain = Chain(**vars(world.bones), stiffness=world.stiffness, damping=free)
    for test, step in ((0, 3), (1, 6), (5, 3)):
        case = stage.tests[test]
        force = np.array([0.0, -case.preload / 6.0, 0.0])
        loads = [Load(b, force=force, point=p) for b, p in enumerate(world.preload_points)]
        loads.append(Load(5, moment=case.moments[step]))
        expected = opensim_peer.equilibrium(chain.with_loads(*loads))
        np.testing.assert_allclose(found[test, step], expected, rtol=0, atol=1e-10)


def test_opensim_has_the_same_poses_and_jacobian() -> None:
    bones = scene(SMALL).bones[0]
    free = np.zeros((6, 6))
    built = opensim_peer.build(Chain(**vars(bones), stiffness=free, damping=free))
    q = np.random.default_rng(4).uniform(-0.2, 0.2, (6, 6)) * ([0.02] * 3 + [1.0] * 3)
    opensim_peer._set_q(built, q.ravel())
    built.model.realizePosition(built.state)
    matrix = opensim.Matrix()
    built.model.getMatterSubsystem().calcSystemJacobian(built.state, matrix)
    bodies = [built.model.getBodySet().get(b) for b in range(6)]
    rows = [body.getMobilizedBodyIndex() for body in bodies]
    jacobian = matrix.to_numpy().reshape(-1, 6, 36)[rows][..., built.slots]
    pose = Spine(bones).at(q[None])
    columns = np.concatenate([pose.angular[0], pose.linear[0]], axis=-1)
    close = 1e-11  # frames are rounded to 1e-12, each joint's anew
    np.testing.assert_allclose(columns, np.swapaxes(jacobian, 1, 2), rtol=0, atol=close)
    for body, place in zip(bodies, pose.places[0], strict=True):
        there = body.getTransformInGround(built.state).p().to_numpy()
        np.testing.assert_allclose(place, there, rtol=0, atol=close)


def test_the_tangent_of_loads_is_their_slope() -> None:
    """Of a follower and listed loads: both turn with the spine, against central differences."""
    recipe = with_effect("follower_load", replace(SMALL, preload_n=150.0))
    stage = scene(recipe)
    world = with_the_effect(stage.plain(0), recipe.hidden[0], 300.0)
    spine, now = Spine(world.bones), Now(np.array([3]), np.array([2]), 0.0)
    q = np.random.default_rng(4).uniform(-0.05, 0.05, (1, 6, 6)) * ([0.02] * 3 + [1.0] * 3)

    def load(at: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        pose = spine.at(at)
        return pose.applied(together(world.wrenches(pose, now)))

    moves = 1e-6 * np.eye(36).reshape(36, 1, 6, 6)
    slopes = np.stack([load(q + move)[0] - load(q - move)[0] for move in moves], axis=-1) / 2e-6
    np.testing.assert_allclose(load(q)[1], slopes, rtol=0, atol=1e-5)


def test_a_short_specimen_in_shear_is_read_in_one_coordinate(tmp_path: Path) -> None:
    recipe = Recipe(
        seed=6,
        region="cervical",
        joints=1,
        design="shear",
        peak_n=60.0,
        noise="none",
        only=("anterior",),
    )
    truth = make(recipe, tmp_path / "shear")
    cohort = read(tmp_path / "shear")
    assert cohort.joint_names == ("C6C7",)
    measured = cohort.motion
    assert measured is not None
    assert measured["extension_deg"].isna().all()
    peak = measured.query("specimen == 's01' and step == 3 and cycle == 1")["anterior_mm"]
    assert peak.item() == pytest.approx(60e3 / truth.stiffness[0, 0], rel=0.02)  # it also tilts


@pytest.mark.parametrize(
    "name",
    [
        "follower_load",
        pytest.param("facet_contact", marks=pytest.mark.full),
        pytest.param("marker_bias", marks=pytest.mark.full),
    ],
)
def test_the_gap_asked_for_is_what_a_refit_leaves(name: str) -> None:
    recipe = with_effect(name, replace(SMALL, gap=0.5), joint=None)
    truth, stage, _ = draw(recipe)
    left = []
    for number, reported in enumerate(truth.reported):
        spine = Spine(stage.bones[number])
        errors = partial(_errors, stage=stage, number=number, spine=spine, reported=reported)
        left.append(least_squares(errors, np.zeros(3), diff_step=1e-4).fun)
    assert np.sqrt(np.mean(np.square(left))) == pytest.approx(0.5, rel=0.1)


def test_each_of_a_pair_has_the_gap_asked_for() -> None:
    recipe = replace(SMALL, gap=0.5)
    names = ("load_offset", "neutral_zone")
    pair = tuple(draw_hidden(name, recipe, n, joint=None) for n, name in enumerate(names))
    truth, _, _ = draw(replace(recipe, hidden=pair))
    assert truth.gaps == pytest.approx([0.5, 0.5], rel=0.1)
    assert truth.gap > max(truth.gaps)


def _errors(logs, stage, number, spine, reported):
    """Rotations, in noise SD, that linear springs scaled by three factors do not follow."""
    stiffness = stage.stiffness[number] * np.exp([0.0, 0.0, 0.0, *logs])
    q = solve(stage.plain(number, stiffness), spine, reported).q
    return ((reported - q)[..., 3:] / SD_RAD).ravel()


@pytest.mark.parametrize(
    "name",
    [
        "hysteresis",
        *(pytest.param(n, marks=pytest.mark.full) for n in CATALOGUE if n != "hysteresis"),
    ],
)
def test_every_effect_makes_a_readable_cohort(tmp_path: Path, name: str) -> None:
    options = {"translations": True, "preload_n": 200.0, "unloading": True, "gap": 0.5}
    recipe = with_effect(name, replace(SMALL, **options))
    truth = make(recipe, tmp_path / name)
    cohort = read(tmp_path / name)
    assert len(cohort.tests) == 6
    told = json.loads((tmp_path / name / "truth.json").read_text("utf-8"))
    assert told["effects"][0]["name"] == name
    assert recipe_from(told["recipe"]) == truth.recipe
    assert told["effects"][0]["formula"] in CATALOGUE[name].formulas
    assert truth.gap == pytest.approx(0.5, rel=0.1) or truth.gap < 0.5
    assert told["effects"][0]["reached"] == (abs(truth.gap - 0.5) <= 0.025)


def test_same_seed_same_bytes(tmp_path: Path) -> None:
    recipe = with_effect("neutral_zone", replace(SMALL, dirt=USUAL, noise="outliers"))
    for folder in ("first/made", "second/made"):
        make(recipe, tmp_path / folder)
    for file in (tmp_path / "first" / "made").iterdir():
        assert file.read_bytes() == (tmp_path / "second" / "made" / file.name).read_bytes()


def test_an_effect_changes_nothing_else_that_is_drawn() -> None:
    plain, _, without = draw(replace(SMALL, cycles=2))
    truth, _, table = draw(with_effect("load_offset", replace(SMALL, cycles=2)))
    border = np.array([1000.0] * 3 + [180.0 / np.pi] * 3)
    added = (truth.reported - plain.reported)[:, :, None] * border
    np.testing.assert_allclose(table - without, np.repeat(added, 2, axis=2), atol=1e-12)


def test_zeroed_readings_start_from_zero() -> None:
    _, _, table = draw(replace(SMALL, zeroed=True))
    assert not table[:, :, :, 0].any()
    assert table[:, :, :, 1].all()


def test_serial_noise_is_correlated_by_a_half() -> None:
    errors = drawn(replace(SMALL, noise="serial"), (4, 3, 3, 40, 6, 6), np.random.default_rng(1))
    pairs = np.corrcoef(errors[:, :, :, 1:].ravel(), errors[:, :, :, :-1].ravel())
    assert pairs[0, 1] == pytest.approx(0.5, abs=0.02)
    assert errors.std() == pytest.approx(1.0, abs=0.02)


def test_outliers_are_one_in_a_hundred() -> None:
    errors = drawn(replace(SMALL, noise="outliers"), (4, 3, 3, 40, 6, 6), np.random.default_rng(1))
    assert np.mean(np.abs(errors) > 5.0) == pytest.approx(0.01, abs=0.002)


@pytest.mark.parametrize("error", ["swapped_specimens", "flipped_sign", "bad_markers"])
def test_mistakes_are_in_the_table_and_told(error: str) -> None:
    _, _, right = draw(SMALL)
    truth, _, wrong = draw(replace(SMALL, errors={error: {}}))
    told = truth.errors[error]
    changed = np.argwhere((right != wrong).any(axis=(1, 2, 3)))
    expected = {
        "swapped_specimens": 2 * 6 * 6,
        "flipped_sign": 2,
        "bad_markers": 2 * 6,
    }
    assert len(changed) == expected[error]
    assert "joint" not in told or set(changed[:, 1]) == {told["joint"]}


def test_loads_in_newton_millimetres_are_refused_at_the_door(tmp_path: Path) -> None:
    make(replace(SMALL, errors={"load_unit": {}}), tmp_path / "wrong_unit")
    with pytest.raises(InputError, match="mz_nm"):
        read(tmp_path / "wrong_unit")
