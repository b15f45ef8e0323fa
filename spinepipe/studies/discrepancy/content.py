"""A digest of what a value holds: the same in every process, however the value came about.

Pickled bytes will not do. They hang on which equal objects are one and the same, on the order of
sets, and on the cached properties that happen to be filled; so a value that was read back from a
store would not be known again.
"""

import hashlib
from collections.abc import Mapping
from collections.abc import Set as AnySet
from dataclasses import fields, is_dataclass
from enum import Enum
from pathlib import PurePath
from types import BuiltinFunctionType, FunctionType
from typing import Any

import numpy as np

PLAIN = (type(None), bool, int, float, complex, str, bytes, PurePath)


def content_digest(value: Any) -> bytes:
    """sha256 over plain values, arrays, enums, functions, dataclasses and what is made of them.

    Of a dataclass its fields count, not its cached properties; of a function and a class the name.
    Mappings count in their order.

    Raises
    ------
    TypeError
        For anything else.
    """
    if isinstance(value, Enum | type | FunctionType | BuiltinFunctionType):
        return _named(value)
    if isinstance(value, PLAIN):
        return _joined(type(value).__name__, repr(value).encode())
    if isinstance(value, np.ndarray | np.generic):
        return _array(np.asarray(value))
    if isinstance(value, Mapping):
        return _joined("mapping", *map(content_digest, value.items()))
    if isinstance(value, tuple | list):
        return _joined("sequence", *map(content_digest, value))
    if isinstance(value, AnySet):
        return _joined("set", *sorted(map(content_digest, value)))
    if is_dataclass(value):
        of_fields = (content_digest(getattr(value, field.name)) for field in fields(value))
        return _joined("dataclass", _named(type(value)), *of_fields)
    raise TypeError(f"what a {type(value).__qualname__} holds cannot be told")


def _joined(kind: str, *parts: bytes) -> bytes:
    return hashlib.sha256(kind.encode() + b":" + b"".join(parts)).digest()


def _named(value: Any) -> bytes:
    """An enum's member, a class or a function by its full name."""
    one = f".{value.name}" if isinstance(value, Enum) else ""
    owner = type(value) if isinstance(value, Enum) else value
    return _joined("name", f"{owner.__module__}.{owner.__qualname__}{one}".encode())


def _array(array: np.ndarray) -> bytes:
    if array.dtype.hasobject:
        raise TypeError("what an array of objects holds cannot be told")
    about = _joined("array", f"{array.dtype.str} {array.shape}".encode())
    return _joined("array", about, array.tobytes())
