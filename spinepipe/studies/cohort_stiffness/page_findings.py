"""Findings that cast doubt on others: flipped signs, fits that failed, doubtful stiffness."""

from collections.abc import Iterator
from typing import Any

import pandas as pd

from spinepipe.report.cohort.named import NAME, case
from spinepipe.report.page.results import Results
from spinepipe.report.stage_errors import joint_label_of
from spinepipe.report.words import AXIS, count, percent
from spinepipe.statics.status import Status
from spinepipe.studies import CohortStiffness

_MOST_PLACES = 6


def signs(study: CohortStiffness, results: Results) -> Iterator[str]:
    """Where the measured motion goes against the load."""
    rows = results.table("sign_checks")
    if rows.empty:
        return
    flipped = rows[rows["verdict"] == "flipped"]
    if len(flipped):
        places = [
            f"{row['specimen']} {row['joint']} in {case(row['test']).lower()} "
            f"({AXIS[row['coordinate']].lower()}: {row['message']})"
            for row in flipped.to_dict("records")
        ]
        where = "1 place" if len(flipped) == 1 else f"{len(flipped)} places"
        yield (
            f"Look at this first: in {where} the measured motion goes against the load: "
            f"{_some(places)}. Stiffness of these joints, and whatever is compared with it, cannot "
            "be believed before this is settled."
        )
    undecided = int((rows["verdict"] == "undecided").sum())
    if undecided or not len(flipped):
        moved = int((rows["verdict"] == "as_expected").sum())
        rest = f"; {undecided} cannot be told" if undecided else ""
        yield f"{moved} of {count(len(rows), 'measured joint motion')} go with the load{rest}."


def failed(study: CohortStiffness, results: Results) -> Iterator[str]:
    """Fits without a stiffness, and why."""
    rows = results.table("fits")
    if rows.empty:
        return
    usable = [status.value for status in Status if status.usable]
    lost = rows[~rows["status"].isin(usable)]
    if lost.empty:
        yield f"All {count(len(rows), 'fit')} ended with a stiffness."
        return
    places = [f"{_fit(row)}: {row['message'] or row['status']}" for row in lost.to_dict("records")]
    yield f"{len(lost)} of {count(len(rows), 'fit')} have no stiffness: {_some(places)}."


def bounds(study: CohortStiffness, results: Results) -> Iterator[str]:
    """Fits with a stiffness at a bound."""
    rows = results.table("fits")
    if rows.empty:
        return
    at = rows[rows["status"] == Status.CONVERGED_AT_BOUND.value]
    if at.empty:
        return
    whole = at["fitted_to"] == joint_label_of(rows)
    places = [f"{_fit(row)} ({row['message']})" for row in at[whole].to_dict("records")]
    fewer = int((~whole).sum())
    parts = [
        f"{len(places)} to all load cases: {_some(places)}" if places else "",
        f"{fewer} to fewer load cases, which say too little about it" if fewer else "",
    ]
    yield (
        f"{count(len(at), 'fit')} of {len(rows)} ended with a stiffness at a bound, where the data "
        f"only say that it is beyond: {'; '.join(part for part in parts if part)}."
    )


def optima(study: CohortStiffness, results: Results) -> Iterator[str]:
    """Fits whose answer hangs on the start."""
    rows = results.table("fits")
    several = rows[rows["n_optima"] > 1] if len(rows) else rows
    if len(several):
        places = [_fit(row) for row in several.to_dict("records")]
        found = count(len(several), "fit has", "fits have")
        yield f"{found} several optima, so that the answer depends on the start: {_some(places)}."


def identifiable(study: CohortStiffness, results: Results) -> Iterator[str]:
    """How many fitted values the data do not constrain, and how well errors are explained."""
    rows = results.table("stiffness")
    if rows.empty:
        return
    own = rows[(rows["fitted_to"] == joint_label_of(rows)) & (rows["source"] == "own")]
    parts = [_lost(str(name), part) for name, part in own.groupby("representation", sort=False)]
    told = "; ".join(part for part in parts if part)
    if told:
        yield f"Not identifiable from all load cases together: {told}."
    elif len(own):
        yield "From all load cases together every fitted stiffness is identifiable."


def _lost(name: str, part: pd.DataFrame) -> str:
    flags = part["identifiable"].dropna().astype(bool)
    lost = int((~flags).sum())
    if not lost:
        return ""
    return f"{NAME[name]} {lost} of {len(flags)} values ({percent(lost, len(flags))})"


def _fit(row: dict[Any, Any]) -> str:
    fitted = str(row["fitted_to"]).replace("_", " ")
    return f"{row['specimen']}, {NAME[row['representation']]}, fitted to {fitted}"


def _some(places: list[str]) -> str:
    more = len(places) - _MOST_PLACES
    return "; ".join(places[:_MOST_PLACES]) + (f"; and {more} more" if more > 0 else "")
