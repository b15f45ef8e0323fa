"""Fits of tangents to both bending films: derivatives, films of the model itself, what they say.

Would catch wrong derivatives of laws and films, a fit that does not come back to the laws which
made the films, intervals too narrow, and a ratio called known that films leave open.
"""

from dataclasses import replace

import numpy as np
import pytest
from scoliosis_cases import STUDY, shipped

from spinepipe.progress import Progress
from spinepipe.studies.scoliosis import film_regions
from spinepipe.studies.scoliosis.film_fit import (
    NO_POSE,
    READINGS,
    FilmFit,
    NoFit,
    by_numbers,
    laws_of,
)
from spinepipe.studies.scoliosis.film_regions import by_ratio, region
from spinepipe.studies.scoliosis.films import LEFT, RIGHT, FilmSd, film_sd
from spinepipe.studies.scoliosis.fit_population import fit_population, weights
from spinepipe.studies.scoliosis.personal import Patient, patient_of
from spinepipe.studies.scoliosis.personalise import rows_of
from spinepipe.studies.scoliosis.population import population_rows, usual_population
from spinepipe.studies.scoliosis.tables import LAWS, POPULATION, POSITIONS
from spinepipe.tables import from_rows


@pytest.fixture(scope="module")
def patient() -> Patient:
    return patient_of(STUDY, shipped(2), "p01")


SHARP = film_sd(0.0, 0.0, 0.05, 0.02)


def times(factor: float, sd: FilmSd) -> FilmSd:
    return FilmSd(factor * sd.vertebra, factor * sd.frame)


def some_unknowns(patient: Patient) -> np.ndarray:
    rng, s = np.random.default_rng(3), patient.chain.n_joints
    numbers = usual_population(s).mean.copy()
    numbers[:s] += rng.normal(0.0, 0.3, s)
    numbers[s:] += 0.3 + rng.normal(0.0, 0.1, 2 * s)
    return np.append(numbers, rng.normal(0.0, 0.5, READINGS))


def filmed_with(patient: Patient, numbers: np.ndarray, sd: FilmSd) -> Patient:
    """The patient with bending films of the model of these numbers."""
    fit = FilmFit(patient, sd)
    spine = fit.spine.with_model(fit.model_of(numbers))
    poses = {name: spine.at(patient.read.films[name].top) for name in (RIGHT, LEFT)}
    assert all(pose.result.status == "converged" for pose in poses.values())
    films = {**patient.read.films, **{name: pose.film for name, pose in poses.items()}}
    read = replace(patient.read, films=films)
    pairs = replace(patient.pairs, right=read.turned(RIGHT), left=read.turned(LEFT))
    return replace(patient, read=read, pairs=pairs)


def test_laws_change_with_their_numbers_as_told() -> None:
    numbers = np.concatenate([[0.1, -0.2], np.log([0.1, 0.2]), np.log([0.15, 0.12])])
    told = by_numbers(numbers, 70.0)
    for column in range(3):
        for segment in range(2):
            step = np.zeros(6)
            step[2 * column + segment] = 1e-6
            change = (laws_of(numbers + step, 70.0) - laws_of(numbers - step, 70.0)) / 2e-6
            np.testing.assert_allclose(told[segment, :, column], change[segment], rtol=1e-6)
            assert not change[1 - segment].any()


def test_errors_change_with_every_unknown_as_told(patient: Patient) -> None:
    fit, at = FilmFit(patient, weights_of_a_usual_study()), some_unknowns(patient)
    found = fit.missed(at)
    assert found is not None
    for number in (0, 6, 13, 14, 25, 30, 41, 42, 44, 47, 50, 53):
        step = np.zeros(len(at))
        step[number] = 1e-5
        ends = [fit.missed(at + s * step) for s in (1.0, -1.0)]
        change = (ends[0][0] - ends[1][0]) / 2e-5
        np.testing.assert_allclose(found[1][:, number], change, rtol=0, atol=1e-6)


def weights_of_a_usual_study() -> FilmSd:
    return film_sd(0.5, 0.7, STUDY.model_sd_mm, STUDY.model_sd_deg)


def test_films_of_the_model_itself_are_reproduced(patient: Patient) -> None:
    hidden = some_unknowns(patient)[:-READINGS]
    fit = FilmFit(filmed_with(patient, hidden, SHARP), SHARP)
    found = fit.fit(usual_population(patient.chain.n_joints))
    assert found.status.usable
    errors, _ = fit.missed(found.unknowns) or (None, None)
    assert errors is not None
    assert np.sqrt(np.mean(errors**2)) < 0.5  # of the 0.05 mm and 0.02 deg that it was held to
    ratio = np.log(fit.personal(found).ratio)
    true = hidden[: len(ratio)] - hidden[: len(ratio)].mean()
    assert np.corrcoef(ratio, true)[0, 1] > 0.9


