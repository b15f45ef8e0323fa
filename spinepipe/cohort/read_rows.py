"""Rows of a CSV file as text, each with the line where an editor shows it."""

import csv
import io
from dataclasses import dataclass
from pathlib import Path

from spinepipe.cohort.read_text import read_text
from spinepipe.problems import Problem

__all__ = ["Rows", "read_rows"]


@dataclass(frozen=True)
class Rows:
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


def read_rows(path: Path, file: str) -> tuple[Rows | None, list[Problem]]:
    """Rows of a comma-separated UTF-8 file, None when it is no such table.

    Wholly blank lines are skipped: they carry nothing.
    """
    text, problems = read_text(path, file)
    if problems:
        return None, problems
    try:
        records = _records(text)
    except csv.Error as error:
        return None, [_not_csv(file, str(error))]
    header = records[0][1]
    problems = _header_problems(file, header)
    if problems:
        return None, problems
    rows, problems = _squared(file, header, records[1:])
    if not rows.lines:
        problems.append(
            Problem(file, 1, None, "a header and no rows", "at least one row", "fill or delete it")
        )
    return rows, problems


def _records(text: str) -> list[tuple[int, list[str]]]:
    reader = csv.reader(io.StringIO(text, newline=""), strict=True)
    records: list[tuple[int, list[str]]] = []
    line = 1
    for cells in reader:
        if cells:
            records.append((line, [cell.strip() for cell in cells]))
        line = reader.line_num + 1  # a quoted cell may span lines
    return records


def _not_csv(file: str, reason: str) -> Problem:
    allowed = "comma-separated cells, double quotes only in pairs around a cell"
    return Problem(file, None, None, f"no CSV ({reason})", allowed, "look for a stray quote mark")


def _header_problems(file: str, header: list[str]) -> list[Problem]:
    separators = [mark for mark in (";", "\t") if len(header) == 1 and mark in header[0]]
    if separators:
        found = f"cells separated by {'semicolons' if separators[0] == ';' else 'tabs'}"
        remedy = "save the file as CSV with commas, and decimal points in numbers"
        return [Problem(file, 1, None, found, "cells separated by commas", remedy)]
    repeated = sorted({name for name in header if header.count(name) > 1 and name})
    problems = [
        Problem(file, 1, name, "the same column name twice", "each name once", "delete one")
        for name in repeated
    ]
    if "" in header:
        allowed = "a name over every column"
        remedy = "name the column or delete it"
        problems.append(Problem(file, 1, None, "a column without a name", allowed, remedy))
    return problems


def _squared(
    file: str, header: list[str], records: list[tuple[int, list[str]]]
) -> tuple[Rows, list[Problem]]:
    width = len(header)
    problems, ragged, cells = [], set(), []
    for line, row in records:
        if len(row) != width:
            problems.append(_ragged(file, line, len(row), width))
            ragged.add(line)
        cells.append((row + [""] * width)[:width])
    return Rows(file, header, [line for line, _ in records], cells, frozenset(ragged)), problems


def _ragged(file: str, line: int, found: int, width: int) -> Problem:
    cause = "a decimal comma splits a number into two cells" if found > width else "fill the row up"
    remedy = f"count the commas ({cause})"
    return Problem(file, line, None, f"{found} cells", f"{width} cells, as in the header", remedy)
