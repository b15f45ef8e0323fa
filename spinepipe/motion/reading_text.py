"""Numbers in text files of motion: read at once where all is plain, else line by line.

A file of 100 MB has some fifteen million cells: too many for Python to look at one by one. They are
handed over as a whole to a parser of tables, which says yes or no; on no, lines are put in
order, and whatever still is no number is looked for cell by cell and told with line and column.
"""

import csv
import io
import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import product
from math import isfinite, nan
from pathlib import Path

import numpy as np
import pyarrow as pa
from pyarrow import csv as arrow_csv

from spinepipe.documents.text import INVISIBLE, NUMBER
from spinepipe.effects.contract import Array
from spinepipe.motion.recording import M_PER, MarkerRecording, recording_from
from spinepipe.problems import InputError, InputProblem

TIME = "time_s"
COLUMN = re.compile(rf"(?P<marker>.+)_(?P<axis>[xyz])_(?P<unit>{'|'.join(M_PER)})")

EMPTY = ("", *map("".join, product("nN", "aA", "nN")))
"""What says that nothing was measured."""

MOST_CELLS = 20_000_000
"""Of a recording: twelve minutes of 80 markers at 100 frames a second; 160 MB as numbers."""

BLOCK_BYTES = 1 << 24
"""Bytes of text that are parsed together; a line must fit in."""


def fault(
    file: str, line: int | None, column: str | None, found: str, allowed: str, remedy: str
) -> InputError:
    """One thing that is wrong."""
    return InputError([InputProblem(file, line, column, found, allowed, remedy)])


def text_of(path: Path, file: str) -> str:
    """Text of a recording; bytes that are no UTF-8, as in names of folders, are replaced.

    Raises
    ------
    InputError
        Where there is more than is read, said before it is taken apart; or nothing readable.
    """
    text = path.read_text(encoding="utf-8-sig", errors="replace")
    hidden = INVISIBLE.search(text)
    if hidden is not None:
        found = f"the control character U+{ord(hidden[0]):04X}"
        line = text[: hidden.start()].count("\n") + 1
        raise fault(file, line, None, found, "text", "export the motion again")
    number = max(map(text.count, "\t,; \n"))
    if number > MOST_CELLS:
        allowed, remedy = f"at most {MOST_CELLS} cells", "crop it, or leave markers or frames out"
        raise fault(file, None, None, f"{number} cells", allowed, remedy)
    return text


def separator_of(line: str) -> str:
    """What parts the cells of a line: a tab, a semicolon, a comma; empty: any blanks."""
    return next((sign for sign in "\t;," if sign in line), "")


def cells_of(line: str) -> list[str]:
    """Cells of a line of a header, blanks around them removed."""
    sign = separator_of(line)
    return [cell.strip() for cell in line.split(sign)] if sign else line.split()


def is_number(text: str) -> bool:
    """Whether a text is a decimal number with a point."""
    return NUMBER.fullmatch(text) is not None and isfinite(float(text))


