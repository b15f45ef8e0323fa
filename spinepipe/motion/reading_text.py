"""Motion as text: `.csv` and `.trc`. Three empty cells, or three noughts: a marker was not seen.

`.csv`: `time_s`, then `<marker>_x_mm`, `<marker>_y_mm`, `<marker>_z_mm` of each. The unit is that
in the names of the columns: mm, cm or m.

`.trc`: a header of five lines, whose units count, then a frame a line; cells between tabs, or
spaces.
"""

import csv
import io
import re
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import chain
from math import isfinite, nan
from pathlib import Path

import numpy as np

from spinepipe.documents.text import INVISIBLE, NUMBER
from spinepipe.effects.contract import Array
from spinepipe.motion.recording import M_PER, MarkerRecording, recording_from, unit_of
from spinepipe.problems import InputError, InputProblem

TIME = "time_s"
COLUMN = re.compile(rf"(?P<marker>.+)_(?P<axis>[xyz])_(?P<unit>{'|'.join(M_PER)})")

VALUES_LINE, NAMES_LINE, AXES_LINE = 3, 4, 5
"""Lines of the header, where an editor shows them."""

RATE_DIFFERS = 0.01
"""Share by which the column of times may differ from DataRate."""

HEADER = ("DataRate", "NumFrames", "NumMarkers", "Units")
EMPTY = ("", "nan")

MOST_CELLS = 10_000_000
"""Of a recording: six minutes of 80 markers at 100 frames a second."""


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
        raise InputError([InputProblem(file, line, None, found, "text", "export the motion again")])
    number = max(map(text.count, "\t, "))
    if number > MOST_CELLS:
        allowed, remedy = f"at most {MOST_CELLS} cells", "crop it, or leave markers or frames out"
        raise InputError([InputProblem(file, None, None, f"{number} cells", allowed, remedy)])
    return text


def parse_floats(cells: Sequence[str]) -> list[float] | None:
    """Cells as numbers; None where one is empty or none, which is to be looked at one by one."""
    try:
        numbers = list(map(float, cells))
    except ValueError:
        return None
    text = "".join(cells)
    return numbers if isfinite(sum(numbers)) and text.isascii() and "_" not in text else None


def _fault(
    file: str, line: int, column: str | None, found: str, allowed: str, remedy: str
) -> InputError:
    return InputError([InputProblem(file, line, column, found, allowed, remedy)])


def read_csv(path: Path, file: str) -> MarkerRecording:
    """Markers of a `.csv`, in the axes of the file.

    Parameters
    ----------
    file : its name in messages.

    Raises
    ------
    InputError
        With the line and column of what cannot be read.
    """
    lines = csv.reader(io.StringIO(text_of(path, file), newline=""))
    try:
        rows = [(k, row) for k, row in enumerate(lines, start=1) if any(row)]
    except csv.Error as error:
        allowed, remedy = "cells between commas", "look for a quote mark"
        raise _fault(file, lines.line_num, None, str(error), allowed, remedy) from error
    if len(rows) < 2:
        raise _fault(file, 1, None, "no frames", "a header and frames", "export it again")
    header, frames = [name.strip() for name in rows[0][1]], rows[1:]
    names, order, scale = _columns(file, header)
    numbers = np.array([_csv_numbers(file, line, header, cells) for line, cells in frames])
    time_s = numbers[:, header.index(TIME)]
    for k in np.flatnonzero(~(np.diff(time_s, prepend=-np.inf) > 0.0)):
        found = f"{time_s[k]:g} s"
        raise _fault(file, frames[k][0], TIME, found, "times that grow", "correct the time")
    places = scale * numbers[:, order].reshape(len(frames), len(names), 3)
    return recording_from(names, time_s, places)


def _columns(file: str, header: list[str]) -> tuple[tuple[str, ...], list[int], float]:
    """Markers (K,), the places of their columns (3 K), and the unit in m."""
    if TIME not in header:
        raise _fault(file, 1, TIME, "no such column", TIME, "add the times in s")
    found: dict[str, dict[str, int]] = {}
    units: set[str] = set()
    for k, name in enumerate(header):
        match = COLUMN.fullmatch(name)
        if match is None and name != TIME:
            allowed = f"{TIME}, or a marker with axis and unit as in LPSI_x_mm"
            raise _fault(file, 1, name, "no marker", allowed, "correct the name")
        if match is not None:
            found.setdefault(match["marker"], {})[match["axis"]] = k
            units.add(match["unit"])
    for name, axes in found.items():
        if len(axes) < 3:
            allowed, remedy = "columns of x, y and z", "add the others"
            raise _fault(file, 1, name, f"only {', '.join(axes)}", allowed, remedy)
    if len(units) != 1 or 1 + 3 * len(found) != len(header):
        found_text = f"columns in {', '.join(sorted(units)) or 'no unit'}"
        allowed, remedy = "markers in one unit, each column once", "correct the header"
        raise _fault(file, 1, None, found_text, allowed, remedy)
    order = [axes[axis] for axes in found.values() for axis in "xyz"]
    return tuple(found), order, M_PER[units.pop()]


def _csv_numbers(file: str, line: int, header: list[str], cells: list[str]) -> list[float]:
    """Cells of a frame, NaN where empty."""
    if len(cells) != len(header):
        found, allowed = f"{len(cells)} cells", f"{len(header)}, as in the header"
        raise _fault(file, line, None, found, allowed, "correct the line")
    if (quick := parse_floats(cells)) is not None:
        return quick
    numbers = []
    for name, cell in zip(header, cells, strict=True):
        written = cell.strip()
        value = float(written) if NUMBER.fullmatch(written) else nan
        if not isfinite(value) and written.lower() not in EMPTY:
            allowed = "a number with a decimal point, or an empty cell"
            raise _fault(file, line, name, repr(cell), allowed, "correct it")
        numbers.append(value)
    return numbers


