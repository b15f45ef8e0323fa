"""Load effects: each against loads said another way, virtual work, and all their derivatives.

Catches a load of wrong size, point or direction, and any wrong derivative of it.
"""

from dataclasses import replace

import numpy as np
import pytest
from effect_slopes import (
    assert_each_test_has_its_own_values,
    assert_sensitivities,
    assert_tangent,
    reported,
    system_with,
)
from example_effects import NOWHERE, loaded, scoped, slope, spine
from scipy.spatial.transform import Rotation
from sweeps import sweep

from spinepipe.effects import PlaceSpread, Wrench, create
from spinepipe.effects.contract import Array
from spinepipe.frames import Pose
from spinepipe.model import Body, LoadCase, LoadStep, SpineModel
from spinepipe.statics import System
from spinepipe.statics.motion import ChainMotion
from spinepipe.world import Chain

JOINTS = (0, 1, 2)
TOP = 2

EFFECTS = {
    "weight of each": ("segment_weight", {"where": "each"}, (1.3,)),
    "weight on top": ("segment_weight", {"where": "top"}, (2.0,)),
    "follower load": ("follower_load", {}, (80.0, 0.0)),
    "follower load beside": ("follower_load", {"guides": "centres"}, (80.0, 0.0)),
    "follower load behind": ("follower_load", {"guides": "centres"}, (80.0, -0.008)),
    "misalignment": ("load_misalignment", {}, (0.06, -0.04)),
    "frame askew": ("load_misalignment", {"turns": "wrench"}, (0.06, -0.04, 0.05)),
    "forces askew": ("load_misalignment", {"turns": "forces"}, (0.06, -0.04, 0.05)),
    "gain": ("load_gain", {}, (0.05,)),
    "offset": ("load_offset", {}, (0.3, -0.2, 0.4)),
    "force offset": ("load_offset", {"coordinate": "right"}, (8.0,)),
    "cable": ("load_offset", {"applies": "force"}, (8.0, -3.0, 5.0)),
}


def effect_of(name: str, on: bool = True, joints: tuple[int, ...] = JOINTS):
    kind, options, values = EFFECTS[name]
    return scoped(create(kind, options), joints, values if on else (0.0,) * len(values))


def pose() -> Array:
    """(18,) a bent pose of three joints."""
    return np.tile([2e-3] * 3 + [0.25] * 3, 3) * np.random.default_rng(4).normal(size=18)


def motion_of(model: SpineModel, q: Array) -> ChainMotion:
    return ChainMotion(Chain(model), q)


def applied(name: str, motion: ChainMotion, joints: tuple[int, ...] = JOINTS) -> Array:
    """(n,) load of an effect at the second step of the case."""
    here, wrenches = effect_of(name), loaded(motion.chain.model).steps[1].wrenches
    return here.effect.apply(motion, wrenches, np.array(joints), here.values).load


def with_wrenches(case: LoadCase, change) -> LoadCase:
    """The case with the wrenches of each step as ``change`` makes them of the listed ones."""
    steps = (LoadStep(s.step, tuple(change(s.wrenches)), s.time) for s in case.steps)
    return replace(case, steps=tuple(steps))


def assert_same_motion(name: str, *, instead: System, case: LoadCase | None = None) -> None:
    found = reported(system_with(effect_of(name), case=case))
    np.testing.assert_allclose(found, reported(instead), rtol=0, atol=1e-12)
    plain = reported(system_with(case=case))
    assert np.rad2deg(np.abs(found - plain)[..., 3:].max()) > 0.02


@sweep("on", [True, False])
@sweep("name", EFFECTS)
def test_tangents_and_sensitivities_of_whole_spines(name: str, on: bool) -> None:
    system = system_with(effect_of(name, on))
    assert_tangent(system)
    assert_sensitivities(system)


@sweep("name", EFFECTS)
def test_part_of_the_joints_in_scope(name: str) -> None:
    system = system_with(effect_of(name, joints=(1,)))
    assert_tangent(system)
    assert_sensitivities(system)


