"""Whole searches of chains in closed form: what is put in is named, or said to be untold.

Catches a search that names nothing, the wrong thing or too much, and one that hangs on the order in
which specimens, tests or effects are listed.
"""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
import search_cases as cases
from search_cases import Array, Searched, exponential, one_sided, searched

from spinepipe.studies.discrepancy.search.regions import values_with_regions
from spinepipe.studies.discrepancy.verdict import VerdictKind

pytestmark = pytest.mark.slow

RATE = 12.0
ASYMMETRY = 0.15


@cache
def stiffening() -> Searched:
    return searched(cases.readings(1, {"bending": exponential(RATE)}))


@cache
def two() -> Searched:
    laws = {"flexion": one_sided(ASYMMETRY), "bending": exponential(RATE)}
    return searched(cases.readings(2, laws))


def test_stiffening_is_named_with_its_coordinate_and_rate() -> None:
    found, ended = stiffening().found, stiffening().ended
    assert (ended.verdict, [one.name for one in ended.named]) == (
        VerdictKind.NAMED,
        ["nonlinear_stiffening"],
    )
    options = dict(found.standing[0].supposed.form.variant.options)
    assert options == {"coordinate": "right_bending", "shape": "exponential"}
    (rate,) = values_with_regions(found.final.fit, found.final.setting, 0)
    assert (rate.name, rate.unit, rate.place) == ("rate", "1/rad", ())
    assert rate.low < RATE < rate.high
    assert rate.high - rate.low < 0.3 * RATE
    assert found.base_gap.gap > 1.0
    assert found.final_gap.interval[0] == 0.0


@pytest.mark.full
def test_a_whole_library_finds_the_same() -> None:
    ended = searched(cases.readings(1, {"bending": exponential(RATE)}), effects=None).ended
    assert [one.name for one in ended.named] == ["nonlinear_stiffening"]


def test_springs_lack_nothing() -> None:
    result = searched(cases.readings(2, {}))
    assert (result.ended.verdict, result.found.standing) == (VerdictKind.NULL, ())
    assert result.found.base_gap.interval[0] == 0.0
    assert result.found.probabilities["nothing"] > 0.5


def test_what_no_effect_does_is_unknown_and_said_where() -> None:
    result = searched(cases.readings(3, {"bending": cases.wavy}))
    assert (result.ended.verdict, result.ended.named) == (VerdictKind.UNKNOWN, ())
    assert "right bending" in result.ended.why
    assert result.found.base_gap.gap > 1.0


def test_two_effects_are_both_named_with_their_places() -> None:
    found, ended = two().found, two().ended
    assert ended.verdict is VerdictKind.NAMED
    on = [(one.name, one.supposed.form.variant.acts_on) for one in found.standing]
    assert on == [
        ("flexion_extension_asymmetry", ("extension",)),
        ("nonlinear_stiffening", ("right_bending",)),
    ]
    (value,) = values_with_regions(found.final.fit, found.final.setting, 0)
    assert value.low < ASYMMETRY < value.high


def test_what_stands_beside_a_name_is_no_rival_of_it() -> None:
    for one in two().found.standing:
        assert one.rivals
        assert not {rival.name for rival in one.rivals} & {"flexion_extension_asymmetry", one.name}


def test_a_lax_joint_is_named_with_its_specimen_and_its_level() -> None:
    def lax(joint: int, moments: Array, k: float) -> Array:
        return moments / (0.7 * k if joint == 1 else k)

    everywhere = {"flexion": lax, "bending": lax, "rotation": lax}
    result = searched([*cases.readings(6, everywhere, ("a",)), *cases.readings(7, {}, ("b",))])
    assert [one.name for one in result.ended.named] == ["local_laxity"]
    (fraction,) = values_with_regions(result.found.final.fit, result.found.final.setting, 0)
    assert fraction.place == ("a", "L4L5")
    assert fraction.low < 0.3 < fraction.high


def assert_same(result: Searched, other: Searched) -> None:
    assert result.ended.verdict == other.ended.verdict
    assert {one.name for one in result.ended.named} == {one.name for one in other.ended.named}
    assert set(result.ended.tied) == set(other.ended.tied)
    for name, evidence in other.evidence().items():
        assert result.evidence()[name] == pytest.approx(evidence, rel=1e-3, abs=0.01)
    for one in result.found.standing:
        same = next(s for s in other.found.standing if s.supposed.form == one.supposed.form)
        assert one.log_evidence == pytest.approx(same.log_evidence, rel=1e-3)
        np.testing.assert_allclose(one.supposed.start, same.supposed.start, rtol=1e-3)


def test_the_order_of_effects_tried_decides_nothing() -> None:
    laws = {"flexion": one_sided(ASYMMETRY), "bending": exponential(RATE)}
    assert_same(searched(cases.readings(2, laws), backwards=True), two())


def test_order_and_names_of_specimens_and_order_of_tests_decide_nothing() -> None:
    given = cases.readings(1, {"bending": exponential(RATE)}, ("z", "m"))[::-1]
    turned = [replace(one, tests=one.tests[::-1]) for one in given]
    assert_same(searched(turned), stiffening())


def test_what_these_steps_cannot_tell_apart_is_a_set() -> None:
    """A weak stiffening bends the curve as a neutral zone does, seen at three loads to a side."""
    result = searched(cases.readings(1, {"flexion": exponential(1.2)}))
    assert result.ended.verdict is VerdictKind.SET
    assert set(result.ended.tied) == {"nonlinear_stiffening", "neutral_zone"}
    assert result.ended.named == ()
    for name in result.ended.tied:
        assert name in result.ended.why


def test_a_tie_beside_a_sure_effect_leaves_that_one_named() -> None:
    laws = {"flexion": one_sided(0.08), "bending": exponential(0.8)}
    ended = searched(cases.readings(6, laws)).ended
    assert (ended.verdict, [one.name for one in ended.named]) == (
        VerdictKind.SET,
        ["flexion_extension_asymmetry"],
    )
    assert {"nonlinear_stiffening", "neutral_zone"} <= set(ended.tied)
