"""Cells of a fitted stiffness in a table: its value, its error and its region."""

from typing import Any

import numpy as np

from spinepipe.calibrate import Fit, Problem
from spinepipe.model import SpineModel
from spinepipe.studies.joint_pose_sensitivity.tables import region_columns
from spinepipe.units import COORDINATES, STIFFNESS_COLUMNS


def stiffness_cells(problem: Problem, found: Fit, model: SpineModel, joint: int) -> dict[str, Any]:
    """Cells of one joint in a table with the stiffness columns of ``calibrations``.

    Parameters
    ----------
    found : a fit with its regions. model : the problem's, moved to the fit.
    """
    row: dict[str, Any] = {}
    solved = found.status.usable
    values = model.effects[0].values[joint]
    for column, (name, stiffness) in enumerate(zip(COORDINATES, STIFFNESS_COLUMNS, strict=True)):
        row[stiffness] = values[column] if solved else None
        row |= dict.fromkeys(region_columns(name))
        for index, unknown in enumerate(problem.free):
            if unknown.column == column and joint in unknown.rows and solved:
                row |= _region(name, values[column], found, index)
    return row


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
