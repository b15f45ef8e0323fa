"""Motion as `.trc`: a header of five lines, whose units count, then a frame a line.

Cells stand between tabs, as the makers write it, or between commas, semicolons or blanks, as what
people edit files with does. Three empty cells, or three noughts: a marker was not seen.
"""

from collections import deque
from collections.abc import Sequence
from itertools import islice
from pathlib import Path

import numpy as np

from spinepipe.effects.contract import Array
from spinepipe.motion.reading_text import (
    NumberBlock,
    cells_of,
    fault,
    is_number,
    separator_of,
    text_of,
)
from spinepipe.motion.recording import MarkerRecording, recording_from, unit_of

VALUES_LINE, NAMES_LINE, AXES_LINE = 3, 4, 5
"""Lines of the header, where an editor shows them."""

RATE_DIFFERS = 0.01
"""Share by which times may differ from DataRate over the whole file, beside their rounding."""

HEADER = ("DataRate", "NumFrames", "NumMarkers", "Units")

SPARE_CELLS = "points without a name behind the markers are left out"
NO_LINE_END = "the last line has no end; its last number may be cut off"
DATA_RATE = "times are from DataRate, the column has {}"


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
    *lines, body = text_of(path, file).split("\n", AXES_LINE)
    if len(lines) < AXES_LINE or not body or not lines[0].startswith("PathFileType"):
        found, allowed = "no header of a .trc", "PathFileType and four more lines, then frames"
        raise fault(file, 1, None, found, allowed, "export the motion again")
    told = _header(file, lines)
    names = _names(file, lines[NAMES_LINE - 1], body, int(float(told["NumMarkers"])))
    columns = ["Frame#", "Time", *(name for name in names for _ in "xyz")]
    block = NumberBlock(
        file, body, AXES_LINE + 1, len(columns), columns.__getitem__, True, 3, "frame"
    )
    numbers, spare = block.numbers()
    repaired = [SPARE_CELLS] if spare else []
    wanted = int(float(told["NumFrames"]))
    counted = len(numbers) == wanted
    whole = bool(len(numbers)) and _is_whole(block, counted)
    if whole is False:
        found = f"{len(numbers)} frames" + (", the last of them not whole" * bool(len(numbers)))
        allowed = f"{wanted} whole frames, as NumFrames says, and more than none"
        remedy = "export the motion again, or correct NumFrames"
        raise fault(file, VALUES_LINE, "NumFrames", found, allowed, remedy)
    if not counted:
        repaired.append(f"NumFrames says {wanted} frames, {len(numbers)} are there and were read")
    if whole is None:
        repaired.append(NO_LINE_END)
    time_s, from_rate = _times(block, numbers[:, 1].copy(), float(told["DataRate"]))
    places = numbers[:, 2:].reshape(len(numbers), len(names), 3)
    places *= unit_of(file, VALUES_LINE, "Units", told["Units"])
    return recording_from(names, time_s, places, (*repaired, *from_rate))


def _header(file: str, lines: Sequence[str]) -> dict[str, str]:
    keys, values = (cells_of(lines[k - 1]) for k in (VALUES_LINE - 1, VALUES_LINE))
    # some writers put two tabs between values: where as many are there as keys, they go by order
    given = [value for value in values if value]
    there = [key for key in keys if key]
    pairs = (there, given) if len(given) == len(there) else (keys, values)
    told = dict(zip(*pairs, strict=False))
    for name in HEADER:
        if not told.get(name):
            raise fault(file, VALUES_LINE, name, "nothing", "a value", "complete the header")
        if name != "Units" and not is_number(told[name]):
            raise fault(file, VALUES_LINE, name, repr(told[name]), "a number", "correct it")
    for name in ("DataRate", "NumMarkers"):
        if not float(told[name]) > 0.0:
            raise fault(file, VALUES_LINE, name, told[name], "above 0", "correct it")
    return told


