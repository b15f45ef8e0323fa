"""The map of parameters: laws of the generator and of spinepipe at mapped values are the same.

Catches a map between parameters of generator and library that is off.
"""

from dataclasses import asdict
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from sweeps import sweep

from spinepipe.effects import create
from spinepipe.effects.contract import MeasurementContext
from tests.generators.hidden import CATALOGUE, Hidden, Recipe
from tests.generators.hidden.anatomy import COORDINATES, JOINTS
from tests.generators.hidden.scene import scene
from tests.generators.hidden.world import Now, World
from tests.validation.discrepancy.parameter_truth import TRUTHS, tilts
from tests.validation.discrepancy.parameters import compared

RECIPE = Recipe(seed=11, n_specimens=1)
NOW = Now(np.array([0]), np.array([0]), 30.0)
N = len(JOINTS)
ANGLE = np.array([-0.09, -0.05, -0.02, 0.02, 0.05, 0.09])
"""rad, far from every corner that spinepipe rounds."""

LAWS: list[tuple[str, str | None, dict[str, Any], float, dict[str, Any]]] = [
    (
        "nonlinear_stiffening",
        "extension",
        {"formula": "exponential"},
        9.0,
        {"shape": "exponential"},
    ),
    ("nonlinear_stiffening", "extension", {"formula": "tangent"}, 8.0, {"shape": "tangent"}),
    ("nonlinear_stiffening", "extension", {"formula": "cubic"}, 7.0, {"shape": "cubic"}),
    (
        "nonlinear_stiffening",
        "extension",
        {"formula": "bilinear", "knee": 0.5},
        12.0,
        {"shape": "bilinear"},
    ),
    (
        "facet_contact",
        "extension",
        {"formula": "hertz", "side": 1, "gap": 0.035, "width": 0.02},
        80.0,
        {"side": "positive"},
    ),
    ("neutral_zone", "right_bending", {"half_width": 0.035}, 0.6, {}),
    ("flexion_extension_asymmetry", "left_rotation", {"sign": -1}, 0.3, {}),
    ("bending_rotation_coupling", None, {"sign": -1}, 12.0, {}),
    ("facet_contact", "extension", {"side": -1, "gap": 0.035}, 80.0, {"side": "negative"}),
    ("facet_contact", "extension", {"side": 1, "gap": 0.035}, 80.0, {"side": "positive"}),
    ("preload_stiffening", "extension", {}, 0.002, {}),
    ("local_laxity", "extension", {}, 0.4, {}),
]


@sweep("name, coordinate, shape, strength, options", LAWS)
def test_joint_laws_carry_the_same_load(
    name: str,
    coordinate: str | None,
    shape: dict[str, Any],
    strength: float,
    options: dict[str, Any],
) -> None:
    hidden = Hidden(name, coordinate, shape=shape, strength=strength)
    effect, values = mapped(hidden, options)
    q = np.linspace(-0.002, 0.002, 6 * N).reshape(N, 6)
    q[:, 3:] = ANGLE[:, None] * [1.0, -0.9, 1.1]
    carried = q * [2e5, 1e6, 1e5, 75.0, 85.0, 250.0]
    theirs = world(hidden).laws[-1](q, carried, np.zeros((2, N, 6)), NOW)
    ours = effect.respond(q, values, carried).load
    rounded = name in ("nonlinear_stiffening", "neutral_zone")  # corners, and |q| over 1e-4 rad
    tolerance = 5e-3 if rounded else 1e-9
    assert np.abs(theirs).max() > 0.1
    assert ours == pytest.approx(theirs, rel=tolerance, abs=1e-12)


def test_friction_follows_the_same_path() -> None:
    hidden = Hidden("hysteresis", "extension", shape={"width": 0.01}, strength=0.7)
    effect, values = mapped(hidden, {})
    theirs, ours = theirs_on_path(hidden, 30.0), ours_on_path(effect, values, 30.0)
    assert np.abs(theirs - ours).max() < 5e-3 * 0.7  # corners are rounded by 1e-4 of the width


