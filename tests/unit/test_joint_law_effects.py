"""Joint laws: loads worked by hand, and what the laws declare.

Catches a law whose load, sign or declared parameter is not the published one.
"""

import numpy as np
import pytest
from joint_law_cases import DEFAULT, EVERY, law_of
from sweeps import sweep

from spinepipe.effects import EffectKind, JointLaw, PlaceSpread, create, registered
from spinepipe.units import COORDINATES


def column(coordinate: str) -> int:
    return COORDINATES.index(coordinate)


def added(law: JointLaw, coordinate: str, q: float, carried: float, *values: float) -> float:
    """Load a law adds on one coordinate when all else is zero."""
    place, load = np.zeros((2, 1, 6))
    place[0, column(coordinate)], load[0, column(coordinate)] = q, carried
    response = law.respond(place, np.array([values]), load)
    found = np.delete(response.load, column(coordinate))
    np.testing.assert_array_equal(found, 0.0)
    return float(response.load[0, column(coordinate)])


def of_a_spring(law: JointLaw, q: float, *values: float, k: float = 50.0) -> float:
    """Total load in extension of a linear spring under the law."""
    return k * q + added(law, "extension", q, k * q, *values)


# Loads worked by hand


def test_exponential_of_a_spring() -> None:
    law = law_of(("nonlinear_stiffening", {"shape": "exponential"}))
    e = 2.718281828459045
    # |q| is rounded over 1e-4 rad: 5e-7 of 0.1 rad
    assert of_a_spring(law, 0.1, 10.0) == pytest.approx(50 * (e - 1) / 10, rel=2e-6)
    assert of_a_spring(law, -0.1, 10.0) == pytest.approx(-50 * (e - 1) / 10, rel=2e-6)
    # straight on beyond an exponent of 10
    straight = 50 * (e**10 - 1 + 5 * e**10) / 50
    assert of_a_spring(law, 0.3, 50.0) == pytest.approx(straight, rel=2e-6)


def test_tangent_of_a_spring() -> None:
    law = law_of(("nonlinear_stiffening", {"shape": "tangent"}))
    assert of_a_spring(law, 0.1, 100.0) == pytest.approx(5 * np.tan(1.0), rel=1e-14)
    assert of_a_spring(law, -0.1, 100.0) == pytest.approx(-5 * np.tan(1.0), rel=1e-14)
    assert of_a_spring(law, 2e-3, 100.0) == pytest.approx(5 * np.tan(0.02), rel=1e-14)
    straight = 5 * (np.tan(1.4) + 0.6 / np.cos(1.4) ** 2)
    assert of_a_spring(law, 0.2, 100.0) == pytest.approx(straight, rel=1e-14)


def test_a_spring_with_a_neutral_zone() -> None:
    law = law_of(("neutral_zone", {}))
    corner = (0.3, 0.02, 50.0)  # far from a corner its sharpness says nothing: 0.5^50
    assert of_a_spring(law, 0.01, *corner) == pytest.approx(0.15)
    assert of_a_spring(law, -0.01, *corner) == pytest.approx(-0.15)
    # parallel to 50 q, lower by the 0.7 * 50 * 0.02 that the zone has not held
    assert of_a_spring(law, 0.1, *corner) == pytest.approx(5.0 - 0.7)
    assert of_a_spring(law, -0.2, *corner) == pytest.approx(-10.0 + 0.7)
    # n = 2: u / sqrt(1 + u^2)
    assert of_a_spring(law, 0.02, 0.3, 0.02, 2.0) == pytest.approx(1.0 - 0.7 / np.sqrt(2.0))
    assert of_a_spring(law, 0.04, 0.3, 0.02, 2.0) == pytest.approx(2.0 - 0.7 * 2.0 / np.sqrt(5.0))


def test_a_zone_beside_the_neutral_pose() -> None:
    """From -0.01 to 0.03: 15 N m/rad in it, 50 beyond, and no load at rest."""
    law = law_of(("neutral_zone", {"zone": "off_centre"}))
    values = (0.3, 0.02, 50.0, 0.5)
    assert of_a_spring(law, 0.0, *values) == 0.0
    assert of_a_spring(law, 0.01, *values) == pytest.approx(0.15, rel=1e-6)
    assert of_a_spring(law, 0.1, *values) == pytest.approx(15 * 0.03 + 50 * 0.07, rel=1e-6)
    assert of_a_spring(law, -0.1, *values) == pytest.approx(-15 * 0.01 - 50 * 0.09, rel=1e-6)
    mirrored = of_a_spring(law, -0.1, 0.3, 0.02, 50.0, -0.5)
    assert mirrored == pytest.approx(-of_a_spring(law, 0.1, *values), rel=1e-12)
    # at rest its slope is that of u / sqrt(1 + u^2) at half a width
    at_rest = of_a_spring(law, 1e-9, 0.3, 0.02, 2.0, 0.5) / 1e-9
    assert at_rest == pytest.approx(50.0 * (1.0 - 0.7 * 1.25**-1.5), rel=1e-6)


