"""What imperfections took up, where their true sizes are known by the algebra of rigid bodies.

Catches sizes, errors or means over places that are wrong, and random errors called common.
"""

from dataclasses import replace
from itertools import product
from typing import Any

import numpy as np
import pytest
from imperfect_cases import JOINTS, SPECIMENS, alike, grounds_of, off_centre
from scipy import stats
from sweeps import sweep

from spinepipe.studies.discrepancy.rows import imperfection_rows
from spinepipe.studies.discrepancy.search import imperfections
from spinepipe.studies.discrepancy.search.baseline import BaselineFit
from spinepipe.studies.discrepancy.search.imperfections import (
    AbsorbedGap,
    InCommon,
    NuisancePlace,
    _mean,
    absorbed_gap,
    in_common,
    labels_of,
)
from spinepipe.studies.discrepancy.search.nuisance import NuisancePriors
from spinepipe.studies.discrepancy.store import at_once
from spinepipe.studies.discrepancy.tables import IMPERFECTIONS
from spinepipe.tables import from_rows

PRIOR_M = NuisancePriors().joint_centre
SHIFT_M = np.array([2e-3, 0.0, -1e-3])
AXES = ("anterior", "superior", "right")


@pytest.fixture(scope="module")
def shifted() -> tuple[BaselineFit, AbsorbedGap]:
    grounds = grounds_of(off_centre(alike(SHIFT_M)))
    return grounds, absorbed_gap(grounds, grounds.fit, JOINTS, at_once)


def centres(taken: AbsorbedGap) -> dict[tuple[str, str, str], tuple[float, float]]:
    """Size and SD in m by specimen, joint and direction."""
    return {
        (one.at.specimen, one.at.joint, one.at.component): (one.size * PRIOR_M, one.sd * PRIOR_M)
        for one in taken.each
        if one.at.kind == "joint_centre"
    }


def test_a_known_shift_of_all_centres_is_found_in_every_joint(shifted):
    found = centres(shifted[1])
    assert len(found) == len(SPECIMENS) * len(JOINTS) * 3
    for (_, _, axis), (size, sd) in found.items():
        assert abs(size - SHIFT_M[AXES.index(axis)]) < 4.0 * sd
        assert sd < 0.3 * PRIOR_M


def test_a_shift_that_all_have_is_no_random_error(shifted):
    certain = {one.at.component: one for one in shifted[1].common if one.certain}
    assert set(certain) == {"anterior", "right"}
    for axis, one in certain.items():
        assert (one.at.kind, one.at.specimen, one.at.joint) == ("joint_centre", "*", "*")
        truth = SHIFT_M[AXES.index(axis)] / PRIOR_M
        assert abs(one.size - truth) < max(4.0 * one.sd, 0.05)


def test_without_imperfections_the_gap_is_there_again(shifted):
    taken = shifted[1]
    assert taken.beside.gap < 0.3
    assert taken.without.gap > 0.8
    largest = max(taken.each, key=lambda one: one.chi2)
    assert largest.at.kind == "joint_centre"
    # chi2 as marginal over the nuisances is that of the fit
    linear = sum(one.chi2 for one in taken.each)
    assert linear == pytest.approx(taken.without.chi2 - shifted[0].fit.chi2, rel=0.02)


def test_sizes_are_those_of_one_large_least_squares_problem(shifted):
    """Readings, priors of nuisances and of unknowns as rows of one matrix, each with SD one."""
    grounds, taken = shifted
    fit, names = grounds.fit, list(grounds.readings)
    counts = [len(labels_of(grounds, name)) for name in names]
    ends = np.cumsum([0, *counts])
    width = ends[-1] + len(fit.x)
    rows, targets = [np.eye(ends[-1], width)], [np.zeros(ends[-1])]
    for name, start, end in zip(names, ends[:-1], ends[1:], strict=True):
        white, member = grounds.setting.whitenings[name], fit.hypothesis.members[name]
        own = np.zeros((white.count, width))
        own[:, start:end] = white.moves
        plain = grounds.plain[name]
        errors = [
            np.nan_to_num(test.mean - seen)
            for test, seen in zip(grounds.readings[name].tests, fit.predicted[name], strict=True)
        ]
        own[:, ends[-1] + np.array(member.numbers)] = white.lengthened(fit.jacobians[name])
        rows.append(own)
        targets.append(plain.noise_only(errors))
    priors = np.diag([1.0 / u.sd for u in fit.hypothesis.unknowns])
    rows.append(np.concatenate([np.zeros((len(fit.x), ends[-1])), priors], axis=1))
    targets.append(np.array([u.mean for u in fit.hypothesis.unknowns]) @ priors - fit.x @ priors)
    matrix = np.concatenate(rows)
    inverse = np.linalg.inv(matrix.T @ matrix)
    solution = (inverse @ matrix.T @ np.concatenate(targets))[: ends[-1]]
    sds = np.sqrt(np.diagonal(inverse))[: ends[-1]]
    # the fit stops where a log evidence is right to 0.01
    assert [one.size for one in taken.each] == pytest.approx(solution, abs=0.02)
    assert [one.sd for one in taken.each] == pytest.approx(sds, rel=1e-6)


