"""Job: errors of one specimen with landmarks of one precision, pose by pose."""

from typing import Any

import numpy as np

from spinepipe.calibrate import Fit, MeasuredCase, Problem, by_record, fit, needed
from spinepipe.cohort import Cohort
from spinepipe.cohort.specimen import frames_from_landmarks
from spinepipe.designs import sample_landmarks
from spinepipe.effects.contract import Array
from spinepipe.frames import Pose
from spinepipe.jobs.digest import provenance
from spinepipe.model import RefusedModel
from spinepipe.statics import with_parameters
from spinepipe.status import Status
from spinepipe.studies.joint_pose_sensitivity.inputs import specimen_inputs, study_and_cohort
from spinepipe.studies.joint_pose_sensitivity.problem import absolute_errors, calibration_problem
from spinepipe.studies.joint_pose_sensitivity.settings import JointPoseSensitivity
from spinepipe.studies.joint_pose_sensitivity.tables import PRECISION_ERRORS
from spinepipe.tables import from_rows, write
from spinepipe.units import MM_PER_M

_ERRORS = ("translation_error_mm", "rotation_error_deg")


def run(root: str, study: str, specimen: str, sd_mm: str, output: str) -> None:
    """Write two rows per sampled pose: with its own stiffness and with the cohort's own pose's."""
    settings, cohort = study_and_cohort(root, study)
    nominal, errors = _nominal(root, settings, cohort, specimen)
    as_they_are = {f"nominal_{name}": errors[name] for name in _ERRORS}
    rows = []
    for pose, points in enumerate(_landmark_sets(settings, cohort, specimen, float(sd_mm))):
        key = {"specimen": specimen, "sd_mm": float(sd_mm), "pose": pose}
        for name, ended in _errors(root, settings, cohort, specimen, points, nominal).items():
            rows.append({**key, "stiffness": name, **ended, **as_they_are})
    metadata = provenance("landmark_errors", settings, cohort, [specimen])
    write(from_rows(PRECISION_ERRORS, rows), output, metadata)


def _landmark_sets(
    settings: JointPoseSensitivity, cohort: Cohort, specimen: str, sd_mm: float
) -> list[dict[str, dict[str, Array]]]:
    """Landmark sets, m: vertebra to landmark to position.

    Every SD draws the same directions, so that errors over SD differ by precision alone.
    """
    assert cohort.landmarks is not None
    rows = cohort.landmarks[cohort.landmarks["specimen"] == specimen]
    points = rows[["x_mm", "y_mm", "z_mm"]].to_numpy(float)
    n = settings.landmark_precision.poses
    sds = np.full(len(rows), sd_mm)
    drawn, _ = sample_landmarks(points, sds, max(n, 2), settings.seed, f"precision/{specimen}")
    names = list(zip(rows["vertebra"], rows["landmark"], strict=True))
    sets: list[dict[str, dict[str, Array]]] = []
    for one in drawn[:n] / MM_PER_M:
        placed: dict[str, dict[str, Array]] = {}
        for (vertebra, landmark), point in zip(names, one, strict=True):
            placed.setdefault(vertebra, {})[landmark] = point
        sets.append(placed)
    return sets


def _nominal(
    root: str, settings: JointPoseSensitivity, cohort: Cohort, specimen: str
) -> tuple[Array | str, dict[str, Any]]:
    """(J, 6) stiffness fitted in the cohort's own pose, or why there is none; and its errors."""
    frames = specimen_inputs(root, settings.study, specimen, cohort.digest).frames
    try:
        problem = calibration_problem(root, settings, specimen, frames)
        found = _fit(settings, problem)
    except RefusedModel as error:
        return str(error), _row((), (), Status.REFUSED, str(error))
    if not found.status.usable:
        return found.message, _fitted(found)
    values: Array = with_parameters(problem.model, problem.free, found.x).effects[0].values
    return values, _fitted(found)


def _errors(
    root: str,
    settings: JointPoseSensitivity,
    cohort: Cohort,
    specimen: str,
    points: dict[str, dict[str, Array]],
    nominal: Array | str,
) -> dict[str, dict[str, Any]]:
    try:
        frames = frames_from_landmarks(cohort.vertebrae, points)
        problem = calibration_problem(root, settings, specimen, frames)
        found = _fit(settings, problem)
    except (ValueError, RefusedModel) as error:
        refused = _row((), (), Status.REFUSED, str(error))
        return {"calibrated": refused, "nominal": refused}
    return {
        "calibrated": _fitted(found),
        "nominal": _with(root, settings, specimen, frames, nominal),
    }


def _fit(settings: JointPoseSensitivity, problem: Problem) -> Fit:
    """A fit from the study's start; from further ones too where that ends at a bound or nowhere."""
    found = fit(problem)
    if found.status is Status.CONVERGED:
        return found
    options = settings.calibration
    return fit(problem, options.starts, settings.seed)


def _fitted(found: Fit) -> dict[str, Any]:
    return _row(found.cases, found.poses, found.status, found.message)


def _with(
    root: str,
    settings: JointPoseSensitivity,
    specimen: str,
    frames: tuple[Pose, ...],
    stiffness: Array | str,
) -> dict[str, Any]:
    """Errors in these frames with a given stiffness (J, 6)."""
    if isinstance(stiffness, str):
        message = f"the cohort's own pose was not calibrated: {stiffness}"
        return _row((), (), Status.REFUSED, message)
    problem: Problem = calibration_problem(root, settings, specimen, frames, stiffness)
    cases = needed(problem)
    found = by_record(problem.model, [one.case for one in cases])
    if isinstance(found, str):
        return _row(cases, (), Status.UNSTABLE, found)
    return _row(cases, found, Status.CONVERGED, "")


def _row(
    cases: tuple[MeasuredCase, ...], poses: tuple[Array, ...], status: Status, message: str
) -> dict[str, Any]:
    ended = {"status": status.value, "message": message}
    if not status.usable:
        return {**dict.fromkeys(_ERRORS), **ended}
    errors = absolute_errors(cases, poses)
    return {
        "translation_error_mm": _largest(errors[..., :3]),
        "rotation_error_deg": _largest(errors[..., 3:]),
        **ended,
    }


def _largest(errors: Array) -> float | None:
    known = errors[np.isfinite(errors)]
    return float(known.max()) if len(known) else None