def test_all_load_effects_at_once() -> None:
    system = system_with(*(effect_of(name) for name in EFFECTS))
    assert_tangent(system)
    assert_sensitivities(system)


@sweep("name", EFFECTS)
def test_off_leaves_the_motion_alone(name: str) -> None:
    effect = effect_of(name).effect
    assert {p.off for p in effect.parameters} <= {0.0, None}
    plain, found = (reported(system_with(*e)) for e in ((), (effect_of(name, on=False),)))
    np.testing.assert_allclose(found, plain, rtol=0, atol=1e-13)


def test_weight_of_vertebrae_without_stated_mass() -> None:
    """Halfway to the next joint; the top one 15 mm above its joint, along its superior axis."""
    model = spine(3, gravity=False)
    massless = tuple(Body(b.name, 0.0, np.zeros(3), np.zeros((3, 3))) for b in model.bodies)
    model = replace(model, bodies=massless)
    origins, top = [frame.origin for frame in model.frames], model.frames[TOP]
    points = [
        (origins[0] + origins[1]) / 2.0,
        (origins[1] + origins[2]) / 2.0,
        origins[2] + 0.015 * top.rotation[:, 1],
    ]
    motion = motion_of(model, pose())
    down = np.array([0.0, -1.3 * 9.81, 0.0])
    expected = sum(motion.velocities(b, point) @ down for b, point in enumerate(points))
    np.testing.assert_allclose(applied("weight of each", motion), expected, rtol=0, atol=1e-13)


def test_weight_goes_nowhere_else() -> None:
    with pytest.raises(ValueError, match="where 'bottom'; allowed: each, top"):
        create("segment_weight", {"where": "bottom"})


def cable_lengths(model: SpineModel, q: Array, name: str) -> Array:
    """(3,) m: guide to guide, the guides carried by the vertebrae."""
    motion = motion_of(model, q)
    origins, top = [frame.origin for frame in model.frames], model.frames[TOP]
    ground, *carried = [*origins, origins[2] + 0.03 * top.rotation[:, 1]]
    if name != "follower load":
        carried = [body.com for body in model.bodies]
        ground = origins[0] - (carried[0] - origins[0])
    if name == "follower load behind":
        back = [-0.008 * frame.rotation[:, 0] for frame in model.frames]
        ground = ground + back[0]
        carried = [point + beside for point, beside in zip(carried, back, strict=True)]
    guides = [ground, *(motion.displacement(b).apply(point) for b, point in enumerate(carried))]
    return np.linalg.norm(np.diff(guides, axis=0), axis=1)


@sweep("name", [name for name in EFFECTS if name.startswith("follower")])
@sweep("joints", [(0, 1, 2), (0,), (1, 2)])
def test_follower_load_does_the_work_of_a_cable(joints: tuple[int, ...], name: str) -> None:
    """80 N times what each coordinate shortens the cable by."""
    model, q = spine(3), pose()
    found = applied(name, motion_of(model, q), joints)
    for coordinate, size in enumerate(np.tile([1e-4] * 3 + [1e-3] * 3, 3)):
        along = size * np.eye(18)[coordinate]
        by_segment = slope(lambda h, a=along: cable_lengths(model, q + h * a, name), 1)
        longer = by_segment[list(joints)].sum()
        assert found[coordinate] == pytest.approx(-80.0 * longer / size, abs=1e-7)


def test_follower_load_of_an_untranslated_spine_only_compresses() -> None:
    """However bent, each segment passes through the centre of its joint: no moment, and 80 N along
    the line up the vertebra, which turns with it."""
    model, q = spine(3), pose().reshape(3, 6)
    q[:, :3] = 0.0
    load = applied("follower load", motion_of(model, q.ravel())).reshape(3, 6)
    np.testing.assert_allclose(load[:, 3:], 0.0, rtol=0, atol=1e-12)
    top = model.frames[TOP]
    ends = [model.frames[1].origin, model.frames[2].origin, top.apply([0.0, 0.03, 0.0])]
    for joint, frame in enumerate(model.frames):
        up = frame.rotation.T @ (ends[joint] - frame.origin)
        turned = Rotation.from_euler("ZXY", q[joint, 3:]).apply(up / np.linalg.norm(up))
        np.testing.assert_allclose(load[joint, :3], -80.0 * turned, rtol=0, atol=1e-12)


