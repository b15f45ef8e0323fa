"""Key findings about covariates: what of the specimens stiffness goes with."""

from collections.abc import Iterator
from typing import Any

import pandas as pd

from spinepipe.report.page.document import ResultTables
from spinepipe.report.words import AXIS, number
from spinepipe.studies.cohort_stiffness.settings import CohortStiffness

_WORDS = {
    "age_years": "age",
    "height_m": "height",
    "mass_kg": "body mass",
    "degeneration_grade": "degeneration grade",
}


def covariates(study: CohortStiffness, results: ResultTables) -> Iterator[str]:
    """What goes with stiffness, what cannot be told, and what was not to be asked."""
    rows = results.table("covariates")
    if rows.empty:
        return
    for row in rows[rows["holds"] == "yes"].to_dict("records"):
        yield (
            f"{AXIS[row['coordinate']]} stiffness goes with {_name(row)}: {_factor(row)}, over "
            f"{row['specimens']} specimens. That is no cause."
        )
    yield from _untold(rows[rows["holds"] == "undecided"])
    for message, part in rows[rows["holds"] == "refused"].groupby("message", sort=False):
        names = list(dict.fromkeys(_name(row) for row in part.to_dict("records")))
        where = list(dict.fromkeys(AXIS[one].lower() for one in part["coordinate"]))
        yield (
            f"Whether stiffness goes with {', '.join(names)} was not asked "
            f"({', '.join(where)}): {message}."
        )


def _untold(rows: pd.DataFrame) -> Iterator[str]:
    """Covariates that this cohort cannot decide about, with what it does not exclude."""
    if rows.empty:
        return
    told = [
        f"{AXIS[row['coordinate']].lower()} with {_name(row)}: {_factor(row)}"
        for row in rows.to_dict("records")
    ]
    yield (
        f"Not told apart from no effect: {'; '.join(told)}. What lies inside an interval is not "
        "excluded."
    )


def _name(row: dict[Any, Any]) -> str:
    return _WORDS.get(row["covariate"], str(row["covariate"]))


def _factor(row: dict[Any, Any]) -> str:
    ends = f"{number(row['low'], 2)} to {number(row['high'], 2)}"
    p = "" if pd.isna(row["p_holm"]) else f", p {number(row['p_holm'], 2)} beside the others"
    return f"times {number(row['factor'], 2)} for {row['step']} (95 % interval {ends}{p})"
