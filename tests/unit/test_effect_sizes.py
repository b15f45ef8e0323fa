"""Sizes, bounds and trials that effects declare, in every variant that a search tries.

A search's verdicts hang on each of these numbers, and model files on what they mean where they do
not name one. Those of the default options stand in docs/effects.md; the others are entered again.

Catches a number that an effect declares and that was changed by mistake.
"""

from collections.abc import Iterator
from dataclasses import FrozenInstanceError, replace
from typing import Any

import numpy as np
import pytest
from sweeps import sweep

from spinepipe.effects import Parameter, create, registered
from spinepipe.units import COORDINATES, ROTATIONS, TRANSLATIONS

UNITS = ("1", "m", "rad", "s", "kg", "N", "N m", "N/m", "N/rad", "N m/rad", "1/N", "m/rad")
POWERS = ("1/rad", "1/m", "1/rad^2", "1/m^2", "N m/rad^2")

DEG, MM = float(np.deg2rad(1.0)), 1e-3


def variants() -> Iterator[tuple[str, dict[str, Any]]]:
    """Every effect by itself, and in every way that a search tries it."""
    for name, cls in registered().items():
        yield name, {}
        trial = getattr(cls, "trial", None)
        for options in trial.variants if trial else ():
            yield name, dict(options)


EVERY = sweep("name, options", variants)


def of(name: str, **options: Any) -> dict[str, Parameter]:
    return {parameter.name: parameter for parameter in create(name, options).parameters}


@EVERY
def test_declared_numbers_make_sense_together(name: str, options: dict[str, Any]) -> None:
    for one in create(name, options).parameters:
        assert one.unit in UNITS + POWERS
        assert np.isfinite([one.low, one.high, one.default, one.prior_scale]).all()
        assert one.low <= one.default <= one.high
        assert one.low <= one.in_a_file <= one.high
        assert one.low < one.high
        # bounds that leave a prior room: an SD to one side at least
        at, low, high = (one.default, one.low, one.high)
        if one.logarithmic:
            assert low > 0.0
            at, low, high = np.log([at, low, high])
        assert 0.0 < one.prior_scale <= max(high - at, at - low)
        if one.off is not None:
            assert one.low <= one.off <= one.high
            assert not one.family
            assert one.unsaid is None
            # strengths of either sign are bounded alike
            assert one.side != 0.0 or one.logarithmic or one.low == -one.high
        tried = [at + times * one.prior_scale for times in one.tried]
        assert one.tried
        assert list(one.tried) == sorted(set(one.tried))
        if one.off is None and one.family:
            assert all(low <= value <= high for value in tried)


@EVERY
def test_an_effect_acts_at_its_usual_size_and_says_once_what_it_is(
    name: str, options: dict[str, Any]
) -> None:
    effect = create(name, options)
    names = [one.name for one in effect.parameters]
    assert len(set(names)) == len(names)
    strengths = [one for one in effect.parameters if one.off is not None]
    assert strengths or name == "linear_bushing"
    for one in strengths:
        usual = one.default if one.default != one.off else one.off + one.prior_scale
        assert one.low <= usual <= one.high
        # what a prior calls usual: not nothing, and no more than a few of its SDs
        away = abs(np.log(usual / one.off)) if one.logarithmic else abs(usual - one.off)
        assert 0.1 <= away / one.prior_scale <= 3.0
    with pytest.raises(FrozenInstanceError):
        effect.name = "another"  # type: ignore[misc]
    assert effect == create(name, options)
    assert hash(effect) == hash(create(name, options))


@EVERY
def test_translations_are_told_in_metres_and_rotations_in_radians(
    name: str, options: dict[str, Any]
) -> None:
    if options.get("coordinate") not in COORDINATES:
        return
    wrong = ("rad",) if options["coordinate"] in TRANSLATIONS else ("m", "N", "N/m", "1/m", "1/m^2")
    for one in create(name, options).parameters:
        assert one.unit.removeprefix("N m/") not in wrong


@sweep(
    "low, high, off, side",
    [
        (0.0, 2.0, 0.0, 1.0),
        (0.5, 2.0, 0.0, 1.0),
        (0.0, 1.0, 1.0, -1.0),
        (0.0, 0.5, 1.0, -1.0),
        (-1.0, 1.0, 0.0, 0.0),
        (0.1, 9.0, 1.0, 0.0),
        (0.0, 2.0, None, 0.0),
    ],
)
def test_bounds_tell_to_which_side_of_off_a_strength_may_go(
    low: float, high: float, off: float | None, side: float
) -> None:
    one = Parameter("strength", "1", low, high, high, 1.0, False, "made up", off=off)
    assert one.side == side
    assert one.in_a_file == high
    assert replace(one, unsaid=low).in_a_file == low