def _names(file: str, line: str, body: str, number: int) -> tuple[str, ...]:
    """Names in the order of the columns, whatever parts them; empty: a marker without a name.

    NumMarkers counts those that have a name, or all.
    """
    sign = separator_of(line)
    cells = [cell.strip() for cell in line.split(sign or None)]
    named = [name for name in cells[2:] if name]
    rows = body.split("\n")
    between = separator_of(next((row for row in rows if row.strip()), ""))
    widths = (row.count(between) + 1 if between else len(row.split()) for row in rows)
    points = (max(widths) - 2) // 3
    if len(named) <= 1:  # blanks between names, a tab before them
        blanks = line.replace(sign or " ", " ").split()[2:]
        named = blanks if len(blanks) == number <= points else named
    # a name stands above the first of its three columns, where all do and rows are wide enough
    placed = cells[2::3]
    while placed and not placed[-1]:
        placed.pop()
    at_places = [name for name in placed if name] == named and len(placed) <= points
    names = placed if at_places else named
    if len(named) == number or len(names) <= number <= points:
        return (*names, *[""] * (number - len(names)))
    found, allowed = f"{len(named)} names", f"{number}, as NumMarkers says"
    remedy = "correct NumMarkers, or the line of names"
    raise fault(file, NAMES_LINE, None, found, allowed, remedy)


def _is_whole(block: NumberBlock, counted: bool) -> bool | None:
    """Whether the file does not break off within its last row; None: nothing tells it.

    A row is whole with a line end behind it, or as many decimals in its last cell as in all others
    of two rows. One that NumFrames does not count has as many cells as the row before it, too.
    """
    rows = [row for _, row in deque(block.rows(), 2)]
    sign = block.separator
    ended = not block.text.endswith(rows[-1])
    if counted and ended:
        return True
    if len({len(row.split(sign or None)) for row in rows}) > 1:
        return False
    *others, last = (cell for row in rows for cell in row.split(sign or None)[2:])
    if ended or not last.strip():
        return ended or not "".join(others[-2:]).strip()
    decimals = {len(cell.partition(".")[2]) for cell in others if cell.strip()}
    if 0 < len(last.partition(".")[2]) == max(decimals, default=0):
        return True
    return None if decimals == {0} or (counted and len(decimals) > 1) else False


def _times(block: NumberBlock, column: Array, rate: float) -> tuple[Array, tuple[str, ...]]:
    """Times (F,) s, and what was repaired."""
    if not np.any(np.isfinite(column) & (column != 0.0)) and len(column) > 1:
        return np.arange(len(column)) / rate, (DATA_RATE.format("none"),)
    rounding = 10.0 ** -_decimals(block)
    by_rate = column[0] + np.arange(len(column)) / rate
    # rounded so that neighbours may be equal: two decimals at 120 Hz
    if rounding * rate > 1.0 and np.abs(column - by_rate).max() < 1.001 * rounding:
        return by_rate, (DATA_RATE.format("too few decimals"),)
    block.check_times(column, "Time")
    # half of the last digit is lost at either end: files have times of three decimals at 60 Hz
    lasts, wanted = float(column[-1] - column[0]), (len(column) - 1) / rate
    if abs(lasts - wanted) > RATE_DIFFERS * wanted + rounding:
        step = lasts / (len(column) - 1)
        found = f"{rate:g} frames a second, and times {step:g} s apart"
        remedy = "correct DataRate or the column Time"
        raise fault(block.file, VALUES_LINE, "DataRate", found, "the same", remedy)
    return column, ()


TIMES_LOOKED_AT = 1000


def _decimals(block: NumberBlock) -> int:
    """Decimals of the times, by the longest of the first: zeros at the end may be left out."""
    most = 0
    for _, row in islice(block.rows(), TIMES_LOOKED_AT):
        cell = row.split(block.separator or None, 2)[1].strip().lower()
        digits, _, power = cell.partition("e")
        most = max(most, len(digits.replace(",", ".").partition(".")[2]) - int(power or 0))
    return most
