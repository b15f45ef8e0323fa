"""Partial pooling: statistics against other people's, mechanics against a plain optimiser.

Catches a likelihood, posterior or slope of the hierarchy that is not the textbook's.
"""

from dataclasses import replace
from typing import Any

import numpy as np
import pandas as pd
import pytest
from example_effects import NOWHERE, loaded, solved_poses, spine
from scipy.linalg import block_diag
from scipy.optimize import minimize
from scipy.stats import multivariate_normal, norm
from scipy.stats import t as student_t
from statsmodels.regression.mixed_linear_model import MixedLM

from spinepipe.calibration import Evaluator, MeasuredCase, Pooled, Problem, fit, pool, pooling
from spinepipe.calibration import hierarchy as spreads
from spinepipe.calibration.hierarchy import (
    Hierarchy,
    LinearReadings,
    Spreads,
    condense_readings,
    estimate_spreads,
    interpolate_spreads,
    tellable_spreads,
)
from spinepipe.effects import Wrench
from spinepipe.effects.contract import Array
from spinepipe.model import LoadStep
from spinepipe.statics import free_parameters, with_parameters
from spinepipe.status import Status

pytestmark = pytest.mark.numeric

ROTATIONS = ("extension_nm_per_rad", "right_bending_nm_per_rad", "left_rotation_nm_per_rad")
READING_SD = np.array([2e-5] * 3 + [1e-3] * 3)
"""(6,) m and rad."""

ANGLES = np.array([0.0, 0.0, 0.0, 1.0, 1.0, 1.0])
FLAT = 10.0
"""SD of the mean's prior, as documented."""

TWO_DOF = np.repeat([0, 1], 3)
SPREADS = Spreads(np.array([0.2, 0.3]), np.array([0.4, 0.1]), np.array([0.15, 0.5]), 0.3)


def one_dof(level: float, specimen: float, rest: float, scatter: float = 1.0) -> Spreads:
    return Spreads(np.array([level]), np.array([specimen]), np.array([rest]), scatter)


def prior_covariance(dof: Array, n_specimens: int, spreads: Spreads) -> Array:
    """Of all unknowns of all specimens, written down pair by pair."""
    places = [(s, p) for s in range(n_specimens) for p in range(len(dof))]
    covariance = np.zeros((len(places), len(places)))
    for i, (s, p) in enumerate(places):
        for k, (t, q) in enumerate(places):
            d = dof[p]
            if dof[q] == d:
                covariance[i, k] = FLAT**2 + (
                    (p == q) * spreads.level[d] ** 2
                    + (s == t) * spreads.specimen[d] ** 2
                    + (s == t and p == q) * spreads.rest[d] ** 2
                )
    return covariance


def random_readings(rng: np.random.Generator) -> tuple[list[Array], list[Array]]:
    """Many, too few, no and some readings of six unknowns in four specimens."""
    counts = (20, 3, 0, 9)
    return [rng.normal(size=(n, 6)) for n in counts], [rng.normal(size=n) for n in counts]


def density(designs: list[Array], targets: list[Array], dof: Array, spreads: Spreads) -> float:
    """Logarithm, by scipy, of readings whose covariance is written down in full."""
    design = block_diag(*designs)
    covariance = design @ prior_covariance(dof, len(designs), spreads) @ design.T
    covariance += spreads.scatter**2 * np.eye(len(covariance))
    return float(multivariate_normal(cov=covariance).logpdf(np.concatenate(targets)))


def known_exactly(table: Array) -> LinearReadings:
    """Readings of (S, J) unknowns that leave next to nothing open; NaN is not read at all."""
    rows = [np.eye(table.shape[1])[np.isfinite(row)] * 1e5 for row in table]
    return condense_readings(
        rows, [r @ np.nan_to_num(t) for r, t in zip(rows, table, strict=True)], table.shape[1]
    )