@dataclass(frozen=True)
class NumberBlock:
    """Rows of numbers behind a header.

    Attributes
    ----------
    file : its name in messages. text : the rows. first : line of the file in which they begin.
    width : how many cells a row has. name : of a column, by its number from 0.
    fills : rows may end early, without their last cells, which are empty then.
    spare : rows may have so many cells more, or a multiple, which are left out; 0: none.
    row : what a row is called, of which the first cell is the number; empty: nothing.
    """

    file: str
    text: str
    first: int
    width: int
    name: Callable[[int], str]
    fills: bool = False
    spare: int = 0
    row: str = ""

    @cached_property
    def separator(self) -> str:
        """What parts cells, by the first row."""
        return separator_of(next((line for _, line in self.rows()), ""))

    def rows(self) -> Iterator[tuple[int, str]]:
        """Rows that are not empty, each with its line in the file."""
        begin, line = 0, self.first
        while begin < len(self.text):
            end = self.text.find("\n", begin)
            end = len(self.text) if end < 0 else end
            if (row := self.text[begin:end]).strip("\t,; \u00a0"):
                yield line, row
            begin, line = end + 1, line + 1

    def line(self, row: int) -> int:
        """Line of a row, counted from 0."""
        return next(line for k, (line, _) in enumerate(self.rows()) if k == row)

    def check_times(self, times: Array, name: str) -> None:
        """Refuse times (F,) s of a column that do not grow.

        Raises
        ------
        InputError
            Of a time that is empty, or not behind the one before it.
        """
        for k in np.flatnonzero(np.isnan(times))[:1].tolist():
            raise fault(self.file, self.line(k), name, "nothing", "a time", "fill it in")
        for k in np.flatnonzero(np.diff(times) <= 0.0)[:1].tolist():
            found, remedy = f"{times[k + 1]:g} s after {times[k]:g} s", "correct the time"
            raise fault(self.file, self.line(k + 1), name, found, "times that grow", remedy)

    def numbers(self) -> tuple[Array, bool]:
        """(F, width) the numbers, NaN where a cell is empty; whether further cells were left out.

        Raises
        ------
        InputError
            Of a row with too few or too many cells, and of a cell that is no number.
        """
        if (found := self._at_once()) is not None:
            return found, False
        # all rows of the same width, a tab between cells
        lines, spare = list[str](), False
        for line, row in self.rows():
            cells = self._cells(row)
            while len(cells) > self.width and not cells[-1].strip() and self.separator:
                cells.pop()
            further = len(cells) - self.width
            if self.spare and further > 0 and further % self.spare == 0:
                cells, spare = cells[: self.width], True
            elif self.fills and self.separator and further < 0:
                cells += [""] * -further
            elif further:
                raise self._wide(line, cells)
            lines.append("\t".join([cell.strip() for cell in cells]))
        even = replace(self, text="\n".join(lines))
        return (self._one_by_one(lines) if (fast := even._at_once()) is None else fast), spare

    def _cells(self, row: str) -> list[str]:
        return row.split(self.separator) if self.separator else row.split()

    def _wide(self, line: int, cells: list[str]) -> InputError:
        found = f"{len(cells)} cells" + (f" in {self.row} {cells[0].strip()}" if self.row else "")
        allowed = f"{self.width} cells, as the header says"
        remedy = "correct the line"
        if not self.separator and len(cells) < self.width:
            remedy = "write tabs between cells, so that empty ones count"
        return fault(self.file, line, None, found, allowed, remedy)

    def _at_once(self) -> Array | None:
        """All numbers; None where rows are not alike, or a cell is no plain number."""
        first = next((row for _, row in self.rows()), None)
        if first is None:
            return np.zeros((0, self.width))
        # a separator at the end of each line makes one cell more, which is empty
        count = first.count(self.separator) + 1 if self.separator else 0
        if not self.separator or not self.width <= count <= self.width + 1:
            return None
        names = [str(k) for k in range(count)]
        try:
            table = arrow_csv.read_csv(
                pa.BufferReader(self.text.encode()),
                read_options=arrow_csv.ReadOptions(
                    use_threads=False, block_size=BLOCK_BYTES, column_names=names
                ),
                parse_options=arrow_csv.ParseOptions(delimiter=self.separator),
                convert_options=arrow_csv.ConvertOptions(
                    column_types=dict.fromkeys(names, pa.float64()),
                    null_values=list(EMPTY),
                    decimal_point="," if self._decimal_commas else ".",
                ),
            )
        except pa.ArrowInvalid:
            return None
        numbers = np.empty((table.num_rows, self.width))
        for k in range(count):
            column = table.column(k)
            if k == self.width:
                if column.null_count < len(column):
                    return None
                continue
            numbers[:, k] = column.to_numpy()
            # `inf`, and what the parser takes for NaN besides `EMPTY`, is no number here
            if np.isfinite(numbers[:, k]).sum() + column.null_count != len(column):
                return None
        empty = np.isnan(numbers).all(axis=1)
        return numbers[~empty] if empty.any() else numbers

    @property
    def _decimal_commas(self) -> bool:
        return self.separator == ";" and "." not in self.text and "," in self.text

    def _one_by_one(self, lines: list[str]) -> Array:
        numbers = np.full((len(lines), self.width), nan)
        for k, row in enumerate(lines):
            for column, cell in enumerate(row.split("\t")):
                text = cell.strip().strip('"')
                plain = text.replace(",", ".") if self._decimal_commas else text
                if is_number(plain):
                    numbers[k, column] = float(plain)
                elif text not in EMPTY:
                    allowed = "a number with a decimal point, or an empty cell"
                    place = (self.line(k), self.name(column))
                    raise fault(self.file, *place, repr(text), allowed, "correct it")
        return numbers


def read_csv(path: Path, file: str) -> MarkerRecording:
    """Markers of a `.csv`, in the axes of the file.

    `time_s`, then `<marker>_x_mm`, `<marker>_y_mm`, `<marker>_z_mm` of each, between commas, tabs
    or semicolons. The unit is that in the names of the columns: mm, cm or m.

    Parameters
    ----------
    file : its name in messages.

    Raises
    ------
    InputError
        With the line and column of what cannot be read.
    """
    head, _, body = text_of(path, file).partition("\n")
    sign = separator_of(head) or ","
    header = [name.strip() for name in next(csv.reader(io.StringIO(head), delimiter=sign), [])]
    names, order, scale = _columns(file, header)
    block = NumberBlock(file, body, 2, len(header), header.__getitem__)
    numbers, _ = block.numbers()
    if not len(numbers):
        raise fault(file, 1, None, "no frames", "a header and frames", "export it again")
    time_s = numbers[:, header.index(TIME)]
    block.check_times(time_s, TIME)
    places = scale * numbers[:, order].reshape(len(numbers), len(names), 3)
    return recording_from(names, time_s, places)


def _columns(file: str, header: list[str]) -> tuple[tuple[str, ...], list[int], float]:
    """Markers (K,), the places of their columns (3 K), and the unit in m."""
    if TIME not in header:
        raise fault(file, 1, TIME, "no such column", TIME, "add the times in s")
    found: dict[str, dict[str, int]] = {}
    units: set[str] = set()
    for k, name in enumerate(header):
        match = COLUMN.fullmatch(name)
        if match is None and name != TIME:
            allowed = f"{TIME}, or a marker with axis and unit as in LPSI_x_mm"
            raise fault(file, 1, name, "no marker", allowed, "correct the name")
        if match is not None:
            found.setdefault(match["marker"], {})[match["axis"]] = k
            units.add(match["unit"])
    for name, axes in found.items():
        if len(axes) < 3:
            allowed, remedy = "columns of x, y and z", "add the others"
            raise fault(file, 1, name, f"only {', '.join(axes)}", allowed, remedy)
    if len(units) != 1 or 1 + 3 * len(found) != len(header):
        found_text = f"columns in {', '.join(sorted(units)) or 'no unit'}"
        allowed, remedy = "markers in one unit, each column once", "correct the header"
        raise fault(file, 1, None, found_text, allowed, remedy)
    order = [axes[axis] for axes in found.values() for axis in "xyz"]
    return tuple(found), order, M_PER[units.pop()]