# Entered again: usual size and prior SD (of the logarithm where it is one), low, high


def told(one: Parameter) -> tuple[float, float, float, float]:
    return one.default, one.prior_scale, one.low, one.high


@sweep(
    "coordinate, gap, stiffness",
    [
        ("extension", 2.0 * DEG, 50.0),
        ("right_bending", 2.0 * DEG, 70.0),
        ("left_rotation", 1.0 * DEG, 290.0),
        ("anterior", 0.5 * MM, 1e5),
        ("superior", 0.3 * MM, 5e5),
        ("right", 0.5 * MM, 1e5),
    ],
)
def test_stops_of_facets(coordinate: str, gap: float, stiffness: float) -> None:
    """Gaps of Adams and Hutton 1981; as stiff as the joint itself (Gould 2024b Table 2)."""
    turns = coordinate in ROTATIONS
    for side in ("positive", "negative"):
        found = of("facet_contact", coordinate=coordinate, side=side)
        assert told(found["stiffness"]) == (stiffness, stiffness, 0.0, 1e6 if turns else 1e10)
        assert told(found["gap"]) == pytest.approx((gap, gap / 2, 0.0, 0.5 if turns else 0.02))
        assert told(found["exponent"]) == (1.25, 0.3, 1.0, 4.0)
        assert found["stiffness"].off == 0.0
        assert found["exponent"].in_a_file == 1.0  # a linear stop, as before there were others


@sweep(
    "coordinate, width",
    [
        ("extension", 1.5 * DEG),
        ("right_bending", 1.5 * DEG),
        ("left_rotation", 0.5 * DEG),
        ("anterior", 0.3 * MM),
        ("superior", 0.15 * MM),
        ("right", 0.3 * MM),
    ],
)
def test_neutral_zones(coordinate: str, width: float) -> None:
    """Yamamoto 1989: 1 to 2 deg in bending of either kind, less in axial rotation."""
    turns = coordinate in ROTATIONS
    ends = (1e-4, 5.0 * width) if turns else (1e-6, 0.02)
    for zone in ("centred", "off_centre"):
        found = of("neutral_zone", coordinate=coordinate, zone=zone)
        assert told(found["stiffness_ratio"]) == (0.3, 0.5, 0.0, 1.0)
        assert found["stiffness_ratio"].off == 1.0
        assert told(found["width"]) == pytest.approx((width, 0.7, *ends))
        assert found["width"].tried == ((-1.0, 0.0, 1.0) if zone == "centred" else (0.0,))
        assert told(found["sharpness"]) == (12.0, 0.6, 2.0, 50.0)
        assert found["sharpness"].in_a_file == 30.0  # a corner, as before there were others
    assert told(found["offset"]) == (0.0, 0.4, -0.8, 0.8)
    assert found["offset"].tried == (-1.0, 1.0)


@sweep(
    "coordinate, at, least",
    [
        ("extension", 4.0 * DEG, 3.0 * DEG),
        ("right_bending", 4.0 * DEG, 3.0 * DEG),
        ("left_rotation", 1.5 * DEG, 1.0 * DEG),
        ("anterior", 1.5 * MM, 0.6 * MM),
        ("superior", 0.6 * MM, 0.3 * MM),
        ("right", 1.5 * MM, 0.6 * MM),
    ],
)
def test_breaks_of_stiffening(coordinate: str, at: float, least: float) -> None:
    """A break within twice a usual neutral zone is that zone by another name."""
    found = of("nonlinear_stiffening", coordinate=coordinate, shape="bilinear")
    assert told(found["gain"]) == (1.0, 1.0, 0.0, 1e4)
    most = 0.5 if coordinate in ROTATIONS else 0.03
    assert told(found["break_at"]) == pytest.approx((at, 0.4, least, most))
    assert found["break_at"].tried == (-1.0, 1.0)
    width = of("neutral_zone", coordinate=coordinate)["width"].default
    assert least == pytest.approx(2.0 * width)


