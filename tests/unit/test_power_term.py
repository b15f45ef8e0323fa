"""The power term: products by numpy, derivatives by differences, motion in closed form.

Catches a product or derivative of the power term that is wrong.
"""

from typing import Any

import numpy as np
import pytest
from example_effects import NOWHERE, scoped, slope, spine
from sweeps import sweep

from spinepipe.effects import JointLaw, Wrench, create
from spinepipe.effects.contract import Array
from spinepipe.model import LoadCase, LoadStep
from spinepipe.model.file import EffectEntry, ModelFile, effects_for, read_model, write_model
from spinepipe.statics import System, follow
from spinepipe.units import COORDINATES
from spinepipe.world import Chain

EXTENSION = COORDINATES.index("extension")
TERMS: tuple[dict[str, Any], ...] = (
    {},
    {"of": ("extension",)},
    {"of": ("extension", "extension"), "signed": True},
    {"of": ("extension", "extension", "extension")},
    {"coordinate": "anterior", "of": ("anterior", "anterior")},
    {"coordinate": "left_rotation", "of": ("right_bending", "right_bending", "left_rotation")},
    {"coordinate": "extension", "of": ("anterior", "left_rotation")},
)


def term(options: dict[str, Any]) -> JointLaw:
    made = create("power_term", options)
    assert isinstance(made, JointLaw)
    return made


def poses() -> Array:
    moved: Array = np.random.default_rng(1).normal(size=(9, 6)) * ([1e-3] * 3 + [0.1] * 3)
    return moved


@sweep("options", TERMS, str)
def test_it_is_the_product(options: dict[str, Any]) -> None:
    law, q = term(options), poses()
    of = options.get("of", ("extension", "extension"))
    at = COORDINATES.index(options.get("coordinate", "extension"))
    product = np.ones(len(q))
    for number, name in enumerate(of):
        factor = q[:, COORDINATES.index(name)]
        last = options.get("signed", False) and number == len(of) - 1
        product = product * (np.abs(factor) if last else factor)
    load = law.respond(q, np.full((9, 1), 3.0), q).load
    np.testing.assert_allclose(load[:, at], 3.0 * product, rtol=1e-14)
    assert not np.delete(load, at, axis=1).any()


@sweep("options", TERMS, str)
def test_derivatives_are_those_of_the_load(options: dict[str, Any]) -> None:
    law, q = term(options), poses()
    size = law.parameters[0].prior_scale
    values = size * np.random.default_rng(2).normal(size=(9, 1))
    found = law.respond(q, values, q)
    for at, step in enumerate([1e-5] * 3 + [1e-3] * 3):
        along = step * np.eye(6)[at]
        by_q = slope(lambda h, d=along: law.respond(q + h * d, values, q).load, 1.0)
        # powers up to the third: fourth-order differences are exact but for rounding
        scale = np.abs(found.load).max()
        np.testing.assert_allclose(step * found.tangent[:, :, at], by_q, atol=1e-12 * scale)
    by_value = slope(lambda h: law.respond(q, values + h * size, q).load, 0.5)
    np.testing.assert_allclose(size * law.by_parameter(q, values, q)[:, :, 0], by_value, rtol=1e-9)


def test_off_is_nothing_but_says_what_it_would_do() -> None:
    law, q = term({}), poses()
    response = law.respond(q, np.zeros((9, 1)), q)
    assert not response.load.any()
    assert not response.tangent.any()
    assert law.by_parameter(q, np.zeros((9, 1)), q)[:, EXTENSION].all()


def test_units_are_those_of_the_product() -> None:
    units = [term(options).parameters[0].unit for options in TERMS]
    assert units[:4] == ["N m/rad^2", "N m/rad", "N m/rad^2", "N m/rad^3"]
    assert units[4:] == ["N/m^2", "N m/rad^3", "N m/(m rad)"]


@sweep("moment_nm", [-6.0, 7.5])
def test_a_joint_turns_as_a_cubic_says(moment_nm: float) -> None:
    """k q + c q^3 = M by Cardano: one root, as both are positive."""
    law, coefficient = term({"of": ("extension",) * 3}), 9e3
    model = spine(1, gravity=False)
    stiffness = float(model.effects[0].values[0, EXTENSION])
    model = model.with_effects((*model.effects, scoped(law, (0,), (coefficient,))))
    axis = model.frames[0].rotation[:, 2]
    step = LoadStep(0, (Wrench(0, NOWHERE, NOWHERE, moment_nm * axis),))
    (found,) = follow(System(Chain(model), model, LoadCase("bent", 1, (step,))))
    p, r = stiffness / coefficient, moment_nm / coefficient
    root = np.sqrt(r**2 / 4.0 + p**3 / 27.0)
    turned = np.cbrt(r / 2.0 + root) + np.cbrt(r / 2.0 - root)
    assert found.equilibrium.q[EXTENSION] == pytest.approx(turned, abs=1e-11)


def test_a_model_file_carries_it(tmp_path: Any) -> None:
    options = {"coordinate": "anterior", "of": ["extension", "anterior"], "signed": True}
    entry = EffectEntry(effect="power_term", options=options)
    write_model(ModelFile(model="m", cohort="c", effects=(entry,)), tmp_path / "model.yaml")
    (found,) = effects_for(read_model(tmp_path / "model.yaml"), "s", ["L4L5"])
    assert found.effect == create("power_term", options)


@sweep(
    "options, message",
    [
        ({"coordinate": "flexion"}, "coordinate 'flexion' is not one of"),
        ({"of": ["flexion"]}, "of 'flexion' is not one of"),
        ({"of": []}, r"of \[\] is not 1 to 4 motions"),
    ],
)
def test_what_cannot_be_is_refused(options: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        create("power_term", options)
