"""The table in a machine's file: text, LabVIEW's .lvm, or a workbook (.xlsx), as rows of cells.

What a file is, its first bytes say, not its name.
"""

import csv
import io
import re
import zipfile
from array import array
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from datetime import timedelta
from itertools import islice

import numpy as np
import openpyxl
import pandas as pd
from numpy.typing import NDArray

from spinepipe.problems import InputProblem, one_of
from spinepipe.testing_machine.settings import FileForm

Rows = Iterator[tuple[int, list[str]]]

MOST_BYTES = 300_000_000
"""Of a recording, and of what a workbook holds when it is unpacked."""

MOST_ROWS, MOST_COLUMNS = 1_048_576, 500
"""Of a sheet: a cell far away must not make room for all before it."""

LOOKED_AT = 1000
"""Rows that tell how many columns there are."""

AT_ONCE = 20_000
MARKS = {"comma": ",", "semicolon": ";", "tab": "\t", "space": r"\s+"}

FOREIGN = (
    (b"TDSm", "a .tdms file of LabVIEW"),
    (b"\xd0\xcf\x11\xe0", "an old workbook (.xls) or another binary document"),
    (b"MATLAB 5.0", "a .mat file of MATLAB"),
    (b"\x89HDF", "an HDF5 file (.mat, .h5)"),
    (b"\x02P", "a .c3d file of motion capture"),
    (b"\x1f\x8b", "a compressed file"),
    (b"%PDF", "a PDF"),
)
"""First bytes of files that are not read, and what they are."""

READ = "text, a workbook (.xlsx) or LabVIEW's .lvm"
EXPORT = "let the program that wrote it export text or .xlsx, see docs/import.md"

# A header of an .lvm file: lines that begin with a word, the last one with the tag that ends it.
_LVM_HEADER = re.compile(r"(?:^[A-Z][^\n]*\n){0,60}?^\*\*\*End_of_Header\*\*\*", re.MULTILINE)


