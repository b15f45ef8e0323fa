"""Drawn frames and stiffness sets, read once per worker and state of their files."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy.spatial.transform import Rotation

from spinepipe.effects.contract import Array
from spinepipe.frames import Pose
from spinepipe.jobs.inputs import Stamp, stamp
from spinepipe.tables import read_frame
from spinepipe.units import MM_PER_M, ROTATIONS, STIFFNESS_COLUMNS


@dataclass(frozen=True, eq=False)
class DrawnFrames:
    """Joint frames of all specimens and poses.

    Attributes
    ----------
    rows : (specimen, pose) to the first row of its frames.
    n_joints : rows of one pose.
    origins, rotations : (rows, 3) m and (rows, 3, 3).
    """

    rows: dict[tuple[str, int], int]
    n_joints: int
    origins: Array
    rotations: Array

    def of(self, specimen: str, pose: int) -> tuple[Pose, ...]:
        """Frames of one pose, caudal to cranial."""
        first = self.rows[specimen, pose]
        at = range(first, first + self.n_joints)
        return tuple(Pose(self.rotations[row], self.origins[row]) for row in at)


def drawn_frames(path: str) -> DrawnFrames:
    """Frames of ``frames.parquet``."""
    return _frames(stamp(path))


@lru_cache(maxsize=2)
def _frames(where: Stamp) -> DrawnFrames:
    table = read_frame(where[0])
    n = table["joint"].nunique()
    keys = zip(table["specimen"][::n], table["pose"][::n].astype(int), strict=True)
    angles = np.deg2rad(table[[f"{name}_deg" for name in ROTATIONS]].to_numpy(float))
    return DrawnFrames(
        {key: n * index for index, key in enumerate(keys)},
        n,
        table[["x_mm", "y_mm", "z_mm"]].to_numpy(float) / MM_PER_M,
        Rotation.from_euler("ZXY", angles).as_matrix(),
    )


def drawn_stiffness(path: str) -> Array:
    """(sets, J, 6) stiffness of ``stiffness_sets.parquet``, SI."""
    return _stiffness(stamp(path))


@lru_cache(maxsize=2)
def _stiffness(where: Stamp) -> Array:
    table = read_frame(where[0])
    values: Array = table[list(STIFFNESS_COLUMNS)].to_numpy(float)
    return values.reshape(table["stiffness"].nunique(), -1, 6)
