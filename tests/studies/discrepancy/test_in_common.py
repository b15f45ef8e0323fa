"""Which imperfections are put together, how much readings must tell, and what is certain."""

from dataclasses import replace
from itertools import product
from typing import Any

import numpy as np
import pytest
from scipy import stats
from sweeps import sweep

from spinepipe.studies.discrepancy.search import imperfections
from spinepipe.studies.discrepancy.search.gaps import Gap
from spinepipe.studies.discrepancy.search.imperfections import (
    AbsorbedGap,
    Imperfection,
    InCommon,
    NuisancePlace,
    _mean,
    in_common,
)

CENTRE = NuisancePlace("a", "joint_centre", "anterior", "x", "*", 2e-3, "m")
GAIN = NuisancePlace("a", "load_gain", "gain", "*", "flexion", 0.02, "1")


def centres(specimens: str, joints: str) -> list[NuisancePlace]:
    return [replace(CENTRE, specimen=s, joint=j) for s, j in product(specimens, joints)]


def grouped(places: list[NuisancePlace]) -> dict[tuple[str, str, str], list[int]]:
    """By specimen, joint and test."""
    found = imperfections._groups(places)
    return {(at.specimen, at.joint, at.test): numbers.tolist() for at, numbers in found.items()}


def test_centres_are_put_together_by_joint_by_specimen_and_over_all() -> None:
    assert grouped(centres("ab", "xy")) == {
        ("*", "*", "*"): [0, 1, 2, 3],
        ("*", "x", "*"): [0, 2],
        ("*", "y", "*"): [1, 3],
        ("a", "*", "*"): [0, 1],
        ("b", "*", "*"): [2, 3],
    }


def test_of_one_specimen_or_one_joint_there_is_one_group() -> None:
    assert list(grouped(centres("a", "xyz")).values()) == [[0, 1, 2]]
    assert list(grouped(centres("abc", "x")).values()) == [[0, 1, 2]]
    assert grouped(centres("a", "x")) == {}


def test_tests_of_a_specimen_are_together_and_specimens_of_a_test() -> None:
    places = [replace(GAIN, specimen=s, test=t) for s, t in product("ab", ("flexion", "bending"))]
    assert grouped(places) == {
        ("*", "*", "*"): [0, 1, 2, 3],
        ("*", "*", "flexion"): [0, 2],
        ("*", "*", "bending"): [1, 3],
        ("a", "*", "*"): [0, 1],
        ("b", "*", "*"): [2, 3],
    }


def test_kinds_and_components_are_never_mixed() -> None:
    other = [replace(one, component="right") for one in centres("a", "xy")]
    third = [replace(one, kind="law_axes") for one in centres("a", "xy")]
    groups = imperfections._groups([*centres("a", "xy"), *other, *third])
    assert sorted(numbers.tolist() for numbers in groups.values()) == [[0, 1], [2, 3], [4, 5]]


def test_what_joints_may_share_anyhow_is_not_put_together() -> None:
    for kind in ("rotation_order", "off_diagonal"):
        assert grouped([replace(one, kind=kind) for one in centres("ab", "xy")]) == {}


# How much must be told


def mean(told: float, count: int = 4) -> InCommon | None:
    """Of nuisances of which readings tell that share of the prior's variance each."""
    return _mean(CENTRE, np.linspace(0.5, 1.0, count), (1.0 - told) * np.eye(count))


def test_what_readings_tell_less_than_a_twentieth_of_has_no_say() -> None:
    assert mean(0.049) is None
    assert mean(0.051) is not None
    size = np.array([3.0, 1.0, 1.4])
    found = _mean(CENTRE, size, np.diag([1.0 - 0.049, 0.5, 0.5]))
    assert found is not None
    assert found.size == pytest.approx(2.4)  # sizes are drawn to nought by a half
    assert found.count == 3


def test_two_that_are_told_have_a_mean_and_one_has_none() -> None:
    assert mean(0.5, 2) is not None
    assert mean(0.5, 1) is None


def test_a_mean_needs_a_twentieth_of_each_of_those_in_it() -> None:
    """Of two among many that are told by w each, the mean has a weight of 2 w."""
    for count, known in ((19, True), (21, False)):
        covariance = np.diag([0.5, 0.5, *np.ones(count - 2)])
        assert (_mean(CENTRE, np.ones(count), covariance) is not None) is known


