"""The hidden truths of tests/generators/hidden on one joint, against closed forms.

Catches a hidden law that is not the one its name and formula say.
"""

from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import quad, solve_ivp
from scipy.optimize import brentq
from scipy.spatial.transform import Rotation
from sweeps import sweep

from tests.generators.hidden import CATALOGUE, KNOWN, Hidden
from tests.generators.hidden.anatomy import Bones
from tests.generators.hidden.design import Test as Case
from tests.generators.hidden.history import GROWTH, Friction, bouc_wen, chain
from tests.generators.hidden.rigid import Spine
from tests.generators.hidden.scope import scope
from tests.generators.hidden.solve import solve
from tests.generators.hidden.world import Now, World

K, M, H = 60.0, 6.0, 0.02
"""N m/rad of every rotation, N m, and m from the joint up to the centre of mass."""
STEP_S = 10.0
EXTENSION, FLEXION = np.array([[0.0, 0.0, M]]), np.array([[0.0, 0.0, -M]])
NOW = Now(np.array([0]), np.array([0]), STEP_S)
CLOSE = 2e-8
"""rad and m: a follower of 400 N compresses the joint by 4e-8 m; all else is closer."""


def one_joint(moments: np.ndarray, preload: float = 0.0, weight: bool = False) -> World:
    """One joint at ground's origin under moments (S, 3); it hardly shifts."""
    bones = Bones(
        np.zeros((1, 3)),
        np.eye(3)[None],
        np.ones(1),
        np.array([[0.0, H, 0.0]]),
        1e-4 * np.eye(3)[None],
    )
    path = np.vstack([np.zeros(3), moments])
    case = Case("test", path, preload, STEP_S * np.arange(len(path)), np.zeros_like(path))
    return World(
        number=0,
        bones=bones,
        stiffness=np.array([[1e10] * 3 + [K] * 3]),
        tests=(case,),
        weight=weight,
        preload_points=np.zeros((1, 3)),
        load_point=np.zeros(3),
        turn_load=np.eye(3)[None],
        gain=np.ones(1),
    )


def solved(world: World) -> np.ndarray:
    """(S, 6) what is reported of the one joint."""
    q = solve(world, Spine(world.bones), np.zeros((1, len(world.tests[0].moments), 1, 6))).q
    return world.reported(q)[0, :, 0]


def put(world: World, name: str, strength: float, **shape: object) -> World:
    """The world with an effect on extension."""
    return CATALOGUE[name].build(world, Hidden(name, "extension", shape=shape), strength)


def extension(name: str, strength: float, moments: np.ndarray = EXTENSION, **shape: object):
    """rad after the last step."""
    return solved(put(one_joint(moments), name, strength, **shape))[-1, 3]


LAWS: dict[str, tuple[float, dict[str, object], Callable[[float], float]]] = {
    "exponential": (9.0, {"formula": "exponential"}, lambda q: K * np.expm1(9.0 * q) / 9.0),
    "tangent": (8.0, {"formula": "tangent"}, lambda q: K * np.tan(8.0 * q) / 8.0),
    "cubic": (10.0, {"formula": "cubic"}, lambda q: K * q * (1.0 + 100.0 * q**2)),
}


@sweep("law", LAWS)
def test_stiffening_holds_the_moment(law: str) -> None:
    rate, shape, load = LAWS[law]
    expected = brentq(lambda q: load(q) - M, 0.0, 0.15, xtol=1e-14)
    assert extension("nonlinear_stiffening", rate, **shape) == pytest.approx(expected, abs=CLOSE)
    flexed = extension("nonlinear_stiffening", rate, FLEXION, **shape)
    assert flexed == pytest.approx(-expected, abs=CLOSE)


def test_a_neutral_zone_shifts_what_is_beyond_it() -> None:
    found = extension("neutral_zone", 0.8, half_width=0.03)
    assert found == pytest.approx(M / K + 0.8 * 0.03, abs=CLOSE)
    inside = extension("neutral_zone", 0.8, EXTENSION / 20.0, half_width=0.03)
    assert inside == pytest.approx(M / 20.0 / (0.2 * K), abs=CLOSE)


