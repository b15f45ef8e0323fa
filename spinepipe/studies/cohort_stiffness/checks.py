"""What a cohort study demands of its cohort."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from spinepipe.cohort import Cohort
from spinepipe.documents.yaml_text import YamlDocument
from spinepipe.effects import create
from spinepipe.model.file import read_model
from spinepipe.problems import InputError, InputProblem, one_of
from spinepipe.studies.cohort_stiffness.representations import (
    NUISANCE,
    STIFFENING,
    STIFFENING_EFFECT,
    named,
)
from spinepipe.studies.cohort_stiffness.settings import (
    ALL,
    ALL_BUT,
    NOBODY,
    NOTHING,
    SEXES,
    CohortStiffness,
)
from spinepipe.studies.places import readings, unknown_levels, unknown_tests
from spinepipe.units import ROTATIONS


def check_cohort_stiffness(
    document: YamlDocument, study: CohortStiffness, cohort: Cohort
) -> Iterator[InputProblem]:
    """Every way in which a sound study and a sound cohort do not fit.

    Parameters
    ----------
    document : the study file, for the lines of its keys.
    """
    yield from _tests(document, study, cohort)
    if NOBODY in cohort.specimen_names:  # folders of results call something else so
        place = (f"{cohort.folder.name}/specimens.csv", None, "specimen")
        allowed = f"any other name: '{NOBODY}' stands for fits that leave no specimen out"
        yield InputProblem(*place, f"'{NOBODY}'", allowed, "rename the specimen in every file")
    yield from _levels(document, study, cohort)
    yield from _cost(document, study, cohort)
    yield from _covariates(document, study, cohort)
    yield from _nuisances(document, study)
    below = study.neutral_zone_below_nm_per_deg
    if (below is None) == (study.neutral_zone == "threshold"):
        lacks = below is None
        name = "neutral_zone_below_nm_per_deg"
        found = f"threshold without {name}" if lacks else f"{below:g}, and no threshold asked for"
        allowed = f"both, neutral_zone: threshold and {name}, or neither"
        key = document.place_of("neutral_zone" if lacks else name)
        yield InputProblem(*key, found, allowed, "give both, or choose another definition")


def _tests(
    document: YamlDocument, study: CohortStiffness, cohort: Cohort
) -> Iterator[InputProblem]:
    """Tests must exist, have names that can name files, and someone must have been measured."""
    if cohort.motion is None:
        found = f"cohort '{cohort.name}', which has no motion.csv"
        allowed = "a cohort with loads.csv and motion.csv: stiffness is fitted to motion"
        remedy = "choose another cohort, or a study of kind range_of_motion"
        yield InputProblem(*document.place_of("cohort"), found, allowed, remedy)
        return
    yield from unknown_tests(document, study.tests, cohort.tests)
    for name in study.tests or cohort.tests:
        reserved = name in (ALL, NOTHING) or name.startswith(ALL_BUT)
        if name in cohort.tests and reserved:
            allowed = f"names other than '{ALL}', '{NOTHING}' and '{ALL_BUT}...'"
            place = (f"{cohort.folder.name}/loads.csv", None, "test")
            yield InputProblem(*place, f"test {name!r}", allowed, "rename it in loads and motion")
    yield from _measured(document, study, cohort)


def _measured(
    document: YamlDocument, study: CohortStiffness, cohort: Cohort
) -> Iterator[InputProblem]:
    """Readings of a free coordinate in each test that is asked for, and of every specimen."""
    measured = readings(cohort, study.tests, study.free)
    for index, name in enumerate(study.tests or ()):
        if name in cohort.tests and name not in set(measured["test"]):
            found = f"test '{name}', which has no motion"
            allowed = f"tests with readings of {one_of(study.free)} of a specimen at least"
            place = document.place_of(f"tests.{index}")
            yield InputProblem(*place, found, allowed, "delete it or add its motion")
    for specimen in cohort.specimen_names:
        if specimen not in set(measured["specimen"]):
            found = f"no motion of specimen '{specimen}' in any chosen test"
            allowed = f"readings of {one_of(study.free)} of every specimen in one test at least"
            remedy = "choose more tests, or leave the specimen out of the cohort"
            yield InputProblem(*document.place_of("tests"), found, allowed, remedy)


def _levels(
    document: YamlDocument, study: CohortStiffness, cohort: Cohort
) -> Iterator[InputProblem]:
    """Ratios of levels need a value for each level, and a value needs its level."""
    given = study.level_stiffness if "level_stiffness" in study.model_fields_set else ()
    yield from unknown_levels(document, given, cohort.joint_names)
    asked = {"representations", "level_stiffness"} & study.model_fields_set
    chosen = [name for name in study.representations if named(name).by_level]
    if not chosen or not asked:  # what nobody asked for is left out where it cannot be
        return
    missing = [joint for joint in cohort.joint_names if joint not in study.level_stiffness]
    if missing:
        found = f"no value for {', '.join(missing)}"
        names, verb = " and ".join(chosen), "is" if len(chosen) == 1 else "are"
        allowed = f"a value for every joint of the cohort, as {names} {verb} among representations"
        remedy = f"add them, or leave {names} out of representations"
        yield InputProblem(*document.place_of("level_stiffness"), found, allowed, remedy)
    elif "representations" in asked and not set(study.free) & set(ROTATIONS):
        allowed = f"{one_of(ROTATIONS)} among them, as published levels differ in rotations alone"
        remedy = f"free a rotation, or leave {' and '.join(chosen)} out of representations"
        yield InputProblem(*document.place_of("free"), ", ".join(study.free), allowed, remedy)


def _cost(document: YamlDocument, study: CohortStiffness, cohort: Cohort) -> Iterator[InputProblem]:
    """Weights need SDs; the published cost knows rotations only."""
    if study.cost == "measurement_sd" and cohort.reading_sd(study.measurement_sd) is None:
        found = "null, and the cohort has none"
        allowed = "SDs of one reading, here or in cohort.yaml, for cost: measurement_sd"
        remedy = "fill them in, or choose cost: published"
        yield InputProblem(*document.place_of("measurement_sd"), found, allowed, remedy)
    others = [name for name in study.free if name not in ROTATIONS]
    if study.cost == "published" and others:
        allowed = f"{one_of(ROTATIONS)} with cost: published, which has no translations"
        remedy = "free rotations only, or choose cost: measurement_sd"
        yield InputProblem(*document.place_of("free"), ", ".join(others), allowed, remedy)


def _covariates(
    document: YamlDocument, study: CohortStiffness, cohort: Cohort
) -> Iterator[InputProblem]:
    """Covariates must be known of someone, and sexes be written so that they are known."""
    for index, name in enumerate(study.covariates or ()):
        known = cohort.specimens[name].dropna()
        if known.empty:
            found = f"'{name}', which {cohort.folder.name}/specimens.csv has of no specimen"
            allowed = "covariates that are known of the specimens"
            remedy = "fill in the column, or delete it here"
            yield InputProblem(*document.place_of(f"covariates.{index}"), found, allowed, remedy)
    if "sex" not in (study.covariates or ()):
        return
    for specimen, sex in zip(cohort.specimens["specimen"], cohort.specimens["sex"], strict=True):
        if isinstance(sex, str) and sex.strip() and sex.strip().lower() not in SEXES:
            place = (f"{cohort.folder.name}/specimens.csv", None, "sex")
            remedy = "write one of them, or leave the cell empty"
            yield InputProblem(*place, f"'{sex}' of specimen '{specimen}'", one_of(SEXES), remedy)


def _nuisances(document: YamlDocument, study: CohortStiffness) -> Iterator[InputProblem]:
    """Priors and representations that fit them need each other, SDs, and the fit without."""
    asked = [name for name in study.representations if name in NUISANCE]
    sds = study.nuisance and (study.nuisance.centre_mm, study.nuisance.axes_deg)
    if asked and not (sds and any(sds)):
        found = "null" if sds is None else "0 mm and 0 deg"
        allowed = f"an SD above 0, as {', '.join(asked)} needs"
        remedy = "write nuisance: {centre_mm: 3, axes_deg: 3}, or leave it out of representations"
        yield InputProblem(*document.place_of("nuisance"), found, allowed, remedy)
    if sds is not None and not asked:
        found = f"SDs, and none of {', '.join(NUISANCE)} among representations"
        allowed = "one of them, as no other fits errors of centres and axes"
        remedy = f"add {NUISANCE[-1]} to representations, or delete nuisance"
        yield InputProblem(*document.place_of("nuisance"), found, allowed, remedy)
    for name in asked:
        plain = named(name).without_nuisances
        if plain not in study.representations:
            found, allowed = f"{name} without {plain}", f"{plain} too, which it is compared with"
            place = document.place_of("representations")
            yield InputProblem(*place, found, allowed, f"add {plain}, or leave {name} out")
    if asked and study.cost == "published":
        found = f"published, and {', '.join(asked)} among representations"
        allowed = "cost: measurement_sd, as priors are weighed against readings in their SDs"
        remedy = "choose cost: measurement_sd, or leave them out of representations"
        yield InputProblem(*document.place_of("cost"), found, allowed, remedy)


def check_one_stiffening(
    document: YamlDocument, study: CohortStiffness, cohort: Cohort, root: Path
) -> Iterator[InputProblem]:
    """A base model that stiffens leaves nothing for a representation that does."""
    asked = [name for name in study.representations if name in STIFFENING]
    path = None if study.base is None else study.base.path(root)
    if not asked or path is None or not path.is_file():
        return
    try:
        effects = read_model(path).effects
    except InputError:
        return  # told by the check of the file itself
    # Of an effect that stiffens, the coordinate is one of its options.
    laws: list[Any] = [
        create(one.effect, one.options) for one in effects if one.effect == STIFFENING_EFFECT
    ]
    if any(law.coordinate in study.free for law in laws):
        found = f"{one_of(asked)}, and {STIFFENING_EFFECT} in the base model too"
        allowed = "one of them: two laws that scale one bushing cannot be told apart"
        remedy = "leave these representations out, or take the effect out of the model file"
        yield InputProblem(*document.place_of("representations"), found, allowed, remedy)
