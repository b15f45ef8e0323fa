"""Job: stiffness of one specimen with one sampled joint pose."""

from typing import Any

import numpy as np

from spinepipe.calibrate import Fit, Problem, fit
from spinepipe.designs import specimen_seed
from spinepipe.jobs.digest import mark_of, provenance
from spinepipe.model import RefusedModel
from spinepipe.statics import moved
from spinepipe.status import Status
from spinepipe.studies.joint_pose_sensitivity.fitted_stiffness import stiffness_cells
from spinepipe.studies.joint_pose_sensitivity.inputs import sampled_poses, study_and_cohort
from spinepipe.studies.joint_pose_sensitivity.problem import absolute_errors, calibration_problem
from spinepipe.studies.joint_pose_sensitivity.settings import JointPoseSensitivity
from spinepipe.studies.joint_pose_sensitivity.tables import CALIBRATIONS
from spinepipe.tables import to_arrow, write
from spinepipe.units import COORDINATE_COLUMNS


def run(root: str, study: str, poses: str, specimen: str, pose: str, output: str) -> None:
    """Write the calibration row of one specimen and pose."""
    settings, cohort = study_and_cohort(root, study)
    rows = _rows(root, settings, specimen, int(pose), poses)
    names = [column.name for column in CALIBRATIONS.columns]
    columns = {name: [row[name] for row in rows] for name in names}
    write(
        to_arrow(CALIBRATIONS, columns),
        output,
        provenance("calibrate", settings, cohort, [specimen], [mark_of(poses)]),
    )


def _rows(
    root: str, settings: JointPoseSensitivity, specimen: str, pose: int, poses_file: str
) -> list[dict[str, Any]]:
    frames, reason = sampled_poses(poses_file).of(specimen, pose)
    if frames is None:
        return [_refused(specimen, pose, reason)]
    try:
        problem = calibration_problem(root, settings, specimen, frames)
        seed = specimen_seed(settings.seed, f"{specimen}/{pose}")
        options = settings.calibration
        found = fit(problem, options.starts, seed, options.identifiable_below, profiled=True)
    except RefusedModel as error:
        return [_refused(specimen, pose, str(error))]
    return _fitted(settings, specimen, pose, problem, found)


def _fitted(
    settings: JointPoseSensitivity, specimen: str, pose: int, problem: Problem, found: Fit
) -> list[dict[str, Any]]:
    """One row, or one per joint where stiffness is per joint."""
    shared = settings.calibration.grouping == "per_specimen"
    solved = found.status.usable
    model = moved(problem.model, problem.free, found.x)
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