@sweep("shift", [0.0, 0.4, 2.0])
def test_the_chance_is_of_two_sides_and_the_better_of_two_ways(shift: float) -> None:
    """Three sizes told wholly: the normal of their mean, Student's t of their scatter."""
    size = shift + np.array([-0.1, 0.0, 0.1])
    found = _mean(CENTRE, size, np.zeros((3, 3)))
    assert found is not None
    t = stats.ttest_1samp(size, 0.0).pvalue
    z = 2.0 * stats.norm.sf(shift * np.sqrt(3.0))
    assert found.chance == pytest.approx(min(1.0, 2.0 * min(t, z)))
    assert found.sd == pytest.approx(0.1 / np.sqrt(3.0))


def test_sizes_that_are_equal_have_no_scatter_and_no_chance() -> None:
    found = _mean(CENTRE, np.full(3, 0.5), np.zeros((3, 3)))
    assert found is not None
    assert found.chance == pytest.approx(0.0, abs=1e-12)
    assert 0.0 < found.sd < 1e-12


# What is certain


def test_a_wider_mean_says_it_for_those_in_it() -> None:
    """Centres of both specimens are off alike: it is said once, of all."""
    places = centres("ab", "xyzw")
    size = 2.0 + 0.01 * np.arange(8)
    found = in_common(places, size, np.zeros((8, 8)))
    assert [one.count for one in found] == sorted((one.count for one in found), reverse=True)
    assert [one.certain for one in found] == [True] + [False] * (len(found) - 1)


def test_what_is_off_in_one_specimen_is_said_of_that() -> None:
    """Four joints of one are off, those of the other to both sides of nought."""
    places = centres("ab", "xyzw")
    size = np.array([2.0, 2.01, 1.99, 2.02, -2.0, 2.1, -1.9, 1.8])
    found = in_common(places, size, np.zeros((8, 8)))
    certain = {(one.at.specimen, one.at.joint) for one in found if one.certain}
    assert ("a", "*") in certain
    assert ("b", "*") not in certain


@sweep("times, certain", [(1.02, True), (0.98, False)])
def test_a_mean_is_certain_below_a_hundredth_of_all_that_are_looked_at(
    times: float, certain: bool
) -> None:
    """Two kinds of two each: each has half of a hundredth; by the normal, of the larger scatter."""
    z = float(stats.norm.isf(0.01 / 2.0 / 4.0))  # two means, two sides, two ways
    size = times * z / np.sqrt(2.0) + np.array([-9.0, 9.0])  # a scatter that is no help
    places = [*centres("a", "xy"), *(replace(one, kind="law_axes") for one in centres("a", "xy"))]
    found = in_common(places, np.array([*size, -9.0, 9.0]), np.zeros((4, 4)))
    assert len(found) == 2
    assert [one.certain for one in found if one.at.kind == "joint_centre"] == [certain]
    assert [one.certain for one in found if one.at.kind == "law_axes"] == [False]


# Sums


def test_what_is_taken_up_adds_up_by_kind_largest_first() -> None:
    every = [
        Imperfection(CENTRE, 0.5, 0.1, 3.0),
        Imperfection(replace(CENTRE, joint="y"), -2.0, 0.1, 4.0),
        Imperfection(GAIN, 1.0, 0.1, 9.0),
        Imperfection(replace(GAIN, kind="load_axis"), 0.1, 0.1, -1.0),
    ]
    taken = AbsorbedGap(None, Gap(1.0, 1.0, 1), tuple(every), ())
    assert taken.linear_chi2 == 15.0
    assert list(taken.by_kind.items()) == [
        ("load_gain", 9.0),
        ("joint_centre", 7.0),
        ("load_axis", -1.0),
    ]
    assert [one.size for one in taken.largest] == [-2.0, 1.0, 0.5, 0.1]


def test_a_variance_is_not_below_nought_by_rounding() -> None:
    covariance: Any = np.diag([4.0, -1e-17])
    found = imperfections._Posterior(np.zeros(2), np.zeros(2), covariance)
    assert found.variance.tolist() == [4.0, 0.0]
