"""What effects declare for each coordinate, in the units that people use: sizes and bounds.

Pages of `docs/effects.md` hold what they declare for the coordinate that they take by default.

Catches a size or bound that means another unit than the page says.
"""

from typing import Any

import numpy as np
import pytest
from sweeps import sweep

from spinepipe.effects import EffectKind, PlaceSpread, create, registered
from spinepipe.effects.contract import Parameter
from spinepipe.units import COORDINATES, ROTATIONS, TRANSLATIONS

PER = {"mm": 1e-3, "deg": float(np.deg2rad(1.0)), "1": 1.0}
SHIFT, TURN = {"coordinate": "anterior"}, {"coordinate": "extension"}


def parameter(effect: str, options: dict[str, Any], name: str) -> Parameter:
    (found,) = (one for one in create(effect, options).parameters if one.name == name)
    return found


SIZES: list[tuple[str, dict[str, Any], str, str, str, float, float, float, float]] = [
    # a joint's stop: 0.5 mm in shear, 0.3 mm in compression, then as stiff as the joint itself
    ("facet_contact", SHIFT, "gap", "mm", "m", 0.0, 0.5, 20.0, 0.25),
    ("facet_contact", {"coordinate": "superior"}, "gap", "mm", "m", 0.0, 0.3, 20.0, 0.15),
    ("facet_contact", {"coordinate": "right"}, "gap", "mm", "m", 0.0, 0.5, 20.0, 0.25),
    ("facet_contact", SHIFT, "stiffness", "1", "N/m", 0.0, 1e5, 1e10, 1e5),
    ("facet_contact", {"coordinate": "superior"}, "stiffness", "1", "N/m", 0.0, 5e5, 1e10, 5e5),
    ("facet_contact", {"coordinate": "right"}, "stiffness", "1", "N/m", 0.0, 1e5, 1e10, 1e5),
    # facets stop axial rotation within 1 to 2 deg (Adams and Hutton 1981)
    ("facet_contact", {"coordinate": "right_bending"}, "gap", "deg", "rad", 0.0, 2.0, 28.6479, 1.0),
    ("facet_contact", {"coordinate": "left_rotation"}, "gap", "deg", "rad", 0.0, 1.0, 28.6479, 0.5),
    *(
        ("facet_contact", {"coordinate": c}, "stiffness", "1", "N m/rad", 0.0, k, 1e6, k)
        for c, k in (("extension", 50.0), ("right_bending", 70.0), ("left_rotation", 290.0))
    ),
    ("facet_contact", SHIFT, "exponent", "1", "1", 1.0, 1.25, 4.0, 0.3),
    # friction of 20 to 30 N that yields in 0.1 to 0.2 mm
    ("hysteresis", SHIFT, "force", "1", "N", 0.0, 20.0, 2000.0, 20.0),
    ("hysteresis", {"coordinate": "superior"}, "force", "1", "N", 0.0, 30.0, 2000.0, 30.0),
    ("hysteresis", {"coordinate": "right"}, "force", "1", "N", 0.0, 20.0, 2000.0, 20.0),
    *(
        ("hysteresis", {"coordinate": c}, "yield_distance", "mm", "m", 1e-3, mm, 20.0, 0.7e3)
        for c, mm in (("anterior", 0.2), ("superior", 0.1), ("right", 0.2))
    ),
    ("hysteresis", TURN, "yield_angle", "deg", "rad", 0.05, 1.0, 20.0, np.rad2deg(0.7)),
    ("hysteresis", {"law": "jenkins"}, "spread", "1", "1", 0.0, 0.7, 2.5, 0.5),
    # zones of 0.3 to 0.6 mm in all, up to 20 mm to each side
    *(
        ("neutral_zone", {"coordinate": c}, "width", "mm", "m", 1e-3, mm, 20.0, 0.7e3)
        for c, mm in (("anterior", 0.3), ("superior", 0.15), ("right", 0.3))
    ),
    ("neutral_zone", {"zone": "off_centre"}, "offset", "1", "1", -0.8, 0.0, 0.8, 0.4),
    ("neutral_zone", TURN, "sharpness", "1", "1", 2.0, 12.0, 50.0, 0.6),
    # half as stiff again at 1 to 2 mm; half a decade more at 7 deg; twice the resistance at 8 deg
    ("nonlinear_stiffening", SHIFT, "rate", "1", "1/m", 0.0, 500.0, 5e4, 500.0),
    *(
        (
            "nonlinear_stiffening",
            {**where, "shape": shape},
            "growth",
            "1",
            unit,
            0.0,
            usual,
            most,
            usual,
        )
        for where, shape, unit, usual, most in (
            (TURN, "tangent", "1/rad^2", 75.0, 5e3),
            (TURN, "cubic", "1/rad^2", 50.0, 1e5),
            (SHIFT, "tangent", "1/m^2", 5e5, 5e9),
            (SHIFT, "cubic", "1/m^2", 2e5, 1e10),
        )
    ),
    *(
        (
            *("nonlinear_stiffening", {"coordinate": c, "shape": "bilinear"}, "break_at"),
            *(people, si, least, usual, most, 0.4 / PER[people]),
        )
        for c, people, si, least, usual, most in (
            ("extension", "deg", "rad", 3.0, 4.0, np.rad2deg(0.5)),
            ("right_bending", "deg", "rad", 3.0, 4.0, np.rad2deg(0.5)),
            ("left_rotation", "deg", "rad", 1.0, 1.5, np.rad2deg(0.5)),
            ("anterior", "mm", "m", 0.6, 1.5, 30.0),
            ("superior", "mm", "m", 0.3, 0.6, 30.0),
            ("right", "mm", "m", 0.6, 1.5, 30.0),
        )
    ),
    ("nonlinear_stiffening", {"shape": "bilinear"}, "gain", "1", "1", 0.0, 1.0, 1e4, 1.0),
    # a fifth of the stiffness in lateral bending; no, one or two translations in the pair
    *(
        (
            "bending_rotation_coupling",
            {"pair": pair},
            "coupling",
            "1",
            unit,
            -most,
            usual,
            most,
            usual,
        )
        for pair, unit, usual, most in (
            (("right_bending", "left_rotation"), "N m/rad", 15.0, 1e4),
            (("right", "left_rotation"), "N/rad", 1e3, 1e7),
            (("right", "superior"), "N/m", 3e4, 1e9),
        )
    ),
    # readings drift by 0.3 mm or 0.3 deg, and slip by 1 mm or 2 deg at most
    ("neutral_pose_drift", SHIFT, "drift", "mm", "m", -10.0, 0.3, 10.0, 0.3),
    (
        "neutral_pose_drift",
        TURN,
        "drift",
        "deg",
        "rad",
        -np.rad2deg(0.2),
        0.3,
        np.rad2deg(0.2),
        0.3,
    ),
    ("neutral_pose_drift", TURN, "pace", "1", "1", 0.05, 1.0, 20.0, 1.5),
    ("soft_tissue_artefact", SHIFT, "reach", "mm", "m", 0.1, 1.0, 5.0, 0.7e3),
    ("soft_tissue_artefact", TURN, "reach", "deg", "rad", 0.1, 2.0, 8.0, np.rad2deg(0.7)),
    ("soft_tissue_artefact", TURN, "share", "1", "1", 0.0, 0.3, 2.0, 0.3),
    ("marker_bias", {}, "anterior", "mm", "m", -20.0, 2.0, 20.0, 2.0),
    ("marker_bias", {}, "left_rotation", "deg", "rad", -20.0, 2.0, 20.0, 2.0),
    ("marker_bias", {"form": "tilt"}, "tilt_extension", "deg", "rad", -28.6479, 2.0, 28.6479, 2.0),
    ("axes_tilt", {}, "tilt_left_rotation", "deg", "rad", -28.6479, 3.0, 28.6479, 3.0),
    # unlisted loads and how they point
    ("load_offset", {}, "moment_x", "1", "N m", -10.0, 0.3, 10.0, 0.3),
    ("load_offset", {"applies": "force"}, "force_right", "1", "N", -200.0, 5.0, 200.0, 5.0),
    ("load_offset", {"coordinate": "superior"}, "force", "1", "N", -200.0, 5.0, 200.0, 5.0),
    ("load_misalignment", {}, "tilt_2", "deg", "rad", -28.6479, 3.0, 28.6479, 3.0),
    ("load_misalignment", {"turns": "wrench"}, "tilt_z", "deg", "rad", -28.6479, 3.0, 28.6479, 3.0),
    # a lumbar joint's law of two exponentials, and of a translation that hardly stiffens
    ("two_sided_exponential", TURN, "stiffness", "1", "N m/rad", 0.0, 27.0, 1e9, 27.0),
    ("two_sided_exponential", TURN, "positive_rate", "1", "1/rad", 0.0, 10.0, 1e3, 10.0),
    ("two_sided_exponential", SHIFT, "stiffness", "1", "N/m", 0.0, 1e5, 1e9, 1e5),
    ("two_sided_exponential", SHIFT, "negative_rate", "1", "1/m", 0.0, 100.0, 1e5, 100.0),
    # springs: three decades beyond what is published for any level
    ("linear_bushing", {}, "anterior_n_per_m", "1", "N/m", 1.0, 1e5, 1e10, 1.0),
    ("linear_bushing", {}, "extension_nm_per_rad", "1", "N m/rad", 1e-4, 50.0, 1e7, 1.0),
]


