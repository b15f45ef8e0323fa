"""Motion as `.trc`: a header of five lines, whose units count, then a frame a line.

Cells stand between tabs, as the makers write it, or between commas, semicolons or blanks, as what
people edit files with does. Three empty cells, or three noughts: a marker was not seen.
"""

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
    names = _names(file, lines, body, int(float(told["NumMarkers"])))
    columns = ["Frame#", "Time", *(name for name in names for _ in "xyz")]
    block = NumberBlock(
        file, body, AXES_LINE + 1, len(columns), columns.__getitem__, True, 3, "frame"
    )
    numbers, spare = block.numbers()
    repaired = [SPARE_CELLS] if spare else []
    if len(numbers) != (wanted := int(float(told["NumFrames"]))) or not len(numbers):
        if not len(numbers) or not _is_whole(block):
            found = f"{len(numbers)} frames" + (", the last of them not whole" * bool(len(numbers)))
            allowed = f"{wanted}, as NumFrames says, and more than none"
            remedy = "export the motion again, or correct NumFrames"
            raise fault(file, VALUES_LINE, "NumFrames", found, allowed, remedy)
        repaired.append(f"NumFrames says {wanted} frames, {len(numbers)} are there and were read")
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


def _names(file: str, lines: Sequence[str], body: str, number: int) -> tuple[str, ...]:
    """As many names as NumMarkers says, whatever parts them; empty: a marker without a name."""
    line = lines[NAMES_LINE - 1]
    by_sign = [name for name in cells_of(line)[2:] if name]
    by_blanks = line.replace(separator_of(line) or " ", " ").split()[2:]
    for names in (by_sign, by_blanks):
        if len(names) == number:
            return tuple(names)
    # in the order of the columns, where rows have places for as many
    row = next((row for row in body.split("\n", 2)[:2] if row.strip()), "")
    cells = [cell.strip() for cell in line.split(separator_of(line) or None)]
    wide = row.rstrip("\r\n").count(separator_of(row) or "\n") + 1
    if len(by_sign) < number and wide >= 2 + 3 * number:
        placed = cells[2::3][:number]
        at_places = len([name for name in placed if name]) == len(by_sign)
        names = placed if at_places else by_sign
        return (*names, *[""] * (number - len(names)))
    found, allowed = f"{len(by_sign)} names", f"{number}, as NumMarkers says"
    remedy = "correct NumMarkers, or the line of names"
    raise fault(file, NAMES_LINE, None, found, allowed, remedy)


def _is_whole(block: NumberBlock) -> bool:
    """Whether the last row has as many cells as the one before it, and its last cell all digits.

    A NumFrames that was left behind by an editor does no harm; a file that breaks off does. The
    last cell is whole with a line end behind it, or as many decimals as the others of the row.
    """
    rows = block.text.rstrip("\n").rsplit("\n", 2)[-2:]
    sign = block.separator
    counts = {row.count(sign) if sign else len(row.split()) for row in rows}
    decimals = [len(cell.partition(".")[2]) for cell in rows[-1].split(sign or None)]
    last = block.text.endswith("\n") or decimals[-1] == max(decimals[2:])
    return last and len(counts) == 1


def _times(block: NumberBlock, column: Array, rate: float) -> tuple[Array, tuple[str, ...]]:
    """Times (F,) s, and what was repaired."""
    if not np.any(np.isfinite(column) & (column != 0.0)) and len(column) > 1:
        return np.arange(len(column)) / rate, ("times are from DataRate, the column has none",)
    block.check_times(column, "Time")
    # half of the last digit is lost at either end: files have times of three decimals at 60 Hz
    lasts, wanted = float(column[-1] - column[0]), (len(column) - 1) / rate
    if abs(lasts - wanted) > RATE_DIFFERS * wanted + 10.0 ** -_decimals(block):
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
