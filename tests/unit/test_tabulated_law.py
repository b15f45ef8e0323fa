"""The tabulated law: straight pieces through its knots, corners as running means, derivatives.

Catches a law that misses its knots, or a wrong derivative between them.
"""

from typing import Any

import numpy as np
import pytest
from example_effects import NOWHERE, scoped, slope, spine
from sweeps import sweep

from spinepipe.effects import JointLaw, Wrench, create
from spinepipe.effects.contract import Array
from spinepipe.effects.tabulated_law import KNOTS, NAMES, ROUNDED
from spinepipe.model import LoadCase, LoadStep, SpineModel
from spinepipe.model.file import (
    EffectEntry,
    ModelFile,
    Values,
    effects_for,
    read_model,
    write_model,
)
from spinepipe.statics import System, follow
from spinepipe.units import COORDINATES
from spinepipe.world import Chain

EXTENSION = COORDINATES.index("extension")
REACH = 0.2
LOADS = np.array([-9.0, -5.0, -2.0, -1.5, 0.0, 0.5, 1.0, 4.0, 11.0])
"""N m at the knots."""

VALUES = np.diff(LOADS) / (0.25 * REACH)


def law(**options: Any) -> JointLaw:
    made = create("tabulated_law", {"reach": REACH} | options)
    assert isinstance(made, JointLaw)
    return made


def loads(u: Array, values: Array = VALUES) -> Array:
    """(N,) load in extension at shares u (N,) of the reach."""
    q = np.zeros((len(u), 6))
    q[:, EXTENSION] = REACH * u
    found: Array = law().respond(q, np.tile(values, (len(u), 1)), np.zeros_like(q)).load
    return found[:, EXTENSION]


def straight(u: Array) -> Array:
    """The table by numpy, its first and last piece going on."""
    inside = np.interp(u, KNOTS, LOADS)
    ends = [np.diff(LOADS)[n] / np.diff(KNOTS)[n] for n in (0, -1)]
    return inside + ends[0] * np.minimum(u + 1.0, 0.0) + ends[1] * np.maximum(u - 1.0, 0.0)


def test_the_table_is_a_running_mean_of_straight_pieces() -> None:
    """A corner rounded by a parabola is the mean over the width to both sides of it."""
    u = np.linspace(-1.6, 1.6, 161)
    around = np.linspace(-ROUNDED, ROUNDED, 4001)
    # no corner at the ends, so the mean there is the line itself
    mean = np.trapezoid(straight(u[:, None] + around), around, axis=1) / (2.0 * ROUNDED)
    at_rest = np.trapezoid(straight(around), around) / (2.0 * ROUNDED)
    # the trapezoid rule misses a corner by an eighth of its step times the change of slope
    np.testing.assert_allclose(loads(u), mean - at_rest, rtol=0, atol=1e-5)


def test_between_corners_it_is_the_table_itself() -> None:
    u = np.array([-1.3, -0.9, -0.6, -0.4, -0.1, 0.1, 0.4, 0.6, 0.9, 1.3])
    change = (LOADS[5] - 2.0 * LOADS[4] + LOADS[3]) / 0.25
    np.testing.assert_allclose(loads(u), straight(u) - 0.25 * ROUNDED * change, rtol=1e-13)
    assert loads(np.zeros(1))[0] == 0.0


def test_a_table_of_a_spring_is_that_spring() -> None:
    u = np.linspace(-2.0, 2.0, 41)
    np.testing.assert_allclose(loads(u, np.full(8, 7.0)), 7.0 * REACH * u, rtol=0, atol=1e-13)


def test_it_rises_where_the_table_rises() -> None:
    rng = np.random.default_rng(2)
    for _ in range(20):
        values = rng.exponential(size=8) * rng.integers(0, 2, 8)
        assert np.diff(loads(np.linspace(-1.5, 1.5, 301), values)).min() >= -1e-12


PLACES = (
    {"coordinate": "extension"},
    {"coordinate": "anterior", "reach": 2e-3},
    {"coordinate": "left_rotation", "over": "right_bending"},
    {"coordinate": "extension", "over": "anterior", "reach": 1e-3},
)