def drawn(rng: np.random.Generator, s: int, j: int, spreads: Spreads, mean: float) -> Array:
    """(S, J) unknowns of one degree of freedom."""
    level = spreads.level * rng.normal(size=(1, j))
    specimen = spreads.specimen * rng.normal(size=(s, 1))
    return mean + level + specimen + spreads.rest * rng.normal(size=(s, j))


def test_the_marginal_likelihood_is_that_of_the_full_covariance() -> None:
    designs, targets = random_readings(np.random.default_rng(0))
    found = Hierarchy(condense_readings(designs, targets, 6), TWO_DOF, SPREADS)
    expected = density(designs, targets, TWO_DOF, SPREADS)
    assert found.log_likelihood == pytest.approx(expected, rel=1e-10)


def test_the_posterior_is_that_of_the_full_covariance() -> None:
    designs, targets = random_readings(np.random.default_rng(1))
    found = Hierarchy(condense_readings(designs, targets, 6), TWO_DOF, SPREADS).posterior()
    prior, design = prior_covariance(TWO_DOF, 4, SPREADS), block_diag(*designs)
    information = design.T @ design / SPREADS.scatter**2
    covariance = np.linalg.inv(np.linalg.inv(prior) + information)
    x = covariance @ design.T @ np.concatenate(targets) / SPREADS.scatter**2
    np.testing.assert_allclose(found.x.ravel(), x, atol=1e-9)
    determined = np.diagonal(information @ covariance).reshape(4, 6).sum(axis=1)
    np.testing.assert_allclose(found.effective_parameters, determined, atol=1e-9)
    for s in range(4):
        block = slice(6 * s, 6 * s + 6)
        np.testing.assert_allclose(found.covariance[s], covariance[block, block], atol=1e-9)


def test_slopes_are_those_of_the_likelihood() -> None:
    designs, targets = random_readings(np.random.default_rng(2))
    slopes = Hierarchy(condense_readings(designs, targets, 6), TWO_DOF, SPREADS).slopes()

    def along(name: str, direction: Array) -> float:
        ends = [
            density(
                designs,
                targets,
                TWO_DOF,
                replace(SPREADS, **{name: getattr(SPREADS, name) * np.exp(step * direction)}),
            )
            for step in (-1e-4, 1e-4)
        ]
        return (ends[1] - ends[0]) / 2e-4

    for name in ("level", "specimen", "rest"):
        expected = [along(name, direction) for direction in np.eye(2)]
        np.testing.assert_allclose(getattr(slopes, name), expected, rtol=1e-5, atol=1e-6)
    assert slopes.scatter == pytest.approx(along("scatter", np.array(1.0)), rel=1e-5)


def test_closed_forms_of_the_balanced_two_way_table() -> None:
    """Mean squares give restricted likelihood's spreads, and they the shrinkage (BLUP)."""
    s, j = 6, 5
    table = drawn(np.random.default_rng(4), s, j, one_dof(0.3, 0.4, 0.2), 0.7)
    grand, by_level, by_specimen = table.mean(), table.mean(axis=0), table.mean(axis=1)
    left = table - by_level - by_specimen[:, None] + grand
    rest = np.sum(left**2) / ((s - 1) * (j - 1))
    level = np.var(by_level, ddof=1) - rest / s
    specimen = np.var(by_specimen, ddof=1) - rest / j
    assert min(level, specimen) > 0.0
    spreads = one_dof(*np.sqrt([level, specimen, rest]))
    hierarchy = Hierarchy(known_exactly(table), np.zeros(j, dtype=int), spreads)
    slopes, found = hierarchy.slopes(), hierarchy.posterior()
    # flat to within what the mean's wide prior bends, in degrees of freedom
    for slope in (slopes.level, slopes.specimen, slopes.rest):
        np.testing.assert_allclose(slope, 0.0, atol=2e-3)
    variance = (j * specimen + s * level + rest) / (s * j)
    assert found.mean[0] == pytest.approx(grand, rel=1e-3)
    assert found.mean_sd[0] == pytest.approx(np.sqrt(variance), rel=1e-3)
    shrinkage = s * level / (s * level + rest)
    np.testing.assert_allclose(found.common, grand + shrinkage * (by_level - grand), atol=1e-3)
    np.testing.assert_allclose(found.x, table, atol=1e-8)
    assert found.effective_parameters.sum() == pytest.approx(s * j, rel=1e-6)


