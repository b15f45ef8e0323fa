"""What stands in a `.c3d`: header, parameters and numbers, taken apart within the file's bounds.

Nothing that a file tells of its sizes is trusted: a parameter may claim gigabytes, a list may lead
back to its beginning. Libraries for this form end the process then, or fill the memory. By The C3D
File Format, User Guide (2008): blocks of 512 bytes; parameters in groups, one behind the other,
each with the way to the next; frames of four numbers a marker, then of analog channels.
"""

import struct
from collections.abc import Mapping
from dataclasses import dataclass
from math import prod

import numpy as np
from numpy.typing import NDArray

BLOCK = 512
MAGIC = 0x50
MOST_DIMENSIONS = 7

INTEL, DEC, MIPS = 84, 85, 86
"""By which processor numbers were written."""

CHARACTERS, BYTE, WORD, REAL = -1, 1, 2, 4
"""Types of parameters."""

Value = tuple[str, ...] | tuple[float, ...]

Parameters = Mapping[tuple[str, str], Value]
"""Texts or numbers by group and name, both in capitals."""


class FormError(ValueError):
    """A file that does not hold together; the text says what was found."""


@dataclass(frozen=True)
class Header:
    """What the first block tells.

    Attributes
    ----------
    points, analog : markers, and numbers of analog channels, in a frame.
    first, last : numbers of frames, from 1. scale : of whole numbers; negative: numbers are reals.
    data_block : where frames begin, blocks from 1. rate : frames a second.
    """

    points: int
    analog: int
    first: int
    last: int
    scale: float
    data_block: int
    rate: float


@dataclass(frozen=True)
class Parts:
    """A file taken apart.

    Attributes
    ----------
    data : all bytes. processor : of its numbers. behind : byte behind the last parameter.
    """

    data: bytes
    processor: int
    header: Header
    parameters: Parameters
    behind: int


def taken_apart(data: bytes) -> Parts:
    """Header and parameters of a file.

    Raises
    ------
    FormError
        Where it does not hold together.
    """
    if len(data) < 2 * BLOCK or data[1] != MAGIC or data[0] < 2:
        raise FormError("no header of a .c3d")
    start = (data[0] - 1) * BLOCK
    if len(data) < start + 4:
        raise FormError("a file that ends before its parameters")
    processor = data[start + 3]
    if processor not in (INTEL, DEC, MIPS):
        raise FormError(f"numbers of a processor {processor}")
    parameters, behind = _parameters(data, start + 4, processor)
    return Parts(data, processor, _header(data, processor), parameters, behind)


def _header(data: bytes, processor: int) -> Header:
    points, analog, first, last = words(data, 2, 4, processor).tolist()
    (scale,), (rate,) = reals(data, 12, 1, processor), reals(data, 20, 1, processor)
    (block,) = words(data, 16, 1, processor).tolist()
    return Header(points, analog, first, last, float(scale), block, float(rate))


def words(data: bytes, at: int, number: int, processor: int) -> NDArray[np.int64]:
    """So many 16-bit numbers without a sign."""
    form = ">u2" if processor == MIPS else "<u2"
    return np.frombuffer(data, form, number, at).astype(np.int64)


def reals(data: bytes, at: int, number: int, processor: int) -> NDArray[np.float64]:
    """So many 32-bit reals; of a DEC they have exchanged halves and are four times as large."""
    if processor != DEC:
        form = ">f4" if processor == MIPS else "<f4"
        return np.frombuffer(data, form, number, at).astype(np.float64)
    halves = np.frombuffer(data, "<u2", 2 * number, at).reshape(-1, 2)
    return np.ascontiguousarray(halves[:, ::-1]).view("<f4").ravel().astype(np.float64) / 4.0


def _parameters(data: bytes, at: int, processor: int) -> tuple[Parameters, int]:
    """All parameters, and where they end."""
    groups: dict[int, str] = {}
    found: list[tuple[int, str, Value]] = []
    while at + 2 <= len(data):
        length, group = struct.unpack_from("<bb", data, at)  # of a locked entry it is negative
        way_at = at + 2 + abs(length)
        if not length:
            break
        if way_at + 2 > len(data):
            raise FormError("a file that ends within its parameters")
        name = data[at + 2 : way_at].decode("ascii", "replace").upper()
        (way,) = struct.unpack_from(">h" if processor == MIPS else "<h", data, way_at)
        if group < 0:
            groups[-group] = name
        else:
            found.append((group, name, _value(data, way_at + 2, name, processor)))
        if way < 0 or (0 < way < 2):
            raise FormError(f"a parameter {name!a} that leads nowhere")
        if not way:
            break
        at = way_at + way
    else:
        raise FormError("parameters that have no end")
    return {(groups.get(group, ""), name): value for group, name, value in found}, at


def _value(data: bytes, at: int, name: str, processor: int) -> Value:
    """The array of a parameter, the first size changing fastest; texts are one size less."""
    if at + 2 > len(data):
        raise FormError("a file that ends within its parameters")
    kind, dimensions = struct.unpack_from("<bB", data, at)
    sizes = list(data[at + 2 : at + 2 + dimensions])
    begin, size = at + 2 + dimensions, abs(kind) * prod(sizes)
    if dimensions > MOST_DIMENSIONS or len(sizes) < dimensions or begin + size > len(data):
        raise FormError(f"a parameter {name!a} of {size} bytes, which are not there")
    if kind == CHARACTERS:
        return _texts(data[begin : begin + size], sizes)
    if kind == BYTE:
        return tuple(map(float, data[begin : begin + size]))
    if kind == WORD:
        return tuple(map(float, words(data, begin, prod(sizes), processor)))
    if kind == REAL:
        return tuple(map(float, reals(data, begin, prod(sizes), processor)))
    raise FormError(f"a parameter {name!a} of type {kind}")


def _texts(letters: bytes, sizes: list[int]) -> tuple[str, ...]:
    longest = sizes[0] if sizes else len(letters)
    number = prod(sizes[1:]) if longest else 0
    pieces = (letters[k * longest : (k + 1) * longest] for k in range(number))
    return tuple(piece.decode("utf-8", "replace").strip(" \0") for piece in pieces)
