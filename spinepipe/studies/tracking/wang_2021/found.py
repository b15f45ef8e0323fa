"""How claims find motions of a kind, and sizes over persons, in tables of a run.

Three tables are no results: `subjects`, `trials` and `marker_set`, rows of the cohort's folder.
"""

from collections.abc import Sequence

import numpy as np
import pandas as pd

from spinepipe.comparison.claim import NotComputed, Ours, Run
from spinepipe.effects.contract import Array
from spinepipe.studies.tracking.settings import APPROACHES, CONSTRAINED

COHORT = ("subjects", "trials", "marker_set")

FE, LB, STANCE = "flexion_extension", "lateral_bending", "stance"

LEARNT = ("optk_calibrated", "optk_from_flexion", "optk_from_bending", "optk_from_both")
"""Approaches whose passive elements are calibrated on one motion or another."""

SETS = tuple(name for name in APPROACHES if name.startswith(CONSTRAINED))
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


def first_of(run: Run, table: str, approaches: Sequence[str]) -> str:
    """The first approach of which a table has rows."""
    there = set(run.rows(table)["approach"])
    for name in approaches:
        if name in there:
            return name
    raise NotComputed(f"this run's table {table} has none of {', '.join(approaches)}")


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