def test_random_centres_are_told_with_honest_errors_and_are_nothing_in_common():
    rng = np.random.default_rng(5)
    truth = {name: PRIOR_M * rng.standard_normal((len(JOINTS), 3)) for name in SPECIMENS}
    centres_alone = NuisancePriors(PRIOR_M, *[0.0] * 7)  # nothing else is wrong here
    grounds = grounds_of(off_centre(truth, seed=2), centres_alone)
    taken = absorbed_gap(grounds, grounds.fit, JOINTS, at_once)
    away = [
        (size - truth[specimen][JOINTS.index(joint), AXES.index(axis)]) / sd
        for (specimen, joint, axis), (size, sd) in centres(taken).items()
    ]
    assert 0.5 < np.sqrt(np.mean(np.square(away))) < 1.5  # 27 values: SD of the root 0.14
    assert not [one for one in taken.common if one.certain]


def test_random_errors_are_seldom_called_common():
    """Estimates of random errors as readings tell them: N(0, I - covariance)."""
    places = [
        NuisancePlace(s, "joint_centre", axis, j, "*", PRIOR_M, "m")
        for s in "abcd"
        for j in "xyz"
        for axis in AXES
    ]
    rng = np.random.default_rng(6)
    told = rng.uniform(0.1, 0.99, len(places))
    alarms = 0
    for _ in range(60):
        size = np.sqrt(told) * rng.standard_normal(len(places))
        alarms += any(one.certain for one in in_common(places, size, np.diag(1.0 - told)))
    assert alarms <= 3  # 1 % allowed for; more than 3 of 60 have a probability of 0.3 % at 1 %


@sweep("seed", range(3))
def test_a_mean_is_that_of_generalised_least_squares(seed: int) -> None:
    """Sizes drawn towards zero as their covariance says, and correlated; by inverses."""
    rng, count = np.random.default_rng(seed), 7
    spread = rng.normal(size=(count, 2 * count)) / np.sqrt(count)
    covariance = np.linalg.inv(np.eye(count) + spread @ spread.T)
    told = np.eye(count) - covariance  # of a mean of one, and the covariance of random sizes
    shift = 0.8 * (seed > 0)
    size = told @ (shift + np.linalg.cholesky(np.linalg.inv(told)) @ rng.normal(size=count))
    at = NuisancePlace("*", "joint_centre", "anterior", "x", "*", PRIOR_M, "m")
    ones = told @ np.ones(count)
    weights = np.linalg.solve(told, ones) / (ones @ np.linalg.solve(told, ones))
    mean = weights @ size
    left = size - mean * ones
    scatter = np.sqrt(left @ np.linalg.solve(told, left) / (count - 1))
    sd = np.sqrt(weights @ told @ weights)
    found = _mean(at, size, covariance)
    assert found is not None
    assert (found.at, found.count) == (at, count)
    assert found.size == pytest.approx(mean, rel=1e-9)
    assert found.sd == pytest.approx(scatter * sd, rel=1e-9)
    by_scatter = 2.0 * stats.t.sf(abs(mean) / (scatter * sd), count - 1)
    by_sd = 2.0 * stats.norm.sf(abs(mean) / sd)
    assert found.chance == pytest.approx(min(1.0, 2.0 * min(by_scatter, by_sd)), rel=1e-6)


