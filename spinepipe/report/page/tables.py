"""Tables of a page: rows of result files with headings."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import pandas as pd

from spinepipe.report.words import number
from spinepipe.schema import Column, Table

MOST_ROWS = 200
"""More rows than this are left to the file of the table."""

_NUMERIC = ("number", "integer")
"""Types of columns that are set as numbers."""

_SAME = ("specimen", "status")
"""Columns that say nothing where all rows have the same value."""

_UNITS: Mapping[str, str] = {
    "see unit": "",
    "mm or deg, see unit": "",
    "N/m or N m/rad, see unit": "",
    "mm2, deg2": "",
}
"""Unit as a table declares it, to that in the heading: none where it differs from row to row."""


@dataclass(frozen=True)
class Head:
    """A column's heading.

    Attributes
    ----------
    unit : beside the name, empty where there is none. meaning : shown when it is pointed at.
    numeric : whether its cells are numbers.
    """

    name: str
    unit: str
    meaning: str
    numeric: bool


@dataclass(frozen=True)
class Cell:
    """Text of a cell, and the number it is sorted by: None where it is empty or no number."""

    text: str
    value: float | None


@dataclass(frozen=True)
class Sortable:
    """One table of the page.

    Attributes
    ----------
    name : no other table of the page has it.
    title, about : above the table: its heading, and what its rows are.
    note : how many rows were left out, or nothing. file : beside the page, that has all rows, for a
        link; empty where none has.
    """

    name: str
    title: str
    about: str
    heads: tuple[Head, ...]
    rows: tuple[tuple[Cell, ...], ...]
    note: str
    file: str


def sortable(
    name: str,
    title: str,
    about: str,
    frame: pd.DataFrame,
    columns: Sequence[Column],
    file: str | None = None,
) -> Sortable:
    """The first `MOST_ROWS` rows of a frame as a table of the page.

    Columns that say nothing are left out: all empty, or the one specimen or status of all rows.
    Where no column is left there are no rows either.

    Parameters
    ----------
    name : of the table, and of its result file.
    columns : those to be shown, in this order; a frame need not have all of them.
    file : that has all rows, where it is not ``<name>.parquet``.
    """
    file = f"{name}.parquet" if file is None else file
    kept = [c for c in columns if c.name in frame and _says_something(frame[c.name])]
    shown = frame.head(MOST_ROWS)
    note = ""
    if len(frame) > len(shown):
        note = f"The first {len(shown)} of {len(frame)} rows; all of them are in {file}."
    values = [[_cell(value, c) for value in shown[c.name]] for c in kept]
    heads = tuple(Head(_title(c), _unit(c), _meaning(c), c.type in _NUMERIC) for c in kept)
    return Sortable(name, title, about, heads, tuple(zip(*values, strict=True)), note, file)


def _unit(column: Column) -> str:
    return _UNITS.get(column.unit, column.unit)


def _meaning(column: Column) -> str:
    empty = f"; empty: {column.empty}" if column.empty else ""
    return f"{column.meaning}{empty}"


def _title(column: Column) -> str:
    """Name without the unit, which stands beside it."""
    name = column.name.removesuffix(f"_{column.unit}") if column.unit else column.name
    return name.replace("_", " ")


def _says_something(values: pd.Series) -> bool:
    if values.name in _SAME and values.nunique() <= 1:
        return False
    return bool((values.notna() & (values != "")).any())


def _cell(value: Any, column: Column) -> Cell:
    """Text by the type of the column: numbers to three significant digits, integers in full."""
    if value is None or (isinstance(value, float) and pd.isna(value)) or value is pd.NA:
        return Cell("", None)
    if column.type == "number":
        return Cell(number(float(value)), float(value))
    if column.type == "integer":
        return Cell(f"{int(value):,}".replace(",", "\u2009"), float(value))
    if column.type == "flag":
        return Cell("yes" if value else "no", None)
    return Cell(str(value), None)


def page_tables(shape: Table, title: str, frame: pd.DataFrame, columns: str = "") -> list[Sortable]:
    """A result table as a page has it; none without rows.

    Parameters
    ----------
    shape : the table as it is declared. frame : its rows.
    columns : names of those that a reader compares, between spaces; all by default.
    """
    shown = [*map(shape.column, columns.split())] or shape.columns
    whole = sortable(shape.name, title, shape.about, frame, shown)
    return [whole] if whole.rows else []
