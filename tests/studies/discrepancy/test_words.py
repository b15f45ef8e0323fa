"""Names of effects in the words of each coordinate, and their parameters in the field's units."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.optimize import brentq
from sweeps import sweep

from spinepipe.effects import create
from spinepipe.studies.discrepancy.quantities import estimate, quantity
from spinepipe.studies.discrepancy.verdict import Estimate, Missing, VerdictScope
from spinepipe.studies.discrepancy.words import (
    general,
    label_of,
    load_axis,
    name_at,
    readable,
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
        (missing(ASYMMETRY, "extension"), "a flexion–extension asymmetry at C6C7"),
        (missing(ASYMMETRY, "anterior"), "an anterior–posterior asymmetry at C6C7"),
        (
            missing(ASYMMETRY, "right_bending"),
            "a right–left asymmetry at C6C7, in lateral bending",
        ),
        (missing(ASYMMETRY, "left_rotation"), "a left–right asymmetry at C6C7, in axial rotation"),
        (
            missing(COUPLING, "right_bending", "left_rotation"),
            "bending–rotation coupling at C6C7",
        ),
        (
            missing(COUPLING, "anterior", "extension"),
            "coupling of anterior–posterior translation and flexion–extension at C6C7",
        ),
        (
            missing("facet_contact", "left_rotation", side="negative"),
            "facet contact at C6C7, in rotation to the right",
        ),
        (
            missing("facet_contact", "anterior", side="positive"),
            "contact (stop) at C6C7, in anterior translation",
        ),
        (
            missing("nonlinear_stiffening", "anterior", shape="cubic"),
            "nonlinear stiffening at C6C7, in anterior–posterior translation",
        ),
    ],
)
def test_an_effect_is_named_as_the_field_does_there(effect: Missing, words: str) -> None:
    assert what_of(effect).removeprefix("an ").removeprefix("a ") == words.removeprefix(
        "an "
    ).removeprefix("a ")


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
    assert label_of(missing("nonlinear_stiffening", "extension", shape="tangent")) == (
        "nonlinear stiffening (tangent)"
    )
    assert label_of(missing("facet_contact", "anterior", side="positive")) == "contact (stop)"


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


def told(effect: str, name: str, value: float, unit: str, **variant: Any) -> Any:
    low, high = sorted((0.9 * value, 1.1 * value))
    return quantity(effect, variant, Estimate(name, value, unit, (low, high)))


@sweep(
    "effect, name, unit, value, words",
    [
        ("facet_contact", "stiffness", "N/m", 120000.0, "stiffness 120 N/mm"),
        ("facet_contact", "stiffness", "N m/rad", 57.29578, "stiffness 1.00 N m/°"),
        ("facet_contact", "gap", "mm", 0.6, "gap 0.600 mm"),
        (COUPLING, "coupling", "N/rad", 5729.578, "coupling 100 N/°"),
        ("hysteresis", "force", "N", 12.0, "half loop height 12.0 N"),
        (
            "nonlinear_stiffening",
            "gain",
            "1",
            2.0,
            "stiffness beyond the break over that within 3.00",
        ),
        ("nonlinear_stiffening", "break_at", "mm", 0.8, "break at 0.800 mm"),
        ("neutral_zone", "width", "deg", 1.6, "half width 1.60°"),
        ("neutral_zone", "stiffness_ratio", "1", 0.2, "stiffness ratio 0.200"),
        ("preload_stiffening", "rise", "1/N", 1e-3, "stiffness gained by compression 10.0 % per"),
    ],
)
def test_units_are_the_fields(effect: str, name: str, unit: str, value: float, words: str) -> None:
    assert told(effect, name, value, unit).words.startswith(words)


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

    found = told("nonlinear_stiffening", name, rise, unit, coordinate=coordinate, shape=shape)
    assert found.name == "stiffness doubles at"
    start = slope(0.0) if shape != "exponential" else 1.0
    doubled = brentq(lambda x: slope(x) - 2.0 * start, 1e-3 / border, 60.0 / border)
    assert found.value == pytest.approx(doubled * border, rel=2e-3)
    assert found.unit == ("mm" if "/m" in unit else "°")
    assert found.low < found.value < found.high


def test_an_end_that_is_open_is_told_as_open() -> None:
    shape = {"shape": "tangent"}
    growth = Estimate("growth@L4L5@s01", 17.68, "1/rad^2", (16.2, 19.1))
    found = quantity("nonlinear_stiffening", shape, growth)
    assert found.place == "L4L5, s01"
    told = "stiffness doubles at (L4L5, s01)"
    assert found.words == f"{told} 10.7° (95 % interval 10.3 to 11.2)"
    assert found.in_brackets == "10.7 [10.3, 11.2]"
    some = quantity(
        "nonlinear_stiffening", shape, replace(growth, ci95=(None, 19.1), open_below=True)
    )
    assert some.words == f"{told}: at least 10.3° (95 %, no upper end)"
    assert some.in_brackets == "at least 10.3, no upper end"
    much = quantity(
        "nonlinear_stiffening", shape, replace(growth, ci95=(16.2, None), open_above=True)
    )
    assert much.words == f"{told}: at most 11.2° (95 %, no lower end)"
    assert much.in_brackets == "at most 11.2, no lower end"


def test_what_no_reading_tells_is_told_without_its_value() -> None:
    width = Estimate("width", 3.1, "deg", (None, None), False, True, True, False)
    found = quantity("neutral_zone", {}, width)
    assert found.words == "half width: not told by these tests"
    assert "3.1" not in found.words + found.in_brackets
    wide = replace(width, ci95=(2.8, None), open_below=False)
    assert quantity("neutral_zone", {}, wide).words == (
        "half width: at least 2.80° (95 %, no upper end)"
    )


def test_a_value_at_its_bound_is_told_as_that() -> None:
    ended = Estimate("gap", 28.6, "deg", (26.0, 28.6), at_bound=True)
    found = quantity("facet_contact", {}, ended)
    assert found.words == "gap 28.6°, at its bound"
    assert found.in_brackets == "28.6, at its bound"


def test_an_asymmetry_is_the_ratio_of_its_two_sides() -> None:
    found = told(ASYMMETRY, "asymmetry", 0.2, "1", coordinate="extension")
    assert found.words.startswith("stiffness in extension over that in flexion 1.50")
    assert found.low < 1.5 < found.high
    shear = told(ASYMMETRY, "asymmetry", -0.2, "1", coordinate="anterior")
    assert "anterior translation over that in posterior translation 0.667" in shear.words


def test_what_is_not_known_keeps_its_name_and_unit() -> None:
    assert told("brand_new", "rate_of_it", 2.0, "furlong").words.startswith(
        "rate of it 2.00 furlong"
    )
    assert told("nonlinear_stiffening", "other", 2.0, "1/rad", shape="new").unit == "1/°"


def test_estimates_of_what_was_tried_are_in_the_same_units() -> None:
    value, unit = estimate("nonlinear_stiffening", {"shape": "tangent"}, 17.68, "1/rad^2")
    assert value == pytest.approx(10.7, abs=0.02)
    assert unit == "° (stiffness doubles at)"
    assert estimate("facet_contact", {}, 57.29578, "N m/rad") == (pytest.approx(1.0), "N m/°")
    value, unit = estimate("creep", {}, float("nan"), "1")
    assert np.isnan(value)
    assert unit == ""
