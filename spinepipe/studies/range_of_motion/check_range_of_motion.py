"""What a study of range of motion demands of its cohort."""

from collections.abc import Iterator

from spinepipe.cohort import Cohort
from spinepipe.cohort.read_yaml import Document
from spinepipe.problems import Problem, did_you_mean, one_of
from spinepipe.studies.places import at, unknown_tests
from spinepipe.studies.range_of_motion import RangeOfMotion

__all__ = ["check_range_of_motion"]


def check_range_of_motion(
    document: Document, study: RangeOfMotion, cohort: Cohort
) -> Iterator[Problem]:
    """Every way in which a sound study and a sound cohort do not fit.

    Parameters
    ----------
    document : the study file, for the lines of its keys.
    """
    yield from _poses(document, study, cohort)
    yield from _tests(document, study, cohort)
    yield from _levels(document, study, cohort)


def _poses(document: Document, study: RangeOfMotion, cohort: Cohort) -> Iterator[Problem]:
    """Sampled frames need to know how uncertain they are."""
    if study.n_poses == 1 or study.pose_sd is not None:
        return
    found = f"null with {study.poses} poses, and "
    allowed = "translation_mm and rotation_deg, or poses: 1 for the cohort's own frames only"
    remedy = "set pose_sd, or set poses: 1"
    if cohort.motion is not None:
        found += f"cohort '{cohort.name}' has motion.csv: its measurement_sd is that of a reading"
        yield Problem(*at(document, "pose_sd"), found, allowed, remedy)
    elif cohort.measurement_sd is None:
        found += f"cohort '{cohort.name}' has no measurement_sd"
        remedy = "set pose_sd, give the cohort a measurement_sd, or set poses: 1"
        yield Problem(*at(document, "pose_sd"), found, allowed, remedy)


def _tests(document: Document, study: RangeOfMotion, cohort: Cohort) -> Iterator[Problem]:
    """Either virtual tests or those of loads.csv, which must then be there."""
    if study.virtual_tests is not None:
        if study.tests is not None:
            allowed = "null beside virtual_tests, which name their own tests"
            remedy = "name the tests in virtual_tests.tests, or set virtual_tests: null"
            yield Problem(*at(document, "tests"), ", ".join(study.tests), allowed, remedy)
        return
    if cohort.loads is None:
        found = f"null, and cohort '{cohort.name}' has no loads.csv"
        allowed = "virtual tests, or null with a cohort that has loads.csv"
        remedy = "set virtual_tests: {moment_nm: 7.5, tests: [flexion], steps: 10}"
        yield Problem(*at(document, "virtual_tests"), found, allowed, remedy)
        return
    yield from unknown_tests(document, study.tests, cohort.tests)


def _levels(document: Document, study: RangeOfMotion, cohort: Cohort) -> Iterator[Problem]:
    for name in study.level_stiffness:
        if name not in cohort.joint_names:
            remedy = did_you_mean(name, cohort.joint_names, "delete it")
            place = at(document, f"level_stiffness.{name}")
            yield Problem(*place, f"unknown joint '{name}'", one_of(cohort.joint_names), remedy)
