"""What a machine's file looks like before anybody has said what it is: its form and its columns."""

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from io import BytesIO
from itertools import islice
from pathlib import Path

import numpy as np
import openpyxl
from numpy.typing import NDArray

from spinepipe.documents.text import read_bytes
from spinepipe.problems import InputError, InputProblem
from spinepipe.testing_machine.channels import ANGLES, FORCES, LENGTHS, MOMENTS, SECONDS
from spinepipe.testing_machine.notation import (
    LOST,
    Notation,
    clock_seconds,
    is_number,
    notations_of,
)
from spinepipe.testing_machine.raw_table import MOST_BYTES, RawTable, cell_at, open_table, text_rows
from spinepipe.testing_machine.settings import FileForm

UNITS: Mapping[str, str] = {
    **{re.sub(" ", "", name).lower(): name for name in (*FORCES, *MOMENTS, *ANGLES, *LENGTHS)},
    **{"nm": "N m", "nmm": "N mm", "ncm": "N cm", "°": "deg", "degrees": "deg", "degree": "deg"},
    **{"grad": "deg", "radians": "rad", "µm": "um", "μm": "um", "sec": "s", "seconds": "s"},
    **{name: name for name in SECONDS if name != "clock"},
}
"""Our name of a unit by what stands in a file, in small letters without blanks, points and signs of
multiplication."""

SEPARATORS = ("tab", "semicolon", "comma", "space")
"""In the order in which they are tried: with an earlier one a later one may stand in a cell."""

SAMPLE = 400
"""Lines of a file from which its form is told."""

IN_A_ROW = 5
"""So many lines of numbers begin the table."""


@dataclass(frozen=True, eq=False)
class SeenColumn:
    """A column of a file.

    Attributes
    ----------
    key : how settings name it: its name, or its number from 1 where it has none of its own.
    unit : as the header says, in our words; empty where it says none.
    values : (N,) its numbers, NaN where a cell has none. clock : whether they are clock times.
    """

    key: str | int
    unit: str
    values: NDArray[np.float64]
    clock: bool = False

    @property
    def words(self) -> str:
        """Its name in small letters, without what stands in brackets."""
        return re.sub(r"[(\[{].*", "", str(self.key)).replace("_", " ").lower().strip()


@dataclass(frozen=True, eq=False)
class SeenFile:
    """A file: its form as settings would tell it, without defaults, and its columns."""

    name: str
    form: Mapping[str, object]
    columns: tuple[SeenColumn, ...]


def seen(path: Path, name: str) -> SeenFile:
    """Look at a file; ``name`` is what it is called in messages.

    Raises
    ------
    InputError
        Where no table of numbers is found in it.
    """
    data, problems = read_bytes(path, name, MOST_BYTES)
    if problems:
        raise InputError(problems)
    for form in _forms(data):
        try:
            table = open_table(data, name, form)
        except InputError:
            if form.sheet is None:  # the only way to open it
                raise
            continue
        if (first := _first_row(table)) is not None:
            return _with_names(table, name, *first)
    found = f"no {IN_A_ROW} lines of numbers below each other"
    remedy = "look at the file; write import.yaml by hand, as in docs/import.md"
    raise InputError([InputProblem(name, None, None, found, "a table with two columns", remedy)])


def _forms(data: bytes) -> Iterator[FileForm]:
    """All forms that a file may have, but for its numbers; names are looked for later."""
    if data.startswith(b"PK"):
        try:
            sheets = len(openpyxl.load_workbook(BytesIO(data), read_only=True).sheetnames)
        except Exception:  # as in `open_table`, which then says what is wrong with it
            sheets = 1
        numbers = [None] if sheets == 1 else range(1, sheets + 1)
        yield from (FileForm(delimiter="tab", sheet=one, names_line=0) for one in numbers)
        return
    encoding = "utf-16" if data.startswith((b"\xff\xfe", b"\xfe\xff")) else "utf-8"
    try:
        data.decode(encoding)
    except UnicodeError:
        encoding = "latin-1"
    for mark in SEPARATORS:
        told = {"delimiter": mark, "encoding": encoding, "names_line": 0}
        yield FileForm.model_validate(told)