def test_an_unbalanced_table_against_statsmodels() -> None:
    table = drawn(np.random.default_rng(12), 7, 6, one_dof(0.5, 0.4, 0.3), -0.4)
    table[[0, 2, 3, 3, 5], [1, 4, 0, 5, 2]] = np.nan
    specimen, level = np.nonzero(np.isfinite(table))
    cells = pd.DataFrame({"specimen": specimen, "level": level, "x": table[specimen, level]})
    theirs = MixedLM.from_formula(
        "x ~ 1",
        cells,
        groups=np.ones(len(cells)),
        vc_formula={"level": "0 + C(level)", "specimen": "0 + C(specimen)"},
    ).fit(reml=True, method="lbfgs")
    spreads = one_dof(*np.sqrt([*theirs.vcomp, theirs.scale]))
    hierarchy = Hierarchy(known_exactly(table), np.zeros(6, dtype=int), spreads)
    slopes, found = hierarchy.slopes(), hierarchy.posterior()
    for slope in (slopes.level, slopes.specimen, slopes.rest):
        np.testing.assert_allclose(slope, 0.0, atol=5e-3)
    assert found.mean[0] == pytest.approx(theirs.fe_params.iloc[0], rel=1e-3, abs=1e-3)
    assert found.mean_sd[0] == pytest.approx(theirs.bse_fe.iloc[0], rel=1e-3)
    effects = theirs.random_effects[1.0]
    levels = [effects[f"level[C(level)[{j}]]"] for j in range(6)]
    np.testing.assert_allclose(found.common - found.mean[0], levels, atol=2e-3)


def test_estimates_are_the_mode_of_likelihood_and_prior() -> None:
    rng = np.random.default_rng(5)
    x = np.column_stack([drawn(rng, 4, 3, one_dof(0.4, 0.5, 0.3), m) for m in (0.3, -0.2)])
    designs = [3.0 * rng.normal(size=(n, 6)) for n in (20, 9, 5, 30)]
    targets = [d @ row + 0.2 * rng.normal(size=len(d)) for d, row in zip(designs, x, strict=True)]
    best = estimate_spreads(condense_readings(designs, targets, 6), TWO_DOF, None).spreads

    def height(spreads: Spreads) -> float:
        """With Gamma(2, 2) on each spread: log spread - 2 spread."""
        sizes = np.concatenate([spreads.level, spreads.specimen, spreads.rest])
        return density(designs, targets, TWO_DOF, spreads) + np.sum(np.log(sizes) - 2.0 * sizes)

    top = height(best)
    for name in ("level", "specimen", "rest"):
        for direction in (*np.eye(2), *-np.eye(2)):
            assert height(replace(best, **{name: getattr(best, name) * 1.03**direction})) < top
    for factor in (0.97, 1.03):
        assert height(replace(best, scatter=best.scatter * factor)) < top


@pytest.mark.parametrize(
    ("shape", "told"),
    [((1, 4), [0, 0, 1]), ((4, 1), [0, 0, 1]), ((1, 1), [0, 0, 1]), ((2, 2), [1, 1, 1])],
)
def test_what_cannot_be_told_apart_is_dropped(shape: tuple[int, int], told: list[int]) -> None:
    table = drawn(np.random.default_rng(6), *shape, one_dof(0.3, 0.3, 0.3), 0.2)
    readings, dof = known_exactly(table), np.zeros(shape[1], dtype=int)
    assert tellable_spreads(readings, dof)[:, 0].tolist() == told
    found = estimate_spreads(readings, dof, 1.0).spreads
    assert [found.level[0] > 0, found.specimen[0] > 0, found.rest[0] > 0] == told
    assert found.rest[0] < 2.0


