"""Tables as the page shows them: columns with unit and meaning, cells with a value to sort by."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import pandas as pd

from spinepipe.report.words import number
from spinepipe.tables.schema import Column

MOST_ROWS = 400
"""More rows than this are left to the file of the table."""


@dataclass(frozen=True)
class Head:
    """A column's heading; ``meaning`` is its tooltip."""

    name: str
    unit: str
    meaning: str
    numeric: bool


@dataclass(frozen=True)
class Cell:
    """Text of a cell and, of a number, the value it is sorted by."""

    text: str
    value: float | None


@dataclass(frozen=True)
class Sortable:
    """One table of the page.

    Attributes
    ----------
    note : what was left out, or nothing.
    """

    name: str
    title: str
    about: str
    heads: tuple[Head, ...]
    rows: tuple[tuple[Cell, ...], ...]
    note: str


def sortable(
    name: str,
    title: str,
    about: str,
    frame: pd.DataFrame,
    columns: Sequence[Column],
) -> Sortable:
    """Rows of a frame.

    Columns that say nothing are left out: all empty, or the one specimen or status of all rows.
    """
    kept = [c for c in columns if c.name in frame and _says_something(frame[c.name])]
    shown = frame.head(MOST_ROWS)
    note = ""
    if len(frame) > len(shown):
        note = f"The first {len(shown)} of {len(frame)} rows; all of them are in {name}.parquet."
    values = [[_cell(value, c) for value in shown[c.name]] for c in kept]
    heads = tuple(Head(_title(c), _unit(c), _meaning(c), c.kind in _NUMERIC) for c in kept)
    return Sortable(name, title, about, heads, tuple(zip(*values, strict=True)), note)


_NUMERIC = ("number", "integer")
_SAME = ("specimen", "status")
_UNITS: Mapping[str, str] = {
    "see unit": "",
    "mm or deg, see unit": "",
    "N/m or N m/rad, see unit": "",
    "mm2, deg2": "",
}


def _unit(column: Column) -> str:
    return _UNITS.get(column.unit, column.unit)


def _meaning(column: Column) -> str:
    empty = f"; empty: {column.null}" if column.null else ""
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
    if value is None or (isinstance(value, float) and pd.isna(value)) or value is pd.NA:
        return Cell("", None)
    if column.kind == "number":
        return Cell(number(float(value)), float(value))
    if column.kind == "integer":
        return Cell(f"{int(value):,}".replace(",", "\u2009"), float(value))
    if column.kind == "flag":
        return Cell("yes" if value else "no", None)
    return Cell(str(value), None)
