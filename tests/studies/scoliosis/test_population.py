"""What is taken for granted of a population, what rounds do with it, and what films add to it.

Would catch rounds that end too early or never, and spreads with the wrong prior.
"""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.stats import multivariate_normal
from sweeps import sweep

from spinepipe.progress import Progress
from spinepipe.studies.scoliosis import fit_population as learning
from spinepipe.studies.scoliosis.film_fit import (
    READINGS,
    FilmFit,
    FilmInformation,
    _information,
    ends_of,
    laws_of,
    prior,
)
from spinepipe.studies.scoliosis.film_regions import _of_films, by_ratio
from spinepipe.studies.scoliosis.films import FilmSd, film_sd
from spinepipe.studies.scoliosis.population import (
    PATIENT_SPREAD,
    PatientPrior,
    Population,
    PopulationEstimate,
    population_of,
    population_rows,
    unsure_means,
    update_population,
    usual_population,
)
from spinepipe.studies.scoliosis.tables import POPULATION
from spinepipe.tables import from_rows

SILENT = Progress(lambda line: None)


def test_what_is_assumed_of_segments_before_any_film() -> None:
    """Half of the ratios between 0.76 and 1.3; ends about 9 deg, half of them within 0.79 to 1.27,
    which of one patient have 0.15 in common: logarithms with SDs of 0.40, and 0.35 and 0.15."""
    usual = usual_population(3)
    assert usual.segments == 3
    np.testing.assert_allclose(np.exp(usual.mean[:3]), 1.0)
    np.testing.assert_allclose(np.rad2deg(np.exp(usual.mean[3:])), 9.0)
    half = 0.6744897501960817
    np.testing.assert_allclose(np.exp(half * usual.sd[:3]), 1.31, atol=0.005)
    np.testing.assert_allclose(usual.sd[3:], np.hypot(0.35, 0.15))
    covariance = np.linalg.inv(usual.precision)
    np.testing.assert_allclose(covariance[3, 8], 0.15**2)


def test_assumptions_count_as_thirty_segments() -> None:
    """One patient of four segments who is just as the mean has it, known exactly."""
    usual = usual_population(4)
    found = update_population(usual, [PatientPrior(usual.mean, np.zeros((12, 12)))])
    assert found.ratio_sd == pytest.approx(0.40 * np.sqrt(30.0 / (30.0 + 4.0)))
    assert found.end_sd == pytest.approx(0.35 * np.sqrt(30.0 / (30.0 + 2.0 * 4.0 - 1.0)))


def test_levels_and_the_common_end_are_drawn_to_what_is_assumed() -> None:
    """SDs of levels of 0.30 and 0.15 and of the common end of 0.25, as for one patient."""
    usual = Population(usual_population(2).mean, 0.3, 0.15)
    mean = usual.mean + np.array([0.2, -0.2, *(0.5, 0.1, 0.1, 0.1)])
    found = update_population(usual, [PatientPrior(mean, np.zeros((6, 6)))]).mean - usual.mean
    np.testing.assert_allclose(found[:2], [0.1, -0.1])  # 0.3^2 / (0.3^2 + 0.3^2)
    common = 0.2 * 0.25**2 / (0.25**2 + 0.15**2 + 0.15**2 / 4.0)
    np.testing.assert_allclose(found[2:], common + np.array([0.15, -0.05, -0.05, -0.05]))


def moved(by: float) -> Any:
    """A population whose means all move by so much each time."""

    def again(population: Population, *_: object) -> Population:
        return Population(population.mean + by, population.ratio_sd, population.end_sd)

    return again