def test_two_specimens_that_share_no_level_tell_no_level() -> None:
    table = np.array([[0.1, 0.3, np.nan, np.nan], [np.nan, np.nan, 0.2, -0.3]])
    assert tellable_spreads(known_exactly(table), np.zeros(4, dtype=int))[:, 0].tolist() == [
        0,
        1,
        1,
    ]


@pytest.mark.full
def test_true_spreads_come_back_and_newcomers_are_where_expected() -> None:
    """At 0.5 the prior has its mode and pulls neither way; variances are then unbiased."""
    rng, truth, dof = np.random.default_rng(7), one_dof(0.5, 0.5, 0.5, 0.1), np.zeros(10, dtype=int)
    variances, off = [], []
    for _ in range(60):
        table = drawn(rng, 11, 10, truth, 0.3)
        cohort, newcomer = table[:10], table[10]
        designs = [rng.normal(size=(25, 10)) for _ in cohort]
        targets = [d @ x + 0.1 * rng.normal(size=25) for d, x in zip(designs, cohort, strict=True)]
        readings = condense_readings(designs, targets, 10)
        found = estimate_spreads(readings, dof, None).spreads
        variances.append([found.level[0], found.specimen[0], found.rest[0], found.scatter])
        expected = Hierarchy(readings, dof, found).posterior()
        away = newcomer - expected.common
        off.append(away @ np.linalg.solve(expected.newcomer_covariance, away) / 10)
    variances = np.square(variances)
    error = variances.std(axis=0, ddof=1) / np.sqrt(60)
    assert np.all(np.abs(variances.mean(axis=0) - [0.25, 0.25, 0.25, 0.01]) < 3.0 * error)
    assert abs(np.mean(off) - 1.0) < 3.0 * np.sqrt(2 / 600)


def newcomers(seeds: int, n: int, j: int) -> Array:
    """How many SDs a new specimen of j joints is off what n others lead one to expect."""
    off = []
    for seed in range(seeds):
        rng, dof = np.random.default_rng(seed), np.zeros(j, dtype=int)
        table = drawn(rng, n + 1, j, one_dof(0.1, 0.5, 0.15), 0.0)
        readings = known_exactly(table[:n])
        expected = Hierarchy(
            readings, dof, estimate_spreads(readings, dof, 1.0).spreads
        ).posterior()
        off.append((table[n] - expected.common) / np.sqrt(np.diag(expected.newcomer_covariance)))
    return np.abs(off)


@pytest.mark.full
def test_a_newcomer_to_five_needs_students_t() -> None:
    """Normal intervals are too short, at 95 %, by more than chance; those of t are not."""
    off = newcomers(120, 5, 6)
    normal, student = (
        np.mean(off < reach, axis=1) for reach in (norm.ppf(0.975), student_t(4).ppf(0.975))
    )
    error = normal.std(ddof=1) / np.sqrt(len(off))
    assert normal.mean() < 0.95 - error
    assert student.mean() > 0.95


TRUTHS = np.random.default_rng(20).normal(0.1, 0.3, (3, 6))


def measured_problem(truth: Array, seed: int, sd: Array = READING_SD, steps: int = 3) -> Problem:
    """A specimen of two joints whose rotational stiffness is free level by level."""
    model = spine(2)
    free = free_parameters(model, 0, ROTATIONS, "per_joint")
    case, true_model = loaded(model, steps), with_parameters(model, free, truth)
    poses = solved_poses(true_model, case)
    read = poses + sd * np.random.default_rng(seed).normal(size=poses.shape)
    return Problem(
        model, (MeasuredCase(case, read),), free, ANGLES, -np.full(6, 3.0), np.full(6, 3.0)
    )


def cohort(sd: Array = READING_SD, steps: int = 3) -> list[Problem]:
    return [measured_problem(truth, seed, sd, steps) for seed, truth in enumerate(TRUTHS)]


