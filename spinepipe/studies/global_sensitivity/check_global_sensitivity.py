"""What a study of global sensitivity demands of its cohort."""

from collections.abc import Iterator

from spinepipe.cohort import Cohort
from spinepipe.cohort.read_yaml import Document
from spinepipe.problems import Problem, did_you_mean, one_of
from spinepipe.studies.check_factors import check_factors
from spinepipe.studies.check_sensitivity_design import check_sensitivity_design
from spinepipe.studies.global_sensitivity import GlobalSensitivity
from spinepipe.studies.measured import measured_columns, readings
from spinepipe.studies.places import at, unknown_names, unknown_tests
from spinepipe.units import COORDINATE_COLUMNS

__all__ = ["check_global_sensitivity"]


def check_global_sensitivity(
    document: Document, study: GlobalSensitivity, cohort: Cohort
) -> Iterator[Problem]:
    """Every way in which a sound study and a sound cohort do not fit.

    Parameters
    ----------
    document : the study file, for the lines of its keys.
    """
    yield from check_sensitivity_design(document, study)
    yield from unknown_names(
        document, "specimens", "specimen", study.specimens, cohort.specimen_names
    )
    yield from _levels(document, study, cohort)
    yield from _tests(document, study, cohort)
    yield from _motion(document, study, cohort)
    yield from check_factors(document, study, cohort)


def _levels(document: Document, study: GlobalSensitivity, cohort: Cohort) -> Iterator[Problem]:
    for name in study.level_stiffness:
        if name not in cohort.joint_names:
            remedy = did_you_mean(name, cohort.joint_names, "delete it")
            place = at(document, f"level_stiffness.{name}")
            yield Problem(*place, f"unknown joint '{name}'", one_of(cohort.joint_names), remedy)


def _tests(document: Document, study: GlobalSensitivity, cohort: Cohort) -> Iterator[Problem]:
    """Tests must exist, and every specimen must have one."""
    if cohort.loads is None:
        found = f"cohort '{cohort.name}', which has no loads.csv"
        allowed = "a cohort with loads.csv: the study moves specimens in its tests"
        yield Problem(*at(document, "cohort"), found, allowed, "add loads, or take another cohort")
        return
    yield from unknown_tests(document, study.tests, cohort.tests)
    rows = cohort.loads[cohort.loads["test"].isin(study.chosen_tests(cohort))]
    if rows.empty:  # no chosen test is known
        return
    loaded = set(rows["specimen"])
    for specimen in study.chosen_specimens(cohort):
        if specimen in cohort.specimen_names and not loaded & {specimen, "*"}:
            found = f"no load of specimen '{specimen}' in any chosen test"
            remedy = "choose more tests, or leave the specimen out"
            allowed = "a load of every chosen specimen in one chosen test at least"
            yield Problem(*at(document, "tests"), found, allowed, remedy)


def _motion(document: Document, study: GlobalSensitivity, cohort: Cohort) -> Iterator[Problem]:
    """Stiffness is calibrated to measured motion, which every specimen must have."""
    if not study.outputs.stiffness:
        return
    place = at(document, "outputs.stiffness")
    remedy = "set outputs.stiffness: false, or choose other specimens and tests"
    allowed = "true with measured motion of every chosen specimen in one chosen test at least"
    if cohort.motion is None:
        found = f"true, and cohort '{cohort.name}' has no motion.csv"
        yield Problem(*place, found, allowed, remedy)
        return
    read = readings(cohort, study.chosen_tests(cohort), None)
    measured = set(read["specimen"])
    missing = [
        name
        for name in study.chosen_specimens(cohort)
        if name in cohort.specimen_names and name not in measured
    ]
    if missing:
        yield Problem(*place, f"true, and no motion of {', '.join(missing)}", allowed, remedy)
    columns = measured_columns(read)
    weights = zip(COORDINATE_COLUMNS, study.calibration.weights.in_order(), strict=True)
    if columns and not any(weight for name, weight in weights if name in columns):
        place = at(document, "calibration.weights")
        found = "no weight on anything that was measured"
        yield Problem(*place, found, f"a weight on {one_of(columns)}", "weigh what was measured")
