"""Motion as `.trc`: a header of five lines, then a frame a line; cells between tabs, or spaces.

A marker whose three cells are empty, or all nought, was not seen. The header's units count.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import chain
from math import isfinite, nan
from pathlib import Path

import numpy as np

from spinepipe.documents.text import NUMBER
from spinepipe.effects.contract import Array
from spinepipe.motion.recorded import Recorded, quickly, recorded, text_of, unit_of
from spinepipe.problems import InputError, InputProblem

VALUES_LINE, NAMES_LINE, AXES_LINE = 3, 4, 5
"""Lines of the header, where an editor shows them."""

RATE_DIFFERS = 0.01
"""Share by which the column of times may differ from DataRate."""

_ASKED = ("DataRate", "NumFrames", "NumMarkers", "Units")
_EMPTY = ("", "nan")


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
        return InputError([InputProblem(self.file, line, column, found, allowed, do)])


def read_trc(path: Path, file: str) -> Recorded:
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
        raise InputError([InputProblem(file, 1, None, found, allowed, "export the motion again")])
    sheet = _Sheet(file, lines, "\t" in lines[NAMES_LINE - 1])
    told = _header(sheet)
    names = _names(sheet, told)
    rows = [k for k in range(AXES_LINE + 1, len(lines) + 1) if lines[k - 1].strip()]
    numbers = np.array([_numbers(sheet, line, names) for line in rows])
    _whole(sheet, told, len(rows))
    time_s, repaired = _times(sheet, rows, numbers[:, 1], float(told["DataRate"]))
    scale = unit_of(file, VALUES_LINE, "Units", told["Units"])
    places = scale * numbers[:, 2:].reshape(len(rows), len(names), 3)
    return recorded(names, time_s, places, repaired)


def _header(sheet: _Sheet) -> dict[str, str]:
    told = dict(zip(sheet.cells(VALUES_LINE - 1), sheet.cells(VALUES_LINE), strict=False))
    for name in _ASKED:
        if not told.get(name):
            raise sheet.fault(VALUES_LINE, name, "nothing", "a value", "complete the header")
        if name != "Units" and not _is_number(told[name]):
            raise sheet.fault(VALUES_LINE, name, repr(told[name]), "a number", "correct it")
    if not float(told["DataRate"]) > 0.0:
        raise sheet.fault(VALUES_LINE, "DataRate", told["DataRate"], "above 0", "correct it")
    return told


def _names(sheet: _Sheet, told: dict[str, str]) -> tuple[str, ...]:
    names = tuple(name for name in sheet.cells(NAMES_LINE)[2:] if name)
    wanted = int(float(told["NumMarkers"]))
    if len(names) != wanted:
        found, allowed = f"{len(names)} names", f"{wanted}, as NumMarkers says"
        remedy = "correct NumMarkers, or the line of names"
        raise sheet.fault(NAMES_LINE, None, found, allowed, remedy)
    return names


def _numbers(sheet: _Sheet, line: int, names: Sequence[str]) -> list[float]:
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
    if (numbers := quickly(cells)) is not None:
        return numbers
    columns = ["Frame#", "Time", *chain.from_iterable((name,) * 3 for name in names)]
    return [_number(sheet, line, column, cell) for column, cell in zip(columns, cells, strict=True)]


def _number(sheet: _Sheet, line: int, column: str, cell: str) -> float:
    if cell.lower() in _EMPTY:
        return nan
    if not _is_number(cell):
        allowed = "a number with a decimal point, or an empty cell"
        raise sheet.fault(line, column, repr(cell), allowed, "correct it")
    return float(cell)


def _is_number(text: str) -> bool:
    return NUMBER.fullmatch(text) is not None and isfinite(float(text))


def _whole(sheet: _Sheet, told: dict[str, str], frames: int) -> None:
    wanted = int(float(told["NumFrames"]))
    if frames != wanted or not frames:
        found, allowed = f"{frames} frames", f"{wanted}, as NumFrames says, and more than none"
        remedy = "export the motion again, or correct NumFrames"
        raise sheet.fault(VALUES_LINE, "NumFrames", found, allowed, remedy)


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
