"""Cells of tables as an import of a model writes them: to 1e-9 mm and deg, so that nothing is lost."""

from collections.abc import Iterable, Sequence

import numpy as np

from spinepipe.effects.contract import Array
from spinepipe.frames import Pose, zxy_angles
from spinepipe.units import MM_PER_M

Rows = list[Sequence[object]]

POINT = ("x_mm", "y_mm", "z_mm")
FRAME = (*POINT, "extension_deg", "right_bending_deg", "left_rotation_deg")


def cells(values: Iterable[float], digits: int = 9) -> list[str]:
    """Numbers of a row."""
    return [f"{round(float(value), digits) + 0.0:.15g}" for value in values]


def point_cells(point: Array) -> list[str]:
    """Of a point (3,) m."""
    return cells(point * MM_PER_M)


def pose_cells(pose: Pose) -> list[str]:
    """Of a frame."""
    return [*point_cells(pose.origin), *cells(np.degrees(zxy_angles(pose.rotation)))]
