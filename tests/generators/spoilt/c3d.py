"""Files of motion as `.c3d`, written by hand, and spoilt byte by byte.

The form: blocks of 512 bytes; a header; parameters in groups; frames of four numbers a marker
(The C3D File Format, User Guide, 2008). Little-endian, 32-bit floats: a negative scale says so.
"""

import struct
from collections.abc import Sequence
from dataclasses import dataclass

BLOCK = 512
MAGIC = 0x50
INTEL = 84

POINT = 1
"""Number of the group of parameters that tells of markers."""

CHARACTERS, WORD, REAL = -1, 2, 4
"""Types of parameters: letters, 16-bit integers, 32-bit reals."""


@dataclass(frozen=True)
class Markers:
    """What a file tells.

    Attributes
    ----------
    frames : (F, K, 3) numbers, in `units`. rate : frames a second.
    """

    names: Sequence[str]
    frames: Sequence[Sequence[Sequence[float]]]
    units: str = "mm"
    rate: float = 100.0
    first: int = 1


@dataclass(frozen=True)
class Form:
    """What stands in header and parameters, where it is not what the markers make it.

    Attributes
    ----------
    points, analog, first, last, data_block, header_rate : of the header.
    used, told_frames, scale, rate : of the group POINT. labels : as one array of letters.
    dimensions : of the labels, whatever they hold. link : bytes to the parameter behind the first
        one; None: what is right.
    """

    magic: int = MAGIC
    parameter_block: int = 2
    points: int | None = None
    analog: int = 0
    first: int | None = None
    last: int | None = None
    header_scale: float = -1.0
    data_block: int | None = None
    header_rate: float | None = None
    parameter_blocks: int | None = None
    processor: int = INTEL
    used: int | None = None
    told_frames: int | None = None
    scale: float = -1.0
    rate: float | None = None
    data_start: int | None = None
    dimensions: tuple[int, ...] | None = None
    link: int | None = None
    name_length: int | None = None
    left_out: tuple[str, ...] = ()
    residual: float = 0.0


SOUND = Form()


def read_trc(text: str) -> Markers:
    """Markers of a `.trc` whose cells are all there."""
    lines = text.rstrip("\n").split("\n")
    rate, _, _, _, units, *_ = lines[2].split("\t")
    names = [name for name in lines[3].rstrip("\t").split("\t")[2:] if name]
    rows = [[float(cell or 0.0) for cell in line.split("\t")[2:]] for line in lines[5:] if line]
    frames = [[row[3 * k : 3 * k + 3] for k in range(len(names))] for row in rows if len(row) >= 3]
    return Markers(names, frames, units, float(rate))


def written(of: Markers, form: Form = SOUND) -> bytes:
    """The file."""
    blocks = -(-len(_parameters(of, form, 0)) // BLOCK)
    parameters = _parameters(of, form, 2 + blocks)
    head = _header(of, form, 2 + blocks)
    data = b"".join(
        struct.pack("<4f", *_single(place), form.residual) for frame in of.frames for place in frame
    )
    return (
        head
        + parameters.ljust(blocks * BLOCK, b"\0")
        + data.ljust(-(-len(data) // BLOCK) * BLOCK, b"\0")
    )


def _single(place: Sequence[float]) -> list[float]:
    return [struct.unpack("<f", struct.pack("<f", one))[0] for one in place]


def _header(of: Markers, form: Form, data_block: int) -> bytes:
    last = of.first + len(of.frames) - 1
    head = struct.pack(
        "<BBHHHHHfHHf",
        form.parameter_block,
        form.magic,
        _or(form.points, len(of.names)),
        form.analog,
        _or(form.first, of.first),
        _or(form.last, last),
        10,
        form.header_scale,
        _or(form.data_block, data_block),
        form.analog and 1,
        _or(form.header_rate, of.rate),
    )
    return head.ljust(BLOCK, b"\0")


def _or(told: float | None, right: float) -> float:
    return right if told is None else told


def _parameters(of: Markers, form: Form, data_block: int) -> bytes:
    longest = max(map(len, of.names), default=1)
    letters = "".join(name.ljust(longest) for name in of.names).encode("latin-1", "replace")
    entries = {
        "USED": _words(_or(form.used, len(of.names))),
        "FRAMES": _words(_or(form.told_frames, len(of.frames))),
        "DATA_START": _words(_or(form.data_start, data_block)),
        "SCALE": _real(form.scale),
        "RATE": _real(_or(form.rate, of.rate)),
        "UNITS": (CHARACTERS, (len(of.units),), of.units.encode("latin-1", "replace")),
        "LABELS": (CHARACTERS, form.dimensions or (longest, len(of.names)), letters),
    }
    entries = {name: entry for name, entry in entries.items() if name not in form.left_out}
    body = _entry("POINT", -POINT, b"\0")
    for number, (name, (kind, dimensions, data)) in enumerate(entries.items()):
        sizes = bytes(dimensions)
        content = struct.pack("<bB", kind, len(sizes)) + sizes + data + b"\0"
        is_spoilt = number == 0
        body += _entry(
            name,
            POINT,
            content,
            form.link if is_spoilt else None,
            form.name_length if is_spoilt else None,
        )
    blocks = -(-(len(body) + 6) // BLOCK)
    lead = struct.pack("<BBBB", 1, MAGIC, _or(form.parameter_blocks, blocks), form.processor)
    return lead + body + b"\0\0"


def _entry(
    name: str, group: int, content: bytes, link: int | None = None, length: int | None = None
) -> bytes:
    """A group or parameter: length of its name, group, name, way to the next one, content."""
    way = 2 + len(content) if link is None else link
    size = len(name) if length is None else length
    return struct.pack("<bb", size, group) + name.encode() + struct.pack("<h", way) + content


def _words(number: float) -> tuple[int, tuple[int, ...], bytes]:
    return WORD, (), struct.pack("<H", int(number))


def _real(number: float) -> tuple[int, tuple[int, ...], bytes]:
    return REAL, (), struct.pack("<f", number)
