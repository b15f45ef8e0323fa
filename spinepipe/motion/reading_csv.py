"""Motion as `.csv`: `time_s`, then `<marker>_x_mm`, `<marker>_y_mm`, `<marker>_z_mm` of each.

The unit is that in the names of the columns: mm, cm or m. Three empty cells, or three noughts:
the marker was not seen.
"""

import csv
import io
import re
from math import isfinite, nan
from pathlib import Path

import numpy as np

from spinepipe.documents.text import NUMBER
from spinepipe.motion.recorded import M_PER, Recorded, quickly, recorded, text_of
from spinepipe.problems import InputError, InputProblem

TIME = "time_s"
COLUMN = re.compile(rf"(?P<marker>.+)_(?P<axis>[xyz])_(?P<unit>{'|'.join(M_PER)})")


def read_csv(path: Path, file: str) -> Recorded:
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
    numbers = np.array([_numbers(file, line, header, cells) for line, cells in frames])
    time_s = numbers[:, header.index(TIME)]
    for k in np.flatnonzero(~(np.diff(time_s, prepend=-np.inf) > 0.0)):
        found = f"{time_s[k]:g} s"
        raise _fault(file, frames[k][0], TIME, found, "times that grow", "correct the time")
    places = scale * numbers[:, order].reshape(len(frames), len(names), 3)
    return recorded(names, time_s, places)


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


def _numbers(file: str, line: int, header: list[str], cells: list[str]) -> list[float]:
    """Cells of a frame, NaN where empty."""
    if len(cells) != len(header):
        found, allowed = f"{len(cells)} cells", f"{len(header)}, as in the header"
        raise _fault(file, line, None, found, allowed, "correct the line")
    if (quick := quickly(cells)) is not None:
        return quick
    numbers = []
    for name, cell in zip(header, cells, strict=True):
        written = cell.strip()
        value = float(written) if NUMBER.fullmatch(written) else nan
        if not isfinite(value) and written.lower() not in ("", "nan"):
            allowed = "a number with a decimal point, or an empty cell"
            raise _fault(file, line, name, repr(cell), allowed, "correct it")
        numbers.append(value)
    return numbers


def _fault(
    file: str, line: int, column: str | None, found: str, allowed: str, remedy: str
) -> InputError:
    return InputError([InputProblem(file, line, column, found, allowed, remedy)])
