"""How claims find motions of a kind, and sizes over persons, in tables of a run.

Four tables are no results: `subjects`, `trials` and `marker_set`, rows of the cohort's folder, and
`generic`, the passive elements that calibrations begin with.
"""

from collections.abc import Sequence

import numpy as np
import pandas as pd

from spinepipe.comparison.claim import NotComputed, Ours, Range, Run
from spinepipe.effects.contract import Array
from spinepipe.studies.tracking.settings import CONSTRAINED

COHORT = ("subjects", "trials", "marker_set")

FE, LB, STANCE = "flexion_extension", "lateral_bending", "stance"

LEARNT = ("optk_calibrated", "optk_from_flexion", "optk_from_bending", "optk_from_both")
"""Approaches whose passive elements are calibrated on one motion or another."""

SETS = tuple(f"{CONSTRAINED}{name}" for name in ("christophy_2012", "bruno_2015", "shojaei_2017"))
"""The paper's three sets of ratios, in its order."""

BEST = ("optk_from_both", "optk_calibrated", "optk_generic")
"""Approaches that stand for the paper's, where it does not say with which a number was made: the
first that the study has."""


def of_kind(run: Run, table: str, kind: str, **where: str) -> pd.DataFrame:
    """Rows of motions of a kind, at least one."""
    rows = run.rows(table, **where)
    trials = run.rows("trials", kind=kind)[["specimen", "trial"]].drop_duplicates()
    on = [name for name in ("specimen", "trial") if name in rows]
    found = rows.merge(trials[on].drop_duplicates(), on=on)
    if found.empty:
        raise NotComputed(f"this run's table {table} has no trial of kind {kind}")
    return found


def first_of(run: Run, table: str, names: Sequence[str], column: str = "approach") -> str:
    """The first approach, or calibration, of which a table has rows."""
    there = set(run.rows(table)[column])
    for name in names:
        if name in there:
            return name
    raise NotComputed(f"this run's table {table} has none of {', '.join(names)}")


def filled(rows: pd.DataFrame, column: str) -> pd.DataFrame:
    """Rows whose cell is not empty, at least one."""
    kept = rows[pd.to_numeric(rows[column], errors="coerce").notna()]
    if kept.empty:
        raise NotComputed(f"{column} is empty in all rows")
    return kept


def numbers(rows: pd.DataFrame, column: str) -> Array:
    """Cells of a column that are not empty, at least one."""
    return filled(rows, column)[column].to_numpy(float)


def spanned(values: Array, note: str = "", value: float | None = None) -> Ours:
    """Mean, or another value, with the least and the largest."""
    mean = float(np.mean(values)) if value is None else value
    return Ours(mean, float(np.min(values)), float(np.max(values)), note)


def farthest(values: Array, window: Range) -> float:
    """The value that is farthest outside a window with two ends, else nearest to one of them."""
    assert window.low is not None
    assert window.high is not None
    beyond = np.maximum(window.low - values, values - window.high)
    return float(values[int(np.argmax(beyond))])


LEAST_PERSONS = 3
"""Fewer tell no order of persons."""


def over_persons(apart: "pd.Series[float]", told: str, unit: str) -> str:
    """What an order hangs on: means of ours, as told, and by how much persons (N,) differ.

    Raises
    ------
    NotComputed
        Where so few persons, or a difference smaller than its spread, do not tell it.
    """
    count = len(apart)
    mean, sd = float(apart.mean()), float(apart.std(ddof=1)) if count > 1 else 0.0
    found = f"{told}; difference {mean:.2g} {unit}, SD {sd:.2g} over {count} persons"
    if count < LEAST_PERSONS:
        raise NotComputed(f"fewer than {LEAST_PERSONS} persons tell no order; {told}")
    if abs(mean) < sd:
        raise NotComputed(f"not told: the difference is smaller than its spread; {found}")
    return found
