"""Job: how far answers can be trusted, and what drives them, from all samples."""

from collections.abc import Iterator

import numpy as np
import pandas as pd

from spinepipe.jobs.digest import provenance
from spinepipe.jobs.inputs import study_of_kind
from spinepipe.sensitivity_analysis.global_indices.estimates import Settings
from spinepipe.sensitivity_analysis.global_indices.indices import indices
from spinepipe.status import Balanced
from spinepipe.studies.trunk_loads.rows import Row
from spinepipe.studies.trunk_loads.sampling import censored_quantile, design_of
from spinepipe.studies.trunk_loads.selection import sound
from spinepipe.studies.trunk_loads.settings import TrunkLoads
from spinepipe.studies.trunk_loads.tables import DRIVERS, INTERVALS, QUANTITIES
from spinepipe.tables import from_rows, read_frames, write

MOST_FAILED = 0.2
"""Share of the samples above which no share is given: what is left would be those that are easy."""

RESOLUTION = 1e-6
"""Outcomes that vary by less are constant."""

_WORDS = {"S1": "first_order", "ST": "total"}
_EMPTY = [f"{word}{end}" for word in _WORDS.values() for end in ("", "_low", "_high")]


def run(root: str, study: str, tables: list[str], intervals: str, drivers: str) -> None:
    """Write both tables from tables tasks and responses."""
    settings, cohort = study_of_kind(TrunkLoads, root, study)
    read = read_frames(tables)
    responses, nominal = read["responses"], read["tasks"]
    made_by = provenance("spread", settings, cohort)
    pairs = responses[["specimen", "task"]].drop_duplicates().to_numpy(str).tolist()
    trusted, driving = list[Row](), list[Row]()
    for who, task in pairs:
        rows = responses[(responses["specimen"] == who) & (responses["task"] == task)]
        trusted += _intervals(who, task, rows, nominal)
        driving += _drivers(settings, who, task, rows)
    write(from_rows(INTERVALS, trusted), intervals, made_by)
    write(from_rows(DRIVERS, driving), drivers, made_by)


def _intervals(who: str, task: str, rows: pd.DataFrame, nominal: pd.DataFrame) -> Iterator[Row]:
    good = rows[sound(rows)]
    above = int((rows["status"] == Balanced.CONVERGED_ABOVE).sum())
    own = nominal[(nominal["specimen"] == who) & (nominal["task"] == task)].iloc[0]
    for quantity in QUANTITIES:
        values = good[quantity].to_numpy(float)
        lost = len(rows) - len(values)
        ends = [censored_quantile(values, lost, p) for p in (0.025, 0.5, 0.975)]
        yield {
            "specimen": who,
            "task": task,
            "quantity": quantity,
            "nominal": None if pd.isna(own[quantity]) else float(own[quantity]),
            **dict(zip(("low", "median", "high"), ends, strict=True)),
            "n_samples": len(values),
            "n_failed": lost,
            "n_above": above,
        }


def _drivers(settings: TrunkLoads, who: str, task: str, rows: pd.DataFrame) -> Iterator[Row]:
    """Sobol indices; a base sample with a failed run is left out as a whole."""
    rows = rows.sort_values("sample")
    ok = sound(rows).to_numpy()
    values = np.where(ok[:, None], rows[list(QUANTITIES)].to_numpy(float), 0.0)
    asked = Settings(
        bootstraps=500,
        seed=settings.uncertain.seed,
        wanted=("S1", "ST"),
        most_failed=MOST_FAILED,
    )
    found = indices(design_of(settings), values, ok, asked, RESOLUTION)
    for factor in settings.uncertain.factors:
        of_factor = [one for one in found if one.factor == factor]
        for number, quantity in enumerate(QUANTITIES):
            row: Row = {
                "specimen": who,
                "task": task,
                "quantity": quantity,
                "factor": factor,
                "n_samples": int(ok.sum()),
                "message": of_factor[0].message[number] if of_factor else "",
                **dict.fromkeys(_EMPTY),
            }
            for one in of_factor:
                word = _WORDS[one.index]
                ends = ("", one.estimate), ("_low", one.low), ("_high", one.high)
                row |= {f"{word}{end}": values.tolist()[number] for end, values in ends}
            yield row