def reading(problem: Problem, keep: Array) -> Problem:
    case = problem.cases[0]
    cases = (replace(case, measured=np.where(keep, case.measured, np.nan)),)
    return replace(problem, cases=cases)


def spreads_of(pooled: Pooled) -> Spreads:
    rows = np.array([[s.level, s.specimen, s.rest] for s in pooled.spreads])
    return Spreads(*rows.T, pooled.scatter)


def penalised_cost(x: Array, problems: list[Problem], prior: Array, scatter: float) -> float:
    """Squared errors of plain forward simulations and distance from the prior."""
    total = x @ np.linalg.solve(prior, x)
    for problem, own in zip(problems, x.reshape(len(problems), -1), strict=True):
        model = with_parameters(problem.model, problem.free, own)
        for case in problem.cases:
            error = np.rad2deg(solved_poses(model, case.case) - case.measured)[:, :, 3:]
            total += np.sum(error**2) / scatter**2
    return float(total)


def test_a_cohort_ends_where_its_penalised_cost_is_least() -> None:
    """Along each unknown, a parabola through plain simulations has its vertex there."""
    problems = cohort(5.0 * READING_SD, steps=2)[:2]
    found = pool(problems)
    assert found.status is Status.CONVERGED
    assert found.message == ""
    spreads = spreads_of(found)
    prior = prior_covariance(np.repeat([0, 1, 2], 2), 2, spreads)
    x = np.concatenate([specimen.x for specimen in found.specimens])

    def cost(at: Array) -> float:
        return penalised_cost(at, problems, prior, spreads.scatter)

    step, least = 0.02, cost(x)
    for along in step * np.eye(12):
        before, after = cost(x - along), cost(x + along)
        curved = before + after - 2.0 * least
        assert curved > 0.0
        # far below the standard errors
        assert abs(step * (before - after) / (2.0 * curved)) < 1e-3
    own_fits = np.concatenate([fit(problem).x for problem in problems])
    assert np.abs(own_fits - x).max() > 0.02


def test_costs_counts_and_values_are_those_of_the_specimens() -> None:
    problems = cohort()
    found = pool(problems)
    for problem, specimen in zip(problems, found.specimens, strict=True):
        error = np.rad2deg(specimen.poses[0].reshape(3, 2, 6) - problem.cases[0].measured)
        assert specimen.cost == pytest.approx(np.sum(error[:, :, 3:] ** 2), rel=1e-9)
        assert specimen.n_readings == 3 * 2 * 3
        springs = with_parameters(problem.model, problem.free, specimen.x).effects[0].values
        np.testing.assert_allclose(specimen.values, springs[:, 3:].T.ravel(), rtol=1e-12)
    cost = sum(specimen.cost for specimen in found.specimens)
    each = [specimen.effective_parameters for specimen in found.specimens]
    assert found.effective_parameters == pytest.approx(sum(each), rel=1e-12)
    # where the likelihood is highest the scatter is that of readings less parameters
    scatter = np.sqrt(cost / (54 - found.effective_parameters))
    assert found.scatter == pytest.approx(scatter, rel=1e-3)
    assert [spread.name for spread in found.spreads] == list(ROTATIONS)


def test_with_sharp_readings_every_specimen_keeps_its_own_fit() -> None:
    problems = cohort(1e-3 * READING_SD)
    found = pool(problems, noise=1e-3 * READING_SD)
    for problem, specimen in zip(problems, found.specimens, strict=True):
        alone = fit(problem, noise=1e-3 * READING_SD)
        np.testing.assert_allclose(specimen.x, alone.x, rtol=0, atol=1e-5)
        errors = np.sqrt(np.diagonal(specimen.covariance))
        np.testing.assert_allclose(errors, alone.uncertainty.standard_error, rtol=1e-2)
        assert specimen.effective_parameters == pytest.approx(6.0, abs=1e-3)
    assert found.scatter == 1.0


def test_exact_readings_give_the_truth() -> None:
    found = pool(cohort(0.0 * READING_SD))
    assert found.status is Status.CONVERGED
    x = [specimen.x for specimen in found.specimens]
    np.testing.assert_allclose(x, TRUTHS, rtol=0, atol=1e-5)


