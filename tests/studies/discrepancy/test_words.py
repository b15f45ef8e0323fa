"""Names of effects in the words of each coordinate, and their parameters in the field's units."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.optimize import brentq
from sweeps import sweep

from spinepipe.effects import create
from spinepipe.studies.discrepancy.quantities import Quantity, quantities
from spinepipe.studies.discrepancy.verdict import Estimate, Missing, VerdictScope
from spinepipe.studies.discrepancy.words import (
    effects_in_words,
    general,
    load_axis,
    name_at,
    readable,
    shape_in_words,
    what_of,
)
from spinepipe.units import COORDINATES, DEG_PER_RAD, MM_PER_M


def missing(name: str, *coordinates: str, **variant: Any) -> Missing:
    scope = VerdictScope(("C6C7",), coordinates or ("*",), ("*",))
    return Missing(name, "joint law", scope, variant, "shared", (), 10.0, ())


ASYMMETRY, COUPLING = "flexion_extension_asymmetry", "bending_rotation_coupling"


@sweep(
    "effect, words",
    [
        (missing(ASYMMETRY, "extension"), "flexion–extension asymmetry at C6–C7"),
        (missing(ASYMMETRY, "anterior"), "anterior–posterior asymmetry at C6–C7"),
        (
            missing(ASYMMETRY, "right_bending"),
            "right–left asymmetry in lateral bending at C6–C7",
        ),
        (missing(ASYMMETRY, "left_rotation"), "left–right asymmetry in axial rotation at C6–C7"),
        (
            missing(COUPLING, "right_bending", "left_rotation"),
            "bending–rotation coupling at C6–C7",
        ),
        (
            missing(COUPLING, "anterior", "extension"),
            "coupling of anterior–posterior translation and flexion–extension at C6–C7",
        ),
        (
            missing("facet_contact", "left_rotation", side="negative"),
            "facet contact in rotation to the right at C6–C7",
        ),
        (
            missing("facet_contact", "anterior", side="positive"),
            "contact (stop) in anterior translation at C6–C7",
        ),
        (
            missing("nonlinear_stiffening", "anterior", shape="cubic"),
            "nonlinear stiffening in anterior–posterior translation at C6–C7",
        ),
    ],
)
def test_an_effect_is_named_as_the_field_does_there(effect: Missing, words: str) -> None:
    assert what_of(effect) == words


def test_of_many_effects_a_sentence_has_what_fits() -> None:
    two = [missing("creep"), missing("neutral_zone", "extension")]
    assert effects_in_words(two, 20) == (
        "creep at C6–C7 and neutral zone in flexion–extension at C6–C7"
    )
    assert effects_in_words(two, 4) == "creep and neutral zone"
    assert effects_in_words(two, 3) == "2 effects"


@sweep("coordinate", COORDINATES)
def test_no_name_says_another_coordinate(coordinate: str) -> None:
    name = name_at(ASYMMETRY, (coordinate,))
    assert ("flexion" in name) == (coordinate == "extension")
    assert "(N)" in load_axis(coordinate) or "(N m)" in load_axis(coordinate)


def test_without_a_place_no_coordinate_is_said() -> None:
    assert [general(name) for name in (ASYMMETRY, COUPLING, "facet_contact", "load_offset")] == [
        "asymmetry",
        "coupling",
        "contact (stop)",
        "load offset",
    ]


def test_sentences_of_results_read_as_words() -> None:
    assert readable("marker_bias: try base per_joint") == "marker bias: try base per_joint"
    assert readable("load in right bending over the joint's other motions, shared") == (
        "load in lateral bending over the joint's other motions, shared"
    )
    assert readable("load over the joint's own anterior") == (
        "load over the joint's own anterior–posterior translation"
    )
    assert readable("L4L5, left rotation, test flexion_extension (gap 4.5)") == (
        "L4L5, axial rotation, test flexion–extension (gap 4.5)"
    )
    assert readable("right bending over extension at every joint") == (
        "lateral bending over flexion–extension at every joint"
    )
    assert "flexion" not in readable("flexion_extension_asymmetry would explain a part")
    assert shape_in_words("load over the joint's own left rotation, shared") == (
        "load over the joint's own axial rotation, alike everywhere"
    )


def told(effect: str, one: Estimate, **variant: Any) -> Quantity:
    scope = VerdictScope()
    (found,) = quantities(Missing(effect, "joint law", scope, variant, "shared", (one,), 9.0, ()))
    return found


def around(name: str, value: float, unit: str) -> Estimate:
    low, high = sorted((0.9 * value, 1.1 * value))
    return Estimate(name, value, unit, (low, high))


@sweep(
    "effect, name, unit, value, words",
    [
        ("facet_contact", "stiffness", "N/m", 120000.0, "stiffness 120 N/mm"),
        ("facet_contact", "stiffness", "N m/rad", 57.29578, "stiffness 1 N m/°"),
        ("facet_contact", "gap", "mm", 0.6, "gap 0.6 mm"),
        (COUPLING, "coupling", "N/rad", 5729.578, "coupling 100 N/°"),
        ("hysteresis", "force", "N", 12.0, "half loop height 12 N"),
        ("nonlinear_stiffening", "gain", "1", 2.0, "stiffness beyond the break over that within 3"),
        ("nonlinear_stiffening", "break_at", "mm", 0.8, "break at 0.8 mm"),
        ("neutral_zone", "width", "deg", 1.6, "half width 1.6 °"),
        (
            "preload_stiffening",
            "rise",
            "1/N",
            1e-3,
            "stiffness gained by compression 10 % per 100 N",
        ),
        ("brand_new", "rate_of_it", "furlong", 2.0, "rate of it 2 furlong"),
    ],
)
def test_units_are_the_fields(effect: str, name: str, unit: str, value: float, words: str) -> None:
    found = told(effect, around(name, value, unit))
    assert found.value is not None
    assert f"{found.name} {found.value.number:.6g} {found.value.unit}".rstrip() == words
    assert found.identifiable


@sweep(
    "shape, unit, rise, coordinate",
    [
        ("tangent", "1/rad^2", 17.7, "extension"),
        ("cubic", "1/rad^2", 7.5, "left_rotation"),
        ("exponential", "1/rad", 8.0, "right_bending"),
        ("tangent", "1/m^2", 5e5, "anterior"),
        ("cubic", "1/m^2", 2e5, "superior"),
        ("exponential", "1/m", 500.0, "right"),
    ],
)
def test_stiffness_has_doubled_where_it_is_said(
    shape: str, unit: str, rise: float, coordinate: str
) -> None:
    """Against the slope of the law itself, by differences."""
    law = create("nonlinear_stiffening", {"coordinate": coordinate, "shape": shape})
    at = COORDINATES.index(coordinate)
    name = law.parameters[0].name
    values = np.array([[rise, *(p.default for p in law.parameters[1:])]])

    def load(x: float) -> float:
        q = np.zeros((1, 6))
        q[0, at] = x
        carried = np.zeros((1, 6))
        carried[0, at] = x  # of a spring of stiffness 1
        return x + float(law.respond(q, values, carried).load[0, at])

    border = MM_PER_M if "/m" in unit else DEG_PER_RAD
    small = 1e-5 / border

    def slope(x: float) -> float:
        return (load(x + small) - load(x - small)) / (2.0 * small)

    options = {"coordinate": coordinate, "shape": shape}
    found = told("nonlinear_stiffening", around(name, rise, unit), **options).value
    assert found is not None
    start = slope(0.0) if shape != "exponential" else 1.0
    doubled = brentq(lambda x: slope(x) - 2.0 * start, 1e-3 / border, 60.0 / border)
    assert found.number == pytest.approx(doubled * border, rel=2e-3)
    assert found.unit == ("mm" if "/m" in unit else "°")
    assert found.low is not None
    assert found.high is not None
    assert found.low < found.number < found.high


def test_an_end_that_is_open_stays_open() -> None:
    """Of what falls where the parameter rises, the other end."""
    growth = Estimate("growth@L4L5@s01", 17.68, "1/rad^2", (16.2, 19.1))
    found = told("nonlinear_stiffening", growth, shape="tangent")
    assert found.place == "L4L5, s01"
    assert f"{found.value}" == "10.70 (10.30 to 11.18)°"
    some = told("nonlinear_stiffening", replace(growth, ci95=(None, 19.1)), shape="tangent")
    much = told("nonlinear_stiffening", replace(growth, ci95=(16.2, None)), shape="tangent")
    assert f"{some.value:interval}" == "above 10"
    assert f"{much.value:interval}" == "below 11"
    assert not some.identifiable
    assert not much.identifiable
    never = told(
        "nonlinear_stiffening", Estimate("growth", 0.0, "1/rad^2", (0.0, 19.1)), shape="tangent"
    )
    assert never.value is None
    bound = told("facet_contact", Estimate("gap", 28.6, "deg", (26.0, 28.6), at_bound=True))
    assert not bound.identifiable


def test_an_asymmetry_is_the_ratio_of_its_two_sides() -> None:
    found = told(ASYMMETRY, around("asymmetry", 0.2, "1"), coordinate="extension")
    assert found.name == "stiffness in extension over that in flexion"
    assert found.value is not None
    assert found.value.number == pytest.approx(1.5)
    shear = told(ASYMMETRY, around("asymmetry", -0.2, "1"), coordinate="anterior")
    assert shear.name == "stiffness in anterior translation over that in posterior translation"
    assert shear.value is not None
    assert shear.value.number == pytest.approx(1.0 / 1.5)
