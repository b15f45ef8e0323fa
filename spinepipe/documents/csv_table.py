"""A CSV file as a typed table, every bad cell with the line where an editor shows it."""

import csv
import io
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from difflib import SequenceMatcher
from functools import cached_property
from math import isfinite, nan
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from spinepipe.documents.form import InputColumn, TableForm
from spinepipe.documents.names import ALLOWED, LONGEST_NAME, name_fault
from spinepipe.documents.text import (
    LONGEST_CELL,
    MOST_CSV_BYTES,
    NUMBER,
    has_long_word,
    read_text,
)
from spinepipe.problems import InputProblem, Spelling, first_of

MOST_ROWS = 150_000

MOST_COLUMNS = 1000

LONGEST_REMARK = 1000
"""Characters of a cell of several words."""

MOST_CELLS = 4_000_000
"""Cells of one file; files within these bounds are read and checked in seconds."""


@dataclass(frozen=True)
class CsvRows:
    """Cells of one CSV file, not yet understood.

    Attributes
    ----------
    file : name in messages.
    header : column names.
    lines : line of each row.
    cells : rows of cells, blanks around a cell removed, as many as the header has names.
    ragged : lines whose rows had too many or too few cells (reported; cut or filled up here).
    """

    file: str
    header: list[str]
    lines: list[int]
    cells: list[list[str]]
    ragged: frozenset[int]

    @cached_property
    def index(self) -> "pd.Index[int]":
        """Lines as all columns of the table have them."""
        return pd.Index(self.lines)


def read_table(
    path: Path, form: TableForm, file: str
) -> tuple[pd.DataFrame | None, list[InputProblem]]:
    """Read and convert one CSV file.

    Parameters
    ----------
    path : the file, which exists.
    form : its declared columns.
    file : its name in messages.

    Returns
    -------
    The table, indexed by line number, with all declared columns (numbers as float64, NaN where
    empty or bad; text as str, NaN where an optional cell is empty) and then the carried ones;
    None when the file is no table or lacks a required column. And the problems.
    """
    rows, problems = read_rows(path, file)
    if rows is None:
        return None, problems
    problems += _column_problems(rows, form)
    lacking = any(not column.nullable and column.name not in rows.header for column in form.columns)
    if lacking or not rows.cells:
        return None, problems
    texts = dict(zip(rows.header, map(list, zip(*rows.cells, strict=True)), strict=True))
    data: dict[str, pd.Series] = {}
    for column in form.columns:
        cells = texts.pop(column.name, [""] * len(rows.lines))
        data[column.name] = _converted(cells, column, rows, problems)
    if form.carries:
        data |= {name: _text_series(cells, rows.index) for name, cells in texts.items()}
    return pd.DataFrame(data), problems


def _column_problems(rows: CsvRows, form: TableForm) -> Iterator[InputProblem]:
    known = Spelling(form.names, "delete the column or correct its name")
    absent = [name for name in form.names if name not in rows.header]
    for name in rows.header:
        if name in form.names:
            continue
        if not form.carries:
            remedy = known.remedy(name)
            yield InputProblem(rows.file, 1, name, "an unknown column", known.allowed, remedy)
        elif (meant := _meant(name, absent)) is not None:
            allowed = f"the name {meant}, or one that is not so similar"
            remedy = f"did you mean '{meant}'?"
            yield InputProblem(rows.file, 1, name, "a column that is not read", allowed, remedy)
        elif name and (fault := name_fault(name)) is not None:
            yield InputProblem(
                rows.file, 1, None, fault, f"columns of {ALLOWED}", "rename the column"
            )
    for column in form.columns:
        if not column.nullable and column.name not in rows.header:
            yield InputProblem(
                rows.file, 1, column.name, "no such column", column.meaning, "add the column"
            )


LIKE = 0.85
"""Least likeness of names of columns of which one is taken for the other misspelt."""


def _meant(name: str, absent: Sequence[str]) -> str | None:
    """The documented column that one of somebody's own most likely is."""
    if len(name) > LONGEST_NAME:
        return None
    for other in absent:
        same_letters = sorted(name.casefold()) == sorted(other)
        if same_letters or SequenceMatcher(None, name.casefold(), other).ratio() >= LIKE:
            return other
    return None


