"""Plain values as bytes and back.

The bytes are a line of JSON, the structure, and behind it the numbers of all arrays as they lie in
memory, as in safetensors. Reading runs no code but the constructors of spinepipe's own dataclasses.
What one value holds twice, being one and the same object, is written once and is one again.
"""

import json
import math
from dataclasses import fields, is_dataclass
from enum import Enum
from functools import cache, reduce
from importlib import import_module
from typing import Any, Literal

import numpy as np

NUMBERS = "biufc"
"""Kinds of dtype that are written: bool, integers, floats and complex numbers."""

PACKAGE = "spinepipe"

_SEQUENCES: dict[str, type] = {"tuple": tuple, "list": list, "frozenset": frozenset}


def encode(value: Any) -> bytes:
    """The value as bytes, the same for the same value.

    None, bool, int, float, str, enums, arrays and scalars of numpy, tuples, lists, dicts, frozen
    sets and dataclasses. Floats keep every bit, arrays dtype, shape and C or Fortran order, dicts
    their order. Of a dataclass its fields count, not its cached properties.

    Raises
    ------
    TypeError
        For anything else: subclasses of these, arrays of objects, classes outside of spinepipe.
    """
    writer = _Writer()
    structure = json.dumps(writer.of(value), ensure_ascii=False, allow_nan=False)
    return b"\n".join([structure.encode(), *writer.numbers])


def decode(data: bytes) -> Any:
    """The value that was encoded; ``data`` is to be verified by who kept it.

    Raises
    ------
    ValueError
        For what `encode` never writes, as arrays of objects, names outside of spinepipe, which
        are never looked up, and values that are no fields of their class.
    """
    structure, _, numbers = data.partition(b"\n")
    try:
        return _Reader(numbers).of(json.loads(structure))
    except (LookupError, TypeError, AttributeError, ImportError, RecursionError) as trouble:
        raise ValueError(f"{type(trouble).__name__}: {trouble}") from trouble


class _Writer:
    """Makes JSON of a value. All but words and numbers becomes a list that begins with a tag."""

    def __init__(self) -> None:
        self.numbers: list[bytes] = []
        self._size = 0
        self._known: dict[int, int] = {}

    def of(self, value: Any) -> Any:
        """JSON of the value; of an object seen before, its number."""
        kind: Any = type(value)
        if value is None or kind in (bool, int, str) or (kind is float and math.isfinite(value)):
            return value
        if isinstance(value, Enum):
            return ["enum", _name(kind), value.name]
        if kind is float or isinstance(value, np.generic):
            return ["float" if kind is float else "scalar", *self._array(np.asarray(value))]
        if id(value) in self._known:
            return ["same", self._known[id(value)]]
        if kind is np.ndarray:
            written = ["array", *self._array(value)]
        elif kind in (tuple, list):
            written = [kind.__name__, *map(self.of, value)]
        elif kind is frozenset:
            written = ["frozenset", *map(self.of, sorted(value, key=repr))]
        elif kind is dict:
            written = ["dict", *([self.of(key), self.of(one)] for key, one in value.items())]
        elif is_dataclass(value):
            name = _name(kind)
            written = ["data", name, *(self.of(getattr(value, f.name)) for f in fields(kind))]
        else:
            raise TypeError(f"a {kind.__module__}.{kind.__qualname__} cannot be kept as data")
        self._known[id(value)] = len(self._known)
        return written

    def _array(self, array: np.ndarray) -> tuple[str, list[int], str, int]:
        """Its dtype, shape and order, and the byte at which its numbers begin."""
        if array.dtype.kind not in NUMBERS:
            raise TypeError(f"an array of dtype {array.dtype} cannot be kept as data")
        order: Literal["F", "C"] = "F" if array.flags.fnc else "C"
        start = self._size
        self.numbers.append(array.tobytes(order=order))
        self._size += array.nbytes + 1
        return array.dtype.str, list(array.shape), order, start


class _Reader:
    """Makes a value of JSON; counts compound objects in the order in which they were written."""

    def __init__(self, numbers: bytes) -> None:
        self._numbers = numbers
        self._made: list[Any] = []

    def of(self, written: Any) -> Any:
        """The value of one piece of JSON."""
        if type(written) is not list:
            return written
        tag, *rest = written
        if tag == "same":
            return self._made[rest[0]]
        if tag == "enum":
            return _class(rest[0])[rest[1]]
        if tag in ("float", "scalar"):
            scalar = self._array(*rest)[()]
            return float(scalar) if tag == "float" else scalar
        if tag == "array":
            made: Any = self._array(*rest)
        elif tag == "dict":
            made = {self.of(key): self.of(one) for key, one in rest}
        elif tag == "data":
            kind = _class(rest[0])
            names = (field.name for field in fields(kind))
            made = kind(**dict(zip(names, map(self.of, rest[1:]), strict=True)))
        else:
            made = _SEQUENCES[tag](map(self.of, rest))
        self._made.append(made)
        return made

    def _array(self, name: str, shape: list[int], order: Any, start: int) -> np.ndarray:
        """An array with memory of its own, in the order in which it was written."""
        dtype = np.dtype(name)
        if dtype.kind not in NUMBERS:
            raise ValueError(f"{name} is no dtype of numbers")
        there = self._numbers[start : start + math.prod(shape) * dtype.itemsize]
        return np.frombuffer(bytearray(there), dtype).reshape(shape, order=order)


@cache
def _name(kind: type) -> str:
    """A class by its module and its name in it."""
    if kind.__module__.split(".")[0] != PACKAGE or "<locals>" in kind.__qualname__:
        raise TypeError(f"a {kind.__module__}.{kind.__qualname__} cannot be kept as data")
    return f"{kind.__module__}:{kind.__qualname__}"


@cache
def _class(name: str) -> Any:
    """The dataclass or enum of that name."""
    module, _, inside = name.partition(":")
    rooms = module.split(".")
    if rooms[0] != PACKAGE or "__main__" in rooms:  # to import that one is to run it
        raise ValueError(f"{name} is not of {PACKAGE}")
    found = reduce(getattr, inside.split("."), import_module(module))
    if not (isinstance(found, type) and (is_dataclass(found) or issubclass(found, Enum))):
        raise ValueError(f"{name} is no class of data")
    if _name(found) != name:  # found through an import, so by another name than its own
        raise ValueError(f"{name} is called {_name(found)}")
    return found
