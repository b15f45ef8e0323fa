"""Job: mean absolute errors in the loaded coordinate, as in Table 4 of Gould et al. 2024b."""

from typing import Any

import pandas as pd

from spinepipe.jobs.digest import provenance
from spinepipe.jobs.inputs import study_of_kind
from spinepipe.studies.cohort_stiffness.settings import CohortStiffness
from spinepipe.studies.cohort_stiffness.stages import largest_mean_motion
from spinepipe.studies.cohort_stiffness.tables import MAE, MAE_IN_DEG
from spinepipe.tables import from_rows, read_frames, write
from spinepipe.units import COORDINATE_UNITS

STEPS = {"peak": ("peak_error", "measured_peak"), "all": ("mae", "measured")}
"""Columns of the error and of the motion, at the largest load and over all load steps."""

PLACE = ["test", "coordinate"]
GROUP = ["representation", "fitted_to", "source", "stage", *PLACE]


def run(root: str, study: str, tables: list[str], output: str) -> None:
    """Write ``mae.parquet``."""
    settings, cohort = study_of_kind(CohortStiffness, root, study)
    rows = mae_rows(read_frames(tables)["errors"])
    write(from_rows(MAE, rows), output, provenance("mae", settings, cohort))


def mae_rows(errors: pd.DataFrame) -> list[dict[str, Any]]:
    """Rows of the table ``mae`` from those of ``errors``."""
    loaded = errors[errors["loaded"].astype(bool)]
    once = loaded.drop_duplicates(["specimen", *PLACE, "joint"])
    largest = {
        (*place, motion): largest_mean_motion(here, motion)
        for place, here in once.groupby(PLACE, sort=False)
        for _, motion in STEPS.values()
    }
    rows = []
    for key, part in loaded.groupby(GROUP, sort=False):
        named = dict(zip(GROUP, map(str, key), strict=True))
        for steps, (error, motion) in STEPS.items():
            found = specimen_mae(part, error, motion)
            of_all = largest[named["test"], named["coordinate"], motion]
            unit = COORDINATE_UNITS[named["coordinate"]]
            row = {**named, "unit": unit, "steps": steps, **_spread(found, of_all)}
            rows.append(row | _in_deg(row))
    return rows


def _in_deg(row: dict[str, Any]) -> dict[str, Any]:
    """The columns that hold rotations alone."""
    return {f"{name}_deg": row[name] if row["unit"] == "deg" else None for name in MAE_IN_DEG}


def specimen_mae(part: pd.DataFrame, error: str, motion: str) -> pd.Series:
    """Mean absolute error over the joints with a motion, by specimen; all of them must be known."""
    measured = part[part[motion].notna()]
    by_joint = measured[error].astype(float).abs().groupby(measured["specimen"])
    known: pd.Series = by_joint.mean()[by_joint.count() == by_joint.size()]
    return known


def _spread(values: pd.Series, largest: float | None) -> dict[str, Any]:
    empty = dict.fromkeys(("mae", "low_quartile", "high_quartile", "mae_percent"))
    row: dict[str, Any] = {"specimens": len(values), "largest_motion": largest, **empty}
    if values.empty:
        return row
    low, median, high = values.quantile([0.25, 0.5, 0.75])
    row |= {"mae": median, "low_quartile": low, "high_quartile": high}
    return row | {"mae_percent": 100.0 * median / largest if largest else None}