@sweep("by, rounds", [(0.029, 1), (-0.029, 1), (0.031, 20), (-0.031, 20)])
def test_rounds_end_when_the_population_stands_still_or_after_twenty(
    by: float, rounds: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    told = SimpleNamespace(information=SimpleNamespace(matrix=np.eye(6)))
    monkeypatch.setattr(learning, "patient_of", lambda *_: None)
    monkeypatch.setattr(learning, "FilmFit", lambda *_: None)
    monkeypatch.setattr(learning, "fit_alike", lambda *_: [told, None])
    monkeypatch.setattr(learning, "_likeliest", moved(by))
    cohort: Any = SimpleNamespace(specimen_names=("p1", "p2"), joint_names=("a", "b"))
    study: Any = None
    found = learning.fit_population(study, cohort, np.ones(3), SILENT)
    assert (found.rounds, found.patients, found.unfitted) == (rounds, 1, ("p2",))
    assert found.change == pytest.approx(abs(by))
    assert found.settled is (rounds < 20)


@sweep("by, steps", [(0.99e-4, 1), (1.01e-4, 500)])
def test_steps_on_parabolas_end_when_nothing_moves_or_after_five_hundred(
    by: float, steps: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(learning, "update_population", moved(by))
    patient: Any = SimpleNamespace(known=lambda population: None)
    found = learning._likeliest(usual_population(2), [patient])
    np.testing.assert_allclose(found.mean - usual_population(2).mean, steps * by, rtol=1e-9)
    usual = usual_population(2)
    assert learning._likeliest(usual, []) is usual


def test_the_largest_change_counts_up_or_down() -> None:
    one = Population(np.zeros(3), 0.4, 0.2)
    for other, change in (
        (Population(np.array([0.0, -0.3, 0.2]), 0.4, 0.2), 0.3),
        (Population(np.array([0.0, -0.3, 0.2]), 0.8, 0.2), np.log(2.0)),
        (Population(np.array([0.0, -0.3, 0.2]), 0.4, 0.1), np.log(2.0)),
    ):
        assert learning._change(one, other) == pytest.approx(change)


def test_a_table_tells_means_with_the_interval_of_patients() -> None:
    """Of a normal logarithm: exp(mean -+ 1.96 SD); ends in degrees."""
    usual = usual_population(2)
    rows = list(
        population_rows(
            PopulationEstimate(usual, 4, np.inf, 3, (), True),
            ("a", "b"),
            FilmSd(np.full(3, 0.002), np.full(3, 0.001)),
        )
    )
    assert [(row["quantity"], row["joint"]) for row in rows] == [
        (quantity, joint) for quantity in ("ratio", "lower_end", "upper_end") for joint in "ab"
    ]
    ratio, end = rows[0], rows[4]
    assert [ratio["mean"], ratio["low"], ratio["high"]] == pytest.approx(
        [1.0, np.exp(-1.959964 * 0.4), np.exp(1.959964 * 0.4)]
    )
    reach = np.exp(1.959964 * np.hypot(0.35, 0.15))
    assert [end["mean"], end["low"], end["high"]] == pytest.approx([9.0, 9.0 / reach, 9.0 * reach])
    assert (ratio["unit"], end["unit"], ratio["sd_log"], end["sd_log"]) == ("", "deg", 0.4, 0.35)
    assert (end["place_sd_mm"], end["tilt_sd_deg"]) == pytest.approx((2.0, np.rad2deg(0.002)))
    assert (end["last_change"], end["message"], end["rounds"], end["n_patients"]) == (
        None,
        "",
        4,
        3,
    )


def test_films_are_weighed_with_two_readings_and_the_model() -> None:
    """sqrt(2 x 3^2 + 1^2) mm and sqrt(2 x 2^2 + 1^2) deg."""
    found = film_sd(reading_mm=3.0, reading_deg=2.0, model_mm=1.0, model_deg=1.0)
    np.testing.assert_allclose(found.vertebra, [np.sqrt(19.0) / 1e3] * 2 + [np.deg2rad(3.0)])
    read = np.sqrt(2.0) * np.array([3e-3, 3e-3, np.deg2rad(2.0)])
    np.testing.assert_allclose(found.frame, read)  # a model moves no frame


def test_what_films_say_of_numbers_is_told_whatever_the_top_was() -> None:
    """Errors e + J (x - at) of unit SD and a top drawn about nothing with an SD of one: the same
    as a normal of all, of which the top is left out."""
    rng = np.random.default_rng(20200)
    n = 3 + READINGS
    slopes, errors, at = rng.normal(size=(20, n)), rng.normal(size=20), rng.normal(size=n)
    told = _information(errors, slopes, at)
    of_top = np.diag([0.0] * 3 + [1.0] * READINGS)
    covariance = np.linalg.inv(slopes.T @ slopes + of_top)
    mean = covariance @ (slopes.T @ (slopes @ at - errors))
    np.testing.assert_allclose(np.linalg.inv(told.matrix), covariance[:3, :3])
    np.testing.assert_allclose(np.linalg.solve(told.matrix, told.vector), mean[:3])


def test_a_patient_of_a_population_is_between_the_films_and_the_population() -> None:
    """As precise as both together; and by how many numbers the films decided."""
    population = usual_population(1)
    told = FilmInformation(
        3.0 * population.precision, 3.0 * population.precision @ (population.mean + 1.0)
    )
    known = told.known(population)
    np.testing.assert_allclose(known.mean, population.mean + 0.75)
    np.testing.assert_allclose(known.covariance, np.linalg.inv(population.precision) / 4.0)
    assert told.decided(population) == pytest.approx(3.0 * 0.75)


def test_means_that_films_leave_open_widen_what_is_known_of_a_patient() -> None:
    """One number of a segment, by hand: films of no weight leave the spread and the mean's own
    error; films of the population's own weight halve the way to the mean, and a quarter of its
    error's variance is left."""
    population = replace(usual_population(1), unsure=np.full(3, 0.5))
    nothing = np.zeros((3, 3))
    told = FilmInformation(nothing, np.zeros(3)).known(population)
    np.testing.assert_allclose(np.diag(told.covariance), population.sd**2 + 0.25)
    told = FilmInformation(population.precision, np.zeros(3)).known(population)
    np.testing.assert_allclose(np.diag(told.covariance), population.sd**2 / 2.0 + 0.25 / 4.0)


def test_means_are_the_surer_the_more_patients_tell() -> None:
    """Ratios of patients whose films are exact: 1 / (1 / 0.3^2 + n / 0.4^2); none: 0.3."""
    usual = usual_population(1)
    exact = np.diag([1e9, 0.0, 0.0])
    for n in (0, 1, 10):
        found = unsure_means(usual, [exact] * n)[0]
        assert found == pytest.approx((1.0 / (1.0 / 0.09 + n / 0.16)) ** 0.5, rel=1e-6)


def test_ends_and_stiffness_at_rest_are_those_of_the_numbers() -> None:
    numbers = np.concatenate([np.log([0.5, 2.0]), np.log([0.1, 0.2]), np.log([0.1, 0.3])])
    lower, upper = ends_of(numbers)
    np.testing.assert_allclose([lower, upper], [[-0.1, -0.2], [0.1, 0.3]])
    # of equal ends e the slope at rest is stretch x pi / (2 e)
    stretch = laws_of(numbers, 80.0)[0, 0]
    assert stretch * np.pi / (2.0 * 0.1) == pytest.approx(40.0)


def of_films(right: list[float], left: list[float]) -> Any:
    """A fit of which only the films are known, rotations in deg."""
    made: Any = object.__new__(FilmFit)
    made.segments = len(right)
    made.patient = SimpleNamespace(
        pairs=SimpleNamespace(right=np.deg2rad(right), left=np.deg2rad(left))
    )
    return made


def test_a_fit_begins_with_ends_beyond_what_the_films_show() -> None:
    """1.3, 2 and 4 times as far as the films turn each segment to a side; a segment that does not
    turn there counts as 0.1 deg. No end is nearer than the population's."""
    fit = of_films([6.0, -2.0], [-9.0, -3.0])
    numbers = np.concatenate([[0.1, -0.1], np.log(np.deg2rad([1.0, 5.0, 20.0, 0.01]))])
    guesses = list(fit._guesses(Population(numbers, 0.4, 0.35)))
    assert len(guesses) == 3
    for guess, times in zip(guesses, (1.3, 2.0, 4.0), strict=True):
        np.testing.assert_allclose(guess[:2], [0.1, -0.1])
        ends = np.rad2deg(np.exp(guess[2:6]))
        expected = [9.0 * times, max(5.0, 3.0 * times), max(20.0, 6.0 * times), 0.1 * times]
        np.testing.assert_allclose(ends, expected)
        assert not guess[6:].any()
        assert len(guess) == 6 + READINGS == 18


def test_an_unfitted_patient_has_the_population_s_intervals() -> None:
    """Ratios are told about their mean: of two segments each with an SD of 0.4 / sqrt(2)."""
    fit = of_films([6.0, 6.0], [-6.0, -6.0])
    fit.size, fit.model_of = 80.0, lambda numbers: "model"
    found = fit.unfitted(usual_population(2))
    reach = np.exp(1.959964 * 0.4 / np.sqrt(2.0))
    np.testing.assert_allclose(found.ratio_range, [[1.0 / reach] * 2, [reach] * 2], rtol=1e-6)
    np.testing.assert_allclose(found.at_rest, [80.0, 80.0])
    np.testing.assert_allclose(np.rad2deg(found.ends.upper), 24.0)  # four times 6, beyond 9
    assert (found.decided, found.free) == (0.0, 5)
    assert not found.constrained.any()


def test_a_profiled_ratio_is_drawn_to_nothing_and_all_else_to_the_population() -> None:
    """The sum of squares beside the films is minus twice the logarithm of a normal density of the
    other numbers, but for what does not change."""
    population = usual_population(2)
    mean, sd, _ = prior(population)
    np.testing.assert_allclose(mean, [*population.mean, *np.zeros(READINGS)])
    np.testing.assert_allclose(sd, [*population.sd, *np.ones(READINGS)])
    nothing = np.zeros(0)
    fit: Any = SimpleNamespace(missed=lambda unknowns: (nothing, np.zeros((0, len(unknowns)))))
    numbers = by_ratio(2, 6 + READINGS, 0)
    point = _of_films(fit, population, 0, numbers)
    covariance = np.linalg.inv(population.precision)
    kept = np.array([1, 2, 3, 4, 5])
    density = multivariate_normal(mean[kept], covariance[np.ix_(kept, kept)])
    rng = np.random.default_rng(20201)
    costs = []
    for _ in range(3):
        unknowns = mean + rng.normal(0.0, 0.1, len(mean))
        errors, slopes = point(np.linalg.solve(numbers, unknowns))
        top = unknowns[-READINGS:]
        costs.append(errors @ errors - top @ top + 2.0 * density.logpdf(unknowns[kept]))
        assert slopes.shape == (len(errors), 6 + READINGS)
    np.testing.assert_allclose(costs, costs[0])


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
    found = usual_population(SEGMENTS)
    for _ in range(20):
        found = update_population(found, [PatientPrior(one, nothing) for one in drawn])
    # 2,000 patients: means to 0.3 / sqrt(2000), five times that; spreads to a few percent
    np.testing.assert_allclose(found.mean, truth.mean, atol=0.035)
    # ratios are told about their mean, which takes one of their freedoms
    assert abs(found.ratio_sd / (truth.ratio_sd * np.sqrt(1.0 - 1.0 / SEGMENTS)) - 1.0) < 0.03
    assert abs(found.end_sd / truth.end_sd - 1.0) < 0.03


def test_a_population_comes_back_from_its_table() -> None:
    population = replace(made(), unsure=np.linspace(0.1, 0.3, 3 * SEGMENTS))
    sd = FilmSd(np.array([1.1e-3, 1.1e-3, 0.01]), np.array([1e-3, 1e-3, 0.02]))
    told = PopulationEstimate(population, 3, 0.01, 7, ("p05",), True)
    rows = from_rows(POPULATION, list(population_rows(told, JOINTS, sd))).to_pandas()
    found, weights = population_of(rows)
    np.testing.assert_allclose(found.mean, population.mean, atol=1e-12)
    assert (found.ratio_sd, found.end_sd) == (population.ratio_sd, population.end_sd)
    np.testing.assert_allclose(found.unsure, population.unsure)
    np.testing.assert_allclose(weights.vertebra, sd.vertebra, rtol=1e-12)
    np.testing.assert_allclose(weights.frame, sd.frame, rtol=1e-12)
    assert set(rows["message"]) == {"without p05: no fit"}
    within = (rows["low"] < rows["mean"]) & (rows["mean"] < rows["high"])
    assert within.all()


def test_patients_of_whom_nothing_is_known_change_no_spread() -> None:
    before = usual_population(SEGMENTS)
    unknown = PatientPrior(before.mean, np.linalg.inv(before.precision))
    after = update_population(before, [unknown] * 50)
    np.testing.assert_allclose(after.mean, before.mean, atol=1e-12)
    np.testing.assert_allclose([after.ratio_sd, after.end_sd], [0.40, 0.35], rtol=1e-9)
