"""Job: the fit of one sampled joint pose in one of several ways, the published one among them."""

from typing import Any

import numpy as np

from spinepipe.calibrate import Problem, fit
from spinepipe.calibrate.forward_runs import (
    DEFAULT_STEP,
    differenced_gradient,
    exact_gradient,
    fit_by_forward_runs,
    relative_error,
)
from spinepipe.effects.contract import Array
from spinepipe.jobs.digest import mark_of, provenance
from spinepipe.model import RefusedModel
from spinepipe.statics import Course, with_parameters
from spinepipe.status import Status
from spinepipe.studies.joint_pose_sensitivity.filters import near_start
from spinepipe.studies.joint_pose_sensitivity.inputs import (
    sampled_poses,
    start_stiffness,
    study_and_cohort,
)
from spinepipe.studies.joint_pose_sensitivity.problem import calibration_problem
from spinepipe.studies.joint_pose_sensitivity.settings import JointPoseSensitivity
from spinepipe.studies.joint_pose_sensitivity.tables import METHOD_FITS
from spinepipe.tables import from_rows, write
from spinepipe.units import COORDINATES, STIFFNESS_COLUMNS

EXACT = "exact"
DEFAULT, SANE = "forward_run_default_step", "forward_run_sane_step"
RAW_UNITS = "forward_run_raw_units"
"""As the default step, but on stiffness in N/m and N m/rad instead of multiples of its start."""

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
        row.update(_fit(settings, problem, method))
    except RefusedModel as error:
        refused = Status.REFUSED.value
        row.update(evaluations=0, claims_success=False, status=refused, message=str(error))
    table = from_rows(METHOD_FITS, [row])
    write(
        table, output, provenance("fit_by_method", settings, cohort, [specimen], [mark_of(poses)])
    )


def _fit(settings: JointPoseSensitivity, problem: Problem, method: str) -> dict[str, Any]:
    if method == EXACT:
        return _fit_exactly(settings, problem)
    options, duration = settings.methods, settings.settle_time_s
    if method not in (DEFAULT, SANE, RAW_UNITS):
        raise ValueError(f"method {method!r}: {EXACT}, {DEFAULT}, {SANE} or {RAW_UNITS}")
    step = options.sane_step if method == SANE else DEFAULT_STEP
    raw = method == RAW_UNITS
    found = fit_by_forward_runs(problem, duration, step, options.accuracy, raw_units=raw)
    exact = exact_gradient(problem, Course(duration))
    started = found.status is not Status.UNSTABLE
    return {
        "evaluations": found.evaluations,
        "claims_success": found.claims_success,
        "status": found.status.value,
        "message": found.message,
        "derivative_error": relative_error(found.start_gradient, exact),
        "cost": found.cost if started else None,
        **(_stiffness(settings, problem, found.x) if started else {}),
    }


def _fit_exactly(settings: JointPoseSensitivity, problem: Problem) -> dict[str, Any]:
    """This library's fit: at rest, exact derivatives, from the study's start alone."""
    found = fit(problem)
    solved = found.status.usable
    return {
        "evaluations": found.evaluations,
        "claims_success": solved,
        "status": found.status.value,
        "message": found.message,
        "derivative_error": relative_error(exact_gradient(problem), differenced_gradient(problem)),
        "cost": found.cost if solved else None,
        **(_stiffness(settings, problem, found.x) if solved else {}),
    }


def _stiffness(settings: JointPoseSensitivity, problem: Problem, x: Array) -> dict[str, Any]:
    """Stiffness, and whether it is near its start."""
    values = with_parameters(problem.model, problem.free, x).effects[0].values[0]
    free = [COORDINATES.index(name) for name in settings.calibration.free]
    start = start_stiffness(settings)[free]
    near = near_start(values[None, free], start, settings.success.near_start_percent)[0]
    return {
        **dict(zip(STIFFNESS_COLUMNS, values.tolist(), strict=True)),
        "near_start_any": bool(np.any(near)),
        "near_start_all": bool(np.all(near)),
    }