def _converted(
    cells: list[str], column: InputColumn, rows: CsvRows, problems: list[InputProblem]
) -> "pd.Series":
    if not column.nullable:
        problems += first_of(
            InputProblem(rows.file, line, column.name, "an empty cell", column.meaning, "fill it")
            for line, cell in zip(rows.lines, cells, strict=True)
            if not cell and line not in rows.ragged
        )
    if column.type == "text":
        return _text_series(cells, rows.index)
    numbers = _numbers(cells)
    wrong = [index for index in np.flatnonzero(_is_wrong(numbers, column)).tolist() if cells[index]]
    problems += first_of(
        InputProblem(
            *(rows.file, rows.lines[index], column.name, f"'{cells[index]}'"),
            *_number_fault(cells[index], float(numbers[index]), column),
        )
        for index in wrong
    )
    numbers[wrong] = nan
    return pd.Series(numbers, index=rows.index, dtype="float64")


def _numbers(cells: list[str]) -> NDArray[np.float64]:
    """The numbers that cells are; where most occur more than once, each is looked at once."""
    known = set(cells)
    if 2 * len(known) > len(cells):
        return np.array([_number(cell) for cell in cells], dtype=np.float64)
    numbers = {cell: _number(cell) for cell in known}
    return np.array([numbers[cell] for cell in cells], dtype=np.float64)


def _number(cell: str) -> float:
    """The number that a cell is; NaN where it is none."""
    return float(cell) if cell[:1] in "+-.0123456789" and NUMBER.fullmatch(cell) else nan


def _is_wrong(numbers: NDArray[np.float64], column: InputColumn) -> NDArray[np.bool_]:
    """Which numbers of a column it may not have; also what is none."""
    with np.errstate(invalid="ignore"):
        wrong = ~np.isfinite(numbers)
        if column.type == "integer":
            wrong |= numbers != np.trunc(numbers)
        wrong |= numbers <= column.low if column.open_low else numbers < column.low
        wrong |= numbers >= column.high if column.open_high else numbers > column.high
    return wrong


def _text_series(cells: list[str], lines: "pd.Index[int]") -> "pd.Series":
    return pd.Series([cell or None for cell in cells], index=lines, dtype="str")


_MISTAKEN = {
    "height_m": (0.01, "cm and not m"),
    "_nm": (1e-3, "moments in N mm and not N m"),
    "_kg": (1e-3, "masses in g and not kg"),
}
"""By the end of a column's name: by what a number in another unit must be multiplied, and which."""


def _number_fault(cell: str, number: float, column: InputColumn) -> tuple[str, str]:
    """What is allowed and what to do about a number that is wrong."""
    if not isfinite(number):
        remedy = "correct it" if not column.nullable else "leave the cell empty if not measured"
        remedy = "write a decimal point" if "," in cell else remedy
        return "a finite number with a decimal point", remedy
    if column.type == "integer" and number != int(number):
        return "a whole number", "correct it"
    allowed = f"{column.meaning}: {column.range_text}"
    # out of range: the unit that brings it back, where there is one
    for end, (factor, words) in _MISTAKEN.items():
        if column.name.endswith(end) and column.low < factor * number < column.high:
            return allowed, f"suspected: {words}; multiply the column by {factor:.3g}"
    check = "correct it; check its unit, its sign, and for a slip of the decimal point"
    return allowed, column.otherwise or check


def read_rows(path: Path, file: str) -> tuple[CsvRows | None, list[InputProblem]]:
    """Rows of a comma-separated UTF-8 file, None when it is no such table.

    Wholly blank lines are skipped: they carry nothing.
    """
    text, problems = read_text(path, file, MOST_CSV_BYTES)
    problems = problems or list(_size_problems(text, file))
    if problems:
        return None, problems
    records, problems = _records(text, file)
    problems = problems or _header_problems(file, records[0][1])
    problems = problems or list(_long_cells(file, records))
    if problems:
        return None, problems
    header = records[0][1]
    rows, problems = _squared(file, header, records[1:])
    if not rows.lines:
        problems.append(
            InputProblem(
                file, 1, None, "a header and no rows", "at least one row", "fill or delete it"
            )
        )
    return rows, problems


