"""What a search for missing effects demands of its cohort."""

from collections.abc import Iterator

from spinepipe.cohort import Cohort
from spinepipe.cohort.supports import MEASURED
from spinepipe.documents.yaml_text import YamlDocument
from spinepipe.effects import registered
from spinepipe.problems import InputProblem, Spelling, one_of
from spinepipe.studies.discrepancy.settings import Discrepancy
from spinepipe.studies.places import measured_columns, readings, repeated, unknown_tests
from spinepipe.units import COORDINATE_COLUMNS, COORDINATES, ROTATIONS, TRANSLATIONS


def check_discrepancy(
    document: YamlDocument, study: Discrepancy, cohort: Cohort
) -> Iterator[InputProblem]:
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
        yield InputProblem(*document.place_of("cohort"), found, allowed, remedy)
        return
    yield from unknown_tests(document, study.tests, cohort.tests)
    yield from _measured(document, study, cohort)
    yield from _coordinates(document, study, cohort)
    yield from _noise(document, study, cohort)
    yield from _loads_of_a_rig(document, study, cohort)


def _effects(document: YamlDocument, study: Discrepancy) -> Iterator[InputProblem]:
    """Names of effects that are in the registry and can be tried."""
    known = tuple(sorted(name for name, cls in registered().items() if hasattr(cls, "trial")))
    spelling = Spelling(known, "delete it")
    for index, name in enumerate(study.effects or ()):
        if name in known:
            continue
        place = document.place_of(f"effects.{index}")
        found, remedy = f"unknown effect '{name}'", spelling.remedy(name)
        if name in registered():
            found = f"'{name}', which does not say how it may be tried"
            remedy = "delete it"
        yield InputProblem(*place, found, spelling.allowed, remedy)


def _measured(document: YamlDocument, study: Discrepancy, cohort: Cohort) -> Iterator[InputProblem]:
    """Readings in each test that is asked for, and of every specimen."""
    rows = readings(cohort, study.tests, study.coordinates)
    for index, name in enumerate(study.tests or ()):
        if name in cohort.tests and name not in set(rows["test"]):
            found = f"test '{name}', which has no motion"
            place = document.place_of(f"tests.{index}")
            allowed = "tests with readings of a specimen at least"
            yield InputProblem(*place, found, allowed, "delete it or add its motion")
    for specimen in cohort.specimen_names:
        if specimen not in set(rows["specimen"]):
            found = f"no motion of specimen '{specimen}' in any chosen test"
            allowed = "readings of every specimen in one test at least"
            remedy = "choose more tests or coordinates, or leave the specimen out of the cohort"
            yield InputProblem(*document.place_of("tests"), found, allowed, remedy)


def _coordinates(
    document: YamlDocument, study: Discrepancy, cohort: Cohort
) -> Iterator[InputProblem]:
    """Coordinates that are asked for were measured."""
    present = measured_columns(readings(cohort, study.tests, None))
    names = dict(zip(COORDINATE_COLUMNS, COORDINATES, strict=True))
    known = [names[column] for column in present]
    for index, name in enumerate(study.coordinates or ()):
        if name not in known:
            place = document.place_of(f"coordinates.{index}")
            found = f"'{name}', which was not measured in the chosen tests"
            yield InputProblem(
                *place, found, one_of(known), "delete it, or add its column to motion"
            )


def _loads_of_a_rig(
    document: YamlDocument, study: Discrepancy, cohort: Cohort
) -> Iterator[InputProblem]:
    """SDs of a rig's loads stand beside those of motion, in the cohort."""
    if cohort.supports is None or study.measurement_sd is None:
        return
    if (cohort.supports["reaction"] == MEASURED).any():
        found = "SDs of motion beside loads of a rig that were measured (supports.csv)"
        allowed = "null: cohort.yaml says the SDs of motion and of loads together"
        remedy = "set measurement_sd in cohort.yaml, and take it out here"
        yield InputProblem(*document.place_of("measurement_sd"), found, allowed, remedy)


def _noise(document: YamlDocument, study: Discrepancy, cohort: Cohort) -> Iterator[InputProblem]:
    """Repeated cycles or declared SDs: without either nobody knows what is above the noise."""
    if cohort.reading_sd(study.measurement_sd) is not None:
        return
    rows = readings(cohort, study.tests, study.coordinates)
    present = measured_columns(rows)
    for kind, members in (("rotation", ROTATIONS), ("translation", TRANSLATIONS)):
        columns = [c for c in present if c.rpartition("_")[0] in members]
        if columns and not repeated(rows, columns):
            found = f"null; the cohort has none, and no {kind} was read in two cycles of a test"
            allowed = "SDs of one reading, here or in cohort.yaml, or repeated cycles in motion.csv"
            remedy = "set measurement_sd: {rotation_deg: 0.1, translation_mm: 0.1} to what is known"
            yield InputProblem(*document.place_of("measurement_sd"), found, allowed, remedy)
            return
