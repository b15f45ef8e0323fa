"""A store of the pieces of a search: each is a content-hashed task, done once and kept.

A killed search finds what it had done; a repeated one only looks it up. Pieces are functions of
plain data, known by a digest of code and arguments, and kept as data (see `codec` and `kept`). What
is missing is run as a task of pydra in this process, in a scratch folder of its own that nobody
reads afterwards. The folder of the store may be deleted at any time: it only saves time.

Pickled bytes will not do for the digest of a value. They hang on which equal objects are one and
the same, on the order of sets, and on the cached properties that happen to be filled; so a value
that was read back from a store would not be known again.
"""

import hashlib
import logging
import os
from collections.abc import Callable, Mapping
from collections.abc import Set as AnySet
from dataclasses import fields, is_dataclass
from enum import Enum
from functools import cache
from pathlib import Path, PurePath
from tempfile import TemporaryDirectory
from types import BuiltinFunctionType, FunctionType
from typing import Any, ParamSpec, Protocol, TypeVar

import numpy as np
from pydra.compose import python
from pydra.engine.submitter import Submitter

from spinepipe.jobs.code import code_digest
from spinepipe.jobs.digest import versions
from spinepipe.studies.discrepancy.codec import decoded, encoded
from spinepipe.studies.discrepancy.kept import Kept

_log = logging.getLogger(__name__)

P = ParamSpec("P")
R = TypeVar("R")


class Run(Protocol):
    """Runs a function on arguments and returns what it returns."""

    def __call__(self, function: Callable[P, R], /, *args: P.args, **kwargs: P.kwargs) -> R:
        """The function's result, computed now or before."""


def at_once(function: Callable[P, R], /, *args: P.args, **kwargs: P.kwargs) -> R:
    """Run here and now, keep nothing."""
    return function(*args, **kwargs)


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
    return _Digests().of(value)


class _Digests:
    """Digests of one value and its parts; a dataclass that it holds twice is looked at once."""

    def __init__(self) -> None:
        self._known: dict[int, bytes] = {}

    def of(self, value: Any) -> bytes:
        """The digest of a part; parts stay alive while the whole is looked at."""
        if isinstance(value, Enum | type | FunctionType | BuiltinFunctionType):
            return _named(value)
        if isinstance(value, PLAIN):
            return _joined(type(value).__name__, repr(value).encode())
        if isinstance(value, np.ndarray | np.generic):
            return _array(np.asarray(value))
        if isinstance(value, tuple | list):
            return _joined("sequence", *map(self.of, value))
        if is_dataclass(value):
            if id(value) not in self._known:
                self._known[id(value)] = self._dataclass(value)
            return self._known[id(value)]
        if isinstance(value, Mapping):
            return _joined("mapping", *map(self.of, value.items()))
        if isinstance(value, AnySet):
            return _joined("set", *sorted(map(self.of, value)))
        raise TypeError(f"what a {type(value).__qualname__} holds cannot be told")

    def _dataclass(self, value: Any) -> bytes:
        kind: Any = type(value)
        name, names = _declared(kind)
        return _joined("dataclass", name, *(self.of(getattr(value, one)) for one in names))


@cache
def _declared(kind: type) -> tuple[bytes, tuple[str, ...]]:
    """A dataclass' name and those of its fields."""
    return _named(kind), tuple(field.name for field in fields(kind))


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


os.environ.setdefault("NO_ET", "1")  # pydra reports its use over the network unless told not to


_WAITING: dict[str, Callable[[], None]] = {}


@python.define(outputs=["done"])  # type: ignore[untyped-decorator]
def Piece(token: str) -> str:
    """Runs the piece of that digest; pydra learns, and pickles, nothing but the digest."""
    from spinepipe.studies.discrepancy.store import waiting

    waiting(token)()
    return token


def waiting(token: str) -> Callable[[], None]:
    """What a digest stands for, in the process that is about to run it."""
    return _WAITING[token]


class Store:
    """Runs functions of plain data once per content of code and arguments.

    Several processes may use a folder at the same time; none waits for another.
    """

    def __init__(self, folder: str | Path, module: str) -> None:
        """``module`` is the job whose code, with all it imports, the results hang on.

        Raises
        ------
        NotADirectoryError
            Where something else than a folder has that name.
        """
        self._kept = Kept(Path(folder).absolute())
        self._made_by = f"{code_digest(module)} {sorted(versions().items())}".encode()
        self._asked: set[str] = set()

    def __call__(self, function: Callable[P, R], /, *args: P.args, **kwargs: P.kwargs) -> R:
        """The function's result, computed now or before; what it raises is passed on.

        Raises
        ------
        TypeError
            For arguments of which no digest can be taken, or results that cannot be kept as data.
        """
        content = content_digest((function, args, sorted(kwargs.items())))
        token = hashlib.sha256(self._made_by + content).hexdigest()
        self._asked.add(token)
        kept = self._kept.read(token)
        if kept is not None:
            try:
                again: R = decoded(kept)
                return again
            except ValueError as trouble:
                _log.warning("a piece that somebody else wrote is replaced: %s", trouble)
        data = _computed(token, lambda: encoded(function(*args, **kwargs)))
        self._kept.write(token, data)
        found: R = decoded(data)  # now too, so that a search made again goes on with the same
        return found

    def forget_the_rest(self) -> None:
        """Delete pieces that nobody asked for since the store was opened: other code or data."""
        self._kept.sweep(self._asked)


def _computed(token: str, piece: Callable[[], bytes]) -> bytes:
    """The piece, run by pydra; what pydra writes about it is gone afterwards."""
    made: list[bytes] = []
    _WAITING[token] = lambda: made.append(piece())
    try:
        with TemporaryDirectory(prefix="spinepipe-", ignore_cleanup_errors=True) as scratch:
            os.environ["PYDRA_HASH_CACHE"] = str(Path(scratch, "hashes"))  # else in the home
            with Submitter(cache_root=scratch, worker="debug") as submitter:
                submitter(Piece(token=token))
    finally:
        del _WAITING[token]
    return made[0]
