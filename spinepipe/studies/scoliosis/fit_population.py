"""Job: the population of a cohort, learned from the films of all its patients.

Patients are fitted in lockstep; what the films of each say near its fit is a parabola, on which
means and spreads of the population are learned until they stand still. Then all are fitted anew
under it, as the parabolas hold near the fits alone.
"""

import sys
from collections import defaultdict
from collections.abc import Mapping
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
from spinepipe.studies.scoliosis.films import FilmSd, weights
from spinepipe.studies.scoliosis.personal import Patient, patient_of
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


def fit_population(
    settings: Scoliosis, cohort: Cohort, sd: FilmSd, progress: Progress
) -> PopulationEstimate:
    """Rounds of fits of all patients, until the population stands still."""
    patients = {name: patient_of(settings, cohort, name) for name in cohort.specimen_names}
    population = usual_population(len(cohort.joint_names))
    rounds, change, fits = 0, np.inf, dict[str, FilmFitResult]()
    films: list[FilmInformation] = []
    for _ in progress.through(range(1, MOST_ROUNDS + 1), "population: rounds"):
        rounds += 1
        # fits of all under the population, from the fits before or, without these, all starts
        fits = _fits(patients, sd, population, fits)
        # then the population that their parabolas make likeliest
        before, films = (
            population,
            [
                one.information.of_all(patients[name].read.lowest, population.segments)
                for name, one in fits.items()
            ],
        )
        population = _likeliest(before, films)
        change = _change(before, population)
        if change < LAST_ROUND or not fits:
            break
    told = unsure_means(population, [one.matrix for one in films])
    population = replace(population, unsure=told)
    unfitted = tuple(name for name in patients if name not in fits)
    return PopulationEstimate(population, rounds, change, len(fits), unfitted, change < LAST_ROUND)


def _fits(
    patients: Mapping[str, Patient],
    sd: FilmSd,
    population: Population,
    before: Mapping[str, FilmFitResult],
) -> dict[str, FilmFitResult]:
    """Fits by name, those of the same segments in lockstep; without patients that have no pose."""
    alike = defaultdict[tuple[int, int], list[str]](list)
    for name, patient in patients.items():
        alike[patient.read.lowest, patient.chain.n_joints].append(name)
    found: dict[str, FilmFitResult | None] = {}
    for part, names in alike.items():
        problems = [FilmFit(patients[name], sd) for name in names]
        ends = fit_alike(problems, population.of_part(*part), [before.get(name) for name in names])
        found |= zip(names, ends, strict=True)
    return {name: one for name in patients if (one := found[name]) is not None}


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
