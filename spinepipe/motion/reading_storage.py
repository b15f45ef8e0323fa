"""Tables of OpenSim: `.sto` and `.mot`. A header, names of columns, then numbers over time.

The header ends with `endheader`. Before it stand lines `key=value`, or `key value` as older
programs wrote them, and free text. What columns mean is not in the file: `inDegrees` is about those
that are rotations, and loads (`ground_force_vx`) are columns like others.
"""

import re
from dataclasses import dataclass
from pathlib import Path

from spinepipe.effects.contract import Array
from spinepipe.motion.reading_text import NumberBlock, cells_of, fault, text_of
from spinepipe.motion.recording import check_file, numbered

END = re.compile(r"^[ \t\"]*endheader\b.*", re.IGNORECASE | re.MULTILINE)
"""The line, with the cells that spreadsheets write behind it."""

DEGREES = re.compile(r"^\s*inDegrees[\s=]+(yes|no)\b", re.IGNORECASE | re.MULTILINE)
ROWS = re.compile(r"^\s*(?:nRows|datarows)[\s=]+(\d+)", re.IGNORECASE | re.MULTILINE)


@dataclass(frozen=True, eq=False)
class StorageTable:
    """Columns over time, as a file has them.

    Attributes
    ----------
    names : (C,) of the columns but time. time_s : (F,). values : (F, C), NaN where a cell is empty;
        the units are not told.
    in_degrees : whether rotations are in degrees; None where the file does not say it.
    repaired : what was read otherwise than it stands in the file, one sentence each.
    """

    names: tuple[str, ...]
    time_s: Array
    values: Array
    in_degrees: bool | None
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
    check_file(path, name)
    head, *behind = END.split(text_of(path, name), 1)
    rest = "".join(behind)
    if not rest:
        allowed = "a header that ends with 'endheader', then names of columns and numbers"
        raise fault(name, 1, None, "no header of a .sto or .mot", allowed, "export it again")
    # names stand in the first line that is not empty
    before = len(rest) - len(rest.lstrip("\r\n\t "))
    line = 1 + head.count("\n") + rest[:before].count("\n")
    # rows may be indented: a table without times has no first cell that is empty
    labels, _, body = re.sub(r"^[ \t]+", "", rest[before:], flags=re.MULTILINE).partition("\n")
    names = [label.strip('"') for label in cells_of(labels.rstrip())]
    if (first := next(iter(names), "")).lower() != "time":
        allowed = "'time' as the first column"
        raise fault(name, line, None, repr(first), allowed, "name the columns")
    block = NumberBlock(name, body, line + 1, len(names), names.__getitem__)
    numbers, _ = block.numbers()
    time_s = numbers[:, 0].copy()
    block.check_times(time_s, "time", may_stand=True)
    columns, repaired = numbered(tuple(names[1:]))
    if (told := ROWS.search(head)) and int(told[1]) != len(numbers):
        repaired += (f"the header says {told[1]} rows, {len(numbers)} are there and were read",)
    degrees = DEGREES.search(head)
    in_degrees = None if degrees is None else degrees[1].lower() == "yes"
    return StorageTable(columns, time_s, numbers[:, 1:], in_degrees, repaired)
