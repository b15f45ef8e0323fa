"""Joint laws: derivatives against differences, what off means, and what is symmetric.

Catches a wrong tangent or derivative of any law at any coordinate, also beside its corners.
"""

from collections.abc import Callable
from fractions import Fraction
from math import factorial

import numpy as np
from example_effects import slope
from joint_law_cases import (
    EVERY,
    VARIANTS,
    defaults,
    law_of,
    off,
    title,
)
from sweeps import sweep

from spinepipe.effects import JointLaw, Parameter, create
from spinepipe.effects.contract import Array
from spinepipe.effects.neutral_zone import NEAR, chord, inside
from spinepipe.effects.nonlinear_stiffening import exponential_rise
from spinepipe.units import COORDINATES


def anywhere(n: int) -> tuple[Array, Array]:
    """Coordinates up to some degrees and millimetres, and loads unrelated to them."""
    rng = np.random.default_rng(3)
    sizes = np.array([1e-3] * 3 + [0.12] * 3)
    return sizes * rng.normal(size=(n, 6)), rng.normal(0.0, [300.0] * 3 + [8.0] * 3, (n, 6))


def places(law: JointLaw) -> tuple[Array, Array, Array]:
    """Coordinates, loads and values at random, and at and around each corner of the law."""
    around = np.array([0.0, 1e-5, 3e-4, 0.93, 0.97, 1.0, 1.04, 1.2])
    corners = np.concatenate([around * c for c in (*corners_of(law), -corners_of(law)[0])])
    q, carried = anywhere(40 + len(corners))
    sizes = np.array([1e-3] * 3 + [0.05] * 3)
    unit = sizes if len(corners_of(law)) == 1 else np.ones(6)
    q[40:] = corners[:, None] * unit
    rng = np.random.default_rng(4)
    values = defaults(law, len(q)) * rng.uniform(0.7, 1.0, (len(q), 1))
    values[40:] = defaults(law)
    centre = np.array([0.6 * p.prior_scale * (p.default == 0.0) for p in law.parameters])
    return q, carried, values + centre * rng.choice([-1.0, 1.0], (len(q), 1))


def corners_of(law: JointLaw) -> tuple[float, ...]:
    """Where a law at its defaults has a rounded corner or goes on straight; 1 for none."""
    strength = law.parameters[0].default
    shape = getattr(law, "shape", None)
    if shape == "exponential":
        return 10.0 / strength, -10.0 / strength
    if shape == "tangent":
        return 1.4 / np.sqrt(strength), -1.4 / np.sqrt(strength)
    motions = [p.default for p in law.parameters if p.name in ("width", "gap", "break_at")]
    return (motions[0], -motions[0]) if motions else (1.0,)


STEP = np.array([1e-9] * 3 + [1e-7] * 3)
"""m and rad; far below the narrowest rounding, so that no corner is stepped over."""


@EVERY
def test_tangent_is_the_slope_by_the_coordinates(variant) -> None:
    law = law_of(variant)
    q, carried, values = places(law)
    found = law.respond(q, values, carried).tangent
    for at, (along, step) in enumerate(zip(np.eye(6), STEP, strict=True)):

        def load(h: float, along: Array = along) -> Array:
            return law.respond(q + h * along, values, carried).load

        close(found[:, :, at], slope(load, step))


@EVERY
def test_by_carried_is_the_slope_by_the_carried_load(variant) -> None:
    law = law_of(variant)
    q, carried, values = places(law)
    found = law.respond(q, values, carried).by_carried
    found = np.zeros((*q.shape, 6)) if found is None else found
    for at, along in enumerate(np.eye(6)):

        def load(h: float, along: Array = along) -> Array:
            return law.respond(q, values, carried + h * along).load

        close(found[:, :, at], slope(load, 1.0))


@sweep("where", [defaults, off])
@EVERY
def test_by_parameter_is_the_slope_by_the_parameters(variant, where: Callable) -> None:
    law = law_of(variant)
    q, carried, values = places(law)
    values = values if where is defaults else where(law, len(q))
    found = law.by_parameter(q, values, carried)
    directions = np.eye(len(law.parameters))
    for at, (along, parameter) in enumerate(zip(directions, law.parameters, strict=True)):

        def load(h: float, along: Array = along) -> Array:
            return law.respond(q, values + h * along, carried).load

        close(found[:, :, at], slope(load, 1e-6 * parameter.prior_scale * scale(parameter)))


def scale(parameter: Parameter) -> float:
    return parameter.default if parameter.logarithmic else 1.0


def close(found: Array, expected: Array) -> None:
    """Equal to what differences resolve: 1e-16 of a load over a relative step of 1e-6 or more."""
    size = np.abs(expected).max()
    np.testing.assert_allclose(found, expected, rtol=2e-5, atol=1e-7 * size)


@sweep("shape", ["exponential", "tangent"])
def test_laws_near_zero_are_as_exact_as_elsewhere(shape: str) -> None:
    """The laws again in extended precision, where differences of nearly equal numbers matter."""
    law = law_of(("nonlinear_stiffening", {"shape": shape}))
    v = np.array([1e-6, 3e-4, 9.9e-4, 1.01e-3, 0.02, 0.5], np.longdouble)
    if shape == "exponential":
        share, by_v, size = np.expm1(v) / v - 1, (np.exp(v) - np.expm1(v) / v) / v, 0.1
    else:
        x, size = np.sqrt(v), 0.01
        share, by_v = np.tan(x) / x - 1, (1 / np.cos(x) ** 2 - np.tan(x) / x) / (2 * v)
    q, carried = np.zeros((6, 6)), np.ones((6, 6))
    q[:, 3] = 0.1
    if shape == "exponential":
        q[:, 3] = np.sqrt(0.1**2 - 1e-4**2)  # rounded to 0.1
    values = v.astype(float)[:, None] / size
    found = law.respond(q, values, carried).load[:, 3]
    np.testing.assert_allclose(found, share.astype(float), rtol=0, atol=4e-16)
    slopes = law.by_parameter(q, values, carried)[:, 3, 0] / size
    np.testing.assert_allclose(slopes, by_v.astype(float), rtol=5e-13, atol=0)