@dataclass(frozen=True, eq=False)
class RawTable:
    """Cells below the names, as text.

    Attributes
    ----------
    form : the form of the YAML, with what the file itself says of it.
    names : of the columns, empty without. first : line of the first numbers.
    rows : makes an iterator over line and cells of every row that has any.
    text : what `rows` reads, in UTF-8; None of a workbook.
    remarks : what the file itself said.
    """

    form: FileForm
    names: list[str]
    first: int
    width: int
    rows: Callable[[], Rows]
    text: bytes | None
    remarks: tuple[str, ...] = ()

    def columns(
        self, places: Sequence[int], value: Sequence[Callable[[str], float]], plain: str | None
    ) -> tuple[NDArray[np.int64], list[NDArray[np.float64]]]:
        """(N,) line of each row, and (N,) numbers of each place, NaN where a cell has none.

        Parameters
        ----------
        places : of the columns, from 0. value : reads a cell, by place.
        plain : the decimal sign where all cells are plain numbers: then the bulk reader is tried.
        """
        if plain is not None and (bulk := self._bulk(places, plain)) is not None:
            return np.arange(self.first, self.first + len(bulk)), list(bulk.T)
        lines, columns = array("q"), [array("d") for _ in places]
        rows = self.rows()
        while chunk := list(islice(rows, AT_ONCE)):
            lines.extend(line for line, _ in chunk)
            for place, read, column in zip(places, value, columns, strict=True):
                column.extend(read(cell_at(row, place)) for _, row in chunk)
        return np.array(lines, dtype=np.int64), [np.array(one) for one in columns]

    def _bulk(self, places: Sequence[int], decimal: str) -> NDArray[np.float64] | None:
        """(N, C) by pandas' reader in C; None where a row or cell is not as plain as it takes it.

        It knows no places of faults; and it reads True as 1.
        """
        text = self.text
        if text is None or any(one in text for one in (b'"', b"rue", b"RUE", b"alse", b"ALSE")):
            return None
        order = sorted(set(places))
        try:
            frame = pd.read_csv(
                io.BytesIO(text.rstrip(b"\r\n")),
                sep=MARKS[self.form.delimiter],
                decimal=decimal,
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
        values = frame.to_numpy()
        return (
            values[:, [order.index(one) for one in places]] if np.isfinite(values).all() else None
        )


def cell_at(row: Sequence[str], place: int) -> str:
    """The cell of a row, empty where the row is too short."""
    return row[place].strip() if place < len(row) else ""


def open_table(data: bytes, file: str, form: FileForm) -> RawTable | InputProblem:
    """The table in a file's bytes, or why there is none."""
    foreign = next((what for start, what in FOREIGN if data.startswith(start)), None)
    if foreign is not None:
        return InputProblem(file, None, None, foreign, READ, EXPORT)
    if data.startswith(b"PK"):
        return _workbook(data, file, form)
    if form.sheet is not None:
        remedy = "delete `form.sheet`, or name a workbook"
        return InputProblem(file, None, None, "a text without sheets", "a workbook (.xlsx)", remedy)
    if data.startswith((b"\xff\xfe", b"\xfe\xff")) and form.encoding != "utf-16":
        remedy = "set `form: {encoding: utf-16}`"
        return InputProblem(
            file, None, None, "letters in UTF-16", "the encoding of the YAML", remedy
        )
    try:
        text = data.decode("utf-8-sig" if form.encoding == "utf-8" else form.encoding)
    except UnicodeError:
        remedy = "set `form: {encoding: latin-1}` or utf-16, or save the file as UTF-8"
        found = f"letters that are not {form.encoding}"
        return InputProblem(file, None, None, found, "the encoding of the YAML", remedy)
    if "\0" in text:
        return InputProblem(file, None, None, "a binary file", READ, EXPORT)
    remarks: tuple[str, ...] = ()
    if text.startswith("LabVIEW Measurement") and "names_line" not in form.model_fields_set:
        told = _labview(text, file, form)
        if isinstance(told, InputProblem):
            return told
        form, remarks = told
    plain = text.encode()
    return _table(lambda: _text_rows(form, plain), file, form, plain, remarks)


def _table(
    every: Callable[[], Rows],
    file: str,
    form: FileForm,
    text: bytes | None,
    remarks: tuple[str, ...] = (),
) -> RawTable | InputProblem:
    """A table from all rows of a file, those above its numbers too."""
    first = form.first_line or form.names_line + 1

    def below() -> Rows:
        return (one for one in every() if one[0] >= first and any(map(str.strip, one[1])))

    head = list(islice(every(), form.names_line))
    width = max((len(row) for _, row in islice(below(), LOOKED_AT)), default=0)
    names = next(([c.strip() for c in row] for line, row in head if line == form.names_line), [])
    while names and not names[-1]:
        names.pop()
    if form.names_line and not names:
        allowed = f"names of columns in line {form.names_line}"
        found = "no such line, or an empty one"
        return InputProblem(file, None, None, found, allowed, "correct it")
    return RawTable(form, names, first, max(width, len(names)), below, text, remarks)


def _text_rows(form: FileForm, text: bytes) -> Rows:
    lines = io.TextIOWrapper(io.BytesIO(text), "utf-8", newline="")
    if form.delimiter == "space":
        yield from ((number, line.split()) for number, line in enumerate(lines, start=1))
        return
    reader = csv.reader(lines, delimiter=MARKS[form.delimiter])
    line = 1
    for row in reader:
        yield line, row
        line = reader.line_num + 1


def _labview(
    text: str, file: str, form: FileForm
) -> tuple[FileForm, tuple[str, ...]] | InputProblem:
    """The form that the header of an .lvm file tells.

    A header of the file, one of each segment, then the names of its columns (National
    Instruments, Specification for the LabVIEW Measurement File).
    """
    headers = list(islice(_LVM_HEADER.finditer(text), 100))
    starts = [text.count("\n", 0, one.start()) + 1 for one in headers]
    if len(headers) != 2:
        lines = ", ".join(map(str, starts[1:])) or "none"
        found = f"{len(headers) - 1} segments, with headers in lines {lines}"
        allowed, remedy = "one segment", "give each segment its own file, with the file's header"
        return InputProblem(file, starts[2] if starts[2:] else None, None, found, allowed, remedy)
    words = dict(re.findall(r"^(\w+)[\t,;](.*?)[\t,;]?\s*$", headers[0].group(), re.MULTILINE))
    mark = "comma" if words.get("Separator") == "Comma" else "tab"
    told = {"delimiter": mark, "names_line": text.count("\n", 0, headers[1].end()) + 2}
    told["decimal"] = "comma" if words.get("Decimal_Separator") == "," else "point"
    remark = f"its header tells the separator ({mark}) and a decimal {told['decimal']}"
    return form.model_copy(update=told), (remark,)


def _workbook(data: bytes, file: str, form: FileForm) -> RawTable | InputProblem:
    """A sheet of a workbook; numbers in it are numbers, whatever the decimal sign on the screen."""
    place = (file, None, None)
    with zipfile.ZipFile(io.BytesIO(data)) as packed:
        size = sum(one.file_size for one in packed.infolist())
        if "xl/workbook.xml" not in packed.namelist():
            return InputProblem(*place, "a packed file that is no .xlsx", READ, EXPORT)
    if size > MOST_BYTES:  # before anything is unpacked
        found = f"a workbook of {size / 1e6:.0f} MB when unpacked"
        allowed = f"at most {MOST_BYTES / 1e6:g} MB"
        return InputProblem(*place, found, allowed, "export it as text, or split it")
    book = openpyxl.load_workbook(io.BytesIO(data), read_only=True, data_only=True)
    sheets = {one.title: one for one in book.worksheets}
    name = form.sheet
    if isinstance(name, int):
        name = [*sheets, None][name - 1] if name <= len(sheets) else None
    elif name is None and len(sheets) == 1:
        (name,) = sheets
    if name not in sheets:
        found = "no sheet named" if form.sheet is None else f"no sheet {form.sheet!r}"
        remedy = "add `sheet:` to `form`, in that of the file where files differ"
        return InputProblem(*place, found, one_of(sheets), remedy)
    sheet = sheets[name]
    sheet.reset_dimensions()  # programs write wrong ones

    def rows() -> Rows:
        cells = sheet.iter_rows(max_col=MOST_COLUMNS, max_row=MOST_ROWS, values_only=True)
        for line, row in enumerate(cells, start=1):
            used = next((n for n in range(len(row), 0, -1) if row[n - 1] is not None), 0)
            yield line, [_cell_text(value, form.decimal) for value in row[:used]]

    return _table(rows, file, form, None)


def _cell_text(value: object, decimal: str) -> str:
    if value is None:
        return ""
    if isinstance(value, int | float) and not isinstance(value, bool):
        return repr(value).replace(".", "," if decimal == "comma" else ".")
    if isinstance(value, timedelta):
        minutes, seconds = divmod(value.total_seconds(), 60)
        return f"{int(minutes // 60)}:{int(minutes % 60):02d}:{seconds:09.6f}"
    return str(value)
