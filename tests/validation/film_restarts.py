"""Fits to the shipped films, started again from many more places than a study starts them."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pandas as pd

from spinepipe.effects.contract import Array
from spinepipe.progress import Progress
from spinepipe.studies.read import check
from spinepipe.studies.scoliosis.film_fit import FilmFit, fit_alike
from spinepipe.studies.scoliosis.films import weights
from spinepipe.studies.scoliosis.fit_population import fit_population
from spinepipe.studies.scoliosis.personal import Patient, patient_of, region_optimum
from spinepipe.studies.scoliosis.population import Population
from spinepipe.studies.scoliosis.settings import Scoliosis

ROOT = Path(__file__).resolve().parents[2]

STUDY = "ais18_scoliosis"

DRAWN, SEED = 12, 1
"""Starts of tangent_fitted drawn anew, and as many mirrored."""

SHARES = (-0.9, -0.3, 0.3, 0.9)
"""Of the farthest multiplier, which starts of linear_regions combine: 17 with three curves."""


TIE = 2e-3
"""Share of the cost: fits settle to a ten-thousandth each, and a tie takes the first."""


def table() -> pd.DataFrame:
    """A row for each patient and fit: costs as fitted and over restarts, optima seen."""
    study, cohort = check(ROOT, STUDY)
    assert isinstance(study, Scoliosis)
    sd = weights(study, cohort)
    everyone = fit_population(
        study, cohort, sd, Progress(lambda line: print(line, flush=True))
    ).population
    patients = [patient_of(study, cohort, name) for name in cohort.specimen_names]
    return pd.DataFrame([*_tangents(patients, sd, everyone), *_regions(patients)])


def _tangents(patients: list[Patient], sd: Array, everyone: Population) -> Iterator[dict[str, Any]]:
    fits = [FilmFit(one, sd) for one in patients]
    usual = fit_alike(fits, everyone, [None] * len(fits))
    again = fit_alike(fits, everyone, [None] * len(fits), DRAWN, SEED)
    for patient, one, other in zip(patients, usual, again, strict=True):
        assert one is not None
        assert other is not None
        ends = (one.cost, one.n_optima), (other.cost, other.n_optima)
        yield _row("tangent_fitted", patient, 1 + 2 * DRAWN, *ends)


def _regions(patients: list[Patient]) -> Iterator[dict[str, Any]]:
    for patient in patients:
        (_, one, n), (fit, other, more) = region_optimum(patient), region_optimum(patient, SHARES)
        if one is not None and other is not None:
            starts = 1 + len(SHARES) ** fit.by_logs.shape[1]
            yield _row("linear_regions", patient, starts, (one.cost, n), (other.cost, more))


def _row(
    model: str, patient: Patient, starts: int, usual: tuple[float, int], again: tuple[float, int]
) -> dict[str, Any]:
    least, seen = again
    return {
        "model": model,
        "patient": patient.name,
        "cost": usual[0],
        "n_optima": usual[1],
        "restarts": starts,
        "best_of_restarts": least,
        "n_optima_of_restarts": seen,
        "lower_elsewhere": least < (1.0 - TIE) * usual[0],
    }
