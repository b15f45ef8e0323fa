"""Which lumbar joint does most of a motion, and how alike persons share it."""

from collections.abc import Iterable, Iterator

import pandas as pd

from spinepipe.cohort import Cohort
from spinepipe.report.page.document import ResultTables
from spinepipe.report.words import capital, count, fixed, listed, plain
from spinepipe.studies.tracking.findings_of_errors import FEWEST
from spinepipe.studies.tracking.settings import CONSTRAINED, Tracking
from spinepipe.studies.tracking.tables import DONE, TOO_FEW, TOO_SMALL, UNDEFINED, WINDOW
from spinepipe.studies.tracking.words import in_order, told

PREFERRED = ("optk_generic", "optk_from_both", "optk_calibrated")
"""Whose shares are told: of the first that there is, else of the first approach of the table."""


def shares(study: Tracking, cohort: Cohort, results: ResultTables) -> Iterator[str]:
    """The joint that does most in each trial, and whether persons agree."""
    rows = _window(results.table("sharing"))
    if rows.empty:
        return
    small = rows[rows["status"] == TOO_SMALL].drop_duplicates(["specimen", "trial", "approach"])
    for trial, own in rows.groupby("trial", sort=False, observed=True):
        known = own.dropna(subset=["share"])
        if len(known):
            name = leading(known["approach"])
            yield _most(str(trial), name, known[known["approach"] == name])
    if len(small):
        yield (
            f"In {count(len(small), 'motion')} the lumbar spine turns too little to be shared out: "
            "they have no share."
        )
    yield from _beyond(rows.dropna(subset=["share"]))


def leading(approaches: Iterable[str]) -> str:
    """The approach whose shares are told."""
    there = [str(name) for name in dict.fromkeys(approaches)]
    return next((name for name in PREFERRED if name in there), there[0])


def _window(rows: pd.DataFrame) -> pd.DataFrame:
    return rows[rows["window"] == WINDOW] if len(rows) else rows


def _most(trial: str, approach: str, rows: pd.DataFrame) -> str:
    wide = rows.pivot_table(index="specimen", columns="joint", values="share", observed=True)
    joint = str(wide.mean().idxmax())
    agree = int((wide.idxmax(axis="columns") == joint).sum())
    n = len(wide)
    values = 100.0 * wide[joint]
    said = (
        f"{capital(plain(trial))}, by {told(approach)}: {joint} does most of the lumbar rotation, "
        f"{fixed(float(values.mean()), 0)} %"
    )
    if n < 2:
        return f"{said}, in the one person there is."
    said += f" ({fixed(float(values.min()), 0)} to {fixed(float(values.max()), 0)} %)"
    if agree == n:
        return f"{said}, in each of {count(n, 'person')}."
    return f"{said} on average, but in {n - agree} of {count(n, 'person')} another joint does most."


def _beyond(rows: pd.DataFrame) -> Iterator[str]:
    """Approaches in which joints turn against the motion."""
    out = rows[(rows["share"] < 0.0) | (rows["share"] > 1.0)]
    if out.empty:
        yield "No joint turns against the motion of the lumbar spine, whatever the approach."
        return
    every = rows.groupby("approach", observed=True).size()
    some = out.groupby("approach", observed=True).size()
    parts = [
        f"{told(name)} {int(some[name])} of {int(every[name])}"
        for name in sorted(in_order(some.index), key=lambda name: -some[name] / every[name])
    ]
    yield (
        f"Shares below 0 or above 100 %, where joints turn against each other: {listed(parts, 4)}."
    )


def likeness(study: Tracking, cohort: Cohort, results: ResultTables) -> Iterator[str]:
    """How alike persons share a motion; where that is not defined it is said."""
    rows = _window(results.table("similarity"))
    if rows.empty:
        return
    for trial, own in rows.groupby("trial", sort=False, observed=True):
        free = own[~own["approach"].astype(str).str.startswith(CONSTRAINED)]
        parts = [*_defined(free[free["status"] == DONE])]
        lost = free[free["status"] == UNDEFINED]
        if len(lost):
            names = listed([told(str(name)) for name in lost["approach"]])
            parts.append(f"not defined for {names}, as persons differ more than the curve varies")
        if (free["status"] == TOO_FEW).all() and len(free):
            parts = ["fewer than two persons have a curve"]
        if parts:
            yield (
                f"How alike persons share {plain(str(trial))} (coefficient of multiple "
                f"correlation, 1: all alike): {'; '.join(parts)}."
            )
    fixed_ones = rows["approach"].astype(str).str.startswith(CONSTRAINED)
    if fixed_ones.any():
        yield "With fixed ratios persons are alike because the ratios are, whatever they did."


def _defined(rows: pd.DataFrame) -> Iterator[str]:
    if rows.empty:
        return
    n = int(rows["n_specimens"].min())
    values = rows.set_index("approach")["cmc"].astype(float).sort_values()
    few = "" if n >= FEWEST else f", of {count(n, 'person')} alone"
    if len(values) == 1:
        yield f"{fixed(float(values.iloc[0]))} for {told(str(values.index[0]))}{few}"
        return
    ends = [f"{fixed(float(values.iloc[k]))} ({told(str(values.index[k]))})" for k in (0, -1)]
    yield f"{ends[0]} to {ends[1]}{few}"