def test_series_near_zero_are_exact_to_the_last_bit() -> None:
    """Against sums of exact fractions: what the closed forms would lose there is not lost."""
    for v in (1e-12, 1e-6, 3e-4, 9.99e-4, -9.99e-4):
        exact, terms = Fraction(v), range(1, 12)
        # (exp(v) - 1) / v - 1 = sum of v^k / (k + 1)!
        value = sum(exact**k / factorial(k + 1) for k in terms)
        by_v = sum(k * exact ** (k - 1) / factorial(k + 1) for k in terms)
        found = exponential_rise(np.array([v]))
        # the value is a share beside 1, of which the next term of the series is 1e-18
        expected = [float(value), float(by_v)]
        np.testing.assert_allclose(np.ravel(found), expected, rtol=5e-16, atol=2e-18)
    # tan(x) / x - 1 in v = x^2: sin(x) / x over cos(x), series of each
    for v in (1e-12, 1e-6, 3e-4, 9.99e-4):
        exact = Fraction(v)
        sine, by_sine, cosine, by_cosine = (
            sum((-1) ** k * exact**k / factorial(2 * k + 1) for k in range(12)),
            sum((-1) ** k * k * exact ** (k - 1) / factorial(2 * k + 1) for k in range(1, 12)),
            sum((-1) ** k * exact**k / factorial(2 * k) for k in range(12)),
            sum((-1) ** k * k * exact ** (k - 1) / factorial(2 * k) for k in range(1, 12)),
        )
        value = sine / cosine - 1
        by_v = (by_sine * cosine - sine * by_cosine) / cosine**2
        q, values = np.zeros((1, 6)), np.array([[v / 0.01]])
        q[:, 3] = 0.1
        law, carried = law_of(("nonlinear_stiffening", {"shape": "tangent"})), np.ones((1, 6))
        load = law.respond(q, values, carried).load[0, 3]
        slope = law.by_parameter(q, values, carried)[0, 3, 0] / 0.01
        np.testing.assert_allclose([load, slope], [float(value), float(by_v)], rtol=2e-15)


# Off, and what is symmetric


@EVERY
def test_off_is_exactly_nothing_but_says_what_it_would_do(variant) -> None:
    law = law_of(variant)
    q, carried = anywhere(30)
    response = law.respond(q, off(law, 30), carried)
    np.testing.assert_array_equal(response.load, 0.0)
    np.testing.assert_array_equal(response.tangent, 0.0)
    if response.by_carried is not None:
        np.testing.assert_array_equal(response.by_carried, 0.0)
    signature = law.by_parameter(q, off(law, 30), carried)
    strengths = [p.off is not None for p in law.parameters]
    assert sum(strengths) == 1
    np.testing.assert_array_equal(signature[:, :, ~np.array(strengths)], 0.0)
    touched = np.abs(signature[:, :, strengths]).max(axis=(1, 2)) > 0.0
    # a stop to one side, or a break, is met by some of the joints, all else by all
    late = variant[0] == "facet_contact" or variant[1].get("shape") == "bilinear"
    assert touched.any() if late else touched.all()


@sweep(
    "variant",
    [v for v in VARIANTS if v[0] not in ("facet_contact", "preload_stiffening")],
    title,
)
def test_the_mirrored_joint_has_the_mirrored_law(variant) -> None:
    law = law_of(variant)
    q, carried = anywhere(30)
    here, there = (law.respond(s * q, defaults(law, 30), s * carried) for s in (1.0, -1.0))
    parity = 1.0 if variant[0] == "flexion_extension_asymmetry" else -1.0
    np.testing.assert_array_equal(there.load, parity * here.load)
    np.testing.assert_array_equal(there.tangent, -parity * here.tangent)


@sweep("coordinate", COORDINATES)
def test_the_two_stops_mirror_each_other(coordinate: str) -> None:
    q, carried = anywhere(30)
    one, other = (
        create("facet_contact", {"coordinate": coordinate, "side": side})
        for side in ("positive", "negative")
    )
    values = defaults(one, 30)
    here, there = one.respond(q, values, carried), other.respond(-q, values, carried)
    assert here.load.any()
    assert (here.load >= 0.0).all()
    np.testing.assert_array_equal(there.load, -here.load)
    np.testing.assert_array_equal(there.tangent, here.tangent)


@sweep("sharpness", [2.0, 2.7, 12.0, 50.0])
@sweep("offset", [-0.8, 0.0, 0.5])
def test_short_chords_of_a_knee_join_long_ones(sharpness: float, offset: float) -> None:
    """Where the mean of slopes takes over from the difference, in value and derivatives."""
    n, at = np.array([sharpness]), np.array([offset])
    for side in (-1.0, 1.0):
        just = [chord(np.array([side * NEAR * share]), n, at) for share in (1 - 1e-9, 1 + 1e-9)]
        np.testing.assert_allclose(*just, rtol=0, atol=2e-7)


def test_a_knee_is_never_infinite() -> None:
    u = np.array([0.0, 1e-200, 1e-3, 1.0, 1e3, 1e200])
    for n in (2.0, 50.0):
        for one in inside(u, np.array([n])):
            assert np.isfinite(one).all()
