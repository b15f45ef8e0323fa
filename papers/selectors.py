"""Selectors that papers share: how our value is read from the tables of a run."""

from collections.abc import Callable
from importlib import import_module
from typing import Any

import pandas as pd

from papers.run import Computed, NotComputed, StudyRun

Selector = Callable[..., Computed]


def selectors_of(paper: str) -> dict[str, Selector]:
    """Those that papers share, and the paper's own, by name."""
    return {**SELECTORS, **import_module(f"papers.{paper}").SELECTORS}


def named(*selectors: Selector) -> dict[str, Selector]:
    """Functions by their names."""
    return {one.__name__: one for one in selectors}


def number(
    run: StudyRun, value: float, low: float | None = None, high: float | None = None
) -> Computed:
    """A value that the paper's other numbers give, whatever the run."""
    return Computed(value, low, high)


def setting(run: StudyRun, name: str) -> Computed:
    """A setting of the study, or a number that the product has of its own."""
    if run.asked.get(name) is None:
        raise NotComputed(f"this study states no {name.replace('_', ' ')}")
    return Computed(float(run.asked[name]))


def cell(
    run: StudyRun,
    table: str,
    column: str,
    low: str = "",
    high: str = "",
    scale: float = 1.0,
    **where: Any,
) -> Computed:
    """One cell, and cells of the same row that are its ends."""
    value = run.number(table, column, **where)
    row = run.row(table, **where)
    ends = [None if not name or pd.isna(row[name]) else float(row[name]) for name in (low, high)]
    return Computed(scale * value, ends[0], ends[1])


def equals(run: StudyRun, table: str, column: str, text: Any, **where: Any) -> Computed:
    """Whether a cell has a text."""
    return Computed(float(run.row(table, **where)[column] == text))


def distinct(run: StudyRun, table: str, column: str, **where: Any) -> Computed:
    """How many values a column has."""
    return Computed(float(run.rows(table, **where)[column].nunique()))


def reduced(
    run: StudyRun,
    table: str,
    column: str,
    by: str,
    ends: bool = False,
    scale: float = 1.0,
    **where: Any,
) -> Computed:
    """Mean, median, largest ... of a column's numbers; its ends, the least and the largest."""
    values = filled(run.rows(table, **where), column)
    low, high = (float(values.min()), float(values.max())) if ends else (None, None)
    return Computed(scale * float(values.agg(by)), low, high)


def tested(run: StudyRun, test: str, **where: Any) -> pd.DataFrame:
    """Tests that have a result and whose name begins like this, in any case; at least one."""
    rows = run.rows("statistics", **where)
    rows = rows[rows["test"].str.lower().str.startswith(test)]
    done = rows.dropna(subset=["p"])
    if done.empty:
        messages = [str(text) for text in rows["message"].unique() if text]
        raise NotComputed("; ".join(["no such test has a result", *messages[:1]]))
    return done


def filled(rows: pd.DataFrame, column: str) -> "pd.Series[float]":
    """Numbers of a column without what is empty, at least one."""
    values = pd.to_numeric(rows[column], errors="coerce").astype(float).dropna()
    if values.empty:
        raise NotComputed(f"{column} is empty in all rows")
    return values


SELECTORS = named(number, setting, cell, equals, distinct, reduced)