@dataclass(frozen=True)
class _Sheet:
    """Lines of a file and how cells part: by tabs, or else by any blanks."""

    file: str
    lines: list[str]
    tabs: bool

    def cells(self, line: int) -> list[str]:
        """Cells of a line, blanks around them removed."""
        text = self.lines[line - 1]
        if not self.tabs:
            return text.split()
        has_blanks = " " in text or not text.isascii()
        return [cell.strip() for cell in text.split("\t")] if has_blanks else text.split("\t")

    def fault(self, line: int, column: str | None, found: str, allowed: str, do: str) -> InputError:
        """What is wrong in a line."""
        return _fault(self.file, line, column, found, allowed, do)


def read_trc(path: Path, file: str) -> MarkerRecording:
    """Markers of a `.trc`, in the axes of the file.

    Parameters
    ----------
    file : its name in messages.

    Raises
    ------
    InputError
        Where it cannot be read, with the line and the marker.
    """
    lines = text_of(path, file).splitlines()
    if len(lines) <= AXES_LINE or not lines[0].startswith("PathFileType"):
        found, allowed = "no header of a .trc", "PathFileType and four more lines, then frames"
        raise _fault(file, 1, None, found, allowed, "export the motion again")
    sheet = _Sheet(file, lines, "\t" in lines[NAMES_LINE - 1])
    told = _header(sheet)
    names = tuple(name for name in sheet.cells(NAMES_LINE)[2:] if name)
    if len(names) != (wanted := int(float(told["NumMarkers"]))):
        found, allowed = f"{len(names)} names", f"{wanted}, as NumMarkers says"
        remedy = "correct NumMarkers, or the line of names"
        raise sheet.fault(NAMES_LINE, None, found, allowed, remedy)
    rows = [k for k in range(AXES_LINE + 1, len(lines) + 1) if lines[k - 1].strip()]
    numbers = np.array([_trc_numbers(sheet, line, names) for line in rows])
    if len(rows) != (wanted := int(float(told["NumFrames"]))) or not rows:
        found = f"{len(rows)} frames"
        allowed = f"{wanted}, as NumFrames says, and more than none"
        remedy = "export the motion again, or correct NumFrames"
        raise sheet.fault(VALUES_LINE, "NumFrames", found, allowed, remedy)
    time_s, repaired = _times(sheet, rows, numbers[:, 1], float(told["DataRate"]))
    scale = unit_of(file, VALUES_LINE, "Units", told["Units"])
    places = scale * numbers[:, 2:].reshape(len(rows), len(names), 3)
    return recording_from(names, time_s, places, repaired)


def _header(sheet: _Sheet) -> dict[str, str]:
    told = dict(zip(sheet.cells(VALUES_LINE - 1), sheet.cells(VALUES_LINE), strict=False))
    for name in HEADER:
        if not told.get(name):
            raise sheet.fault(VALUES_LINE, name, "nothing", "a value", "complete the header")
        if name != "Units" and not _is_number(told[name]):
            raise sheet.fault(VALUES_LINE, name, repr(told[name]), "a number", "correct it")
    if not float(told["DataRate"]) > 0.0:
        raise sheet.fault(VALUES_LINE, "DataRate", told["DataRate"], "above 0", "correct it")
    return told


def _trc_numbers(sheet: _Sheet, line: int, names: Sequence[str]) -> list[float]:
    """Cells of a frame, NaN where empty."""
    cells, width = sheet.cells(line), 2 + 3 * len(names)
    if sheet.tabs:
        while len(cells) > width and not cells[-1]:
            cells.pop()
        cells += [""] * (width - len(cells))
    if len(cells) != width:
        found = f"{len(cells)} cells in frame {cells[0]}"
        remedy = "write tabs between cells, so that empty ones count"
        raise sheet.fault(line, None, found, f"{width}: frame, time, 3 for each marker", remedy)
    if (numbers := parse_floats(cells)) is not None:
        return numbers
    columns = ["Frame#", "Time", *chain.from_iterable((name,) * 3 for name in names)]
    for column, cell in zip(columns, cells, strict=True):
        if cell.lower() not in EMPTY and not _is_number(cell):
            allowed = "a number with a decimal point, or an empty cell"
            raise sheet.fault(line, column, repr(cell), allowed, "correct it")
    return [nan if cell.lower() in EMPTY else float(cell) for cell in cells]


def _is_number(text: str) -> bool:
    return NUMBER.fullmatch(text) is not None and isfinite(float(text))


def _times(
    sheet: _Sheet, rows: Sequence[int], column: Array, rate: float
) -> tuple[Array, tuple[str, ...]]:
    """Times (F,) s, and what was repaired."""
    if not np.any(np.isfinite(column) & (column != 0.0)) and len(column) > 1:
        return np.arange(len(column)) / rate, ("times are from DataRate, the column has none",)
    for k in np.flatnonzero(~np.isfinite(column)).tolist():
        raise sheet.fault(rows[k], "Time", "nothing", "a time", "fill it in")
    for k in np.flatnonzero(np.diff(column) <= 0.0).tolist():
        found = f"{column[k + 1]:g} s after {column[k]:g} s"
        raise sheet.fault(rows[k + 1], "Time", found, "times that grow", "correct the time")
    if len(column) > 1:
        step = float(np.median(np.diff(column)))
        if abs(step * rate - 1.0) > RATE_DIFFERS:
            found = f"{rate:g} frames a second, and times {step:g} s apart"
            remedy = "correct DataRate or the column Time"
            raise sheet.fault(VALUES_LINE, "DataRate", found, "the same", remedy)
    return column, ()
