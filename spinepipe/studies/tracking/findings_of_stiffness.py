"""What markers tell of stiffness, and what calibrations and weights make of it.

A calibrated stiffness is said to be a property of a spine only where the profile of its region and
coordinate is closed at both ends.
"""

from collections.abc import Iterator
from typing import Any

import numpy as np
import pandas as pd

from spinepipe.cohort import Cohort
from spinepipe.report.page.document import ResultTables
from spinepipe.report.words import AXIS, capital, count, listed, number, percent, plain, tick
from spinepipe.status import Status
from spinepipe.studies.tracking.settings import Tracking
from spinepipe.studies.tracking.tables import VERDICTS
from spinepipe.studies.tracking.words import error_text, short_of

Row = dict[Any, Any]

NOT_KNOWN = "a number of the fit and no property of the spine"
_THIS_MODEL = (
    "Such an end holds for this model and its weights alone, and on made-up persons one was wrong "
    "(docs/studies/tracking.md)."
)
_MOST_PLACES = 9


def profiles(study: Tracking, cohort: Cohort, results: ResultTables) -> Iterator[str]:
    """What profiles say, each verdict in plain words."""
    rows = results.table("profiles")
    if rows.empty:
        return
    settled = rows["best_ratio"].notna()
    falling = _at_end(rows, results.table("profile_points"))
    for verdict in VERDICTS:
        own = rows[settled & ~falling & (rows["verdict"] == verdict)]
        if len(own):
            yield _verdict(verdict, own, len(rows))
    if not settled.all():
        lost = rows[~settled]
        yield (
            f"In {len(lost)} of {count(len(rows), 'profile')} no fit settled, so what markers tell "
            f"there is not known: {_places(lost)}."
        )
    edges = rows[falling]
    if len(edges):
        ways = sorted({tick(float(value)) for value in edges["best_ratio"]})
        yield (
            f"In {len(edges)} of {count(len(rows), 'profile')} the least cost lies at the end of "
            f"what was tried ({listed(ways)} times generic), so that markers tell nothing there: "
            "slack joints need little of muscles, whoever they belong to, and slipping skin can "
            "ask for them as well as a spine."
        )
    lost = rows[settled & rows["message"].fillna("").str.contains("did not settle")]
    if len(lost):
        yield f"Profiles with fits that did not settle: {_places(lost)}."


def closed_profiles(results: ResultTables) -> tuple[int, int]:
    """How many profiles tell a stiffness, of how many of which some fit settled."""
    rows = results.table("profiles")
    if rows.empty:
        return 0, 0
    return int((rows["verdict"] == "told").sum()), int(rows["best_ratio"].notna().sum())


def persons_with_profiles(results: ResultTables) -> list[str]:
    """Persons whose markers were asked."""
    return [str(name) for name in dict.fromkeys(results.table("profiles")["specimen"])]


def _verdict(verdict: str, own: pd.DataFrame, every: int) -> str:
    """Profiles of a verdict, with their ends."""
    if verdict == "not_told":
        return (
            f"In {len(own)} of {count(every, 'profile')} markers tell nothing of stiffness: "
            f"whatever was tried fits as well ({_places(own)})."
        )
    ends = []
    for row in own.to_dict("records"):
        low, high = (number(row[end], 2) if pd.notna(row[end]) else "" for end in ("low", "high"))
        between = (
            f"{low} to {high}" if low and high else f"below {high}" if high else f"above {low}"
        )
        ends.append(f"{_place(row)} {between} times generic")
    told = listed(ends, _MOST_PLACES)
    if verdict == "told":
        return f"Markers tell stiffness between two ends (95 %): {told}. {_THIS_MODEL}"
    return (
        f"Markers tell one end of stiffness alone, so they do not tell how stiff it is (95 %): "
        f"{told}. {_THIS_MODEL}"
    )


def _place(row: Row) -> str:
    return f"{plain(row['region'])} {AXIS[row['coordinate']].lower()} of {row['specimen']}"


def _places(rows: pd.DataFrame) -> str:
    return listed([_place(row) for row in rows.to_dict("records")], _MOST_PLACES)


def _at_end(rows: pd.DataFrame, points: pd.DataFrame) -> "pd.Series[bool]":
    """Profiles whose least cost is at the smallest or largest ratio that settled."""
    if points.empty:
        return pd.Series(False, index=rows.index)
    settled = points.dropna(subset=["cost_over_best"])
    keys = ["specimen", "region", "coordinate"]
    ends = settled.groupby(keys, observed=True)["ratio"].agg(["min", "max"])
    beside = rows.join(ends, on=keys)
    return (beside["best_ratio"] == beside["min"]) | (beside["best_ratio"] == beside["max"])


