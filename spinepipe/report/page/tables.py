"""Tables of a page: rows of result files with headings, and a paper's numbers beside ours."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
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
    folded : whether its rows are hidden until a reader asks for them.
    """

    name: str
    title: str
    about: str
    heads: tuple[Head, ...]
    rows: tuple[tuple[Cell, ...], ...]
    note: str
    file: str
    folded: bool = False


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


def page_tables(shape: Table, title: str, frame: pd.DataFrame) -> list[Sortable]:
    """A result table as a page has it.

    None without rows; two, see `beside_paper`, of a table ``against_*``, which sets a paper's
    numbers beside ours; else one.

    Parameters
    ----------
    shape : the table as it is declared. frame : its rows.
    """
    if frame.empty:
        return []
    if shape.name.startswith("against_"):
        return beside_paper(shape, title, frame)
    whole = sortable(shape.name, title, shape.about, frame, shape.columns)
    return [whole] if whole.rows else []


_PAPER_ORDER = (
    *("quantity", "unit", "paper", "paper_low", "paper_high", "ours", "ours_low", "ours_high"),
    *("limit", "verdict", "reason", "where", "evidence"),
)
"""Columns of a table ``against_*``: what a reader compares stands first. The key of its rows, a
short name of each quantity, is left to the file.
"""


def beside_paper(shape: Table, title: str, frame: pd.DataFrame) -> list[Sortable]:
    """A paper's numbers beside ours: those that are evidence, then folded those that are none.

    Evidence are those whose column ``evidence`` is ``independent``: the cohort and the study were
    not made to have them, so that agreement could have failed.
    """
    independent = frame["evidence"] == "independent"
    columns = tuple(map(shape.column, _PAPER_ORDER))
    rest = sortable(shape.name, f"{title}: no evidence", NO_EVIDENCE, frame[~independent], columns)
    told = frame[independent].drop(columns="evidence")
    first = sortable(shape.name, title, shape.about, told, columns)
    return [table for table in (first, replace(rest, folded=True)) if table.rows]


NO_EVIDENCE = (
    "Numbers of the paper of which agreement shows nothing: the cohort or the study was made to "
    "have them (circular), they follow from the paper's other numbers (recomputed), these exclude "
    "them (contradicted), or no run has anything to set beside them."
)


def judged(rows: pd.DataFrame) -> str:
    """A sentence on rows of a table ``against_*``; nothing without rows.

    It tells how many quantities that are evidence lie inside the paper's range, outside it, or
    were not computed; how hard it was to lie inside; and, not counted, those that are no evidence.
    """
    if rows.empty:
        return ""
    counted = rows[rows["evidence"] == "independent"]
    inside, outside, lacking = (
        int((counted["verdict"] == name).sum()) for name in ("inside", "outside", "not_computed")
    )
    told = (
        f"Of {len(counted)} published quantities that are evidence ours are inside the paper's "
        f"range for {inside} and outside for {outside}"
        + (f"; {lacking} are not computed" if lacking else "")
    )
    kinds = rows["evidence"].fillna("")
    others = [f"{n} {words}" for kind, words in _NO_EVIDENCE if (n := int((kinds == kind).sum()))]
    rest = f" Not counted: {', '.join(others)}." if others else ""
    return f"{told}.{_what_it_took(counted[counted['verdict'] == 'inside'])}{rest}"


_NO_EVIDENCE = (
    ("circular", "that cohort or study were made to have"),
    ("recomputed", "that follow from the paper's own numbers"),
    ("contradicted", "that other numbers of the paper exclude"),
    ("", "that nothing of a run can be held against"),
)
"""Values of the column ``evidence`` that are none, with the words that follow their number."""

_WORDS_OF_LIMITS = {
    "two_sided": "lie in a range with two ends whose width the paper gives",
    "chosen": "in one whose width was chosen here",
    "wide": "in one so wide (half to twice, or more) that inside is no agreement",
    "one_sided": "are on the right side of a single limit or of zero",
    "binary": "are the same yes, no or count",
}
"""Kinds of range, as in the column ``limit``, in words: that which is hardest to lie in first."""


def _what_it_took(inside: pd.DataFrame) -> str:
    """How many of the rows, all of them inside, lie in ranges of each kind; nothing without rows.

    The strongest kind is told even where its number is 0.
    """
    if inside.empty:
        return ""
    counts = {name: int((inside["limit"] == name).sum()) for name in _WORDS_OF_LIMITS}
    strongest, *weaker = _WORDS_OF_LIMITS
    told = [f"{counts[strongest]} {_WORDS_OF_LIMITS[strongest]}"]
    told += [f"{counts[name]} {_WORDS_OF_LIMITS[name]}" for name in weaker if counts[name]]
    return f" Of the {len(inside)} inside, {', '.join(told)}."