def test_what_films_decide_falls_with_how_coarsely_they_are_read(patient: Patient) -> None:
    population = usual_population(patient.chain.n_joints)
    fits = [FilmFit(patient, times(f, SHARP)).fit(population) for f in (1.0, 10.0, 100.0)]
    decided = [one.decided for one in fits]
    assert 41.0 > decided[0] > decided[1] > decided[2] > 0.0


def test_an_interval_holds_the_ratio(patient: Patient) -> None:
    fit = FilmFit(patient, weights_of_a_usual_study())
    personal = fit.personal(fit.fit(usual_population(patient.chain.n_joints)))
    assert personal.ratio_range is not None
    low, high = personal.ratio_range
    assert (low < personal.ratio).all()
    assert (personal.ratio < high).all()
    assert personal.free == 3 * patient.chain.n_joints - 1


def test_a_ratio_takes_the_place_of_a_number() -> None:
    """The logarithm of a stiffness over the geometric mean, the other numbers as they are."""
    numbers = np.array([0.3, -0.1, 0.4, 0.2, 7.0, 8.0])  # four segments, two other unknowns
    by = by_ratio(4, 6, 2)
    moved = np.linalg.solve(by, numbers)
    assert moved[2] == pytest.approx(0.4 - 0.2)
    np.testing.assert_allclose(np.delete(moved, 2), np.delete(numbers, 2), rtol=0, atol=1e-14)


def test_films_close_the_ratios_that_move_them_and_leave_others_open(patient: Patient) -> None:
    """Films of a known chain: regions hold its ratios. Coarsely read, nothing is told."""
    hidden = some_unknowns(patient)[:-READINGS]
    sd, s = weights_of_a_usual_study(), patient.chain.n_joints
    population = usual_population(s)
    filmed = FilmFit(filmed_with(patient, hidden, sd), sd)
    fitted = filmed.fit(population)
    true = np.exp(hidden[:s] - hidden[:s].mean())
    for segment, is_open in ((5, False), (12, True)):
        reach = region(filmed, population, fitted, segment)
        assert reach.open_below is reach.open_above is is_open
        if not is_open:
            assert (reach.low or np.inf) < true[segment] < (reach.high or 0.0)
    coarse = FilmFit(patient, times(100.0, sd))
    reach = region(coarse, population, coarse.fit(population), 5)
    assert reach.open_below
    assert reach.open_above


def test_a_ratio_whose_fit_does_not_arrive_is_left_open(
    patient: Patient, monkeypatch: pytest.MonkeyPatch
) -> None:
    """After two evaluations nothing has settled: what lies about such a point is no region."""
    monkeypatch.setattr(film_regions, "SETTLED", replace(film_regions.SETTLED, evaluations=2))
    fit, population = (
        FilmFit(patient, weights_of_a_usual_study()),
        usual_population(patient.chain.n_joints),
    )
    assert region(fit, population, fit.fit(population), 5) is film_regions.OPEN


def test_a_patient_without_a_pose_is_told_and_keeps_the_population(
    patient: Patient, monkeypatch: pytest.MonkeyPatch
) -> None:
    cohort = shipped(2)
    silent = Progress(lambda line: None)
    sd = weights(STUDY, cohort)
    usual = fit_population(STUDY, cohort, sd, silent)
    assert (usual.patients, usual.unfitted) == (2, ())
    monkeypatch.setattr(FilmFit, "missed", lambda self, unknowns: None)
    with pytest.raises(NoFit, match="uppermost vertebra"):
        FilmFit(patient, sd).fit(usual.population)
    rows = from_rows(POPULATION, list(population_rows(usual, cohort.joint_names, sd)))
    found = rows_of(STUDY, cohort, "p01", "tangent_fitted", rows.to_pandas())
    positions = from_rows(POSITIONS, found["positions"]).to_pandas()
    assert positions["message"].str.contains(NO_POSE).all()
    laws = from_rows(LAWS, found["laws"]).to_pandas()
    assert (laws["decided_parameters"] == 0.0).all()
    none = fit_population(STUDY, cohort, sd, silent)
    assert (none.patients, none.unfitted) == (0, ("p01", "p02"))
