"""Regions of a missing effect's values against closed forms, and where readings leave them open.

Joints of upright chains turn by moment over stiffness; stiffness of the base is known or is fitted
along, and the noise is known: white, one SD.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
import pytest
import spring_chain_cases as chains
from spring_chain_cases import SD, Array

from spinepipe.calibration.profile import NEAR, RegionEnds
from spinepipe.effects import PlaceSpread
from spinepipe.studies.discrepancy.search.baseline import base_parameters
from spinepipe.studies.discrepancy.search.hypothesis import (
    ActiveTerm,
    CandidateForm,
    Variant,
    hypothesis,
)
from spinepipe.studies.discrepancy.search.joint_fit import JointFit, Setting, joint_fit
from spinepipe.studies.discrepancy.search.model_files import covariance
from spinepipe.studies.discrepancy.search.noise import Noise
from spinepipe.studies.discrepancy.search.readings import Repeats, SpecimenReadings
from spinepipe.studies.discrepancy.search.regions import (
    ValueWithRegion,
    region,
    values_with_regions,
)
from spinepipe.studies.discrepancy.search.whitening import whitening
from spinepipe.studies.discrepancy.verdict import REPEATS
from spinepipe.units import DEG_PER_RAD, ROTATIONS

pytestmark = pytest.mark.numeric

Z = 1.959964
SLACK = NEAR / 2.0 + 0.01
"""Of the way to an end: it is found where the rise, nearly a square, is known to `NEAR`."""

K = float(chains.STIFFNESS[0])
EXTENSION, JOINTS, CYCLES = 3, 3, 3
LEVELS = np.array([-6.0, -4.0, -2.0, 0.0, 2.0, 4.0, 6.0])

LAXITY = Variant("local_laxity", (("coordinate", "extension"),))
ZONE = Variant("neutral_zone", (("coordinate", "extension"),))
BIAS = Variant("marker_bias", (("form", "offset"),))
CONTACT = Variant("facet_contact", (("coordinate", "extension"), ("side", "positive")))

Turned = Callable[[int, Array], Array]
"""Rotation (T,) of a joint (its index) in moments (T,)."""


def read(turned: Turned, levels: Array = LEVELS, seed: int = 1) -> SpecimenReadings:
    """Flexion tests of one chain, extension read in some cycles."""
    case = chains.cases(tuple(levels), JOINTS)[0]
    q = np.full((CYCLES, len(levels), JOINTS, 6), np.nan)
    rng = np.random.default_rng(seed)
    for joint in range(JOINTS):
        noise = SD * rng.standard_normal((CYCLES, len(levels)))
        q[:, :, joint, EXTENSION] = turned(joint, levels) + noise
    return SpecimenReadings("a", chains.frames(JOINTS), (Repeats(case, q),))


def fitted(
    given: SpecimenReadings, supposed: ActiveTerm, free_base: bool = False
) -> tuple[JointFit, Setting]:
    noise = Noise(np.full(6, SD), 0.0, REPEATS, np.full(6, 1000), 0, False)
    setting = Setting({"a": given}, {"a": whitening(given.tests, noise)}, False)
    model = chains.model("a", chains.STIFFNESS, JOINTS)
    base = {"a": base_parameters(model, "per_specimen", ROTATIONS[:1]) if free_base else ()}
    started = hypothesis({"a": model}, base, (supposed,), ("flexion",), 100.0)
    fit = joint_fit(started, setting)
    assert not fit.status
    return fit, setting


def by_name(found: Sequence[ValueWithRegion]) -> dict[str, ValueWithRegion]:
    return {one.name: one for one in found}


def lax(joint: int) -> ActiveTerm:
    return ActiveTerm(CandidateForm(LAXITY, PlaceSpread.ONE_JOINT, joint), np.array([0.3]))


def loosened(fraction: float, joint: int) -> Turned:
    return lambda at, moments: moments / (K * (1.0 - fraction if at == joint else 1.0))


def test_a_value_that_readings_follow_in_one_over_it_has_the_region_of_a_straight_line() -> None:
    """theta = M u, u = 1 / (k (1 - f)): u lies within 1.96 SD / |M| of its least squares."""
    given = read(loosened(0.4, 1))
    fit, setting = fitted(given, lax(1))
    theta = given.tests[0].mean[:, 1, EXTENSION]
    size = float(LEVELS @ LEVELS)
    u, way = float(LEVELS @ theta) / size, Z * SD / np.sqrt(CYCLES * size)
    (found,) = values_with_regions(fit, setting, 0)
    ends = 1.0 / (K * (1.0 - np.array([found.low, found.high], dtype=float)))
    np.testing.assert_allclose(ends, [u - way, u + way], rtol=0, atol=SLACK * way)
    assert found.identifiable


def test_with_the_base_fitted_along_it_is_fiellers() -> None:
    """1 - f = u / v, of slopes u of the other joints and v of the lax one: Fieller (1954)."""
    moments = LEVELS / 40.0
    given = read(loosened(0.4, 1), moments, seed=3)
    fit, setting = fitted(given, lax(1), free_base=True)
    mean, size = given.tests[0].mean[..., EXTENSION], float(moments @ moments)
    u, v = (
        float((moments @ mean[:, [0, 2]]).sum()) / (2.0 * size),
        float(moments @ mean[:, 1]) / size,
    )
    su, sv = SD / np.sqrt(CYCLES * 2.0 * size), SD / np.sqrt(CYCLES * size)
    # (u - r v)^2 = Z^2 (su^2 + r^2 sv^2)
    ratios = np.roots([v**2 - Z**2 * sv**2, -2.0 * u * v, u**2 - Z**2 * su**2])
    (found,) = values_with_regions(fit, setting, 0)
    expected = np.sort(1.0 - ratios.real)
    way = float(np.ptp(expected)) / 2.0
    assert abs(expected.mean() - found.value) > 0.02 * way  # no symmetric interval
    np.testing.assert_allclose([found.low, found.high], expected, rtol=0, atol=2.0 * SLACK * way)


def test_where_all_is_straight_it_is_the_interval_of_the_standard_error() -> None:
    given = read(lambda _, moments: moments / K + 0.02)
    start = np.zeros(len(BIAS.create().parameters))
    fit, setting = fitted(given, ActiveTerm(CandidateForm(BIAS, PlaceSpread.SHARED), start))
    mean = float(np.nanmean(given.tests[0].mean[..., EXTENSION] - (LEVELS / K)[:, None]))
    way = Z * SD / np.sqrt(CYCLES * len(LEVELS) * JOINTS)
    every = by_name(values_with_regions(fit, setting, 0))
    found, unread = every["extension"], every["anterior"]
    expected = np.array([mean - way, mean + way]) * DEG_PER_RAD
    np.testing.assert_allclose(
        [found.low, found.high], expected, rtol=0, atol=SLACK * way * DEG_PER_RAD
    )
    assert (unread.low, unread.high, unread.identifiable) == (None, None, False)


def zoned(width: float, ratio: float) -> ActiveTerm:
    values = ZONE.off((0.0,) * len(ZONE.shapes))
    names = [p.name for p in ZONE.create().parameters]
    values[names.index("width")], values[names.index("stiffness_ratio")] = width, ratio
    return ActiveTerm(CandidateForm(ZONE, PlaceSpread.SHARED), values)


def local(fit: JointFit, name: str) -> float:
    """Standard error of a value by the curvature where the cost is least."""
    parameters = fit.hypothesis.supposed[0].form.variant.create().parameters
    at = next(
        k
        for k, u in enumerate(fit.hypothesis.unknowns)
        if u.supposed == 0 and parameters[u.column].name == name
    )
    return float(np.sqrt(covariance(fit)[at, at]))


def test_loads_that_stay_inside_a_zone_do_not_tell_where_it_ends() -> None:
    """Motions up to 2.9 deg under a third of the stiffness: the zone is as wide, or wider."""
    levels = LEVELS / 6.0
    given = read(lambda _, moments: moments / (0.33 * K), levels)
    fit, setting = fitted(given, zoned(0.06, 0.33))
    width = by_name(values_with_regions(fit, setting, 0))["width"]
    reached = DEG_PER_RAD / (0.33 * K)
    assert np.isfinite(local(fit, "width"))
    assert (width.high, width.open_above, width.identifiable) == (None, True, False)
    assert width.low is not None
    assert 0.7 * reached < width.low < 1.5 * reached
    assert not width.open_below


def test_loads_beyond_a_zone_tell_where_it_ends() -> None:
    """The same zone under six times the load: sharp corners at 1.5 deg."""
    half = 1.5 / DEG_PER_RAD

    def turned(_: int, moments: Array) -> Array:
        within = 0.33 * K * half
        beyond = np.sign(moments) * (half + (np.abs(moments) - within) / K)
        return np.where(np.abs(moments) < within, moments / (0.33 * K), beyond)

    fit, setting = fitted(read(turned, np.linspace(-6.0, 6.0, 25)), zoned(0.02, 0.4))
    width = by_name(values_with_regions(fit, setting, 0))["width"]
    assert width.identifiable
    assert width.low is not None
    assert width.high is not None
    assert width.low < 1.5 < width.high
    assert width.high - width.low < 1.0


def test_a_contact_as_rigid_as_a_wall_has_no_upper_end() -> None:
    """Motion that stops at 2 deg: any stiffness that is large enough does the same."""
    gap = 2.0 / DEG_PER_RAD
    given = read(lambda _, moments: np.minimum(moments / K, gap), np.linspace(-6.0, 6.0, 13))
    values = CONTACT.off((0.0,) * len(CONTACT.shapes))
    names = [p.name for p in CONTACT.create().parameters]
    values[names.index("gap")], values[names.index("stiffness")] = 0.9 * gap, 500.0
    fit, setting = fitted(given, ActiveTerm(CandidateForm(CONTACT, PlaceSpread.SHARED), values))
    stiffness = by_name(values_with_regions(fit, setting, 0))["stiffness"]
    assert np.isfinite(local(fit, "stiffness"))
    assert (stiffness.high, stiffness.open_above) == (None, True)
    assert stiffness.low is not None
    assert stiffness.low > K


def test_a_region_that_holds_a_bound_is_open_there() -> None:
    """A joint as stiff as the others may have lost nothing; what it may have lost has an end."""
    given = read(loosened(0.0, 1), seed=2)
    fit, setting = fitted(given, lax(1))
    theta = given.tests[0].mean[:, 1, EXTENSION]
    size = float(LEVELS @ LEVELS)
    u, way = float(LEVELS @ theta) / size, Z * SD / np.sqrt(CYCLES * size)
    assert u - way < 1.0 / K < u + way
    (found,) = values_with_regions(fit, setting, 0)
    assert (found.low, found.open_below, found.open_above) == (None, True, False)
    assert not found.identifiable
    end = 1.0 / (K * (1.0 - np.array([found.high], dtype=float)))
    assert u > 1.0 / K  # else the least cost would be at the bound, and the end be nearer
    np.testing.assert_allclose(end, [u + way], rtol=0, atol=SLACK * way)


def test_nothing_is_known_of_a_fit_that_is_none() -> None:
    fit, setting = fitted(read(loosened(0.4, 1)), lax(1))
    assert region(replace(fit, residuals={}), setting, 0) == RegionEnds(None, None, True, True)
