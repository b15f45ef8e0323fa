"""The table in a machine's file: text or a workbook (.xlsx), as rows of cells.

What a file is, its first bytes say, not its name. All become text in UTF-8.
"""

import csv
import io
import warnings
import zipfile
from array import array
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from datetime import timedelta
from itertools import islice

import numpy as np
import openpyxl
import pandas as pd
from numpy.typing import NDArray

from spinepipe.problems import InputError, InputProblem, one_of
from spinepipe.testing_machine.settings import FileForm

MOST_BYTES = 300_000_000
"""Of a recording, and of what a workbook holds when it is unpacked."""

MOST_ROWS, MOST_COLUMNS = 1_048_576, 500
"""Of a sheet: a cell far away must not make room for all before it."""

LOOKED_AT = 1000
"""Rows that tell how many columns there are."""

AT_ONCE = 20_000
MARKS = {"comma": ",", "semicolon": ";", "tab": "\t", "space": r"\s+"}

FOREIGN = {
    b"TDSm": "a .tdms file of LabVIEW",
    b"\xd0\xcf\x11\xe0": "an old workbook (.xls) or another binary document",
    b"MATLAB 5.0": "a .mat file of MATLAB",
    b"\x89HDF": "an HDF5 file (.mat, .h5)",
}
"""What files are that are not read, by their first bytes."""

READ = "text or a workbook (.xlsx)"
EXPORT = "let the program that wrote it export text or .xlsx, see docs/import.md"


@dataclass(frozen=True, eq=False)
class RawTable:
    """Cells below the names, as text.

    Attributes
    ----------
    form : the form of the YAML; tabs between cells of a workbook.
    names : of the columns, empty without. first : line of the first numbers.
    text : the file, in UTF-8. workbook : whether cells stand in columns, whatever is beside them.
    """

    form: FileForm
    names: list[str]
    first: int
    width: int
    text: bytes
    workbook: bool = False

    def rows(self) -> Iterator[tuple[int, int, list[str]]]:
        """Line, number from 0, and cells of every row of numbers that has any.

        A row of empty cells has a number, as a frame in which a camera saw nothing; a blank line
        has none.
        """
        number = -1
        for line, cells in text_rows(self.form, self.text):
            if line >= self.first and (len(cells) > 1 or any(map(str.strip, cells))):
                number += 1
                if any(map(str.strip, cells)):
                    yield line, number, cells

    def misfit(self) -> tuple[int, list[str]] | None:
        """Line and cells of the first row with more cells than names, or fewer between blanks."""
        if self.workbook or not self.names:
            return None
        mark = None if self.form.delimiter == "space" else MARKS[self.form.delimiter].encode()
        ends, most = b" \r\n" + (mark or b""), len(self.names)
        below = self.text.splitlines()[self.first - 1 :]
        widths = {len(line.rstrip(ends).split(mark)) for line in below}
        if max(widths, default=0) <= most and (mark or widths <= {0, most}):
            return None
        # marks in quotes are none
        for line, _, cells in self.rows():
            there = sum(map(bool, map(str.strip, cells)))
            if there > most or (mark is None and there != most):
                return line, cells
        return None

    def columns(
        self, places: Sequence[int], values: Sequence[Callable[[str], float]], plain: bool
    ) -> tuple[NDArray[np.int64], NDArray[np.int64], list[NDArray[np.float64]]]:
        """(N,) line and number of each row, (N,) readings of each place, NaN where it has none.

        Parameters
        ----------
        places : of the columns, from 0. values : what reads a cell, by place.
        plain : whether all are plain numbers, which the bulk reader can try.
        """
        if plain and (bulk := self._bulk(places)) is not None:
            return np.arange(self.first, self.first + len(bulk)), np.arange(len(bulk)), [*bulk.T]
        lines, numbers, columns = array("q"), array("q"), [array("d") for _ in places]
        rows = self.rows()
        while chunk := list(islice(rows, AT_ONCE)):
            lines.extend(line for line, _, _ in chunk)
            numbers.extend(number for _, number, _ in chunk)
            for place, value, column in zip(places, values, columns, strict=True):
                column.extend(value(cell_at(row, place)) for *_, row in chunk)
        return np.array(lines), np.array(numbers), [np.array(one) for one in columns]

    def _bulk(self, places: Sequence[int]) -> NDArray[np.float64] | None:
        """(N, C) by pandas' reader in C; None where it is not all plain, as it tells no places."""
        text = self.text
        if any(one in text for one in (b'"', b"rue", b"RUE", b"alse", b"ALSE")):  # True would be 1
            return None
        order = sorted(set(places))
        try:
            frame = pd.read_csv(
                io.BytesIO(text.rstrip(b"\r\n")),
                sep=MARKS[self.form.delimiter],
                decimal="," if self.form.decimal == "comma" else ".",
                header=None,
                index_col=False,
                skiprows=self.first - 1,
                usecols=order,
                dtype=np.float64,
                skip_blank_lines=False,
                quoting=csv.QUOTE_NONE,
            )
        except ValueError:  # a cell is no number, a row too short
            return None
        values = frame.to_numpy()[:, [order.index(one) for one in places]]
        return values if np.isfinite(values).all() else None


