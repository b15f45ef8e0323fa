"""What a search for missing effects demands of its cohort, and of the model file it starts from."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

from spinepipe.cohort import Cohort
from spinepipe.cohort.text import Document
from spinepipe.effects import registered
from spinepipe.model.file import EffectEntry, ModelFile, effects_for, read_model
from spinepipe.problems import InputError, Problem, did_you_mean, one_of
from spinepipe.studies.base_model import made_by
from spinepipe.studies.discrepancy.settings import Discrepancy
from spinepipe.studies.places import at, measured_columns, readings, repeated, unknown_tests
from spinepipe.units import COORDINATE_COLUMNS, COORDINATES, ROTATIONS, TRANSLATIONS

_KEY = "base.model"


def check_discrepancy(document: Document, study: Discrepancy, cohort: Cohort) -> Iterator[Problem]:
    """Every way in which a sound study and a sound cohort do not fit.

    Parameters
    ----------
    document : the study file, for the lines of its keys.
    """
    yield from _effects(document, study)
    if cohort.motion is None:
        found = f"cohort '{cohort.name}', which has no motion.csv"
        allowed = "a cohort with loads.csv and motion.csv: what a model lacks shows in motion"
        remedy = "choose another cohort, or a study of kind range_of_motion"
        yield Problem(*at(document, "cohort"), found, allowed, remedy)
        return
    yield from unknown_tests(document, study.tests, cohort.tests)
    yield from _measured(document, study, cohort)
    yield from _coordinates(document, study, cohort)
    yield from _noise(document, study, cohort)


def _effects(document: Document, study: Discrepancy) -> Iterator[Problem]:
    """Names of effects that are in the registry and can be tried."""
    known = effects_to_try()
    for index, name in enumerate(study.effects or ()):
        if name in known:
            continue
        place = at(document, f"effects.{index}")
        found, remedy = f"unknown effect '{name}'", did_you_mean(name, known, "delete it")
        if name in registered():
            found = f"'{name}', which does not say how it may be tried"
            remedy = "delete it"
        yield Problem(*place, found, one_of(known), remedy)


def _measured(document: Document, study: Discrepancy, cohort: Cohort) -> Iterator[Problem]:
    """Readings in each test that is asked for, and of every specimen."""
    rows = readings(cohort, study.tests, study.coordinates)
    for index, name in enumerate(study.tests or ()):
        if name in cohort.tests and name not in set(rows["test"]):
            found = f"test '{name}', which has no motion"
            place = at(document, f"tests.{index}")
            allowed = "tests with readings of a specimen at least"
            yield Problem(*place, found, allowed, "delete it or add its motion")
    for specimen in cohort.specimen_names:
        if specimen not in set(rows["specimen"]):
            found = f"no motion of specimen '{specimen}' in any chosen test"
            allowed = "readings of every specimen in one test at least"
            remedy = "choose more tests or coordinates, or leave the specimen out of the cohort"
            yield Problem(*at(document, "tests"), found, allowed, remedy)


def _coordinates(document: Document, study: Discrepancy, cohort: Cohort) -> Iterator[Problem]:
    """Coordinates that are asked for were measured."""
    present = measured_columns(readings(cohort, study.tests, None))
    names = dict(zip(COORDINATE_COLUMNS, COORDINATES, strict=True))
    known = [names[column] for column in present]
    for index, name in enumerate(study.coordinates or ()):
        if name not in known:
            place = at(document, f"coordinates.{index}")
            found = f"'{name}', which was not measured in the chosen tests"
            yield Problem(*place, found, one_of(known), "delete it, or add its column to motion")
    if known and not set(study.coordinates or known) & set(ROTATIONS):
        found = f"no rotation, only {', '.join(study.coordinates or known)}"
        remedy = "add a rotation: effects are told by how joints turn"
        yield Problem(*at(document, "coordinates"), found, f"one of {one_of(ROTATIONS)}", remedy)


def _noise(document: Document, study: Discrepancy, cohort: Cohort) -> Iterator[Problem]:
    """Repeated cycles or declared SDs: without either nobody knows what is above the noise."""
    if (study.measurement_sd or cohort.measurement_sd) is not None:
        return
    rows = readings(cohort, study.tests, study.coordinates)
    present = measured_columns(rows)
    for kind, members in (("rotation", ROTATIONS), ("translation", TRANSLATIONS)):
        columns = [c for c in present if c.rpartition("_")[0] in members]
        if columns and not repeated(rows, columns):
            found = f"null; the cohort has none, and no {kind} was read in two cycles of a test"
            allowed = "SDs of one reading, here or in cohort.yaml, or repeated cycles in motion.csv"
            remedy = "set measurement_sd: {rotation_deg: 0.1, translation_mm: 0.1} to what is known"
            yield Problem(*at(document, "measurement_sd"), found, allowed, remedy)
            return


def check_base_model(
    document: Document, study: Discrepancy, cohort: Cohort, root: Path
) -> Iterator[Problem]:
    """Every way in which the base's model file cannot be used; none where it is no model file.

    A file that another study makes may be missing until that study has run.

    Parameters
    ----------
    document : the study file, for the lines of its keys.
    root : folder of the Snakefile.
    """
    if study.base.model is None:
        return
    path = Path(root, study.base.model)  # an absolute path replaces the root
    maker = made_by(path, root)
    if maker == study.study:
        allowed = "a model file that this study does not write itself"
        yield Problem(*at(document, _KEY), study.base.model, allowed, "copy it to another folder")
    elif path.is_file():
        yield from _content(document, study.base.model, path, cohort)
    elif maker is None:
        allowed = "a model file, or a result of another study in config/studies"
        remedy = "correct the path (relative to the Snakefile), or use stiffness: per_joint"
        yield Problem(*at(document, _KEY), f"no file '{study.base.model}'", allowed, remedy)


def _content(document: Document, name: str, path: Path, cohort: Cohort) -> Iterator[Problem]:
    """Problems of the file itself, then joints, specimens and tests that the cohort lacks."""
    try:
        model = read_model(path)
    except InputError as error:
        yield from (replace(problem, file=name) for problem in error.problems)
        return
    yield from _strangers(document, name, model, cohort)
    try:
        effects_for(model, cohort.specimen_names[0], cohort.joint_names)
    except InputError as error:
        for fault in error.problems:
            found = f"{name} with '{fault.found}' in {fault.column}"
            remedy = "take a model of this spine, or correct it"
            yield Problem(*at(document, _KEY), found, fault.allowed, remedy)


def _strangers(
    document: Document, name: str, model: ModelFile, cohort: Cohort
) -> Iterator[Problem]:
    """Specimens and tests of a scope that are none of the cohort's."""
    for entry in model.effects:
        for what, named, known in _named(entry, cohort):
            if named != "*" and named not in known:
                found = f"{name} with effect {entry.effect} of {what} '{named}'"
                remedy = did_you_mean(named, known, "take a model of this cohort, or correct it")
                yield Problem(*at(document, _KEY), found, one_of(known), remedy)


def _named(entry: EffectEntry, cohort: Cohort) -> Iterator[tuple[str, str, tuple[str, ...]]]:
    """What kind of name, the name, and the names that there are."""
    specimens = dict.fromkeys((*entry.scope.specimens, *(row.specimen for row in entry.values)))
    for name in specimens:
        yield "specimen", name, cohort.specimen_names
    for name in entry.scope.tests:
        yield "test", name, cohort.tests


def effects_to_try() -> tuple[str, ...]:
    """Names of the registered effects that say how they may be tried."""
    return tuple(sorted(name for name, cls in registered().items() if hasattr(cls, "trial")))