@sweep("row", SIZES, lambda row: "-".join(map(str, (row[0], row[1], row[2]))))
def test_sizes_and_bounds(row: tuple[Any, ...]) -> None:
    effect, options, name, people, si, low, usual, high, sd = row
    found = parameter(effect, options, name)
    expected = PER[people] * np.array([low, usual, high, sd])
    told = [found.low, found.default, found.high, found.prior_scale]
    np.testing.assert_allclose(told, expected, rtol=1e-5)
    assert found.unit == si


@sweep(
    "coordinate, of, usual, unit",
    [
        ("extension", ("extension", "extension"), 500.0, "N m/rad^2"),  # 5 N m at 6 deg
        ("anterior", ("extension",), 1000.0, "N/rad"),
        ("extension", ("anterior", "anterior", "right_bending"), 5e7, "N m/(m^2 rad)"),
        ("right", ("right", "right", "right"), 1e11, "N/m^3"),  # 100 N at 1 mm
    ],
)
def test_a_power_term_is_as_large_as_its_motions_make_it(
    coordinate: str, of: tuple[str, ...], usual: float, unit: str
) -> None:
    """Where a joint has moved 0.1 rad and 1 mm the load is 5 N m or 100 N."""
    found = parameter("power_term", {"coordinate": coordinate, "of": of}, "coefficient")
    told = [found.low, found.default, found.high, found.prior_scale]
    np.testing.assert_allclose(told, [-1e4 * usual, 0.0, 1e4 * usual, usual], rtol=1e-12)
    assert found.unit == unit