@sweep("seconds", [0.1, 30.0])
def test_creep_relaxes_alike(seconds: float) -> None:
    hidden = Hidden("creep", "extension", shape={"time_s": 40.0}, strength=0.5)
    effect, values = mapped(hidden, {})
    theirs, ours = theirs_on_path(hidden, seconds), ours_on_path(effect, values, seconds)
    assert np.abs(theirs).max() > 0.3
    np.testing.assert_allclose(ours, theirs, rtol=0, atol=1e-12)


PATH = np.concatenate([np.linspace(0.0, 0.08, 300), np.full(600, 0.08), np.linspace(0.08, -0.05)])
"""rad of extension: up, held, and back."""


def theirs_on_path(hidden: Hidden, seconds: float) -> np.ndarray:
    made = world(hidden)
    law, found = made.laws[-1], []
    memory = np.zeros((law.cells, N, 6))  # type: ignore[attr-defined]
    for angle in PATH:
        q = np.zeros((N, 6))
        q[:, 3] = angle
        now = Now(np.array([0]), np.array([0]), seconds)
        found.append(law(q, made.stiffness * q, memory, now)[:, 3])
        memory = law.renewed(q, memory, now)  # type: ignore[attr-defined]
    return np.array(found)


def ours_on_path(effect: Any, values: np.ndarray, seconds: float) -> np.ndarray:
    stiffness = scene(RECIPE).plain(0).stiffness
    state, found = np.zeros((N, 2)), []
    for angle in PATH:
        q = np.zeros((N, 6))
        q[:, 3] = angle
        step = (q, values, state, seconds, stiffness * q)
        found.append(effect.respond_on_path(*step).load[:, 3])
        state = effect.advance(*step).state
    return np.array(found)


def test_a_migrating_centre_is_in_the_same_place() -> None:
    hidden = Hidden(
        "joint_centre_migration", "extension", strength=0.1, shape={"direction": [0.6, -0.8, 0.0]}
    )
    effect, values = mapped(hidden, {})
    seen, _ = world(hidden).places[-1](POSES)
    assert effect.place(POSES, values).q == pytest.approx(seen, abs=1e-12)


def test_a_centre_elsewhere_is_seen_back_to_the_true_motion() -> None:
    hidden = Hidden("joint_centre_offset", strength=0.01, shape={"direction": [0.6, -0.8, 0.0]})
    effect, values = mapped(hidden, {})
    told = world(hidden).views[-1](POSES)
    assert np.abs(told - POSES).max() > 1e-4
    assert effect.place(told, values).q == pytest.approx(POSES, abs=1e-12)


def test_a_tilted_marker_frame_tells_the_same_motion() -> None:
    shape = {"axis": [0.6, 0.0, 0.8], "offset_m": [0.0, 0.0, 0.0]}
    hidden = Hidden("marker_bias", strength=0.1, shape=shape)
    effect, values = mapped(hidden, {"form": "tilt"})
    told = world(hidden).views[-1](POSES)
    assert np.abs(told - POSES).max() > 1e-3
    assert effect.observe(POSES, values).q == pytest.approx(told, abs=1e-12)


def test_skin_and_a_moving_zero_read_alike() -> None:
    q = np.stack([POSES, 0.5 * POSES, -POSES, 0.0 * POSES])[None]
    skin = Hidden(
        "soft_tissue_artefact", "extension", strength=0.4, shape={"formula": "root", "reach": 0.03}
    )
    drift = Hidden("neutral_pose_drift", "extension", strength=0.01, shape={"sign": 1, "pace": 0.4})
    for hidden, options in ((skin, {"neighbour": "above"}), (drift, {})):
        effect, values = mapped(hidden, options)
        told = world(hidden).views[-1](q)[0]
        for step, pose in enumerate(q[0]):
            above = np.vstack([pose[1:], np.zeros((1, 6))])
            beside = MeasurementContext(above, np.zeros((N, 6)), np.full(N, step / 3.0))
            assert effect.observe_beside(pose, values, beside).q == pytest.approx(
                told[step], abs=1e-12
            )