def test_readings_that_lack_are_filled_in_by_the_cohort() -> None:
    """One specimen lacks the upper joint, one has fewer steps, one has nothing at all."""
    problems = [*cohort(steps=4), measured_problem(TRUTHS[0], 9)]
    keep = np.ones((4, 2, 6), dtype=bool)
    keep[:, 1] = False
    problems[0] = reading(problems[0], keep)
    problems[3] = reading(problems[3], np.zeros((3, 2, 6), dtype=bool))
    found = pool(problems)
    lacking, nothing = found.specimens[0], found.specimens[3]
    assert lacking.status is Status.CONVERGED
    assert lacking.n_readings == 4 * 3
    assert nothing.status is Status.REFUSED
    assert "no reading" in nothing.message
    assert found.message == "1 of 4 specimens without a usable fit"
    assert found.status is Status.CONVERGED
    np.testing.assert_allclose(nothing.x, found.newcomer, atol=1e-12)
    np.testing.assert_allclose(nothing.covariance, found.newcomer_covariance, atol=1e-12)
    assert nothing.effective_parameters == pytest.approx(0.0, abs=1e-12)
    assert np.isfinite(lacking.x).all()
    ratio = np.diagonal(lacking.covariance) / np.diagonal(found.newcomer_covariance)
    assert ratio.max() < 1.0


def test_a_degree_of_freedom_that_nobody_reads_stays_where_it_was() -> None:
    """Only axial twist of an upright weightless joint: bending leaves no trace."""
    model = spine(1, gravity=False)
    model = replace(
        model, frames=(replace(model.frames[0], rotation=np.eye(3), origin=np.zeros(3)),)
    )
    free = free_parameters(model, 0, ROTATIONS, "per_joint")
    turn = Wrench(0, NOWHERE, NOWHERE, np.array([0.0, 2.0, 0.0]))
    case = replace(loaded(model), steps=(LoadStep(0, (turn,)),))
    angle = 2.0 / (model.effects[0].values[0, 5] * np.exp([0.3, -0.2]))
    problems = []
    for a in angle:
        measured = np.zeros((1, 1, 6))
        measured[0, 0, 5] = a
        problems.append(
            Problem(model, (MeasuredCase(case, measured),), free, ANGLES, -np.ones(3), np.ones(3))
        )
    found = pool(problems, noise=np.full(6, 1e-6))
    assert found.status is Status.CONVERGED
    for specimen, twist in zip(found.specimens, [0.3, -0.2], strict=True):
        np.testing.assert_allclose(specimen.x, [0.0, 0.0, twist], atol=1e-4)
        assert specimen.covariance[0, 0] > FLAT**2
        assert specimen.covariance[2, 2] < 1e-6


def test_one_specimen_leans_on_its_own_mean() -> None:
    problem = cohort(20.0 * READING_SD)[0]
    found, alone = pool([problem]), fit(problem)
    assert found.status is Status.CONVERGED
    assert [(s.level, s.specimen) for s in found.spreads] == [(0.0, 0.0)] * 3
    x = found.specimens[0].x.reshape(3, 2)
    means = [spread.mean for spread in found.spreads]
    np.testing.assert_allclose(found.newcomer.reshape(3, 2), np.tile(means, (2, 1)).T, atol=1e-9)
    assert np.all(np.ptp(x, axis=1) < np.ptp(alone.x.reshape(3, 2), axis=1))