def calibrations(study: Tracking, cohort: Cohort, results: ResultTables) -> Iterator[str]:
    """What calibration makes of generic stiffness, and what it is worth."""
    rows = results.table("stiffness")
    if rows.empty:
        return
    fits = rows.drop_duplicates(["specimen", "law"])
    lost = fits[fits["status"] != Status.CONVERGED.value]
    if len(lost):
        names = [f"{short_of(str(r['law']))} of {r['specimen']}" for r in lost.to_dict("records")]
        yield f"{len(lost)} of {count(len(fits), 'calibration')} did not settle: {listed(names)}."
    known = rows.dropna(subset=["ratio_to_generic"])
    if known.empty:
        yield "No calibration loaded a joint, so none tells a stiffness."
        return
    inside = int(known["inside_generic"].astype(bool).sum())
    ratios = known["ratio_to_generic"].to_numpy(float)
    yield (
        f"Calibrated stiffness is {number(float(np.median(ratios)), 2)} times generic at the "
        f"median ({number(float(ratios.min()), 2)} to {number(float(ratios.max()), 2)}); "
        f"{inside} of {count(len(known), 'value')} ({percent(inside, len(known))}) are inside the "
        f"generic range. {_worth(results)}"
    )
    yield from _between_laws(known)


def _worth(results: ResultTables) -> str:
    """Whether such a number is knowledge."""
    sure, asked = closed_profiles(results)
    if not asked:
        return f"No profile says whether markers tell stiffness: each is {NOT_KNOWN}."
    if sure == asked:
        persons = set(results.table("stiffness")["specimen"].astype(str))
        asked_of = persons_with_profiles(results)
        others = len(persons - set(asked_of))
        more = f"; of {count(others, 'other person')} it was not asked" if others else ""
        return f"All profiles of {listed(asked_of)} are closed at both ends{more}."
    if not sure:
        return f"No profile is closed at both ends: each is {NOT_KNOWN}."
    return (
        f"{sure} of {count(asked, 'profile')} are closed at both ends: outside of these each is "
        f"{NOT_KNOWN}."
    )


def _between_laws(known: pd.DataFrame) -> Iterator[str]:
    """How unlike the same element comes out of one motion and another."""
    pair = ("optk_from_flexion", "optk_from_bending")
    keys = ["specimen", "joint", "coordinate", "side"]
    one, other = (known[known["law"] == law].set_index(keys)["ratio_to_generic"] for law in pair)
    ratio = (one / other).dropna().to_numpy(float)
    if len(ratio):
        apart = np.exp(np.abs(np.log(ratio)))
        yield (
            f"The same element, calibrated on flexion and on bending, differs by a factor of "
            f"{number(float(np.median(apart)), 3)} at the median and of "
            f"{number(float(apart.max()), 2)} at most ({count(len(ratio), 'element')})."
        )


def weights(study: Tracking, cohort: Cohort, results: ResultTables) -> Iterator[str]:
    """Whether the weight of loads is a good one, where the truth is known."""
    rows = results.table("weights")
    if rows.empty:
        return
    for trial, own in rows.groupby("trial", sort=False, observed=True):
        measures = (("centres", "centre_mm"), ("sagittal angles", "angle_deg"))
        best = [_best(*one, own) for one in measures if own[one[1]].notna().any()]
        if best:
            yield (
                f"{capital(plain(str(trial)))} of {own['specimen'].iloc[0]}, weight of loads: "
                f"{'; '.join(best)}."
            )


def _best(name: str, column: str, own: pd.DataFrame) -> str:
    """The weight of the least error, and whether it is an end of what was tried."""
    row = own.iloc[int(np.nanargmin(own[column].to_numpy(float)))]
    ratio = float(row["ratio"])
    ends = (float(own["ratio"].min()), float(own["ratio"].max()))
    edge = ", an end of what was tried" if ratio in ends else ""
    at_one = own.loc[own["ratio"] == 1.0, column].dropna()
    now = f" (now {error_text(float(at_one.iloc[0]), column)})" if len(at_one) else ""
    least = error_text(float(row[column]), column)
    return f"errors of {name} are least, {least}{now}, at {tick(ratio)} times the study's{edge}"
