"""The fit of a specimen in given joint frames: its problem, its errors, its rows in a table."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from spinepipe.calibration import Fit, Problem
from spinepipe.effects.contract import Array
from spinepipe.frames import Pose
from spinepipe.model import MeasuredCase
from spinepipe.statics import with_parameters
from spinepipe.studies.joint_pose_sensitivity.inputs import (
    bushing_model,
    specimen_inputs,
    start_stiffness,
    study_and_cohort,
)
from spinepipe.studies.joint_pose_sensitivity.settings import JointPoseSensitivity
from spinepipe.studies.joint_pose_sensitivity.tables import region_columns
from spinepipe.studies.problem import BUSHING, measured_in_frames, stiffness_problem
from spinepipe.units import (
    COORDINATE_COLUMNS,
    COORDINATES,
    DISPLAY_PER_SI,
    STIFFNESS_COLUMNS,
    subtract_baseline,
)

ERROR_COLUMNS = [
    f"{name}_error_{unit}"
    for name, unit in (column.rsplit("_", 1) for column in COORDINATE_COLUMNS)
]
"""Columns of mean absolute errors, mm and deg."""


def calibration_problem(
    root: str,
    settings: JointPoseSensitivity,
    specimen: str,
    frames: tuple[Pose, ...] | None = None,
    stiffness: Array | None = None,
) -> Problem:
    """What is fitted for a specimen with these joint frames.

    Parameters
    ----------
    frames : None: the cohort's own.
    stiffness : (6,) or (J, 6) SI to start from; None: the study's.

    Raises
    ------
    RefusedModel
        When the frames and loads make no model.
    """
    _, cohort = study_and_cohort(root, settings.study)
    inputs = specimen_inputs(root, settings.study, specimen, cohort.digest)
    placed = inputs.frames if frames is None else frames
    start = start_stiffness(settings) if stiffness is None else stiffness
    options = settings.calibration
    return stiffness_problem(
        bushing_model(settings, cohort, specimen, placed, start),
        measured_in_frames(inputs.tested, inputs.frames, placed),
        options.free,
        options.grouping,
        options.bound_factor,
        np.array(options.weights.in_order(), dtype=float),
    )


def fitted_stiffness(problem: Problem, x: Array) -> Array:
    """(J, 6) SI at a point x (m,) of the unknowns."""
    values: Array = with_parameters(problem.model, problem.free, x).effects[BUSHING].values
    return values


def absolute_errors(cases: Sequence[MeasuredCase], poses: Sequence[Array]) -> Array:
    """(R, J, 6) absolute error of every reading, mm and deg; NaN where not measured.

    R counts the load steps of all tests and cycles.

    Parameters
    ----------
    poses : (T, n) of each case, or nothing when there are none: then all is NaN.
    """
    if not poses:
        return np.concatenate([np.full_like(case.measured, np.nan) for case in cases])
    # predicted motion (T, J, 6) counts from step 0 where the readings do
    error = np.concatenate(
        [
            subtract_baseline(q.reshape(len(q), -1, 6), case.zeroed) - case.readings
            for q, case in zip(poses, cases, strict=True)
        ]
    )
    absolute: Array = np.abs(error) * DISPLAY_PER_SI
    return absolute


def mean_errors(errors: Array) -> dict[str, float | None]:
    """Cells of the mean of errors (R, 6) by coordinate, None where none was measured."""
    return {
        name: float(np.nanmean(column)) if np.isfinite(column).any() else None
        for name, column in zip(ERROR_COLUMNS, errors.T, strict=True)
    }


def fit_rows(problem: Problem, found: Fit, grouping: str) -> list[dict[str, Any]]:
    """One row, or one per joint where stiffness is per joint, with regions as in ``calibrations``.

    Parameters
    ----------
    found : a fit with its regions.
    """
    shared, solved = grouping == "per_specimen", found.status.usable
    ended = {
        "cost": found.cost if solved else None,
        "degrees_of_freedom": found.uncertainty.degrees_of_freedom,
        "status": found.status.value,
        "message": found.message,
    }
    rows = []
    for joint, values in enumerate(fitted_stiffness(problem, found.x)[: 1 if shared else None]):
        row = {"joint": "*" if shared else problem.model.joints[joint], **ended}
        for column, (name, stiffness) in enumerate(
            zip(COORDINATES, STIFFNESS_COLUMNS, strict=True)
        ):
            row[stiffness] = values[column] if solved else None
            row |= dict.fromkeys(region_columns(name))
            for index, unknown in enumerate(problem.free):
                if unknown.column == column and joint in unknown.rows and solved:
                    row |= _region(name, values[column], found, index)
        rows.append(row)
    return rows


def _region(name: str, value: float, found: Fit, index: int) -> dict[str, Any]:
    """What is known of one free stiffness: its standard error and how far it may be from there."""
    reach = found.reach(index, value)
    assert reach is not None  # of every fit that has a stiffness
    error = value * found.uncertainty.standard_error[index]
    cells = (
        error if np.isfinite(error) else None,
        reach.low,
        reach.high,
        reach.open_below,
        reach.open_above,
        found.identifiable(index),
    )
    return dict(zip(region_columns(name), cells, strict=True))