def test_a_specimen_that_tips_is_said_to_and_the_others_go_on() -> None:
    problems = cohort()
    point = problems[0].model.bodies[1].com + np.array([0.01, 0.05, 0.0])
    press = Wrench(1, point, np.array([0.0, -1e5, 0.0]), NOWHERE)
    case = replace(problems[0].cases[0].case, steps=(LoadStep(0, (press,)),))
    tipping = replace(problems[0], cases=(MeasuredCase(case, np.zeros((1, 2, 6))),))
    found = pool([tipping, *problems[1:]])
    without = pool(problems[1:])
    assert found.specimens[0].status is Status.UNSTABLE
    assert "tip" in found.specimens[0].message
    assert found.specimens[0].cost == np.inf
    assert found.specimens[0].poses == ()
    np.testing.assert_allclose(found.specimens[0].x, found.newcomer, atol=1e-12)
    assert found.status is Status.CONVERGED
    for one, other in zip(found.specimens[1:], without.specimens, strict=True):
        np.testing.assert_allclose(one.x, other.x, atol=1e-6)
    assert pool([tipping]).status is Status.UNSTABLE


def test_bounds_are_kept_and_named() -> None:
    problems = [replace(problem, upper=np.full(6, 0.05)) for problem in cohort()]
    found = pool(problems)
    assert found.status is Status.CONVERGED_AT_BOUND
    assert all((specimen.x <= 0.05).all() for specimen in found.specimens)
    for problem, specimen in zip(problems, found.specimens, strict=True):
        # inside, those free to move make up for those at a bound
        away = specimen.x - found.newcomer
        spreads = np.array([[s.specimen, s.rest] for s in found.spreads]) ** 2
        own = block_diag(*[s * np.ones((2, 2)) + r * np.eye(2) for s, r in spreads])
        seen = Evaluator(problem).at(specimen.x)
        slope = seen.residual @ seen.jacobian / found.scatter**2 + np.linalg.solve(own, away)
        inside = specimen.at_bound == 0
        np.testing.assert_allclose(slope[inside], 0.0, atol=1e-3 * np.abs(slope).max())
        assert (slope[~inside] < 0.0).all()
    at_bound = next(s for s in found.specimens if s.at_bound.any())
    first = problems[0].free[int(np.argmax(at_bound.at_bound))].label
    assert at_bound.message.startswith(f"{first} at its upper bound")


def test_a_specimen_unlike_all_others_is_at_its_bounds() -> None:
    """Its motion at one joint has the wrong sign, which no stiffness explains."""
    problems = cohort(steps=6)
    case = problems[1].cases[0]
    flipped = case.measured * np.array([1.0, -1.0])[:, None]
    problems[1] = replace(problems[1], cases=(replace(case, measured=flipped),))
    found = pool(problems, noise=READING_SD)
    assert found.status is Status.CONVERGED_AT_BOUND
    upper = [
        p.label
        for p, at in zip(problems[1].free, found.specimens[1].at_bound, strict=True)
        if at == 1
    ]
    assert upper == [f"{name}@L1L2" for name in ROTATIONS]
    assert [found.specimens[n].status for n in (0, 2)] == [Status.CONVERGED] * 2