@sweep(
    "coordinate, over, usual, unit",
    [
        ("extension", "itself", 50.0, "N m/rad"),
        ("anterior", "itself", 1e5, "N/m"),
        ("anterior", "extension", 1e3, "N/rad"),
        ("extension", "superior", 5e3, "N m/m"),
    ],
)
def test_a_table_has_stretches_of_any_sign(
    coordinate: str, over: str, usual: float, unit: str
) -> None:
    """5 N m or 100 N over 0.1 rad or 1 mm; a fifth of that is one SD."""
    law = create("tabulated_law", {"coordinate": coordinate, "over": over})
    for one in law.parameters:
        told = [one.low, one.default, one.high, one.prior_scale]
        np.testing.assert_allclose(told, [-1e4 * usual, 0.0, 1e4 * usual, 0.2 * usual], rtol=1e-12)
        assert (one.unit, one.off, one.logarithmic) == (unit, 0.0, False)
    names = [one.name.removeprefix("stiffness_") for one in law.parameters]
    assert names[:4] == ["minus_100", "minus_75", "minus_50", "minus_25"]
    assert names[4:] == ["plus_25", "plus_50", "plus_75", "plus_100"]
    assert law.parameters[4].meaning.endswith("0 to 25 % of the reach")


@sweep("coordinate, most", [("extension", 1.0), ("right", 0.01)])
def test_a_table_reaches_ten_usual_reaches_at_most(coordinate: str, most: float) -> None:
    assert create("tabulated_law", {"coordinate": coordinate, "reach": most}).furthest == most  # type: ignore[attr-defined]
    for reach in (1.001 * most, -0.001):
        with pytest.raises(ValueError, match=f"within 0 to {most:g}"):
            create("tabulated_law", {"coordinate": coordinate, "reach": reach})


LOGARITHMIC = {
    *("exponent", "yield_distance", "yield_angle", "width", "sharpness", "break_at", "pace"),
    *("reach", "time", "ratio"),
}
"""Positive and spread over decades, besides the springs' stiffness."""

SHAPES = {
    # name: (tried at these SDs, a family of forms, what a file means that does not name it)
    ("creep", "time"): ((-1.0, 0.0, 1.0), False, None),
    ("creep", "spread"): ((0.0,), True, 0.0),
    ("facet_contact", "gap"): ((-1.0, 0.0, 1.0), False, None),
    ("facet_contact", "exponent"): ((0.0,), True, 1.0),
    ("follower_load", "anterior"): ((-1.0, 0.0, 1.0), False, None),
    ("hysteresis", "yield_angle"): ((-1.0, 0.0, 1.0), False, None),
    ("neutral_pose_drift", "pace"): ((-1.0, 0.0, 1.0), True, None),
    ("neutral_zone", "width"): ((-1.0, 0.0, 1.0), False, None),
    ("neutral_zone", "sharpness"): ((0.0,), True, 30.0),
    ("soft_tissue_artefact", "reach"): ((-1.0, 0.0, 1.0), False, None),
    ("bounded_tangent", "lower_end"): ((-1.0, 0.0, 1.0), False, None),
    ("bounded_tangent", "upper_end"): ((-1.0, 0.0, 1.0), False, None),
    ("two_sided_exponential", "positive_rate"): ((-1.0, 0.0, 1.0), False, None),
    ("two_sided_exponential", "negative_rate"): ((-1.0, 0.0, 1.0), False, None),
}
"""All parameters that say nothing while the strengths are off."""


