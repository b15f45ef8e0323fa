"""Populations: their spreads, what is learned from patients, and their table.

Would catch a precision that is not the inverse of its covariance, and patients that do not give
their population back.
"""

import numpy as np

from spinepipe.studies.scoliosis.population import (
    END_FACTOR,
    END_RAD,
    END_SPREAD,
    LEVEL_END_SPREAD,
    LEVEL_RATIO_SPREAD,
    PATIENT_SPREAD,
    RATIO_SPREAD,
    PatientPrior,
    Population,
    assumed,
    learned,
)
from spinepipe.studies.scoliosis.population_table import (
    PopulationEstimate,
    population_of,
    population_rows,
)
from spinepipe.studies.scoliosis.tables import POPULATION
from spinepipe.tables import from_rows

SEGMENTS = 4
JOINTS = tuple(f"j{number}" for number in range(SEGMENTS))


def made(ratio_sd: float = 0.3, end_sd: float = 0.2) -> Population:
    rng = np.random.default_rng(1)
    ratios = rng.normal(0.0, 0.2, SEGMENTS)
    ends = np.log(np.deg2rad(9.0)) + rng.normal(0.0, 0.1, 2 * SEGMENTS)
    return Population(np.concatenate([ratios - ratios.mean(), ends]), ratio_sd, end_sd)


def covariance(population: Population) -> np.ndarray:
    """Written down anew: own spreads, and what the ends of a patient share."""
    found = np.diag(np.repeat([population.ratio_sd, population.end_sd], [SEGMENTS, 2 * SEGMENTS]))
    found = found**2
    found[SEGMENTS:, SEGMENTS:] += PATIENT_SPREAD**2
    return found


def test_precision_is_the_inverse_of_the_covariance_and_root_its_root() -> None:
    population = made()
    whole = covariance(population)
    np.testing.assert_allclose(population.precision @ whole, np.eye(len(whole)), atol=1e-10)
    np.testing.assert_allclose(population.root @ population.root, population.precision, atol=1e-9)
    np.testing.assert_allclose(population.sd, np.sqrt(np.diag(whole)), rtol=1e-12)


def test_patients_who_are_known_exactly_give_their_population_back() -> None:
    truth, count = made(), 2000
    rng = np.random.default_rng(2)
    drawn = rng.multivariate_normal(truth.mean, covariance(truth), count)
    drawn[:, :SEGMENTS] -= drawn[:, :SEGMENTS].mean(axis=1, keepdims=True)
    nothing = np.zeros((3 * SEGMENTS,) * 2)
    found = assumed(SEGMENTS)
    for _ in range(20):
        found = learned(found, [PatientPrior(one, nothing) for one in drawn])
    # 2,000 patients: means to 0.3 / sqrt(2000), five times that; spreads to a few percent
    np.testing.assert_allclose(found.mean, truth.mean, atol=0.035)
    # ratios are told about their mean, which takes one of their freedoms
    assert abs(found.ratio_sd / (truth.ratio_sd * np.sqrt(1.0 - 1.0 / SEGMENTS)) - 1.0) < 0.03
    assert abs(found.end_sd / truth.end_sd - 1.0) < 0.03


def test_few_patients_draw_levels_as_normal_priors_let_them() -> None:
    """By precisions: of levels about their common mean, and of that about the usual end."""
    before, count = made(), 3
    rng = np.random.default_rng(7)
    means = before.mean + rng.normal(0.0, 0.4, (count, 3 * SEGMENTS))
    nothing = np.zeros((3 * SEGMENTS, 3 * SEGMENTS))
    found = learned(before, [PatientPrior(mean, nothing) for mean in means]).mean

    def between(prior: float, sd: float, seen: np.ndarray, variance: float) -> np.ndarray:
        return (prior / sd**2 + seen / variance) / (1.0 / sd**2 + 1.0 / variance)

    ratios, ends = means[:, :SEGMENTS], means[:, SEGMENTS:].mean(axis=0)
    ratios = (ratios - ratios.mean(axis=1, keepdims=True)).mean(axis=0)
    levels = between(0.0, LEVEL_RATIO_SPREAD, ratios, before.ratio_sd**2 / count)
    np.testing.assert_allclose(found[:SEGMENTS], levels, rtol=1e-12, atol=1e-12)
    variance = (PATIENT_SPREAD**2 + before.end_sd**2 / (2 * SEGMENTS)) / count
    common = between(np.log(END_RAD), END_FACTOR, ends.mean(), variance)
    own = between(0.0, LEVEL_END_SPREAD, ends - ends.mean(), before.end_sd**2 / count)
    np.testing.assert_allclose(found[SEGMENTS:], common + own, rtol=1e-12, atol=1e-12)


def test_patients_of_whom_nothing_is_known_change_no_spread() -> None:
    before = assumed(SEGMENTS)
    unknown = PatientPrior(before.mean, np.linalg.inv(before.precision))
    after = learned(before, [unknown] * 50)
    np.testing.assert_allclose(after.mean, before.mean, atol=1e-12)
    np.testing.assert_allclose(after.ratio_sd, RATIO_SPREAD, rtol=1e-9)
    np.testing.assert_allclose(after.end_sd, END_SPREAD, rtol=1e-9)


def test_a_population_comes_back_from_its_table() -> None:
    population, sd = made(), np.array([1.1e-3, 1.1e-3, 0.01])
    told = PopulationEstimate(population, 3, 0.01, 7, ("p05",), True)
    rows = from_rows(POPULATION, list(population_rows(told, JOINTS, sd))).to_pandas()
    found, weights = population_of(rows)
    np.testing.assert_allclose(found.mean, population.mean, atol=1e-12)
    assert (found.ratio_sd, found.end_sd) == (population.ratio_sd, population.end_sd)
    np.testing.assert_allclose(weights, sd, rtol=1e-12)
    assert set(rows["message"]) == {"without p05: no fit"}
    within = (rows["low"] < rows["mean"]) & (rows["mean"] < rows["high"])
    assert within.all()