def test_spreads_that_do_not_settle_are_said_to_and_the_worst_specimen_is_named(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(pooling, "MOST_ROUNDS", 1)
    problems = cohort()
    problems[1] = replace(
        problems[1],
        model=replace(problems[1].model, specimen="odd"),
        cases=(replace(problems[1].cases[0], measured=-problems[1].cases[0].measured),),
    )
    found = pool(problems)
    assert found.iterations == 1
    assert found.status is Status.NOT_CONVERGED
    assert "do not settle" in found.message
    assert found.message.endswith("see odd")
    assert all(s.message.startswith("still moving") for s in found.specimens)


def test_a_search_for_spreads_that_ends_early_is_said_to(monkeypatch: pytest.MonkeyPatch) -> None:
    def early(*known: Any, options: dict[str, Any], **given: Any) -> Any:
        return minimize(*known, **given, options=options | {"maxiter": 1})

    assert pool(cohort()).message == ""
    monkeypatch.setattr(spreads, "minimize", early)
    readings, dof = known_exactly(np.random.default_rng(3).normal(size=(4, 3))), np.zeros(3, int)
    assert "LIMIT" in estimate_spreads(readings, dof, 1.0).trouble
    monkeypatch.setattr(pooling, "MOST_ROUNDS", 1)
    found = pool(cohort())
    assert found.status is Status.NOT_CONVERGED
    assert "the search for the most likely spreads ended early" in found.message


def test_a_spread_that_could_not_be_told_before_starts_anew() -> None:
    table = drawn(np.random.default_rng(6), 5, 5, one_dof(0.3, 0.3, 0.3), 0.2)
    readings, dof = known_exactly(table), np.zeros(5, dtype=int)
    found = estimate_spreads(readings, dof, 1.0, one_dof(0.0, 0.0, 0.4)).spreads
    expected = estimate_spreads(readings, dof, 1.0).spreads
    for name in ("level", "specimen", "rest"):
        np.testing.assert_allclose(getattr(found, name), getattr(expected, name), rtol=1e-3)


def test_where_it_starts_makes_no_difference() -> None:
    problems = cohort()
    found, other = pool(problems), pool(problems, starts=[np.full(6, s) for s in (-0.5, 0.9, 2.0)])
    for one, same in zip(found.specimens, other.specimens, strict=True):
        np.testing.assert_allclose(one.x, same.x, rtol=0, atol=2e-4)


def test_a_start_that_cannot_stand_is_stiffened() -> None:
    problems = cohort()
    start = np.full(6, np.log(1 / 64))
    wide = [replace(p, lower=np.full(6, -6.0)) for p in problems]
    found = pool(wide, starts=[start] * 3)
    assert found.status is Status.CONVERGED
    expected = pool(problems)
    for one, same in zip(found.specimens, expected.specimens, strict=True):
        np.testing.assert_allclose(one.x, same.x, rtol=0, atol=2e-4)


def zeroed(problem: Problem) -> Problem:
    case = problem.cases[0]
    cases = (replace(case, measured=case.measured - case.measured[0], zeroed=True),)
    return replace(problem, cases=cases)


def test_zeroed_readings_need_their_correlation_for_declared_noise() -> None:
    problems = [zeroed(problem) for problem in cohort(steps=4)]
    with pytest.raises(ValueError, match="correlated"):
        pool(problems, noise=READING_SD)
    found = pool([replace(problem, correlated=True) for problem in problems], noise=READING_SD)
    assert found.status is Status.CONVERGED


def test_what_does_not_belong_together_is_refused() -> None:
    problems = cohort()
    other = replace(
        problems[1], model=with_parameters(problems[1].model, problems[1].free, np.full(6, 0.1))
    )
    with pytest.raises(ValueError, match="another stiffness"):
        pool([problems[0], other])
    with pytest.raises(ValueError, match="unknowns differ"):
        pool([problems[0], replace(problems[1], free=problems[1].free[:3])])
    with pytest.raises(ValueError, match="must be positive"):
        pool(problems, noise=np.zeros(6))
    with pytest.raises(ValueError, match="no specimen"):
        pool([])


@pytest.mark.parametrize("share", [0.0, 0.25, 0.5, 1.0])
def test_spreads_between_two_are_so_in_logarithms_and_dropped_ones_stay_dropped(
    share: float,
) -> None:
    sizes = (np.array([0.1, 0.0]), np.array([0.2, 2.0]), np.array([0.3, 0.5]), 0.01)
    others = (np.array([0.4, 0.0]), np.array([0.8, 0.5]), np.array([3.0, 0.0]), 0.04)
    one, other = Spreads(*sizes), Spreads(*others)
    found = interpolate_spreads(one, other, share)
    for name in ("level", "specimen", "rest"):
        first, second = (getattr(spreads, name) for spreads in (one, other))
        expected = np.zeros(2)
        there = (first > 0.0) & (second > 0.0)
        expected[there] = np.exp(
            (1.0 - share) * np.log(first[there]) + share * np.log(second[there])
        )
        np.testing.assert_allclose(getattr(found, name), expected, rtol=1e-12)
    assert found.scatter == pytest.approx(0.01 * 4.0**share, rel=1e-12)
