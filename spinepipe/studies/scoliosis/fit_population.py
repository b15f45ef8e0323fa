"""Job: the population of a cohort, learned from the films of all its patients.

Patients are fitted in lockstep; what the films of each say near its fit is a parabola, on which
means and spreads of the population are learned until they stand still. Then all are fitted anew
under it, as the parabolas hold near the fits alone.
"""

import sys
from dataclasses import replace

import numpy as np

from spinepipe.cohort import Cohort
from spinepipe.jobs.digest import provenance
from spinepipe.jobs.inputs import study_of_kind
from spinepipe.progress import Progress
from spinepipe.studies.scoliosis.film_fit import (
    FilmFit,
    FilmFitResult,
    FilmInformation,
    fit_alike,
)
from spinepipe.studies.scoliosis.films import FilmSd, film_sd, reading_noise
from spinepipe.studies.scoliosis.personal import patient_of
from spinepipe.studies.scoliosis.population import (
    Population,
    PopulationEstimate,
    population_rows,
    unsure_means,
    update_population,
    usual_population,
)
from spinepipe.studies.scoliosis.settings import Scoliosis
from spinepipe.studies.scoliosis.tables import POPULATION
from spinepipe.tables import from_rows, write

MOST_ROUNDS = 20
LAST_ROUND = 0.03
"""Rounds end when no mean of a logarithm and no spread changes by more."""

MOST_STEPS = 500
LAST_STEP = 1e-4
"""The same of the steps on parabolas."""


def run(root: str, study: str, output: str) -> None:
    """Write ``population.parquet``."""
    settings, cohort = study_of_kind(Scoliosis, root, study)
    progress = Progress(lambda line: print(f"{study}: {line}", file=sys.stderr, flush=True))
    sd = weights(settings, cohort)
    found = fit_population(settings, cohort, sd, progress)
    rows = population_rows(found, cohort.joint_names, sd)
    write(from_rows(POPULATION, list(rows)), output, provenance("population", settings, cohort))


def weights(settings: Scoliosis, cohort: Cohort) -> FilmSd:
    """With which films are weighed; those of which nothing tells how they were read are exact."""
    _, tilt, own = np.nan_to_num(reading_noise(settings, cohort)).tolist()
    return film_sd(own, tilt, settings.model_sd_mm, settings.model_sd_deg)


def fit_population(
    settings: Scoliosis, cohort: Cohort, sd: FilmSd, progress: Progress
) -> PopulationEstimate:
    """Rounds of fits of all patients, until the population stands still."""
    patients = {name: patient_of(settings, cohort, name) for name in cohort.specimen_names}
    population = usual_population(len(cohort.joint_names))
    rounds, change, fits = 0, np.inf, dict[str, FilmFitResult]()
    for _ in progress.through(range(1, MOST_ROUNDS + 1), "population: rounds"):
        rounds += 1
        # fits of all under the population, from the fits before or, without these, all starts
        problems = [FilmFit(patient, sd) for patient in patients.values()]
        found = fit_alike(problems, population, [fits.get(name) for name in patients])
        fits = {name: one for name, one in zip(patients, found, strict=True) if one is not None}
        # then the population that their parabolas make likeliest
        before = population
        population = _likeliest(before, [one.information for one in fits.values()])
        change = _change(before, population)
        if change < LAST_ROUND or not fits:
            break
    films = [one.information.matrix for one in fits.values()]
    population = replace(population, unsure=unsure_means(population, films))
    unfitted = tuple(name for name in patients if name not in fits)
    return PopulationEstimate(population, rounds, change, len(fits), unfitted, change < LAST_ROUND)


def _likeliest(population: Population, patients: list[FilmInformation]) -> Population:
    """The population that is likeliest for what the films of all patients say.

    Expectation and maximisation: posteriors of the patients under a population, then the population
    of these posteriors, until it stands still.
    """
    for _ in range(MOST_STEPS if patients else 0):
        after = update_population(population, [one.known(population) for one in patients])
        change, population = _change(population, after), after
        if change < LAST_STEP:
            break
    return population


def _change(one: Population, other: Population) -> float:
    spreads = np.log([other.ratio_sd / one.ratio_sd, other.end_sd / one.end_sd])
    return float(max(np.abs(spreads).max(), np.abs(other.mean - one.mean).max()))