def test_a_spring_with_a_break() -> None:
    law = law_of(("nonlinear_stiffening", {"shape": "bilinear"}))
    assert of_a_spring(law, 0.06, 1.5, 0.08) == pytest.approx(3.0)
    assert of_a_spring(law, 0.1, 1.5, 0.08) == pytest.approx(4.0 + 0.02 * 125.0)
    assert of_a_spring(law, -0.2, 1.5, 0.08) == pytest.approx(-4.0 - 0.12 * 125.0)
    # the corner is cut by a quarter of a tenth of the break
    assert of_a_spring(law, 0.08, 1.5, 0.08) == pytest.approx(4.0 + 75.0 * 0.0020)


@sweep(
    "coordinate, widest_deg", [("extension", 7.5), ("right_bending", 7.5), ("left_rotation", 2.5)]
)
def test_a_neutral_zone_is_no_wider_than_five_usual_ones(
    coordinate: str, widest_deg: float
) -> None:
    """Wider, all motion would lie inside: a softer joint by another name."""
    _, width, _ = create("neutral_zone", {"coordinate": coordinate}).parameters
    assert np.rad2deg(width.high) == pytest.approx(widest_deg)
    assert np.rad2deg(width.default) == pytest.approx(widest_deg / 5.0)


def test_a_spring_that_is_stiffer_to_one_side() -> None:
    law = law_of(("flexion_extension_asymmetry", {}))
    assert of_a_spring(law, 0.1, 0.2) == pytest.approx(6.0)
    assert of_a_spring(law, -0.1, 0.2) == pytest.approx(-4.0)
    assert of_a_spring(law, 0.1, -0.2) == pytest.approx(4.0)
    assert of_a_spring(law, 0.0, 0.2) == 0.0


def test_a_stop_beyond_a_gap() -> None:
    law = law_of(("facet_contact", {"side": "positive"}))
    stop = (100.0, 0.05, 1.0)
    assert added(law, "extension", 0.1, 3.0, *stop) == pytest.approx(5.0)
    assert added(law, "extension", 0.045, 3.0, *stop) == 0.0
    assert added(law, "extension", -0.1, 3.0, *stop) == 0.0
    # a parabola over 3.5 mrad to each side: a quarter of that at the gap
    assert added(law, "extension", 0.05, 3.0, *stop) == pytest.approx(0.0875)
    other = law_of(("facet_contact", {"side": "negative"}))
    assert added(other, "extension", -0.1, 3.0, *stop) == pytest.approx(-5.0)
    assert added(other, "extension", 0.1, 3.0, *stop) == 0.0


@sweep("exponent", [1.0, 1.5, 3.0])
def test_stops_of_any_exponent_meet_two_degrees_beyond_the_gap(exponent: float) -> None:
    law = law_of(("facet_contact", {"side": "positive"}))
    two = np.deg2rad(2.0)
    found = added(law, "extension", 0.05 + two, 3.0, 100.0, 0.05, exponent)
    assert found == pytest.approx(100.0 * two)
    twice = added(law, "extension", 0.05 + 2.0 * two, 3.0, 100.0, 0.05, exponent)
    assert twice == pytest.approx(100.0 * two * 2.0**exponent)


def test_a_level_of_another_stiffness_and_a_lax_one() -> None:
    assert of_a_spring(law_of(("level_dependence", {})), 0.1, 1.3) == pytest.approx(6.5)
    assert of_a_spring(law_of(("local_laxity", {})), 0.1, 0.3) == pytest.approx(3.5)


@sweep(
    "name, value, share",
    [
        ("level_dependence", 1.3, 0.3),
        ("local_laxity", 0.3, -0.3),
        ("preload_stiffening", 1e-3, 0.4),
    ],
)
def test_all_rotations_at_once(name: str, value: float, share: float) -> None:
    carried = np.array([[7.0, -400.0, 9.0, 5.0, -3.0, 2.0]])
    law = law_of((name, {"coordinate": "rotations"}))
    found = law.respond(np.zeros((1, 6)), np.array([[value]]), carried).load
    expected = share * np.array([[0.0, 0.0, 0.0, 5.0, -3.0, 2.0]])
    np.testing.assert_allclose(found, expected, rtol=1e-14)


@sweep("name", ["level_dependence", "local_laxity"])
def test_all_coordinates_at_once(name: str) -> None:
    carried = np.array([[7.0, -400.0, 9.0, 5.0, -3.0, 2.0]])
    law = law_of((name, {"coordinate": "all"}))
    found = law.respond(np.zeros((1, 6)), np.array([[0.25]]), carried).load
    share = -0.75 if name == "level_dependence" else -0.25
    np.testing.assert_allclose(found, share * carried, rtol=1e-14)


