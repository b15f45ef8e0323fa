"""A study together with its cohort: do the two fit each other?"""

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from spinepipe import cohort as cohorts
from spinepipe.cohort import Cohort
from spinepipe.cohort.read_yaml import Document
from spinepipe.problems import InputError, Problem, did_you_mean, one_of
from spinepipe.studies.check_base_model import check_base_model
from spinepipe.studies.check_cohort_base import check_cohort_base
from spinepipe.studies.check_cohort_stiffness import check_cohort_stiffness
from spinepipe.studies.check_discrepancy import check_discrepancy
from spinepipe.studies.check_global_sensitivity import check_global_sensitivity
from spinepipe.studies.check_joint_pose_sensitivity import check_joint_pose_sensitivity
from spinepipe.studies.check_range_of_motion import check_range_of_motion
from spinepipe.studies.read import STUDIES, load
from spinepipe.studies.size_of_design import check_size_of_design
from spinepipe.studies.study import COHORTS, Study, cohort_folder

__all__ = ["check"]

CHECKS: dict[str, Callable[[Document, Any, Cohort], Iterator[Problem]]] = {
    "joint_pose_sensitivity": check_joint_pose_sensitivity,
    "range_of_motion": check_range_of_motion,
    "cohort_stiffness": check_cohort_stiffness,
    "discrepancy": check_discrepancy,
    "global_sensitivity": check_global_sensitivity,
}
"""What each kind of study demands of its cohort."""

FILE_CHECKS: dict[str, Callable[[Document, Any, Cohort, Path], Iterator[Problem]]] = {
    "cohort_stiffness": check_cohort_base,
    "discrepancy": check_base_model,
}
"""What kinds of studies demand of further files, whose paths count from the Snakefile."""

ROOM_CHECKS: dict[str, Callable[[Document, Any, Cohort, Path], Iterator[Problem]]] = {
    "global_sensitivity": check_size_of_design,
}
"""What kinds of studies need of the machine; asked when all else is sound."""


def check(root: Path, study_name: str, starting: bool = True) -> tuple[Study, Cohort]:
    """Read a study and its cohort and hold them against each other.

    Parameters
    ----------
    root : folder of the Snakefile.
    study_name : name of a file in ``config/studies``, without ``.yaml``.
    starting : whether the study is yet to start, so that the machine must have room for it; a
        job of a study that runs has its own share in what is short.

    Raises
    ------
    InputError
        With every problem of the study and of its cohort; when each is sound by itself, with
        every way in which they do not fit.
    """
    document, study, problems = load(root / STUDIES / f"{study_name}.yaml", root)
    cohort, faults = _cohort(document, root)
    problems += faults
    if document and study and cohort:
        problems += CHECKS[study.kind](document, study, cohort)
        if study.kind in FILE_CHECKS:
            problems += FILE_CHECKS[study.kind](document, study, cohort, root)
        if starting and not problems and study.kind in ROOM_CHECKS:
            problems += ROOM_CHECKS[study.kind](document, study, cohort, root)
    if problems or study is None or cohort is None:
        raise InputError(problems)
    return study, cohort


def _cohort(document: Document | None, root: Path) -> tuple[Cohort | None, list[Problem]]:
    """The cohort a study file names, though the rest of the file may be unsound."""
    name = document.data.get("cohort") if document else None
    if document is None or not isinstance(name, str) or not name:
        return None, []
    folder = cohort_folder(name, root)
    if not folder.is_dir():
        known = sorted(path.name for path in (root / COHORTS).glob("*") if path.is_dir())
        remedy = did_you_mean(name, known, f"add the folder {folder}")
        allowed = f"{one_of(known)}, or the path of a folder"
        place = (document.file, document.line_of("cohort"), "cohort")
        return None, [Problem(*place, f"unknown cohort '{name}'", allowed, remedy)]
    try:
        return cohorts.read(folder), []
    except InputError as error:
        return None, list(error.problems)