def _size_problems(text: str, file: str) -> Iterator[InputProblem]:
    """More lines or cells than are read, said before they are."""
    for what, sign, most in (
        ("rows", "\n", MOST_ROWS),
        ("rows", "\r", MOST_ROWS),
        ("cells", ",", MOST_CELLS),
    ):
        number = text.count(sign)
        if number > most:
            remedy = "split the cohort, or leave steps out"
            yield InputProblem(
                file, None, None, f"{number} {what}", f"at most {most} {what}", remedy
            )
            return


Records = list[tuple[int, list[str]]]
"""Line and cells of each row, the header too."""


def _records(text: str, file: str) -> tuple[Records, list[InputProblem]]:
    reader = csv.reader(io.StringIO(text, newline=""), strict=True)
    records: Records = []
    line = 1
    try:
        for cells in reader:
            if cells:
                records.append((line, [cell.strip() for cell in cells]))
            line = reader.line_num + 1  # a quoted cell may span lines
    except csv.Error as error:
        return [], [_not_csv(file, line, str(error))]
    return records, [] if records else [_not_csv(file, 1, "blank lines alone")]


def _not_csv(file: str, line: int, reason: str) -> InputProblem:
    allowed = "comma-separated cells, double quotes only in pairs around a cell"
    return InputProblem(
        file, line, None, f"no CSV ({reason})", allowed, "look for a stray quote mark"
    )


def _long_cells(file: str, records: Records) -> Iterator[InputProblem]:
    """Cells that no table has; they are not looked into."""
    header = records[0][1]
    for line, cells in records:
        if max(map(len, cells)) > LONGEST_CELL:
            for number, cell in enumerate(cells):
                if len(cell) > LONGEST_REMARK or has_long_word(cell):  # remarks have blanks
                    column = header[number][:LONGEST_CELL] if number < len(header) else None
                    found = f"a cell of {len(cell)} characters, '{cell[:20]}…'"
                    allowed = f"at most {LONGEST_CELL}, or {LONGEST_REMARK} with blanks in it"
                    remedy = "shorten it, or look for a quote mark"
                    yield InputProblem(file, line, column, found, allowed, remedy)


def _header_problems(file: str, header: list[str]) -> list[InputProblem]:
    if len(header) > MOST_COLUMNS:
        found, allowed = f"{len(header)} columns", f"at most {MOST_COLUMNS}"
        return [InputProblem(file, 1, None, found, allowed, "one header row, one thing per row")]
    separators = [mark for mark in (";", "\t") if len(header) == 1 and mark in header[0]]
    if separators:
        found = f"cells separated by {'semicolons' if separators[0] == ';' else 'tabs'}"
        remedy = "save the file as CSV with commas, and decimal points in numbers"
        return [InputProblem(file, 1, None, found, "cells separated by commas", remedy)]
    repeated = sorted({name for name in header if header.count(name) > 1 and name})
    problems = [
        InputProblem(file, 1, name, "the same column name twice", "each name once", "delete one")
        for name in repeated
    ]
    if "" in header:
        allowed = "a name over every column"
        remedy = "name the column or delete it"
        problems.append(InputProblem(file, 1, None, "a column without a name", allowed, remedy))
    return problems


def _squared(
    file: str, header: list[str], records: list[tuple[int, list[str]]]
) -> tuple[CsvRows, list[InputProblem]]:
    width = len(header)
    problems, ragged, cells = [], set(), []
    for line, row in records:
        if row == header:
            place = (file, line, None)
            problems.append(
                InputProblem(*place, "the header again", "rows of cells", "delete the line")
            )
        if len(row) != width:
            many = "a decimal comma splits a number into two cells"
            remedy = f"count the commas ({many if len(row) > width else 'fill the row up'})"
            found, allowed = f"{len(row)} cells", f"{width} cells, as in the header"
            problems.append(InputProblem(file, line, None, found, allowed, remedy))
            ragged.add(line)
        cells.append((row + [""] * width)[:width])
    rows = CsvRows(file, header, [line for line, _ in records], cells, frozenset(ragged))
    return rows, list(first_of(problems))
