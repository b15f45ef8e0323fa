"""Job: stiffness of one specimen with sampled joint poses."""

from collections.abc import Mapping
from typing import Any

from spinepipe.calibration import Fit, Problem, fit_alike
from spinepipe.designs import specimen_seed
from spinepipe.jobs.digest import mark_of, provenance
from spinepipe.model import RefusedModel
from spinepipe.status import Status
from spinepipe.studies.joint_pose_sensitivity.inputs import sampled_poses, study_and_cohort
from spinepipe.studies.joint_pose_sensitivity.problem import (
    absolute_errors,
    calibration_problem,
    fit_rows,
    mean_errors,
)
from spinepipe.studies.joint_pose_sensitivity.settings import JointPoseSensitivity
from spinepipe.studies.joint_pose_sensitivity.tables import CALIBRATIONS
from spinepipe.tables import from_rows, write

_Rows = list[dict[str, Any]]


def run(
    root: str, study: str, poses: str, specimen: str, parts: Mapping[str, Mapping[str, str]]
) -> None:
    """Write the calibration rows of poses, a file each.

    They are fitted side by side: fifty together take as long as about twenty one by one.
    """
    settings, cohort = study_and_cohort(root, study)
    made_by = provenance("calibrate", settings, cohort, [specimen], [mark_of(poses)])
    files = {int(place["pose"]): path for path, place in parts.items()}
    rows: dict[int, _Rows] = {}
    problems: dict[int, Problem] = {}
    for pose in files:
        frames, reason = sampled_poses(poses).of(specimen, pose)
        try:
            if frames is None:
                raise RefusedModel(reason)
            problems[pose] = calibration_problem(root, settings, specimen, frames)
        except RefusedModel as error:
            rows[pose] = _refused(str(error))
    rows |= _fitted(settings, specimen, problems) if problems else {}
    for pose, found in rows.items():
        keyed = [{**row, "specimen": specimen, "pose": pose} for row in found]
        write(from_rows(CALIBRATIONS, keyed), files[pose], made_by)


def _fitted(
    settings: JointPoseSensitivity, specimen: str, problems: dict[int, Problem]
) -> dict[int, _Rows]:
    """Rows of each pose's fit, all solved in lockstep."""
    seeds = [specimen_seed(settings.seed, f"{specimen}/{pose}") for pose in problems]
    options = settings.calibration
    starts, below = options.starts, options.identifiable_below
    try:
        fits = fit_alike(list(problems.values()), starts, seeds, below, profiled=True)
    except RefusedModel as error:
        if len(problems) > 1:  # which of them it is, is found one by one
            raise
        return dict.fromkeys(problems, _refused(str(error)))
    return {
        pose: [
            {
                **row,
                **mean_errors(absolute_errors(found.cases, found.poses).reshape(-1, 6)),
                "iterations": found.iterations,
                "evaluations": found.evaluations,
                "n_optima": found.n_optima,
                "start_stiffened": found.stiffened,
                "message": _message(found),
            }
            for row in fit_rows(problem, found, options.grouping)
        ]
        for (pose, problem), found in zip(problems.items(), fits, strict=True)
    }


def _message(found: Fit) -> str:
    notes = [found.message] if found.message else []
    if found.stiffened:
        notes.append(f"start stiffened by a factor of {2**found.stiffened} to stand")
    if found.n_optima > 1:
        notes.append(f"{found.n_optima} optima: the answer depends on the start")
    return "; ".join(notes)


def _refused(message: str) -> _Rows:
    row: dict[str, Any] = {column.name: None for column in CALIBRATIONS.columns}
    zero = ("degrees_of_freedom", "iterations", "evaluations", "n_optima", "start_stiffened")
    row |= dict.fromkeys(zero, 0)
    return [{**row, "joint": "*", "status": Status.REFUSED.value, "message": message}]
