"""Finding about the cohort: how much stiffness differs between specimens, levels and joints."""

from collections.abc import Iterator
from math import exp
from typing import Any

import pandas as pd

from spinepipe.report.page.results import Results
from spinepipe.report.stage_errors import joint_label_of
from spinepipe.report.words import AXIS, number
from spinepipe.statics.status import Status
from spinepipe.studies import CohortStiffness
from spinepipe.studies.fitted_to import NOBODY

_PARTS = {
    "between_specimens": "between specimens",
    "between_levels": "between levels",
    "between_joints": "of joints beyond that",
}


def spreads(study: CohortStiffness, results: Results) -> Iterator[str]:
    """Spreads that the hierarchical fit found, as factors: one SD up or down."""
    rows = results.table("pooling")
    if rows.empty:
        return
    whole = rows[(rows["without"] == NOBODY) & (rows["fitted_to"] == joint_label_of(rows))]
    settled = whole[whole["status"].map(lambda name: Status(name).usable).astype(bool)]
    told = [_spread(row) for row in settled.dropna(subset=["centre"]).to_dict("records")]
    if told:
        yield (
            "Stiffness in the middle of the cohort, and the factor that one SD stands for: "
            f"{'; '.join(told)}."
        )


def _spread(row: dict[Any, Any]) -> str:
    factors = [
        f"{words} {number(exp(row[name]))}"
        for name, words in _PARTS.items()
        if not pd.isna(row[name])
    ]
    centre = f"{AXIS[row['coordinate']].lower()} {number(row['centre'])} {row['unit']}"
    return f"{centre} ({', '.join(factors)})" if factors else centre