def test_asymmetry_is_one_stiffness_on_each_side() -> None:
    shape = {"sign": 1}
    found = extension("flexion_extension_asymmetry", 0.2, **shape)
    assert found == pytest.approx(M / (1.2 * K), abs=CLOSE)
    found = extension("flexion_extension_asymmetry", 0.2, FLEXION, **shape)
    assert found == pytest.approx(-M / (0.8 * K), abs=CLOSE)


def test_a_facet_stops_beyond_its_gap_on_its_side() -> None:
    shape = {"side": -1, "gap": 0.04}
    assert extension("facet_contact", 140.0, **shape) == pytest.approx(M / K, abs=CLOSE)
    stopped = -(M + 140.0 * 0.04) / (K + 140.0)
    assert extension("facet_contact", 140.0, FLEXION, **shape) == pytest.approx(stopped, abs=CLOSE)


def test_bending_and_rotation_turn_each_other() -> None:
    """A moment so small that the joint's axes stay where they are."""
    small = 1e-5
    world = put(
        one_joint(np.array([[small, 0.0, 0.0]])), "bending_rotation_coupling", 20.0, sign=-1
    )
    expected = np.linalg.solve([[K, -20.0], [-20.0, K]], [small, 0.0])
    np.testing.assert_allclose(solved(world)[-1, 4:], expected, rtol=1e-4)


def test_compression_stiffens() -> None:
    world = put(one_joint(EXTENSION, preload=300.0), "preload_stiffening", 0.002)
    assert solved(world)[-1, 3] == pytest.approx(M / (K * 1.6), abs=CLOSE)


def test_friction_follows_its_loop() -> None:
    load, width = 1.5, 0.02
    world = put(one_joint(np.array([[0, 0, M], [0, 0, 0]])), "hysteresis", load, width=width)
    up = brentq(lambda q: K * q + load * (1.0 - np.exp(-q / width)) - M, 0.0, 0.2, xtol=1e-14)
    force = load * (1.0 - np.exp(-up / width))
    down = brentq(
        lambda q: K * q - load + (force + load) * np.exp((q - up) / width), 0.0, up, xtol=1e-14
    )
    np.testing.assert_allclose(solved(world)[1:, 3], [up, down], atol=CLOSE)


def test_creep_grows_with_time_at_constant_load() -> None:
    held = np.repeat(EXTENSION, 4, axis=0)
    found = solved(put(one_joint(held), "creep", 0.3, time_s=25.0))[1:, 3]
    seconds = STEP_S * np.arange(1, 5)
    np.testing.assert_allclose(found, M / K * (1.0 + 0.3 * -np.expm1(-seconds / 25.0)), atol=CLOSE)


def test_a_left_out_weight_tips_the_joint() -> None:
    world = put(one_joint(EXTENSION), "segment_weight", 3.0)
    expected = brentq(lambda q: K * q - 3.0 * 9.81 * H * np.sin(q) - M, 0.0, 0.3, xtol=1e-14)
    assert solved(world)[-1, 3] == pytest.approx(expected, abs=CLOSE)


def test_a_follower_pulls_along_its_cable() -> None:
    """The cable runs from the centre of mass to as far below the joint: its arm is H sin(q/2)."""
    world = put(one_joint(EXTENSION), "follower_load", 400.0)
    expected = brentq(lambda q: K * q - 400.0 * H * np.sin(q / 2.0) - M, 0.0, 0.3, xtol=1e-14)
    assert solved(world)[-1, 3] == pytest.approx(expected, abs=CLOSE)


def test_a_constant_moment_is_there_at_step_0() -> None:
    world = put(one_joint(EXTENSION), "load_offset", 0.6, axis=[0.0, 0.0, 1.0])
    np.testing.assert_allclose(solved(world)[:, 3], [0.6 / K, (M + 0.6) / K], atol=CLOSE)


