"""What imperfections took up, where their true sizes are known by the algebra of rigid bodies.

Catches sizes, errors or means over places that are wrong, and random errors called common.
"""

import numpy as np
import pytest
from imperfect_cases import JOINTS, SPECIMENS, alike, grounds_of, off_centre
from scipy import stats
from sweeps import sweep

from spinepipe.studies.discrepancy.imperfection_rows import imperfection_rows, told_imperfections
from spinepipe.studies.discrepancy.search.baseline import BaselineFit
from spinepipe.studies.discrepancy.search.imperfections import (
    AbsorbedGap,
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
    assert next(iter(taken.by_kind)) == "joint_centre"
    # chi2 as marginal over the nuisances is that of the fit
    assert taken.linear_chi2 == pytest.approx(taken.without.chi2 - shifted[0].fit.chi2, rel=0.02)


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


def test_of_readings_that_say_too_little_there_is_no_mean() -> None:
    at = NuisancePlace("*", "joint_centre", "anterior", "x", "*", PRIOR_M, "m")
    assert _mean(at, np.zeros(3), np.eye(3)) is None
    assert _mean(at, np.zeros(3), np.diag([0.0, 1.0, 1.0])) is None
    assert _mean(at, np.zeros(3), np.diag([0.0, 0.0, 1.0])) is not None


def test_rows_and_words_say_what_was_taken_up(shifted):
    rows = list(imperfection_rows(shifted[1], "base"))
    frame = from_rows(IMPERFECTIONS, rows).to_pandas()
    assert not frame.duplicated(list(IMPERFECTIONS.key)).any()
    (anterior,) = frame[frame["common"] & (frame["component"] == "anterior")].to_dict("records")
    assert (anterior["specimen"], anterior["joint"], anterior["unit"]) == ("*", "*", "mm")
    assert anterior["value"] == pytest.approx(2.0, abs=0.2)
    told = told_imperfections(shifted[1])
    assert told.gap_without > told.gap_with
    assert {one.kind for one in told.common} == {"joint_centre"}
    for words in ("Without the small imperfections", "joint_centre", "no random error"):
        assert words in told.message


def test_where_nothing_is_allowed_for_nothing_is_taken_up():
    grounds = grounds_of(off_centre(alike(0.0 * SHIFT_M)), NuisancePriors(*[0.0] * 8))
    taken = absorbed_gap(grounds, grounds.fit, JOINTS, at_once)
    assert (taken.each, taken.common, taken.linear_chi2) == ((), (), 0)
    assert taken.without.gap == pytest.approx(taken.beside.gap, abs=1e-4)
    assert "change little" in told_imperfections(taken).message