@sweep("options", PLACES, str)
def test_derivatives_are_those_of_the_load(options: dict[str, Any]) -> None:
    """Between knots, at corners, in their rounded parts and beyond the reach."""
    one = law(**options)
    along = COORDINATES.index(one.along)
    u = np.array([-1.4, -0.98, -0.77, -0.5, -0.02, 0.0, 0.1, 0.26, 0.73, 1.0, 1.5])
    q = np.random.default_rng(1).normal(size=(len(u), 6)) * ([1e-3] * 3 + [0.1] * 3)
    q[:, along] = one.furthest * u
    values = np.random.default_rng(5).normal(size=(len(u), 8)) * one.parameters[0].prior_scale
    rest = np.zeros_like(q)
    found = one.respond(q, values, rest).tangent
    for at in range(6):
        step = 1e-4 * one.furthest * np.eye(6)[at]
        by_q = slope(lambda h, d=step: one.respond(q + h * d, values, rest).load, 1.0)
        size = one.furthest * np.abs(found).max()
        # parabolas and lines: differences miss only where they step over the edge of a corner
        np.testing.assert_allclose(
            1e-4 * one.furthest * found[:, :, at], by_q, rtol=0, atol=1e-8 * size
        )
    by_values = one.by_parameter(q, values, rest)
    for column in range(8):
        step = one.parameters[0].prior_scale * np.eye(8)[column]
        by_value = slope(lambda h, d=step: one.respond(q, values + h * d, rest).load, 0.5)
        scale = one.parameters[0].prior_scale
        np.testing.assert_allclose(scale * by_values[:, :, column], by_value, rtol=1e-9, atol=1e-12)


def test_off_is_nothing_but_says_what_it_would_do() -> None:
    one, q = law(), np.full((3, 6), 0.03)
    off = np.zeros((3, 8))
    response = one.respond(q, off, q)
    assert not response.load.any()
    assert not response.tangent.any()
    assert response.by_carried is None
    assert one.by_parameter(q, off, q)[:, EXTENSION].any()
    assert all(p.off == 0.0 for p in one.parameters)


def test_other_coordinates_bear_nothing() -> None:
    q = np.full((1, 6), 0.06)
    response = law(over="right_bending").respond(q, VALUES[None], np.zeros((1, 6)))
    assert not np.delete(response.load, EXTENSION).any()
    assert np.argwhere(response.tangent).tolist() == [[0, EXTENSION, 4]]


def bent(moment_nm: float) -> tuple[SpineModel, LoadCase]:
    """One joint that bears a moment about its own extension axis by a spring and a table."""
    model = spine(1, gravity=False)
    model = model.with_effects((*model.effects, scoped(law(), (0,), tuple(VALUES.tolist()))))
    axis = model.frames[0].rotation[:, 2]
    step = LoadStep(0, (Wrench(0, NOWHERE, NOWHERE, moment_nm * axis),))
    return model, LoadCase("bent", 1, (step,))


@sweep("moment_nm", [-15.0, -3.0, 0.4, 7.5, 30.0])
def test_a_joint_turns_as_far_as_the_table_says(moment_nm: float) -> None:
    """Spring and table together, read backwards by numpy."""
    model, case = bent(moment_nm)
    stiffness = float(model.effects[0].values[0, EXTENSION])
    u = np.linspace(-3.0, 3.0, 600_001)
    turned = np.interp(moment_nm, stiffness * REACH * u + loads(u), REACH * u)
    (found,) = follow(System(Chain(model), model, case))
    assert found.usable, found.equilibrium.message
    assert found.equilibrium.q[EXTENSION] == pytest.approx(turned, abs=1e-9)


def test_a_model_file_carries_it(tmp_path: Any) -> None:
    values = Values(joint="L4L5", **dict(zip(NAMES, VALUES.tolist(), strict=True)))
    options = {"coordinate": "anterior", "over": "extension", "reach": 0.15}
    entry = EffectEntry(effect="tabulated_law", options=options, values=(values,))
    write_model(ModelFile(model="m", cohort="c", effects=(entry,)), tmp_path / "model.yaml")
    (found,) = effects_for(read_model(tmp_path / "model.yaml"), "s", ["L5S1", "L4L5"])
    assert found.effect == create("tabulated_law", options)
    np.testing.assert_array_equal(found.values, [np.zeros(8), VALUES])


@sweep(
    "options, message",
    [
        ({"coordinate": "flexion"}, "coordinate 'flexion' is not one of"),
        ({"over": "flexion"}, "over 'flexion' is not one of"),
        ({"reach": -0.1}, "reach -0.1 is not within 0 to 1 rad"),
        ({"coordinate": "anterior", "reach": 0.1}, "reach 0.1 is not within 0 to 0.01 m"),
    ],
)
def test_what_cannot_be_is_refused(options: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        create("tabulated_law", options)