@sweep(
    "shape, name, turning, moving",
    [
        ("exponential", "rate", (10.0, 100.0), (5e2, 5e4)),
        ("tangent", "growth", (75.0, 5e3), (5e5, 5e9)),
        ("cubic", "growth", (50.0, 1e5), (2e5, 1e10)),
    ],
)
def test_how_fast_joints_stiffen(
    shape: str, name: str, turning: tuple[float, float], moving: tuple[float, float]
) -> None:
    for coordinate in COORDINATES:
        usual, most = turning if coordinate in ROTATIONS else moving
        found = of("nonlinear_stiffening", coordinate=coordinate, shape=shape)
        assert told(found[name]) == (usual, usual, 0.0, most)


def test_friction_of_joints() -> None:
    shifts = {"anterior": (20.0, 0.2), "superior": (30.0, 0.1), "right": (20.0, 0.2)}
    for law in ("dahl", "jenkins"):
        tried = (-1.0, 0.0, 1.0) if law == "dahl" else (0.0,)
        for coordinate in COORDINATES:
            found = of("hysteresis", coordinate=coordinate, law=law)
            if coordinate in TRANSLATIONS:
                newton, mm = shifts[coordinate]
                strength, motion = found["force"], found["yield_distance"]
                assert told(strength) == (newton, newton, 0.0, 2e3)
                assert told(motion) == pytest.approx((mm * MM, 0.7, 1e-6, 0.02))
            else:
                strength, motion = found["moment"], found["yield_angle"]
                assert told(strength) == (0.5, 0.5, 0.0, 20.0)
                assert told(motion) == pytest.approx((DEG, 0.7, 0.05 * DEG, 20.0 * DEG))
            assert (strength.off, motion.tried) == (0.0, tried)
    assert told(found["spread"]) == (0.7, 0.5, 0.0, 2.5)
    assert found["spread"].tried == (0.0,)


@sweep("number", range(3))
def test_coupling_by_how_many_of_the_pair_are_translations(number: int) -> None:
    """A fifth of the stiffness in lateral bending, and the like of forces."""
    unit, usual, most = (("N m/rad", 15.0, 1e4), ("N/rad", 1e3, 1e7), ("N/m", 3e4, 1e9))[number]
    pair = (*TRANSLATIONS[:number], *ROTATIONS)[:2]
    found = of("bending_rotation_coupling", pair=pair)["coupling"]
    assert (found.unit, *told(found)) == (unit, usual, usual, -most, most)


def test_skin_and_zero_of_readings() -> None:
    for coordinate in COORDINATES:
        turns = coordinate in ROTATIONS
        reach = (2.0 * DEG, 0.7, 0.1 * DEG, 8.0 * DEG) if turns else (MM, 0.7, 0.1 * MM, 5.0 * MM)
        for neighbour in ("above", "below"):
            skin = of("soft_tissue_artefact", coordinate=coordinate, neighbour=neighbour)
            assert told(skin["reach"]) == pytest.approx(reach)
            assert told(skin["share"]) == (0.3, 0.3, 0.0, 2.0)
        drift = of("neutral_pose_drift", coordinate=coordinate)
        usual, most = (0.3 * DEG, 0.2) if turns else (0.3 * MM, 0.01)
        assert told(drift["drift"]) == pytest.approx((usual, usual, -most, most))
        assert told(drift["pace"]) == (1.0, 1.5, 0.05, 20.0)


def test_tilts_and_constant_loads() -> None:
    for name, options in (("axes_tilt", {}), ("load_misalignment", {"turns": "wrench"})):
        for one in of(name, **options).values():
            assert told(one) == pytest.approx((3.0 * DEG, 3.0 * DEG, -0.5, 0.5))
    for one in of("marker_bias", form="tilt").values():
        assert told(one) == pytest.approx((2.0 * DEG, 2.0 * DEG, -0.5, 0.5))
    for name, one in of("marker_bias", form="offset").items():
        usual = 2.0 * DEG if name in ROTATIONS else 2.0 * MM
        assert told(one) == pytest.approx((usual, usual, -10 * usual, 10 * usual))
    for one in of("load_offset", applies="force").values():
        assert told(one) == (5.0, 5.0, -200.0, 200.0)
    for one in of("load_offset").values():
        assert told(one) == (0.3, 0.3, -10.0, 10.0)
    for one in of("joint_centre_migration").values():
        assert told(one) == pytest.approx((MM / DEG, MM / DEG, -10 * MM / DEG, 10 * MM / DEG))
