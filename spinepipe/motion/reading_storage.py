"""Tables of OpenSim: `.sto` and `.mot`. A header, names of columns, then numbers over time.

The header ends with `endheader`. Before it stand lines `key=value`, or `key value` as older
programs wrote them, and free text. What columns mean is not in the file: `inDegrees` is about those
that are rotations, and loads (`ground_force_vx`) are columns like others.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from spinepipe.effects.contract import Array
from spinepipe.motion.reading_text import NumberBlock, cells_of, fault, is_number, text_of
from spinepipe.motion.recording import MOST_RECORDING_BYTES, numbered

END = "endheader"

ROWS = ("nrows", "datarows")
COLUMNS = ("ncolumns", "datacolumns")

DEGREES = {"yes": True, "no": False}


@dataclass(frozen=True, eq=False)
class StorageTable:
    """Columns over time, as a file has them.

    Attributes
    ----------
    names : (C,) of the columns but time. time_s : (F,). values : (F, C), NaN where a cell is empty;
        the units are not told.
    in_degrees : whether rotations are in degrees; None where the file does not say it.
    header : what else the header says, keys in small letters.
    repaired : what was read otherwise than it stands in the file, one sentence each.
    """

    names: tuple[str, ...]
    time_s: Array
    values: Array
    in_degrees: bool | None
    header: Mapping[str, str]
    repaired: tuple[str, ...] = ()


def read_storage(path: Path, file: str | None = None) -> StorageTable:
    """A `.sto` or `.mot`.

    Parameters
    ----------
    file : its name in messages; None: that of the path.

    Raises
    ------
    InputError
        With the line and column of what cannot be read.
    """
    name = file or path.name
    if not path.is_file():
        raise fault(name, None, None, "no such file", "a .sto or .mot", "correct the name")
    if path.stat().st_size > MOST_RECORDING_BYTES:
        found = f"{path.stat().st_size / 1e6:.0f} MB"
        allowed = f"at most {MOST_RECORDING_BYTES / 1e6:g} MB"
        raise fault(name, None, None, found, allowed, "leave columns or rows out")
    head, _, rest = text_of(path, name).partition(END)
    rest = rest[rest.find("\n") :] if "\n" in rest else ""  # spreadsheets write cells behind it
    if not rest:
        allowed = f"a header that ends with '{END}', then names of columns and numbers"
        raise fault(name, 1, None, "no header of a .sto or .mot", allowed, "export it again")
    header = dict(_header_lines(head))
    if (kind := header.get("datatype", "double")) != "double":
        allowed, remedy = "a number in each cell: DataType=double", "export it so"
        raise fault(name, None, "DataType", repr(kind), allowed, remedy)
    # names stand in the first line that is not empty
    before = len(rest) - len(rest.lstrip("\r\n\t "))
    line = 1 + head.count("\n") + rest[:before].count("\n")
    labels, _, body = rest[before:].partition("\n")
    names = [label.strip('"') for label in cells_of(labels)]
    while names and not names[-1]:
        names.pop()
    if not names or names[0].lower() != "time":
        found = repr(names[0]) if names else "no names of columns"
        raise fault(name, line, None, found, "'time' as the first column", "name the columns")
    block = NumberBlock(name, body, line + 1, len(names), names.__getitem__)
    numbers, _ = block.numbers()
    time_s = numbers[:, 0].copy()
    for k in np.flatnonzero(~(np.diff(time_s, prepend=-np.inf) >= 0.0))[:1].tolist():
        found = f"{time_s[k]:g} s"
        raise fault(name, block.line(k), "time", found, "times that grow", "correct the time")
    columns, repaired = numbered(tuple(names[1:]))
    repaired += tuple(
        f"the header says {header[key]} {what}, {count} are there and were read"
        for keys, what, count in ((ROWS, "rows", len(numbers)), (COLUMNS, "columns", len(names)))
        for key in keys
        if is_number(header.get(key, "")) and float(header[key]) != count
    )
    degrees = DEGREES.get(header.get("indegrees", "").lower())
    return StorageTable(columns, time_s, numbers[:, 1:], degrees, header, repaired)


def _header_lines(head: str) -> list[tuple[str, str]]:
    """Keys in small letters, and values, of the lines that have both."""
    found = []
    for line in head.splitlines():
        key, sign, value = line.partition("=")
        if not sign:
            key, _, value = line.strip().partition(" ")
        if value.strip():
            found.append((key.strip().lower(), value.strip()))
    return found
