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
            # over the joints with a motion, by specimen; all of these must be known
            measured = part[part[motion].notna()]
            by_joint = measured[error].astype(float).abs().groupby(measured["specimen"])
            found = by_joint.mean()[by_joint.count() == by_joint.size()]
            largest_of_all = largest[named["test"], named["coordinate"], motion]
            row = {
                **named,
                "unit": COORDINATE_UNITS[named["coordinate"]],
                "steps": steps,
                "specimens": len(found),
                "largest_motion": largest_of_all,
                **dict.fromkeys(("mae", "low_quartile", "high_quartile", "mae_percent")),
            }
            if len(found):
                low, median, high = found.quantile([0.25, 0.5, 0.75])
                share = 100.0 * median / largest_of_all if largest_of_all else None
                row |= {"mae": median, "low_quartile": low, "high_quartile": high}
                row |= {"mae_percent": share}
            in_deg = row["unit"] == "deg"
            rows.append(row | {f"{name}_deg": row[name] if in_deg else None for name in MAE_IN_DEG})
    return rows
