"""Job: stiffness of one specimen with sampled joint poses."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from spinepipe.calibrate import Fit, Problem, fit_alike
from spinepipe.designs import specimen_seed
from spinepipe.jobs.digest import mark_of, provenance
from spinepipe.model import RefusedModel
from spinepipe.statics import with_parameters
from spinepipe.status import Status
from spinepipe.studies.joint_pose_sensitivity.fitted_stiffness import stiffness_cells
from spinepipe.studies.joint_pose_sensitivity.inputs import sampled_poses, study_and_cohort
from spinepipe.studies.joint_pose_sensitivity.problem import absolute_errors, calibration_problem
from spinepipe.studies.joint_pose_sensitivity.settings import JointPoseSensitivity
from spinepipe.studies.joint_pose_sensitivity.tables import CALIBRATIONS
from spinepipe.tables import from_rows, write
from spinepipe.units import COORDINATE_COLUMNS

_Rows = list[dict[str, Any]]


def run(
    root: str, study: str, poses: str, specimen: str, parts: Mapping[str, Mapping[str, str]]
) -> None:
    """Write the calibration rows of poses, a file each.

    They are fitted side by side: fifty together take as long as about twenty one by one.
    """
    settings, cohort = study_and_cohort(root, study)
    made_by = provenance("calibrate", settings, cohort, [specimen], [mark_of(poses)])
    numbers = {int(place["pose"]): path for path, place in parts.items()}
    for number, rows in _calibrated(root, settings, specimen, list(numbers), poses).items():
        write(from_rows(CALIBRATIONS, rows), numbers[number], made_by)


def _calibrated(
    root: str,
    settings: JointPoseSensitivity,
    specimen: str,
    poses: Sequence[int],
    poses_file: str,
) -> dict[int, _Rows]:
    """Rows of poses of one specimen."""
    rows: dict[int, _Rows] = {}
    problems: dict[int, Problem] = {}
    for pose in poses:
        frames, reason = sampled_poses(poses_file).of(specimen, pose)
        try:
            if frames is None:
                raise RefusedModel(reason)
            problems[pose] = calibration_problem(root, settings, specimen, frames)
        except RefusedModel as error:
            rows[pose] = [_refused(specimen, pose, str(error))]
    if not problems:
        return rows
    seeds = [specimen_seed(settings.seed, f"{specimen}/{pose}") for pose in problems]
    options = settings.calibration
    below = options.identifiable_below
    try:
        fits = fit_alike(list(problems.values()), options.starts, seeds, below, profiled=True)
    except RefusedModel as error:
        if len(problems) > 1:  # which of them it is, is found one by one
            raise
        return {**rows, **{pose: [_refused(specimen, pose, str(error))] for pose in problems}}
    for (pose, problem), found in zip(problems.items(), fits, strict=True):
        rows[pose] = _fitted(settings, specimen, pose, problem, found)
    return rows


def _fitted(
    settings: JointPoseSensitivity, specimen: str, pose: int, problem: Problem, found: Fit
) -> _Rows:
    """One row, or one per joint where stiffness is per joint."""
    shared = settings.calibration.grouping == "per_specimen"
    solved = found.status.usable
    model = with_parameters(problem.model, problem.free, found.x)
    common = {
        "specimen": specimen,
        "pose": pose,
        **_errors(found),
        "cost": found.cost if solved else None,
        "degrees_of_freedom": found.uncertainty.degrees_of_freedom,
        "iterations": found.iterations,
        "evaluations": found.evaluations,
        "n_optima": found.n_optima,
        "start_stiffened": found.stiffened,
        "status": found.status.value,
        "message": _message(found),
    }
    joints = range(1) if shared else range(model.n_joints)
    return [
        {
            **common,
            "joint": "*" if shared else model.joints[joint],
            **stiffness_cells(problem, found, model, joint),
        }
        for joint in joints
    ]


def _message(found: Fit) -> str:
    notes = [found.message] if found.message else []
    if found.stiffened:
        notes.append(f"start stiffened by a factor of {2**found.stiffened} to stand")
    if found.n_optima > 1:
        notes.append(f"{found.n_optima} optima: the answer depends on the start")
    return "; ".join(notes)


def _errors(found: Fit) -> dict[str, Any]:
    """Mean absolute error per coordinate over all measured readings, mm and deg."""
    size = absolute_errors(found.cases, found.poses).reshape(-1, 6)
    return {
        _error_column(name): float(np.nanmean(column)) if np.isfinite(column).any() else None
        for name, column in zip(COORDINATE_COLUMNS, size.T, strict=True)
    }


def _error_column(column: str) -> str:
    name, unit = column.rsplit("_", 1)
    return f"{name}_error_{unit}"


def _refused(specimen: str, pose: int, message: str) -> dict[str, Any]:
    row: dict[str, Any] = {column.name: None for column in CALIBRATIONS.columns}
    zero = ("degrees_of_freedom", "iterations", "evaluations", "n_optima", "start_stiffened")
    row.update(dict.fromkeys(zero, 0))
    row.update(specimen=specimen, pose=pose, joint="*", status=Status.REFUSED.value)
    return {**row, "message": message}