def test_shapes_are_tried_and_read_as_told() -> None:
    found = {
        (name, one.name): (one.tried, one.family, one.unsaid)
        for name, cls in registered().items()
        if not name.endswith("_for_a_test") and name != "linear_bushing"
        for one in cls().parameters
        if one.off is None
    }
    assert found == SHAPES
    for (name, shape), (_, _, unsaid) in SHAPES.items():
        one = parameter(name, {}, shape)
        assert one.in_a_file == (one.default if unsaid is None else unsaid)


def test_what_options_change_in_how_shapes_are_tried() -> None:
    beside = {"zone": "off_centre"}
    assert parameter("neutral_zone", beside, "width").tried == (0.0,)
    assert parameter("neutral_zone", beside, "offset").tried == (-1.0, 1.0)
    assert parameter("hysteresis", {"law": "jenkins"}, "yield_angle").tried == (0.0,)
    assert parameter("hysteresis", {"law": "jenkins", **SHIFT}, "yield_distance").tried == (0.0,)
    spread = parameter("hysteresis", {"law": "jenkins"}, "spread")
    assert (spread.tried, spread.family, spread.off) == ((0.0,), True, None)
    bent = parameter("nonlinear_stiffening", {"shape": "bilinear"}, "break_at")
    assert (bent.tried, bent.off) == ((-1.0, 1.0), None)


def variants() -> list[tuple[str, dict[str, Any]]]:
    """Every effect with its default options and in each variant that a search tries."""
    return [
        (name, dict(options))
        for name, cls in registered().items()
        for options in ({}, *(cls.trial.variants if hasattr(cls, "trial") else ()))
        if not name.endswith("_for_a_test")
    ]


def test_decades_are_fitted_by_their_logarithm() -> None:
    for name, options in variants():
        for one in create(name, options).parameters:
            shown = name == "linear_bushing" or one.name in LOGARITHMIC
            assert one.logarithmic == shown, f"{name} {one.name}"


def test_strengths_are_off_at_nothing_or_at_all_of_it() -> None:
    for name, options in variants():
        for one in create(name, options).parameters:
            if one.off is not None:
                whole = (name, one.name) in {
                    ("neutral_zone", "stiffness_ratio"),
                    ("level_dependence", "ratio"),
                }
                assert one.off == (1.0 if whole else 0.0), f"{name} {one.name}"


@sweep(
    "low, high, off, side",
    [(0.0, 1.0, 0.0, 1.0), (-1.0, 0.0, 0.0, -1.0), (-1.0, 1.0, 0.0, 0.0), (2.0, 3.0, None, 0.0)],
)
def test_a_strength_has_the_side_that_its_bounds_leave(
    low: float, high: float, off: float | None, side: float
) -> None:
    assert Parameter("a", "1", low, high, low, 1.0, False, "of a test", off=off).side == side


def test_what_stays_of_one_joint_may_differ_in_every_way() -> None:
    every = tuple(one for one in PlaceSpread if one is not PlaceSpread.BY_TEST)
    for name in ("creep", "hysteresis", "neutral_pose_drift"):
        assert registered()[name].trial.spreads == every
    skin = registered()["soft_tissue_artefact"].trial
    assert skin.spreads == (PlaceSpread.SHARED, PlaceSpread.BY_SPECIMEN)
    both = {(one["coordinate"], one["neighbour"]) for one in skin.variants}
    assert both == {(c, n) for c in COORDINATES for n in ("above", "below")}


def test_loads_of_a_specimen_are_tried_once_for_all_joints() -> None:
    loads = [name for name, cls in registered().items() if cls.kind is EffectKind.LOAD]
    assert all(not registered()[name].per_joint for name in loads if "_for_a_test" not in name)
    offset = registered()["load_offset"].trial.variants
    assert {one.get("coordinate") for one in offset} == {None, *TRANSLATIONS}
    assert {one.get("applies", "moment") for one in offset} == {"moment", "force"}
    assert len(offset) == 2 + len(TRANSLATIONS)
    friction = registered()["hysteresis"].trial.variants
    assert len(friction) == 2 * (len(TRANSLATIONS) + len(ROTATIONS))
