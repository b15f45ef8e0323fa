"""Plain values as bytes and back: numbers as arrays in npz form, their structure as JSON.

Reading runs no code but the constructors of spinepipe's own dataclasses. Arrays of one dtype lie
one behind the other in one array, so that a value of hundreds of small arrays is read at once.
What one value holds twice, being one and the same object, is written once and is one again.
"""

import json
import math
from collections.abc import Callable
from dataclasses import fields, is_dataclass
from enum import Enum
from functools import cache
from importlib import import_module
from io import BytesIO
from typing import Any, Literal
from zipfile import BadZipFile

import numpy as np

STRUCTURE = "structure"
"""The member of the npz that is the JSON, as bytes; the others are arrays, named by dtype."""

NUMBERS = "biufc"
"""Kinds of dtype that are written: bool, integers, floats and complex numbers."""

PACKAGE = "spinepipe"

_NOT_OURS = (
    *(LookupError, TypeError, AttributeError, ImportError),
    *(EOFError, BadZipFile, ArithmeticError, RecursionError),
)
"""What reading bytes raises that were not written here, besides ValueError."""


def encoded(value: Any) -> bytes:
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
    flat = {name: np.concatenate(parts, dtype=name) for name, parts in writer.parts.items()}
    flat[STRUCTURE] = np.frombuffer(structure.encode(), dtype=np.uint8)
    buffer = BytesIO()
    np.savez(buffer, allow_pickle=False, **flat)
    return buffer.getvalue()


def decoded(data: bytes) -> Any:
    """The value that was encoded; ``data`` is to be verified by who kept it.

    Raises
    ------
    ValueError
        For what `encoded` never writes: pickles, arrays of objects, names outside of spinepipe,
        which are never looked up, values that are no fields of their class.
    """
    try:
        with np.load(BytesIO(data), allow_pickle=False) as file:
            flat = {name: file[name] for name in file.files}
        return _Reader(flat).of(json.loads(flat.pop(STRUCTURE).tobytes()))
    except _NOT_OURS as trouble:
        raise ValueError(f"{type(trouble).__name__}: {trouble}") from trouble


class _Writer:
    """Makes JSON of a value. All but words and numbers becomes a list that begins with a tag."""

    def __init__(self) -> None:
        self.parts: dict[str, list[np.ndarray]] = {}
        self._sizes: dict[str, int] = {}
        self._known: dict[int, int] = {}

    def of(self, value: Any) -> Any:
        """JSON of the value; of an object seen before, its number."""
        kind: Any = type(value)
        if value is None or kind in (bool, int, str):
            return value
        if kind is float:
            return value if math.isfinite(value) else ["float", *self._array(np.array(value))]
        if isinstance(value, Enum):
            return ["enum", _name(kind), value.name]
        if isinstance(value, np.generic):
            return ["scalar", *self._array(np.asarray(value))]
        if id(value) in self._known:
            return ["same", self._known[id(value)]]
        written = self._compound(value, kind)
        self._known[id(value)] = len(self._known)
        return written

    def _compound(self, value: Any, kind: Any) -> list[Any]:
        if kind is np.ndarray:
            return ["array", *self._array(value)]
        if kind in (tuple, list):
            return [kind.__name__, *map(self.of, value)]
        if kind is frozenset:
            return ["frozenset", *map(self.of, sorted(value, key=repr))]
        if kind is dict:
            return ["dict", *([self.of(key), self.of(one)] for key, one in value.items())]
        if is_dataclass(kind):
            return self._data(value, type(value))
        raise TypeError(f"a {kind.__module__}.{kind.__qualname__} cannot be kept as data")

    def _data(self, value: Any, kind: Any) -> list[Any]:
        name, names = _name(kind), _fields(kind)
        return ["data", name, *(self.of(getattr(value, one)) for one in names)]

    def _array(self, array: np.ndarray) -> tuple[str, list[int], str, int]:
        """Its dtype, shape and order, and where it begins among those of its dtype."""
        if array.dtype.kind not in NUMBERS:
            raise TypeError(f"an array of dtype {array.dtype} cannot be kept as data")
        name = array.dtype.str
        order: Literal["F", "C"] = "F" if array.flags.fnc else "C"
        start = self._sizes.get(name, 0)
        self._sizes[name] = start + array.size
        self.parts.setdefault(name, []).append(array.ravel(order=order))
        return name, list(array.shape), order, start


class _Reader:
    """Makes a value of JSON; counts compound objects in the order in which they were written."""

    def __init__(self, flat: dict[str, np.ndarray]) -> None:
        self._flat = flat
        self._made: list[Any] = []

    def of(self, written: Any) -> Any:
        """The value of one piece of JSON."""
        if type(written) is not list:
            return written
        tag, *rest = written
        if tag == "same":
            return self._made[rest[0]]
        if tag == "float":
            return float(self._array(*rest))
        if tag == "scalar":
            return self._array(*rest)[()]
        if tag == "enum":
            return _class(rest[0])[rest[1]]  # type: ignore[index]
        made = self._compound(tag, rest)
        self._made.append(made)
        return made

    def _compound(self, tag: str, rest: list[Any]) -> Any:
        if tag == "array":
            return self._array(*rest)
        if tag == "dict":
            return {self.of(key): self.of(one) for key, one in rest}
        if tag == "data":
            kind = _class(rest[0])
            return kind(**dict(zip(_fields(kind), map(self.of, rest[1:]), strict=True)))
        return _SEQUENCES[tag](map(self.of, rest))

    def _array(self, dtype: str, shape: list[int], order: Any, start: int) -> np.ndarray:
        """An array with memory of its own, in the order in which it was written."""
        there = self._flat[dtype][start : start + math.prod(shape)].copy()
        return there.reshape(shape, order=order)


_SEQUENCES: dict[str, Callable[[Any], Any]] = {"tuple": tuple, "list": list, "frozenset": frozenset}


@cache
def _fields(kind: type) -> tuple[str, ...]:
    return tuple(field.name for field in fields(kind))


@cache
def _name(kind: type) -> str:
    """A class by its module and its name in it."""
    name = f"{kind.__module__}:{kind.__qualname__}"
    if kind.__module__.split(".")[0] != PACKAGE or "<locals>" in kind.__qualname__:
        raise TypeError(f"a {kind.__module__}.{kind.__qualname__} cannot be kept as data")
    return name


@cache
def _class(name: str) -> type:
    """The dataclass or enum of that name."""
    module, _, inside = name.partition(":")
    rooms = module.split(".")
    if rooms[0] != PACKAGE or "__main__" in rooms:  # to import that one is to run it
        raise ValueError(f"{name} is not of {PACKAGE}")
    found: Any = import_module(module)
    for part in inside.split("."):
        found = getattr(found, part)
    if not (isinstance(found, type) and (is_dataclass(found) or issubclass(found, Enum))):
        raise ValueError(f"{name} is no class of data")
    if _name(found) != name:  # found through an import, so by another name than its own
        raise ValueError(f"{name} is called {_name(found)}")
    return found