def test_follower_load_beside_a_joint_turns_it() -> None:
    """One upright joint, the centre of mass 10 mm ahead and 20 mm above, the guide of ground as far
    behind and below: at rest the cable passes through the joint, 5 mm forward it does not."""
    ahead = Body("L1", 1.0, np.array([0.01, 0.02, 0.0]), 1e-3 * np.eye(3))
    model = replace(
        spine(1, gravity=False), bodies=(ahead,), frames=(Pose(np.eye(3), np.zeros(3)),)
    )
    q = np.zeros(6)
    load = applied("follower load beside", motion_of(model, q), (0,))
    down = -80.0 * np.array([0.02, 0.04, 0.0]) / np.hypot(0.02, 0.04)
    np.testing.assert_allclose(load[:3], down, rtol=0, atol=1e-12)
    np.testing.assert_allclose(load[3:], 0.0, rtol=0, atol=1e-12)
    q[0] = 0.005
    load = applied("follower load beside", motion_of(model, q), (0,))
    pull = -80.0 * np.array([0.025, 0.04, 0.0]) / np.hypot(0.025, 0.04)
    np.testing.assert_allclose(load[:3], pull, rtol=0, atol=1e-12)
    # about the moved joint: (0.01, 0.02) x pull along z, positive towards extension
    assert load[3] == pytest.approx(0.01 * pull[1] - 0.02 * pull[0], abs=1e-12)


def test_follower_load_has_guides_that_exist() -> None:
    with pytest.raises(ValueError, match="guides 'discs', allowed: joints, centres"):
        create("follower_load", {"guides": "discs"})


def about(main: int, size: float) -> Array:
    return size * np.eye(3)[main]


@pytest.mark.parametrize("main", range(3))
def test_misaligned_moments_worked_by_hand(main: int) -> None:
    """M along the main axis, turned by t2 about the second axis after it and then by t1 about the
    first. Axes in cyclic order stand in for each other, so the case of z is worked for all."""
    t1, t2 = EFFECTS["misalignment"][2]
    s1, c1, s2, c2 = np.sin(t1), np.cos(t1), np.sin(t2), np.cos(t2)
    first, second = (main + 1) % 3, (main + 2) % 3

    def steps(turned: bool):
        for number, size in enumerate((1.5, -3.0, 0.0)):
            moment = about(main, size)
            if turned:  # for z: Rx(t1) Ry(t2) (0, 0, M) = M (s2, -s1 c2, c1 c2)
                moment = about(main, c1 * c2 * size)
                moment = moment + about(first, s2 * size) + about(second, -s1 * c2 * size)
            yield LoadStep(number, (Wrench(TOP, NOWHERE, NOWHERE, moment),))

    listed, actual = (LoadCase("one axis", 1, tuple(steps(turned))) for turned in (False, True))
    assert_same_motion("misalignment", case=listed, instead=system_with(case=actual))


def test_the_main_axis_is_that_of_all_moments_together() -> None:
    """Two moments of 2 N m about x outweigh one of 3 N m about z, also when they cancel."""
    moments = [(TOP, about(0, 2.0)), (1, about(0, -2.0)), (0, about(2, 3.0))]
    wrenches = tuple(Wrench(body, NOWHERE, NOWHERE, moment) for body, moment in moments)
    here = effect_of("misalignment")
    motion = motion_of(spine(3), pose())
    found = here.effect.apply(motion, wrenches, np.array(JOINTS), np.array([[0.5, 0.0]])).load
    turned = 3.0 * np.array([np.sin(0.5), 0.0, np.cos(0.5) - 1.0])  # about y: z goes towards x
    twist = 2.0 * np.array([np.cos(0.5) - 1.0, 0.0, -np.sin(0.5)])  # and x towards -z
    changes = ((TOP, twist), (1, -twist), (0, turned))
    expected = sum(motion.angular(body) @ change for body, change in changes)
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-14)