def test_compression_stiffens_and_traction_softens() -> None:
    law = law_of(("preload_stiffening", {}))
    for superior, expected in ((-400.0, 2.0), (0.0, 0.0), (400.0, -2.0)):
        carried = np.array([[0.0, superior, 0.0, 5.0, 3.0, 0.0]])
        found = law.respond(np.zeros((1, 6)), np.array([[1e-3]]), carried).load
        np.testing.assert_allclose(found, [[0.0, 0.0, 0.0, expected, 0.0, 0.0]], rtol=1e-14)


def test_coupling_loads_each_by_the_other() -> None:
    q = np.array([[1e-3, 2e-3, 3e-3, 0.3, 0.1, 0.02]])
    response = law_of(("bending_rotation_coupling", {})).respond(q, np.array([[15.0]]), 0 * q)
    np.testing.assert_allclose(response.load, [[0.0, 0.0, 0.0, 0.0, 0.3, 1.5]], rtol=1e-14)
    assert response.by_carried is None


@sweep("shape", ["exponential", "tangent"])
def test_steepest_laws_stay_finite_and_rising_far_out(shape: str) -> None:
    """Newton may ask for a whole turn on its way."""
    law = create("nonlinear_stiffening", {"shape": shape})
    q = np.zeros((200, 6))
    q[:, 3] = np.linspace(-7.0, 7.0, 200)
    values = np.full((200, 1), law.parameters[0].high)
    response = law.respond(q, values, 50.0 * q)
    total = 50.0 * q[:, 3] + response.load[:, 3]
    assert np.isfinite(law.by_parameter(q, values, 50.0 * q)).all()
    assert (np.diff(total) > 0.0).all()


# Declarations


@DEFAULT
def test_what_a_search_may_try(name: str) -> None:
    trial = registered()[name].trial
    made = [create(name, options) for options in trial.variants]
    assert len(set(made)) == len(made)
    assert {law.kind for law in made} == {EffectKind.JOINT_LAW}
    assert trial.told_by
    only = {"level_dependence": (PlaceSpread.BY_JOINT,), "local_laxity": (PlaceSpread.ONE,)}
    assert trial.spreads == only.get(
        name, tuple(s for s in PlaceSpread if s is not PlaceSpread.BY_TEST)
    )
    places = {o.get("coordinate", o.get("pair")) for o in trial.variants} - {"rotations", "all"}
    if name == "bending_rotation_coupling":
        assert {frozenset(pair) for pair in places} == {
            frozenset((a, b)) for a in COORDINATES for b in COORDINATES if a != b
        }
    else:
        lost = {"superior"} if name == "preload_stiffening" else set()
        assert places == set(COORDINATES) - lost


@EVERY
def test_declared_numbers_make_sense(variant) -> None:
    for parameter in law_of(variant).parameters:
        assert parameter.low <= parameter.default <= parameter.high
        if parameter.off is not None:
            assert parameter.low <= parameter.off <= parameter.high
            assert parameter.off != parameter.default
            assert not parameter.logarithmic or parameter.off == 1.0


@sweep(
    "name, options, message",
    [
        (
            "nonlinear_stiffening",
            {"shape": "square"},
            "shape 'square' is not one of exponential, tan",
        ),
        (
            "nonlinear_stiffening",
            {"coordinate": "flexion"},
            "coordinate 'flexion' is not one of ante",
        ),
        ("neutral_zone", {"coordinate": "rotations"}, "'rotations' is not one of"),
        ("flexion_extension_asymmetry", {"coordinate": ""}, "'' is not one of"),
        ("bending_rotation_coupling", {"pair": ["extension"]}, "is not two coordinates"),
        ("bending_rotation_coupling", {"pair": ["right", "right"]}, "is not two coordinates"),
        (
            "bending_rotation_coupling",
            {"pair": ["anterior", "superior", "right"]},
            "is not two coordinates",
        ),
        ("bending_rotation_coupling", {"pair": ["right", "left"]}, "pair 'left' is not one of"),
        ("facet_contact", {"side": "left"}, "side 'left' is not one of positive, negative"),
        ("facet_contact", {"coordinate": "x"}, "coordinate 'x' is not one of"),
        ("level_dependence", {"coordinate": "twist"}, "is not one of anterior, .*, rotations, all"),
        ("local_laxity", {"coordinate": "twist"}, "is not one of anterior, .*, rotations, all"),
        (
            "preload_stiffening",
            {"coordinate": "superior"},
            "is not one of anterior, right, .*, rotations",
        ),
    ],
)
def test_an_impossible_option_is_refused(name: str, options: dict, message: str) -> None:
    with pytest.raises(ValueError, match=f"{name}: .*{message}"):
        create(name, options)


def test_a_pair_may_come_as_a_list() -> None:
    made = create("bending_rotation_coupling", {"pair": ["right_bending", "left_rotation"]})
    assert made == create("bending_rotation_coupling")
