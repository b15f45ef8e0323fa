"""Measured pressures beside computed ones of which nothing was fitted to them."""

from collections.abc import Mapping

import numpy as np
import pandas as pd
from scipy.stats import chi2

from spinepipe.muscles.measured_pressures import paired
from spinepipe.report.conclusions import Value
from spinepipe.studies.trunk_loads.selection import PRESSURE, named, of_person, of_task, sound
from spinepipe.studies.trunk_loads.settings import TrunkLoads

FEWEST = 3
"""Tasks from which on an error is told of them together."""

_COLUMNS = (
    *("task", "measured_mpa", "confirmed", "counted", "computed_mpa", "held"),
    *("low", "high", "n_samples", "n_failed"),
)


def beside_measured(study: TrunkLoads, tables: Mapping[str, pd.DataFrame]) -> pd.DataFrame:
    """Tasks of the volunteer whose pressure was measured, by that pressure.

    Columns: task, measured_mpa, confirmed (read in print), counted (and one of the tasks of the
    paper's comparison), computed_mpa, held (by the model's muscles); of a sampled task low, high,
    n_samples, n_failed. No rows where nobody stands for the volunteer.
    """
    rows, tasks = [], tables.get("tasks", pd.DataFrame())
    if study.volunteer is None or tasks.empty:
        return pd.DataFrame(columns=list(_COLUMNS))
    own = of_person(tasks, study.volunteer.specimen)
    asked = {
        str(row["task"]): (
            None if pd.isna(row["number"]) else int(row["number"]),
            float(row["trunk_right_bending_deg"]),
        )
        for row in named(own)
    }
    computed = dict(zip(own["task"], named(own.assign(held=sound(own))), strict=True))
    for one in paired(asked):
        row = computed[one.task]
        sampled = of_task(tables.get("intervals", pd.DataFrame()), row)
        chosen = named(sampled[sampled["quantity"] == PRESSURE]) if len(sampled) else []
        spread = chosen[0] if chosen else {}
        rows.append(
            {
                "task": one.task,
                "measured_mpa": one.mpa,
                "confirmed": one.status == "confirmed",
                "counted": one.counted,
                "computed_mpa": row[PRESSURE],
                "held": row["held"],
                **{name: spread.get(name) for name in _COLUMNS[6:]},
            }
        )
    found = pd.DataFrame(rows, columns=list(_COLUMNS))
    numbers = ["measured_mpa", "computed_mpa", *_COLUMNS[6:]]
    found[numbers] = found[numbers].astype(float)
    return found.astype({"held": bool, "counted": bool, "confirmed": bool}).sort_values(
        "measured_mpa", kind="stable"
    )


def counted_and_held(beside: pd.DataFrame) -> pd.DataFrame:
    """Rows over which errors are told: confirmed, and held by the model's muscles."""
    return beside[beside["counted"] & beside["held"]].dropna(subset=["computed_mpa"])


def error(computed_mpa: pd.Series, measured_mpa: pd.Series, source: str) -> Value | None:
    """Root mean square error, MPa, with the interval of normal errors without a mean.

    None of fewer than `FEWEST` tasks.
    """
    off = (computed_mpa - measured_mpa).to_numpy(float)
    n = len(off)
    if n < FEWEST:
        return None
    rms = float(np.sqrt(np.mean(off**2)))
    low, high = (rms * float(np.sqrt(n / chi2.ppf(p, n))) for p in (0.975, 0.025))
    return Value(rms, "MPa", low, high, n, source)