def test_rows_say_what_was_taken_up(shifted):
    rows = list(imperfection_rows(shifted[1], "base"))
    frame = from_rows(IMPERFECTIONS, rows).to_pandas()
    assert not frame.duplicated(list(IMPERFECTIONS.key)).any()
    (anterior,) = frame[frame["common"] & (frame["component"] == "anterior")].to_dict("records")
    assert (anterior["specimen"], anterior["joint"], anterior["unit"]) == ("*", "*", "mm")
    assert anterior["value"] == pytest.approx(2.0, abs=0.2)


def test_where_nothing_is_allowed_for_nothing_is_taken_up():
    grounds = grounds_of(off_centre(alike(0.0 * SHIFT_M)), NuisancePriors(*[0.0] * 8))
    taken = absorbed_gap(grounds, grounds.fit, JOINTS, at_once)
    assert (taken.each, taken.common) == ((), ())
    assert taken.without.gap == pytest.approx(taken.beside.gap, abs=1e-4)


# Which are put together, how much readings must tell, and what is certain

CENTRE = NuisancePlace("a", "joint_centre", "anterior", "x", "*", 2e-3, "m")
GAIN = NuisancePlace("a", "load_gain", "gain", "*", "flexion", 0.02, "1")


def places_of(specimens: str, joints: str) -> list[NuisancePlace]:
    return [replace(CENTRE, specimen=s, joint=j) for s, j in product(specimens, joints)]


def grouped(places: list[NuisancePlace]) -> dict[tuple[str, str, str], list[int]]:
    """By specimen, joint and test."""
    found = imperfections._groups(places)
    return {(at.specimen, at.joint, at.test): numbers.tolist() for at, numbers in found.items()}


def test_centres_are_put_together_by_joint_by_specimen_and_over_all() -> None:
    assert grouped(places_of("ab", "xy")) == {
        ("*", "*", "*"): [0, 1, 2, 3],
        ("*", "x", "*"): [0, 2],
        ("*", "y", "*"): [1, 3],
        ("a", "*", "*"): [0, 1],
        ("b", "*", "*"): [2, 3],
    }


def test_of_one_specimen_or_one_joint_there_is_one_group() -> None:
    assert list(grouped(places_of("a", "xyz")).values()) == [[0, 1, 2]]
    assert list(grouped(places_of("abc", "x")).values()) == [[0, 1, 2]]
    assert grouped(places_of("a", "x")) == {}


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
    other = [replace(one, component="right") for one in places_of("a", "xy")]
    third = [replace(one, kind="law_axes") for one in places_of("a", "xy")]
    groups = imperfections._groups([*places_of("a", "xy"), *other, *third])
    assert sorted(numbers.tolist() for numbers in groups.values()) == [[0, 1], [2, 3], [4, 5]]


def test_what_joints_may_share_anyhow_is_not_put_together() -> None:
    for kind in ("rotation_order", "off_diagonal"):
        assert grouped([replace(one, kind=kind) for one in places_of("ab", "xy")]) == {}


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
    places = places_of("ab", "xyzw")
    size = 2.0 + 0.01 * np.arange(8)
    found = in_common(places, size, np.zeros((8, 8)))
    assert [one.count for one in found] == sorted((one.count for one in found), reverse=True)
    assert [one.certain for one in found] == [True] + [False] * (len(found) - 1)


def test_what_is_off_in_one_specimen_is_said_of_that() -> None:
    """Four joints of one are off, those of the other to both sides of nought."""
    places = places_of("ab", "xyzw")
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
    places = [
        *places_of("a", "xy"),
        *(replace(one, kind="law_axes") for one in places_of("a", "xy")),
    ]
    found = in_common(places, np.array([*size, -9.0, 9.0]), np.zeros((4, 4)))
    assert len(found) == 2
    assert [one.certain for one in found if one.at.kind == "joint_centre"] == [certain]
    assert [one.certain for one in found if one.at.kind == "law_axes"] == [False]


def test_a_variance_is_not_below_nought_by_rounding() -> None:
    covariance: Any = np.diag([4.0, -1e-17])
    found = imperfections._Posterior(np.zeros(2), np.zeros(2), covariance)
    assert found.variance.tolist() == [4.0, 0.0]
