"""Which readings of a cohort a study has before it: what was measured, and what again."""

from collections.abc import Sequence

import pandas as pd

from spinepipe.cohort import Cohort
from spinepipe.units import COORDINATE_COLUMNS, COORDINATES

__all__ = ["measured_columns", "readings", "repeated"]

_PLACE = ["specimen", "test", "step", "joint"]


def readings(
    cohort: Cohort, tests: Sequence[str] | None, coordinates: Sequence[str] | None
) -> pd.DataFrame:
    """Rows of motion with a reading, and their columns of the coordinates; None stands for all.

    Zeros that zeroing made are no readings.

    Parameters
    ----------
    cohort : with motion.
    """
    assert cohort.motion is not None
    columns = [
        column
        for name, column in zip(COORDINATES, COORDINATE_COLUMNS, strict=True)
        if name in (coordinates or COORDINATES)
    ]
    zeros = cohort.zeroed_at_step_0 & (cohort.motion["step"] == 0)
    read = cohort.motion[columns].notna().any(axis=1) & ~zeros
    chosen = cohort.motion["test"].isin(list(tests or cohort.tests))
    return cohort.motion.loc[read & chosen, [*_PLACE, "cycle", *columns]]


def measured_columns(rows: pd.DataFrame) -> list[str]:
    """Columns of coordinates that have a reading, in their order."""
    return [c for c in COORDINATE_COLUMNS if c in rows and bool(rows[c].notna().any())]


def repeated(rows: pd.DataFrame, columns: Sequence[str]) -> bool:
    """Whether any coordinate was read at the same place in two cycles of a test."""
    counts = rows.groupby(_PLACE)[list(columns)].count()
    return bool((counts > 1).to_numpy().any())