@sweep(
    "test, main, first, second",
    [
        ("flexion_extension", 2, 0, 1),
        ("lateral_bending_preloaded", 0, 1, 2),
        ("axial_rotation", 1, 2, 0),
    ],
)
def test_a_tilted_load_is_two_tilts_of_each_test(
    test: str, main: int, first: int, second: int
) -> None:
    axis = np.array([0.6, 0.8, 0.0])
    hidden = {"strength": 0.2, "shape": {"axis": axis.tolist()}}
    two, axes = tilts(hidden, test), np.eye(3)
    turn = Rotation.from_rotvec(two["tilt_1"] * axes[first])
    turn = turn * Rotation.from_rotvec(two["tilt_2"] * axes[second])
    expected = Rotation.from_rotvec(0.2 * axis).apply(axes[main])
    assert turn.apply(axes[main]) == pytest.approx(expected, abs=1e-12)


def test_values_of_other_places_shapes_and_coordinates_are_not_compared() -> None:
    zone = {"name": "neutral_zone", "coordinate": "extension", "joint": 2, "specimen": None}
    hidden = zone | {"strength": 0.6, "shape": {"half_width": np.deg2rad(2.0)}}
    values = [
        value("stiffness_ratio", 0.42, 0.35, 0.44, [JOINTS[2]]),
        value("stiffness_ratio", 0.9, 0.8, 1.0, [JOINTS[3]]),
        value("width", 2.5, 2.1, 2.9, [JOINTS[2]], "deg"),
    ]
    one = {
        "name": "neutral_zone",
        "options": {"coordinate": "extension"},
        "spread": "by joint",
        "joint": None,
        "specimen": None,
        "values": values,
    }
    found = compared({"recipe": {"seed": 1, "hidden": [hidden]}, "standing": [one]})
    assert [(o.name, o.close, o.inside) for o in found] == [
        ("stiffness_ratio", True, True),
        ("width", False, False),
    ]
    assert [o.error for o in found] == pytest.approx([0.05, 0.25])
    other = one | {"options": {"coordinate": "right_bending"}}
    assert compared({"recipe": {"seed": 1, "hidden": [hidden]}, "standing": [other]}) == []


def test_levels_are_compared_against_their_mean() -> None:
    pattern = [1.0, -1.0, 1.0, -1.0, 1.0, -1.0]
    hidden = {
        "name": "level_dependence",
        "coordinate": "extension",
        "joint": None,
        "specimen": None,
        "strength": 0.5,
        "shape": {"pattern": pattern},
    }
    ratios = [3.0 * np.exp(0.5 * step) for step in pattern]
    values = [value("ratio", r, r - 1, r + 1, [j]) for j, r in zip(JOINTS, ratios, strict=True)]
    one = {
        "name": "level_dependence",
        "options": {"coordinate": "extension"},
        "joint": None,
        "specimen": None,
        "spread": "by joint",
        "values": values,
    }
    found = compared({"recipe": {"seed": 1, "hidden": [hidden]}, "standing": [one]})
    assert [o.error for o in found] == pytest.approx([0.0] * 6, abs=1e-12)
    assert {o.inside for o in found} == {None}


def value(
    name: str, at: float, low: float, high: float, place: list[str], unit: str = "1"
) -> dict[str, Any]:
    return {
        "name": name,
        "place": place,
        "value": at,
        "low": low,
        "high": high,
        "unit": unit,
        "at_bound": False,
    }


POSES = np.column_stack([np.linspace(-1, 1, N)[:, None] * [2e-3, -1e-3, 1e-3, 0.1, -0.06, 0.04]])


def world(hidden: Hidden) -> World:
    """One specimen with the effect."""
    build = CATALOGUE[hidden.name].build
    return build(scene(RECIPE).plain(0), hidden, float(hidden.strength or 0.0))


def mapped(hidden: Hidden, options: dict[str, Any]) -> tuple[Any, np.ndarray]:
    """Spinepipe's effect and its values (J, P) by the map."""
    if hidden.coordinate in COORDINATES and hidden.name != "joint_centre_migration":
        options = {"coordinate": hidden.coordinate, **options}
    effect = create(hidden.name, options)
    asked = {"pair": ("right_bending", "left_rotation")} | options
    truth = TRUTHS[hidden.name](asdict(hidden), asked)
    assert truth is not None
    values = [truth.get(one.name, one.unsaid) for one in effect.parameters]
    return effect, np.tile(values, (N, 1))
