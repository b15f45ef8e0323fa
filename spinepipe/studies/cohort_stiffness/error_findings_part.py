"""Findings about errors: which representation is best, and how large errors are."""

from collections.abc import Iterator
from typing import Any

import pandas as pd

from spinepipe.report.cohort.named import NAME, case
from spinepipe.report.page.results import Results
from spinepipe.report.stage_errors import joint_label_of
from spinepipe.report.words import number
from spinepipe.studies import CohortStiffness
from spinepipe.studies.fitted_to import NOTHING

_CRITERIA = {
    "fitted": "Motion that was fitted",
    "left_out_case": "Motion under a left-out load case",
    "left_out_specimen": "Motion of a left-out specimen",
}


def ranking(study: CohortStiffness, results: Results) -> Iterator[str]:
    """The order of representations by each criterion."""
    rows = results.table("ranking")
    if rows.empty:
        return
    for criterion, words in _CRITERIA.items():
        ranked = rows[(rows["criterion"] == criterion) & rows["rank"].notna()].sort_values("rank")
        if (~ranked["representation"].str.startswith("literature")).any():
            told = [_place(row, study.significance) for row in ranked.to_dict("records")]
            yield f"{words}, from least to largest error (mean ± SE): {'; '.join(told)}."
    best = [
        f"{words} prefers {_best(part)}"
        for name, words in (("aicc", "Akaike's criterion"), ("bic", "Schwarz's criterion"))
        if len(part := rows[(rows["criterion"] == name) & (rows["rank"] == 1)])
    ]
    if best:
        yield f"Of fits to all load cases, {', '.join(best)}."


def _place(row: dict[Any, Any], significance: float) -> str:
    """Name and error with its standard error; where it is no worse than the first, that."""
    error = row["standard_error"]
    spread = "" if pd.isna(error) else f" ± {number(error, 2)}"
    same = (
        ""
        if pd.isna(row["p"]) or row["p"] < significance
        else (f" (not told apart from the first, p {number(row['p'], 2)})")
    )
    return f"{NAME[row['representation']]} {number(row['value'])}{spread}°{same}"


def _best(part: pd.DataFrame) -> str:
    return " and ".join(NAME[name] for name in part["representation"])


def loaded_errors(study: CohortStiffness, results: Results) -> Iterator[str]:
    """Errors in the loaded direction at the largest load, load case by load case."""
    rows = results.table("mae")
    if rows.empty:
        return
    labels = [joint_label_of(rows), NOTHING]
    chosen = rows[
        (rows["steps"] == "peak")
        & rows["stage"].isin(["literature", "fitted"])
        & rows["fitted_to"].isin(labels)
        & rows["mae_deg"].notna()
    ]
    for (test, _), part in chosen.groupby(["test", "coordinate"], sort=False):
        told = [
            f"{NAME[row['representation']]} {number(row['mae_deg'], 2)}°{_share(row)}"
            for row in part.to_dict("records")
        ]
        yield (
            f"{case(str(test))}, error in the loaded direction at the largest load (median over "
            f"specimens, share of the largest motion): {'; '.join(told)}."
        )


def _share(row: dict[Any, Any]) -> str:
    share = row["mae_percent"]
    return "" if pd.isna(share) else f" ({number(share, 2)} %)"
