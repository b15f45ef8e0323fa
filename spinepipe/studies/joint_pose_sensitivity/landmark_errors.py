"""Job: errors of one specimen with landmarks of one precision, pose by pose."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from spinepipe.calibration import Fit, MeasuredCase, Problem, by_record, fit, needed
from spinepipe.cohort.specimen import frames_from_landmarks
from spinepipe.effects.contract import Array
from spinepipe.jobs.digest import provenance
from spinepipe.model import RefusedModel
from spinepipe.status import Status
from spinepipe.studies.joint_pose_sensitivity.inputs import study_and_cohort
from spinepipe.studies.joint_pose_sensitivity.landmarks import landmarks_of
from spinepipe.studies.joint_pose_sensitivity.problem import (
    absolute_errors,
    calibration_problem,
    fitted_stiffness,
)
from spinepipe.studies.joint_pose_sensitivity.settings import JointPoseSensitivity
from spinepipe.studies.joint_pose_sensitivity.tables import PRECISION_ERRORS
from spinepipe.tables import from_rows, write

_ERRORS = {"translation_error_mm": slice(0, 3), "rotation_error_deg": slice(3, 6)}
"""Columns of the largest error, with the coordinates that it is taken over."""

_Row = dict[str, Any]


def run(root: str, study: str, specimen: str, sd_mm: str, output: str) -> None:
    """Write two rows per sampled pose: with its own stiffness and with the cohort's own pose's."""
    settings, cohort = study_and_cohort(root, study)
    nominal, errors = _nominal(root, settings, specimen)
    as_they_are = {f"nominal_{name}": errors[name] for name in _ERRORS}
    marks, count = landmarks_of(cohort, specimen), settings.landmark_precision.poses
    sets = marks.with_sd(float(sd_mm), count, settings.seed, f"precision/{specimen}")
    rows = []
    for pose, points in enumerate(sets):
        try:
            frames = frames_from_landmarks(cohort.vertebrae, points)
            found = _fit(settings, calibration_problem(root, settings, specimen, frames))
        except (ValueError, RefusedModel) as error:
            refused = _ended(Status.REFUSED, str(error))
            ended = {"calibrated": refused, "nominal": refused}
        else:
            if isinstance(nominal, str):
                message = f"the cohort's own pose was not calibrated: {nominal}"
                other = _ended(Status.REFUSED, message)
            else:
                other = _of_model(calibration_problem(root, settings, specimen, frames, nominal))
            ended = {"calibrated": _of_fit(found), "nominal": other}
        key = {"specimen": specimen, "sd_mm": float(sd_mm), "pose": pose, **as_they_are}
        rows += [{**key, "stiffness": name, **row} for name, row in ended.items()]
    metadata = provenance("landmark_errors", settings, cohort, [specimen])
    write(from_rows(PRECISION_ERRORS, rows), output, metadata)


def _nominal(root: str, settings: JointPoseSensitivity, specimen: str) -> tuple[Array | str, _Row]:
    """(J, 6) stiffness fitted in the cohort's own pose, or why there is none; and its errors."""
    try:
        problem = calibration_problem(root, settings, specimen)
        found = _fit(settings, problem)
    except RefusedModel as error:
        return str(error), _ended(Status.REFUSED, str(error))
    usable = found.status.usable
    return fitted_stiffness(problem, found.x) if usable else found.message, _of_fit(found)


def _fit(settings: JointPoseSensitivity, problem: Problem) -> Fit:
    """A fit from the study's start; from further ones too where that ends at a bound or nowhere."""
    found = fit(problem)
    if found.status is Status.CONVERGED:
        return found
    return fit(problem, settings.calibration.starts, settings.seed)


def _of_fit(found: Fit) -> _Row:
    return _ended(found.status, found.message, found.cases, found.poses)


def _of_model(problem: Problem) -> _Row:
    """Errors of a problem's model as it is, nothing fitted."""
    cases = needed(problem)
    found = by_record(problem.model, [one.case for one in cases])
    if isinstance(found, str):
        return _ended(Status.UNSTABLE, found)
    return _ended(Status.CONVERGED, "", cases, found)


def _ended(
    status: Status, message: str, cases: Sequence[MeasuredCase] = (), poses: Sequence[Array] = ()
) -> _Row:
    """Largest error of each kind of motion over all readings; None where there is none."""
    row: _Row = {**dict.fromkeys(_ERRORS), "status": status.value, "message": message}
    if status.usable:
        errors = absolute_errors(cases, poses)
        for name, columns in _ERRORS.items():
            known = errors[..., columns]
            known = known[np.isfinite(known)]
            row[name] = float(known.max()) if len(known) else None
    return row