def test_a_misaligned_moment_about_x_tilts_towards_y() -> None:
    world = put(one_joint(EXTENSION), "load_misalignment", 0.1, axis=[1.0, 0.0, 0.0])
    pose = Spine(world.bones).at(np.zeros((1, 1, 6)))
    (applied,) = world.wrenches(pose, Now(np.array([0]), np.array([1]), 0.0))
    np.testing.assert_allclose(applied.moments[0, 0], [0, -M * np.sin(0.1), M * np.cos(0.1)])


def test_another_centre_shows_in_translations() -> None:
    world = put(one_joint(EXTENSION), "joint_centre_offset", 0.01, direction=[0.6, 0.8, 0.0])
    turn = Rotation.from_euler("z", M / K).as_matrix()
    expected = (np.eye(3) - turn) @ [0.006, 0.008, 0.0]
    np.testing.assert_allclose(solved(world)[-1, :4], [*expected, M / K], atol=CLOSE)


def test_a_moving_centre_shows_in_translations() -> None:
    world = put(one_joint(EXTENSION), "joint_centre_migration", 0.1, direction=[0.0, 1.0, 0.0])
    turn = Rotation.from_euler("z", M / K).as_matrix()
    expected = (np.eye(3) - turn) @ [0.0, 0.1 * M / K, 0.0]
    np.testing.assert_allclose(solved(world)[-1, :4], [*expected, M / K], atol=CLOSE)


def test_a_plain_joint_turns_by_moment_over_stiffness() -> None:
    world = replace(one_joint(EXTENSION), gain=np.array([1.02]))
    assert solved(world)[-1, 3] == pytest.approx(1.02 * M / K, abs=CLOSE)


def test_a_lax_joint_has_lost_a_share_of_its_stiffness() -> None:
    assert extension("local_laxity", 0.4) == pytest.approx(M / (0.6 * K), abs=CLOSE)


def test_levels_differ_by_a_factor() -> None:
    found = extension("level_dependence", 0.1, pattern=[-2.0])
    assert found == pytest.approx(M / (np.exp(-0.2) * K), abs=CLOSE)


def test_a_click_is_a_wave_on_the_spring() -> None:
    expected = brentq(
        lambda q: K * q + 0.4 * np.sin(2 * np.pi * q / 0.06) - M, 0.0, 0.2, xtol=1e-14
    )
    found = extension("periodic_click", 0.4, period=0.06)
    assert found == pytest.approx(expected, abs=CLOSE)


def test_a_bilinear_spring_has_a_break() -> None:
    """Stiffness K up to knee / rate = 0.05 rad, three times K beyond."""
    found = extension("nonlinear_stiffening", 10.0, formula="bilinear", knee=0.5)
    assert found == pytest.approx((M + 2.0 * K * 0.05) / (3.0 * K), abs=CLOSE)


def test_a_hyperbolic_spring_ends_short_of_its_pole() -> None:
    found = extension("nonlinear_stiffening", 5.0, formula="hyperbolic")
    assert found == pytest.approx(M / (K + 5.0 * M), abs=CLOSE)


ZONES: dict[str, Callable[[float], float]] = {
    "tanh": np.tanh,
    "erf": lambda u: quad(lambda x: np.exp(-np.pi * x**2 / 4.0), 0.0, u, epsabs=1e-13)[0],
    "arctan": lambda u: quad(lambda x: 1.0 / (1.0 + (np.pi * x / 2.0) ** 2), 0.0, u)[0],
}


@sweep("formula", ZONES)
def test_a_smooth_zone_takes_off_a_saturating_load(formula: str) -> None:
    lost = ZONES[formula]
    expected = brentq(lambda q: K * q - 0.8 * K * 0.03 * lost(q / 0.03) - M, 0.0, 0.3, xtol=1e-14)
    found = extension("neutral_zone", 0.8, half_width=0.03, formula=formula)
    assert found == pytest.approx(expected, abs=CLOSE)


def test_a_zone_off_centre_is_not_the_same_on_both_sides() -> None:
    shape = {"half_width": 0.03, "centre": 0.02, "formula": "off_centre"}

    def missing(q: float, load: float) -> float:
        lost = 0.03 * (np.tanh((q - 0.02) / 0.03) + np.tanh(0.02 / 0.03))
        return K * q - 0.8 * K * lost - load

    for moments, load in ((EXTENSION, M), (FLEXION, -M)):
        expected = brentq(missing, -0.3, 0.3, args=(load,), xtol=1e-14)
        assert extension("neutral_zone", 0.8, moments, **shape) == pytest.approx(
            expected, abs=CLOSE
        )


