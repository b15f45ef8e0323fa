"""Findings about the paper's claims and numbers."""

from collections.abc import Iterator
from typing import Any

import pandas as pd

from spinepipe.report.page.paper_findings import judged
from spinepipe.report.page.results import Results
from spinepipe.report.words import count, number
from spinepipe.studies import CohortStiffness

_VERDICTS = {
    "yes": ("hold", "Holds here"),
    "no": ("do not hold", "Does not hold here"),
    "undecided": ("cannot be decided", "Cannot be decided with this cohort"),
}
_MOST = 6


def claims(study: CohortStiffness, results: Results) -> Iterator[str]:
    """How many claims hold, and the first of each verdict with their numbers."""
    rows = results.table("findings")
    if rows.empty:
        return
    parts = {name: rows[rows["holds"] == name] for name in _VERDICTS}
    told = [f"{_VERDICTS[name][0]} {len(part)}" for name, part in parts.items() if len(part)]
    yield (
        f"Of {count(len(rows), 'claim')} about this cohort: {', '.join(told)}; table 1 has the "
        "numbers that decide, and what they are."
    )
    for name, part in parts.items():
        if len(part):
            first = "; ".join(_claim(row) for row in part.head(_MOST).to_dict("records"))
            more = f"; and {len(part) - _MOST} more" if len(part) > _MOST else ""
            yield f"{_VERDICTS[name][1]}: {first}{more}."


def _claim(row: dict[Any, Any]) -> str:
    """Statement with its value, interval and p; the message where there is no value."""
    statement = str(row["statement"]).rstrip(".")
    words = f"{statement[:1].lower()}{statement[1:]}"
    if pd.isna(row["value"]):
        return f"{words} ({row['message']})" if row["message"] else words
    numbers = [f"{number(row['value'])} {row['unit']}".rstrip()]
    if not (pd.isna(row["low"]) or pd.isna(row["high"])):
        numbers.append(f"95 % interval {number(row['low'])} to {number(row['high'])}")
    if not pd.isna(row["p"]):
        numbers.append(f"p {number(row['p'], 2)}")
    return f"{words} ({', '.join(numbers)})"


def beside_the_paper(study: CohortStiffness, results: Results) -> Iterator[str]:
    """How the published quantities were judged."""
    told = judged(results.table("against_gould_2024b"))
    if told:
        yield told
