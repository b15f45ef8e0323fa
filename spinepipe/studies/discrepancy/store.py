"""A store of the pieces of a search: each is a content-hashed task, done once and kept.

A killed search finds what it had done; a repeated one only looks it up. The tasks are pydra's,
run in this process: they are known by a digest of code and arguments, and what they work on is
handed to them by that digest. The folder may be deleted at any time: it only saves time.

How the pieces of a search are run: at once, or through a store of what was done before.

A piece is a function of plain data, so that a store can know it by the content of its arguments.

A digest of what a value holds: the same in every process, however the value came about.

Pickled bytes will not do. They hang on which equal objects are one and the same, on the order of
sets, and on the cached properties that happen to be filled; so a value that was read back from a
store would not be known again.
"""

import hashlib
import os
import shutil
from collections.abc import Callable, Mapping
from collections.abc import Set as AnySet
from dataclasses import fields, is_dataclass
from enum import Enum
from pathlib import Path, PurePath
from types import BuiltinFunctionType, FunctionType
from typing import Any, ParamSpec, Protocol, TypeVar

import numpy as np
from pydra.compose import python
from pydra.engine.submitter import Submitter

from spinepipe.jobs.digest import code_digest, versions

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


os.environ.setdefault("NO_ET", "1")  # pydra reports its use over the network unless told not to


_WAITING: dict[str, Callable[[], Any]] = {}

_DONE, _TASK = "_result.pklz", "_job.pklz"
"""Files of pydra: a result, and the task with its result once more."""


@python.define(outputs=["result"])  # type: ignore[untyped-decorator]
def Piece(token: str) -> Any:
    """The piece of that digest; its result is kept under it."""
    from spinepipe.studies.discrepancy.store import waiting

    return waiting(token)()


def waiting(token: str) -> Callable[[], Any]:
    """What a digest stands for, in the process that is about to run it."""
    return _WAITING[token]


class Store:
    """Runs functions of plain data once per content of code and arguments.

    Only one process may use a folder at a time, which Snakemake sees to.
    """

    def __init__(self, folder: str | Path, module: str) -> None:
        """``module`` is the job whose code, with all it imports, the results hang on."""
        self._folder = Path(folder).absolute()
        self._made_by = f"{code_digest(module)} {sorted(versions().items())}".encode()
        self._asked: set[str] = set()

    def __call__(self, function: Callable[P, R], /, *args: P.args, **kwargs: P.kwargs) -> R:
        """The function's result, computed now or before; what it raises is passed on."""
        content = content_digest((function, args, sorted(kwargs.items())))
        token = hashlib.sha256(self._made_by + content).hexdigest()
        self._asked.add(token)
        place = self._folder / token
        if not list(place.glob(f"*/{_DONE}")):  # else a killed run's lock would be waited for
            shutil.rmtree(place, ignore_errors=True)
        _WAITING[token] = lambda: function(*args, **kwargs)
        try:
            found: R = _done(token, place)
        except BaseException:
            shutil.rmtree(place, ignore_errors=True)
            raise
        finally:
            del _WAITING[token]
        return found

    def forget_the_rest(self) -> None:
        """Delete pieces that nobody asked for since the store was opened: other code or data."""
        for place in self._folder.iterdir() if self._folder.is_dir() else ():
            if place.name not in self._asked:
                shutil.rmtree(place, ignore_errors=True)


def _done(token: str, place: Path) -> Any:
    """The result of a piece, from its folder or put there."""
    place.mkdir(parents=True, exist_ok=True)
    os.environ["PYDRA_HASH_CACHE"] = str(place / "hashes")  # else in the user's home
    with Submitter(cache_root=place, worker="debug") as submitter:
        result = submitter(Piece(token=token))
    for copy in place.glob(f"*/{_TASK}"):
        copy.unlink()
    return result.outputs.result