def cell_at(row: Sequence[str], place: int) -> str:
    """The cell of a row, empty where the row is too short."""
    return row[place].strip() if place < len(row) else ""


def text_rows(form: FileForm, text: bytes) -> Iterator[tuple[int, list[str]]]:
    """Line and cells of every row of a file."""
    lines = io.TextIOWrapper(io.BytesIO(text), "utf-8", newline="")
    if form.delimiter == "space":
        yield from ((number, line.split()) for number, line in enumerate(lines, start=1))
        return
    reader = csv.reader(lines, delimiter=MARKS[form.delimiter], skipinitialspace=True)
    line = 1
    for row in reader:
        yield line, row
        line = reader.line_num + 1


def open_table(data: bytes, file: str, form: FileForm) -> RawTable:
    """The table in a file's bytes.

    Raises
    ------
    InputError
        Where there is none.
    csv.Error
        Where rows are no table.
    """
    workbook = data.startswith(b"PK")
    if workbook:
        try:
            with warnings.catch_warnings(action="ignore"):  # of styles and the like
                text = _sheet(data, form)
        except Exception as error:  # openpyxl raises whatever its parsers do
            text = f"a workbook that is damaged ({type(error).__name__})", READ, "save it anew"
        form = form.model_copy(update={"delimiter": "tab"})
    else:
        text = _decoded(data, form)
    if not isinstance(text, str):
        raise InputError([InputProblem(file, None, None, *text)])
    table = RawTable(form, [], form.first_line or form.names_line + 1, 0, text.encode(), workbook)
    head = islice(text_rows(form, table.text), form.names_line)
    names = next(([c.strip() for c in row] for line, row in head if line == form.names_line), [])
    while names and not names[-1]:
        names.pop()
    if form.names_line and not names:
        allowed = f"names of columns in line {form.names_line}"
        found = "no such line, or an empty one"
        raise InputError([InputProblem(file, None, None, found, allowed, "correct it")])
    width = max([len(names), *(len(row) for *_, row in islice(table.rows(), LOOKED_AT))])
    return replace(table, names=names, width=width)


