"""The parameters of a `.c3d`: named values in named groups (POINT, TRIAL, ...).

By The C3D File Format, User Guide (2008). Entries stand one behind the other, each with the number
of bytes to the next (its *way*). Nothing that a file tells of its sizes is trusted: a parameter may
claim gigabytes, a list may lead back to its beginning. Libraries for this form end the process
then, or fill the memory.

`at` and `begin` are places in the file in bytes from 0.
"""

import struct
from collections.abc import Mapping
from math import prod
from typing import Any

import numpy as np
from numpy.typing import NDArray

INTEL, DEC, MIPS = 84, 85, 86
"""By which processor numbers were written: Intel (low byte first), DEC (low byte first, reals of
its own) or MIPS (high byte first)."""

CHARACTERS, BYTE, WORD, REAL = -1, 1, 2, 4
"""Types of parameters; without their sign, the bytes of one element."""

MOST_PARAMETERS = 10
"""A parameter holds 255 elements; further ones follow in the next: LABELS, LABELS2, LABELS3 ..."""

Value = tuple[str, ...] | tuple[float, ...]
"""Elements of a parameter's array in the order of the file, the first index changing fastest."""

Parameters = Mapping[tuple[str, str], Value]
"""Value by group and name, both in capitals: (POINT, RATE)."""


class FormError(ValueError):
    """A file that does not hold together; the text says what was found."""


def elements(parameters: Parameters, group: str, name: str) -> list[str | float]:
    """Of a parameter and of those that go on with it; none where there is none."""
    names = (name, *(f"{name}{k}" for k in range(2, MOST_PARAMETERS)))
    return [one for key in names for one in parameters.get((group, key), ())]


def numbers_at(data: bytes, kind: int, at: int, number: int, processor: int) -> NDArray[Any]:
    """(number,) of a type, whole numbers without a sign.

    A DEC writes the two 16-bit halves of a real in the other order, and the same bits, read as
    IEEE's, are four times its number.
    """
    if kind == REAL and processor == DEC:
        halves = np.frombuffer(data, "<u2", 2 * number, at).reshape(-1, 2)
        return np.ascontiguousarray(halves[:, ::-1]).view("<f4").ravel() * np.float32(0.25)
    found = np.frombuffer(data, f"<{'f' if kind == REAL else 'u'}{kind}", number, at)
    return found.byteswap() if processor == MIPS else found


def read_parameters(data: bytes, at: int, processor: int) -> tuple[Parameters, int]:
    """All parameters, and where their list ends.

    That is its last entry, the empty one behind that, or the end of the section: programs of SGI
    let the last entry lead beyond it. An entry: length of its name, number of its group, name, way
    to the next entry, and of a parameter its value. Entries with a negative group number are the
    groups themselves.

    Raises
    ------
    FormError
        Where it does not hold together.
    """
    groups: dict[int, str] = {}
    found: list[tuple[int, str, Value]] = []
    while at + 2 <= len(data):
        length, group = struct.unpack_from("<bb", data, at)  # length: negative if it is locked
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
        # counted from the way itself, which has 2 bytes; 0 at the last entry. Never backwards
        if way < 0 or (0 < way < 2):
            raise FormError(f"a parameter {name!a} that leads nowhere")
        if not way:
            break
        at = way_at + way
    named = {(groups.get(group, ""), name): value for group, name, value in found}
    return named, min(at, len(data))


def _value(data: bytes, at: int, name: str, processor: int) -> Value:
    """The array of a parameter, flat.

    At ``at``: type, how many sizes, the sizes, the elements. Of characters the first size is the
    length of each text, and texts are the elements.
    """
    if at + 2 > len(data):
        raise FormError("a file that ends within its parameters")
    kind, dimensions = struct.unpack_from("<bB", data, at)
    sizes = data[at + 2 : at + 2 + dimensions]
    begin, size = at + 2 + dimensions, abs(kind) * prod(sizes)
    if begin + size > len(data):
        raise FormError(f"a parameter {name!a} of {size} bytes, which are not there")
    if kind == CHARACTERS:
        longest = sizes[0] if sizes else size
        texts = (data[k : k + longest] for k in range(begin, begin + size, longest or 1))
        return tuple(text.decode("utf-8", "replace").strip(" \0") for text in texts)
    if kind not in (BYTE, WORD, REAL):
        raise FormError(f"a parameter {name!a} of type {kind}")
    return tuple(map(float, numbers_at(data, kind, begin, prod(sizes), processor)))
