"""From a study of kind discrepancy and its cohort to the grounds and the rules of its search."""

import numpy as np

from spinepipe.cohort import Cohort
from spinepipe.discrepancy.base import base_model, base_parameters
from spinepipe.discrepancy.forms import trials
from spinepipe.discrepancy.found import Rules
from spinepipe.discrepancy.grounds import Grounds, NoBase, Start, laid
from spinepipe.discrepancy.noise import DECLARED, Noise, estimated_noise, without_outliers
from spinepipe.discrepancy.nuisance import NuisancePriors, as_si
from spinepipe.discrepancy.readings import SpecimenReadings, specimen_readings
from spinepipe.discrepancy.tasks import Run
from spinepipe.effects.contract import Array
from spinepipe.model.file import ModelFile
from spinepipe.studies import Discrepancy
from spinepipe.units import COORDINATE_COLUMNS, COORDINATES, DEG_PER_RAD, MM_PER_M

PER_SPECIMEN = "per_specimen"

GUESSED_SD = np.array([1e-3] * 3 + [np.deg2rad(1.0)] * 3)
"""For the first fit of a cohort that declares no SD and whose cycles differ in their loads."""


def prepared(
    study: Discrepancy, cohort: Cohort, file: ModelFile | None, run: Run
) -> tuple[Grounds, Rules]:
    """Grounds with the base fitted, and what the search may do.

    Parameters
    ----------
    file : the model file that the study starts from, if it does.

    Raises
    ------
    NoBase
        When there is no base fit, or nothing tells how large the noise is.
    """
    coordinates = read_coordinates(study, cohort)
    readings, noise = with_noise(study, cohort, measured(study, cohort))
    start = np.array(study.stiffness.in_order(), dtype=float)
    models = {one.specimen: base_model(cohort, one, start, file) for one in readings}
    grouping = study.base.stiffness or PER_SPECIMEN
    base = {name: base_parameters(model, grouping, coordinates) for name, model in models.items()}
    begin = Start(models, base, study.bound_factor)
    grounds = laid(readings, noise, priors(study), begin, run)
    if grounds.noise.source == DECLARED and declared_sd(study, cohort) is None:
        raise NoBase("too few repeated readings to tell the noise: state measurement_sd")
    return grounds, rules(study, cohort, coordinates)


def rules(study: Discrepancy, cohort: Cohort, coordinates: tuple[str, ...]) -> Rules:
    """What a search may do, as the study says."""
    tried = trials(study.effects, coordinates, cohort.specimen_names, len(cohort.joint_names))
    return Rules(
        tried,
        coordinates,
        study.false_alarm,
        study.bootstrap,
        study.margin,
        study.most_effects,
        study.seed,
    )


def priors(study: Discrepancy) -> NuisancePriors:
    """The study's nuisance block, SI."""
    return as_si(study.nuisance.model_dump())


def read_coordinates(study: Discrepancy, cohort: Cohort) -> tuple[str, ...]:
    """Coordinates with readings, of those that the study uses."""
    assert cohort.motion is not None
    motion = cohort.motion[cohort.motion["test"].isin(list(study.tests or cohort.tests))]
    return tuple(
        name
        for name, column in zip(COORDINATES, COORDINATE_COLUMNS, strict=True)
        if name in (study.coordinates or COORDINATES) and motion[column].notna().any()
    )


def measured(study: Discrepancy, cohort: Cohort) -> tuple[SpecimenReadings, ...]:
    """All readings that the study uses, specimens without any left out."""
    coordinates, tests = read_coordinates(study, cohort), study.tests or cohort.tests
    found = (specimen_readings(cohort, s, tests, coordinates) for s in cohort.specimen_names)
    return tuple(one for one in found if one.tests)


def with_noise(
    study: Discrepancy, cohort: Cohort, readings: tuple[SpecimenReadings, ...]
) -> tuple[tuple[SpecimenReadings, ...], Noise]:
    """Readings without outliers, and their noise."""
    kept, outliers = without_outliers(readings)
    noise = estimated_noise(kept, declared_sd(study, cohort), cohort.zeroed_at_step_0, outliers)
    if noise is None:  # cycles of unequal loads may still tell, once the base is fitted
        noise = estimated_noise(kept, GUESSED_SD, cohort.zeroed_at_step_0, outliers)
    assert noise is not None
    return kept, noise


def declared_sd(study: Discrepancy, cohort: Cohort) -> Array | None:
    """(6,) m and rad, SD of one reading as the study or the cohort declares it."""
    sd = study.measurement_sd or cohort.measurement_sd
    if sd is None:
        return None
    return np.array([sd.translation_mm / MM_PER_M] * 3 + [sd.rotation_deg / DEG_PER_RAD] * 3)