def test_forces_are_not_misaligned() -> None:
    force = Wrench(TOP, NOWHERE, np.array([5.0, -20.0, 3.0]), NOWHERE)
    here, motion = effect_of("misalignment"), motion_of(spine(3), pose())
    for wrenches in ((force,), ()):
        call = (motion, wrenches, np.array(JOINTS), here.values)
        response = here.effect.apply(*call)
        assert not response.load.any()
        assert not response.tangent.any()
        assert not here.effect.by_parameter(*call).any()


@pytest.mark.parametrize("name", ["frame askew", "forces askew"])
def test_a_loading_frame_askew_turns_forces_about_their_points(name: str) -> None:
    """Rx Ry Rz by another library; what turns the moments too is the whole frame."""
    turned = Rotation.from_euler("XYZ", EFFECTS[name][2]).as_matrix()

    def askew(wrenches):
        for w in wrenches:
            moment = turned @ w.moment if name == "frame askew" else w.moment
            yield replace(w, force=turned @ w.force, moment=moment)

    case = with_wrenches(loaded(spine(3)), askew)
    assert_same_motion(name, instead=system_with(case=case))


def test_what_turns_is_known() -> None:
    with pytest.raises(ValueError, match="turns 'all'; allowed: moments, wrench, forces"):
        create("load_misalignment", {"turns": "all"})


def test_offset_is_one_more_moment_also_without_load() -> None:
    case = loaded(spine(3))
    case = replace(case, steps=(LoadStep(0, (), 1.0), *case.steps[1:]))
    offset = Wrench(TOP, NOWHERE, NOWHERE, np.array([0.3, -0.2, 0.4]))
    more = with_wrenches(case, lambda wrenches: (*wrenches, offset))
    assert_same_motion("offset", case=case, instead=system_with(case=more))
    unloaded = reported(system_with(effect_of("offset"), case=case))[0]
    assert np.rad2deg(np.abs(unloaded - reported(system_with(case=case))[0]).max()) > 0.1


def test_a_force_offset_is_one_more_force_at_the_centre_of_the_top() -> None:
    model = spine(3)
    point, force = model.bodies[TOP].com, np.array([0.0, 0.0, 8.0])
    case = with_wrenches(loaded(model), lambda w: (*w, Wrench(TOP, point, force, NOWHERE)))
    assert_same_motion("force offset", instead=system_with(case=case))
    cable = np.array([8.0, -3.0, 5.0])
    case = with_wrenches(loaded(model), lambda w: (*w, Wrench(TOP, point, cable, NOWHERE)))
    assert_same_motion("cable", instead=system_with(case=case))
    with pytest.raises(ValueError, match="applies 'pull' is not one of moment, force"):
        create("load_offset", {"applies": "pull"})
    with pytest.raises(ValueError, match="coordinate 'extension' is not one of anterior"):
        create("load_offset", {"coordinate": "extension"})


@sweep("name", EFFECTS)
def test_each_test_has_its_own_values(name: str) -> None:
    assert_each_test_has_its_own_values(effect_of(name))


def test_spreads_of_what_is_looked_for() -> None:
    everywhere = {PlaceSpread.SHARED, PlaceSpread.BY_SPECIMEN}
    for name, by_test in (
        ("segment_weight", False),
        ("follower_load", False),
        ("load_misalignment", True),
        ("load_offset", True),
    ):
        trial = create(name).trial
        assert set(trial.spreads) == everywhere | ({PlaceSpread.BY_TEST} if by_test else set())
        assert [create(name, dict(options)) for options in trial.variants]
    assert not hasattr(create("load_gain"), "trial")