def test_curved_faces_and_cartilage_stop_later_and_harder() -> None:
    shape = {"side": 1, "gap": 0.04, "width": 0.02}
    stops = {
        "hertz": lambda d: d**1.5 / np.sqrt(0.02),
        "exponential": lambda d: 0.02 * np.expm1(d / 0.02),
    }
    for formula, stop in stops.items():
        found = extension("facet_contact", 140.0, formula=formula, **shape)
        expected = brentq(
            lambda q, stop=stop: K * q + 140.0 * stop(max(q - 0.04, 0.0)) - M, 0.0, 0.2, xtol=1e-14
        )
        assert found == pytest.approx(expected, abs=CLOSE)


def test_sliders_side_by_side_follow_a_parabola() -> None:
    """Yields evenly between 0 and w: F / F_max = x / w (1 + log(w / x)) is the mean of min(1, x/y).

    Twelve elements are within 2 % of it; after a turn by d the branch is that of d / 2, twice.
    """
    law = Friction(scope("extension", None, 1), 1.0, 0.01, "even")
    memory = np.zeros((law.cells, 1, 1, 6))
    loads = []
    for angle in (0.02, 0.005):
        q = np.zeros((1, 1, 6))
        q[..., 3] = angle
        loads.append(law(q, np.zeros_like(q), memory, NOW)[0, 0, 3])
        memory = law.renewed(q, memory, NOW)

    def mean(x: float) -> float:
        return x / 0.04 * (1.0 + np.log(0.04 / x))

    expected = [mean(0.02), mean(0.02) - 2.0 * mean(0.0075)]
    np.testing.assert_allclose(loads, expected, atol=0.02)


def test_bouc_and_wen_as_an_equation_of_motion() -> None:
    turns, force = [0.0, 2.5, -1.0, 0.5, -3.0], 0.0
    for start, end in pairwise(turns):
        side = np.sign(end - start)
        expected = solve_ivp(
            lambda x, f, side=side: side * (1.0 - 0.5 * f**2 * (1.0 + side * np.sign(f))),
            (0.0, abs(end - start)),
            [force],
            rtol=1e-9,
            atol=1e-10,
            max_step=0.01,
        ).y[0, -1]
        force = float(bouc_wen(np.array(force), np.array(end - start)))
        assert force == pytest.approx(expected, abs=1e-5)
    assert bouc_wen(np.array(0.4), np.array(0.0)) == 0.4


@sweep("formula", ["stretched", "logarithmic", "power"])
def test_a_chain_creeps_as_its_formula(formula: str) -> None:
    """Under one constant load, from 3 s to 20 minutes; seven units are within 2 % of the whole."""
    shares, times = chain(formula, 60.0)
    t = np.geomspace(3.0, 1200.0, 30)[:, None]
    grown = np.where(times > 0.0, -np.expm1(-t / np.maximum(times, 1e-9)), 1.0) @ shares
    np.testing.assert_allclose(grown, GROWTH[formula](t[:, 0], 60.0), atol=0.02)


def test_a_force_through_the_centre_shears_and_no_more() -> None:
    world = one_joint(np.zeros((1, 3)))
    case = replace(world.tests[0], forces=np.array([[0.0, 0, 0], [80.0, 0.0, 0.0]]))
    springs = np.array([[1e5, 1e10, 1e10, K, K, K]])
    found = solved(replace(world, tests=(case,), stiffness=springs))
    np.testing.assert_allclose(found[-1], [80.0 / 1e5, 0, 0, 0, 0, 0], atol=1e-9)


def test_every_other_formula_is_told_from_the_librarys() -> None:
    told = {name: set(CATALOGUE[name].formulas.values()) for name in KNOWN}
    with_others = [name for name, which in told.items() if "other" in which]
    assert len(with_others) >= 14
    assert all("same" in which for which in told.values())