def _row_of_numbers(cells: list[str]) -> bool:
    """Whether two cells or more are numbers, and the others have no digits."""
    told = [one.strip() for one in cells]
    numbers = [is_number(one) or not np.isnan(clock_seconds(one)) for one in told]
    others = (one for one, number in zip(told, numbers, strict=True) if not number)
    return sum(numbers) > 1 and not any(re.search("[0-9]", one) for one in others)


def _first_row(table: RawTable) -> tuple[int, list[tuple[int, list[str]]]] | None:
    """Line of the first numbers, and the lines that were looked at; None where there is no table.

    Cells that a decimal comma has cut in two are told by rows of unlike widths.
    """
    rows = list(islice(text_rows(table.form, table.text), SAMPLE))
    good = [_row_of_numbers(cells) for _, cells in rows]
    for at, (line, cells) in enumerate(rows[: len(rows) - IN_A_ROW + 1]):
        below = rows[at : at + IN_A_ROW]
        if all(good[at : at + IN_A_ROW]) and len({len(one) for _, one in below}) == 1:
            return (line, rows) if len(cells) > 1 else None
    return None


def _with_names(
    table: RawTable, name: str, first: int, rows: list[tuple[int, list[str]]]
) -> SeenFile:
    """The file with names, units and numbers of its columns."""
    head = [(line, [c.strip() for c in cells]) for line, cells in rows if line < first]
    body = [[c.strip() for c in cells] for line, cells in rows if line >= first and len(cells) > 1]
    width = max(max(n for n, c in enumerate(row, 1) if c) for row in body if any(row))
    cells = [c for row in body for c in row if np.isnan(clock_seconds(c))]
    notation = (*notations_of(cells), Notation("point"))[0]
    # units may stand below the names; remarks above them have fewer cells
    head = [(line, cells) for line, cells in head if sum(map(bool, cells)) > 1]
    units: list[str] = []
    if len(head) > 1 and _are_units(head[-1][1]):
        units = head.pop()[1]
    names_line, names = head[-1] if head else (0, [])
    while names and not names[-1]:
        names.pop()
    if len(names) < width or (table.form.delimiter == "space" and len(names) > width):
        names_line, names = 0, []  # a name is missing, or has blanks: columns go by their number
    form = table.form.model_copy(
        update={
            "names_line": names_line,
            "first_line": first if first != names_line + 1 else None,
            "decimal": notation.decimal,
            "thousands": notation.thousands,
        }
    )
    told = RawTable(form, names, first, width, table.text, table.workbook)
    clocks = [_clock(body, place) for place in range(width)]
    values = [clock_seconds if clock else notation.value for clock in clocks]
    *_, numbers = told.columns(range(width), values, notation.thousands is None and not any(clocks))
    columns = []
    for place in range(width):
        own = names[place] if place < len(names) else ""
        key: str | int = own if own and names.count(own) == 1 else place + 1
        bracket = re.search(r"[(\[{](.+?)[)\]}]|/\s*(\S+)$", own)
        unit = (bracket[1] or bracket[2]) if bracket else ""
        unit = unit or (units[place] if place < len(units) else "")
        columns.append(SeenColumn(key, unit_of(unit), numbers[place], clocks[place]))
    kept = tuple(one for one in columns if np.isfinite(one.values).any())
    plain = form.model_dump(exclude_defaults=True)
    if table.workbook:
        plain.pop("delimiter", None)
        plain.pop("decimal", None)
    return SeenFile(name, plain, kept)


def unit_of(text: str) -> str:
    """A unit in our words; empty where it is none of ours."""
    return UNITS.get(re.sub(r"[\s.·*⋅()\[\]{}-]", "", text).lower(), "")


def _are_units(cells: list[str]) -> bool:
    told = [one for one in cells if one]
    return sum(bool(unit_of(one)) or one[:1] in "([{" for one in told) > len(told) / 2


def _clock(rows: list[list[str]], place: int) -> bool:
    """Whether a column has clock times."""
    cells = (cell_at(row, place) for row in rows)
    told = [one for one in cells if not LOST.fullmatch(one)]
    return bool(told) and all(not np.isnan(clock_seconds(one)) for one in told)
