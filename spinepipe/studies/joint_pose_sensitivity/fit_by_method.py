"""Job: the fit of one sampled joint pose in one of several ways, the published one among them."""

from typing import Any

import numpy as np

from spinepipe.calibration import Fit, Problem, fit
from spinepipe.calibration.forward_runs import (
    DEFAULT_STEP,
    ForwardFit,
    differenced_gradient,
    exact_gradient,
    fit_by_forward_runs,
    relative_error,
)
from spinepipe.jobs.digest import mark_of, provenance
from spinepipe.model import RefusedModel
from spinepipe.statics import Course
from spinepipe.status import Status
from spinepipe.studies.joint_pose_sensitivity.filters import near_start
from spinepipe.studies.joint_pose_sensitivity.inputs import (
    sampled_poses,
    start_stiffness,
    study_and_cohort,
)
from spinepipe.studies.joint_pose_sensitivity.problem import calibration_problem, fitted_stiffness
from spinepipe.studies.joint_pose_sensitivity.settings import (
    DEFAULT,
    EXACT,
    METHODS,
    RAW_UNITS,
    SANE,
    JointPoseSensitivity,
)
from spinepipe.studies.joint_pose_sensitivity.tables import METHOD_FITS
from spinepipe.tables import from_rows, write
from spinepipe.units import COORDINATES, STIFFNESS_COLUMNS

ONE_STIFFNESS_ONLY = "it needs one stiffness shared by all joints"


def run(
    root: str, study: str, poses: str, specimen: str, pose: str, method: str, output: str
) -> None:
    """Write the row of one specimen, pose and method."""
    settings, cohort = study_and_cohort(root, study)
    frames, reason = sampled_poses(poses).of(specimen, int(pose))
    row: dict[str, Any] = {column.name: None for column in METHOD_FITS.columns}
    row.update(specimen=specimen, pose=int(pose), method=method)
    try:
        if frames is None:
            raise RefusedModel(reason)
        if settings.calibration.grouping != "per_specimen":
            raise RefusedModel(ONE_STIFFNESS_ONLY)
        problem = calibration_problem(root, settings, specimen, frames)
        if method == EXACT:
            row |= _fit_exactly(settings, problem)
        else:
            row |= _fit_by_forward_runs(settings, problem, method)
    except RefusedModel as error:
        refused = Status.REFUSED.value
        row.update(evaluations=0, claims_success=False, status=refused, message=str(error))
    made_by = provenance("fit_by_method", settings, cohort, [specimen], [mark_of(poses)])
    write(from_rows(METHOD_FITS, [row]), output, made_by)


def _fit_exactly(settings: JointPoseSensitivity, problem: Problem) -> dict[str, Any]:
    """This library's fit: at rest, exact derivatives, from the study's start alone."""
    found = fit(problem)
    solved = found.status.usable
    error = relative_error(exact_gradient(problem), differenced_gradient(problem))
    return {
        "claims_success": solved,
        "derivative_error": error,
        **_ended(settings, problem, found, solved),
    }


def _fit_by_forward_runs(
    settings: JointPoseSensitivity, problem: Problem, method: str
) -> dict[str, Any]:
    """The published way: runs of the model in time, derivatives by differences of their cost."""
    if method not in METHODS:
        raise ValueError(f"method {method!r}: {EXACT}, {DEFAULT}, {SANE} or {RAW_UNITS}")
    options, duration = settings.methods, settings.settle_time_s
    step = options.sane_step if method == SANE else DEFAULT_STEP
    raw = method == RAW_UNITS
    found = fit_by_forward_runs(problem, duration, step, options.accuracy, raw_units=raw)
    exact = exact_gradient(problem, Course(duration))
    return {
        "claims_success": found.claims_success,
        "derivative_error": relative_error(found.start_gradient, exact),
        **_ended(settings, problem, found, found.status is not Status.UNSTABLE),
    }


def _ended(
    settings: JointPoseSensitivity, problem: Problem, found: Fit | ForwardFit, has_stiffness: bool
) -> dict[str, Any]:
    """How a fit ended; stiffness, and whether it is near its start, where it has one."""
    row: dict[str, Any] = {
        "evaluations": found.evaluations,
        "status": found.status.value,
        "message": found.message,
    }
    if not has_stiffness:
        return row
    values = fitted_stiffness(problem, found.x)[0]
    free = [COORDINATES.index(name) for name in settings.calibration.free]
    start = start_stiffness(settings)[free]
    near = near_start(values[None, free], start, settings.success.near_start_percent)[0]
    return {
        **row,
        "cost": found.cost,
        **dict(zip(STIFFNESS_COLUMNS, values.tolist(), strict=True)),
        "near_start_any": bool(np.any(near)),
        "near_start_all": bool(np.all(near)),
    }
