"""The calibration problem of a study in given joint frames, and the errors of its solutions."""

from collections.abc import Sequence

import numpy as np

from spinepipe.calibrate import Problem
from spinepipe.effects.contract import Array
from spinepipe.frames import Pose
from spinepipe.model import MeasuredCase
from spinepipe.statics import free_parameters
from spinepipe.studies.joint_pose_sensitivity.inputs import (
    bushing_model,
    specimen_inputs,
    start_stiffness,
    study_and_cohort,
)
from spinepipe.studies.joint_pose_sensitivity.settings import JointPoseSensitivity
from spinepipe.units import (
    COORDINATES,
    DISPLAY_PER_SI,
    STIFFNESS_COLUMNS,
    subtract_baseline,
)


def calibration_problem(
    root: str,
    settings: JointPoseSensitivity,
    specimen: str,
    frames: tuple[Pose, ...],
    stiffness: Array | None = None,
) -> Problem:
    """What is fitted for a specimen with these joint frames.

    Parameters
    ----------
    stiffness : (6,) or (J, 6) SI to start from; None: the study's.

    Raises
    ------
    RefusedModel
        When the frames and loads make no model.
    """
    _, cohort = study_and_cohort(root, settings.study)
    inputs = specimen_inputs(root, settings.study, specimen, cohort.digest)
    start = start_stiffness(settings) if stiffness is None else stiffness
    model = bushing_model(settings, cohort, specimen, frames, start)
    options = settings.calibration
    names = [STIFFNESS_COLUMNS[COORDINATES.index(name)] for name in options.free]
    free = free_parameters(model, 0, names, options.grouping)
    reach = np.full(len(free), np.log(options.bound_factor))
    cases = tuple(one.in_frames(inputs.frames, frames) for one in inputs.tested)
    weights = np.array(options.weights.in_order(), dtype=float)
    return Problem(model, cases, free, weights, -reach, reach)


def absolute_errors(cases: Sequence[MeasuredCase], poses: Sequence[Array]) -> Array:
    """(R, J, 6) absolute error of every reading, mm and deg; NaN where not measured.

    R counts the load steps of all tests and cycles.

    Parameters
    ----------
    poses : (T, n) of each case, or nothing when there are none: then all is NaN.
    """
    if not poses:
        return np.concatenate([np.full_like(case.measured, np.nan) for case in cases])
    error = np.concatenate(
        [_predicted(case, q) - case.readings for q, case in zip(poses, cases, strict=True)]
    )
    absolute: Array = np.abs(error) * DISPLAY_PER_SI
    return absolute


def _predicted(measured: MeasuredCase, poses: Array) -> Array:
    """(T, J, 6) predicted motion by load step, zeroed at step 0 if the measurement is."""
    q = poses.reshape(len(poses), -1, 6)
    return subtract_baseline(q, measured.zeroed)