def first_lines(data: bytes, most: int) -> Iterator[tuple[int, str]]:
    """Number and text of the lines that a file begins with; 0 and the name above those of a sheet.

    Parameters
    ----------
    data : the file; of a text its start is enough. most : how many lines, of each sheet.
    """
    if data.startswith(b"PK"):
        try:
            book = openpyxl.load_workbook(io.BytesIO(data), read_only=True, data_only=True)
            for sheet in book.worksheets:
                yield 0, f"sheet {sheet.title}"
                sheet.reset_dimensions()
                rows = sheet.iter_rows(max_row=most, max_col=MOST_COLUMNS, values_only=True)
                for number, row in enumerate(rows, start=1):
                    yield number, "\t".join(_cell_text(one, "point") for one in row).rstrip()
        except Exception as error:  # as in `open_table`
            yield 0, f"a workbook that is damaged ({type(error).__name__})"
        return
    wide = data.startswith((b"\xff\xfe", b"\xfe\xff"))
    if b"\0" in data and not wide:
        yield 0, "no text"
        return
    text = data.decode("utf-16" if wide else "utf-8-sig", "replace")
    yield from enumerate(text.splitlines()[:most], start=1)


def _decoded(data: bytes, form: FileForm) -> str | tuple[str, str, str]:
    """The text of a file; else what was found, what is allowed, and what to do."""
    foreign = next((what for start, what in FOREIGN.items() if data.startswith(start)), None)
    if foreign is not None:
        return foreign, READ, EXPORT
    if form.sheet is not None:
        return "a text without sheets", "a workbook (.xlsx)", "delete `form.sheet`, or name one"
    of_yaml = "the encoding of the YAML"
    if data.startswith((b"\xff\xfe", b"\xfe\xff")) and form.encoding != "utf-16":
        return "letters in UTF-16", of_yaml, "set `form: {encoding: utf-16}`"
    if form.encoding != "utf-16" and b"\0" in data:
        return "a binary file", READ, EXPORT
    try:
        return data.decode("utf-8-sig" if form.encoding == "utf-8" else form.encoding)
    except UnicodeError:
        remedy = "set `form: {encoding: latin-1}` or utf-16, or save the file as UTF-8"
        return f"letters that are not {form.encoding}", of_yaml, remedy


def _sheet(data: bytes, form: FileForm) -> str | tuple[str, str, str]:
    """A sheet of a workbook as text with tabs; numbers are numbers, however they look there."""
    with zipfile.ZipFile(io.BytesIO(data)) as packed:
        size = sum(one.file_size for one in packed.infolist())
        if "xl/workbook.xml" not in packed.namelist():
            return "a packed file that is no .xlsx", READ, EXPORT
    if size > MOST_BYTES:  # before anything is unpacked
        found = f"a workbook of {size / 1e6:.0f} MB when unpacked"
        return found, f"at most {MOST_BYTES / 1e6:g} MB", "export it as text, or split it"
    book = openpyxl.load_workbook(io.BytesIO(data), read_only=True, data_only=True)
    sheets = {one.title: one for one in book.worksheets}
    name = form.sheet
    if isinstance(name, int):
        name = [*sheets, None][name - 1] if name <= len(sheets) else None
    elif name is None and len(sheets) == 1:
        (name,) = sheets
    if name not in sheets:
        found = "no sheet named" if form.sheet is None else f"no sheet {form.sheet!r}"
        return found, one_of(sheets), "set `form: {sheet: …}`, for a file where they differ"
    sheet, text = sheets[name], io.StringIO(newline="")
    sheet.reset_dimensions()  # programs write wrong ones
    rows = sheet.iter_rows(max_col=MOST_COLUMNS, max_row=MOST_ROWS, values_only=True)
    writer = csv.writer(text, delimiter="\t", lineterminator="\n")
    for row in rows:
        used = next((n for n in range(len(row), 0, -1) if row[n - 1] is not None), 0)
        writer.writerow(_cell_text(value, form.decimal) for value in row[:used])
    return text.getvalue()


def _cell_text(value: object, decimal: str) -> str:
    if value is None:
        return ""
    if isinstance(value, int | float) and not isinstance(value, bool):
        return repr(value).replace(".", "," if decimal == "comma" else ".")
    if isinstance(value, timedelta):
        minutes, seconds = divmod(value.total_seconds(), 60)
        return f"{int(minutes // 60)}:{int(minutes % 60):02d}:{seconds:09.6f}"
    return " ".join(str(value).split())  # one line each
