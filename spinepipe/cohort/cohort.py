"""A validated cohort of specimens."""

from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import pandas as pd

from spinepipe.cohort.header import MeasurementSd

__all__ = ["Cohort", "joint_names"]


def joint_names(vertebrae: tuple[str, ...]) -> tuple[str, ...]:
    """Joints of vertebrae listed caudal to cranial: (L4, L3, L2) has L3L4 and L2L3."""
    return tuple(upper + lower for lower, upper in pairwise(vertebrae))


@dataclass(frozen=True, eq=False)
class Cohort:
    """Everything measured on one group of specimens, validated, in the units of the files.

    Tables have all columns of the format in its order, rows in the order of the file, float64
    numbers (NaN: not measured) and int64 ``step``; a table whose file is absent is None.

    Attributes
    ----------
    name, title, source : as in ``cohort.yaml``.
    folder : where it was read.
    vertebrae : caudal to cranial; the first is fixed to ground.
    gravity : whether 9.81 m/s2 acts along -y.
    zeroed_at_step_0 : whether step-0 coordinates were subtracted in every cycle.
    measurement_sd : SD of one reading, if known.
    specimens : one row each; undeclared columns follow as text, as written.
    landmarks, joints, bodies : geometry and masses in ground, neutral pose.
    loads : ``specimen`` may be ``*`` (all); ``cycle`` is float64, NaN stands for every cycle.
    motion : ``cycle`` is int64, 1 where the file says nothing.
    digest : sha256 over the names and bytes of the files that were read.
    """

    name: str
    title: str
    source: str
    folder: Path
    vertebrae: tuple[str, ...]
    gravity: bool
    zeroed_at_step_0: bool
    measurement_sd: MeasurementSd | None
    specimens: pd.DataFrame
    landmarks: pd.DataFrame | None
    joints: pd.DataFrame | None
    bodies: pd.DataFrame | None
    loads: pd.DataFrame | None
    motion: pd.DataFrame | None
    digest: str

    @property
    def joint_names(self) -> tuple[str, ...]:
        """Joints, caudal to cranial."""
        return joint_names(self.vertebrae)

    @property
    def specimen_names(self) -> tuple[str, ...]:
        """Specimens in the order of ``specimens.csv``."""
        return tuple(self.specimens["specimen"])

    @property
    def tests(self) -> tuple[str, ...]:
        """Tests in the order in which ``loads.csv`` first names them."""
        return () if self.loads is None else tuple(self.loads["test"].unique())
