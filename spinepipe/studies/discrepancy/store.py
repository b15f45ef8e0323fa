"""The pieces of a search: each is done once and kept, and independent ones run side by side.

A piece is a function of plain data, known by the digest of the code, its name and its arguments.
What it returns is kept as data in ``<digest>.piece``, see `codec`; a file that does not verify
counts as not there. Files appear whole, so nothing needs a lock: two runs at once may both compute
a piece. Nothing is unpickled and no link is followed. The folder may be deleted at any time.

Pieces that do not wait for each other are run by pydra's workers, one for each thread of the job.
A worker keeps a piece as soon as it is done, so a killed search loses none that was.
"""

import gc
import hashlib
import logging
import multiprocessing
import os
import re
from collections.abc import Callable, Iterable, Mapping
from concurrent.futures import ProcessPoolExecutor
from contextlib import suppress
from functools import partial
from itertools import chain
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, TypeVar

from pydra.compose import python
from pydra.engine.submitter import Submitter
from pydra.workers.cf import ConcurrentFuturesWorker

from spinepipe.files import appearing, sweep
from spinepipe.jobs.code import code_digest
from spinepipe.jobs.digest import versions
from spinepipe.jobs.pool import end_with_parent
from spinepipe.studies.discrepancy.codec import decode, encode

_log = logging.getLogger(__name__)

R = TypeVar("R")
Arguments = tuple[Any, ...]

SUFFIX = ".piece"
MARK = b"spinepipe piece 2\n"
"""First bytes of a file; the number is that of the format."""

_HEAD = len(MARK) + 65
_NAME = re.compile(rf"[0-9a-f]{{64}}{SUFFIX}")


class PieceRunner:
    """Runs pieces: here and now, and keeps nothing."""

    def __call__(self, function: Callable[..., R], /, *arguments: Any) -> R:
        """The function's result; what it raises is passed on."""
        return self.map(function, [arguments])[0]

    def map(self, function: Callable[..., R], arguments: Iterable[Arguments]) -> list[R]:
        """Its results for several arguments that do not wait for each other, in their order."""
        return [function(*one) for one in arguments]


at_once = PieceRunner()


class Store(PieceRunner):
    """Runs functions of plain data once per content of code and arguments."""

    def __init__(self, folder: str | Path, module: str, threads: int = 1) -> None:
        """``module`` is the job whose code, with all it imports, the results hang on.

        Parameters
        ----------
        folder : need not exist. threads : how many pieces are computed at the same time.

        Raises
        ------
        NotADirectoryError
            Where something else than a folder has that name.
        """
        self._folder, self._threads = Path(folder).absolute(), threads
        if (self._folder.exists() or self._folder.is_symlink()) and not self._folder.is_dir():
            raise NotADirectoryError(f"{folder} is no folder; remove it, nothing is lost by that")
        self._made_by = f"{code_digest(module)} {sorted(versions().items())}"
        self._asked: set[Path] = set()

    def map(self, function: Callable[..., R], arguments: Iterable[Arguments]) -> list[R]:
        """Its results; what is not kept yet is computed, by workers where it is several pieces.

        Raises
        ------
        TypeError
            For arguments or results that cannot be kept as data.
        """
        every = list(arguments)
        paths = self._paths(function, every)
        self._asked.update(paths)
        found = _kept(paths)
        calls = {
            path: partial(_compute, path, function, one)
            for path, one in zip(paths, every, strict=True)
            if path not in found
        }
        if self._threads > 1 and len(calls) > 1:
            _in_workers({path.name: call for path, call in calls.items()}, self._threads)
            found |= _kept(calls)
        for path, call in calls.items():
            if path not in found:  # not even by a worker: what it raises is raised here
                found[path] = decode(call())  # as it will be read, so that all goes on the same
        return [found[path] for path in paths]

    def _paths(self, function: Callable[..., R], every: Iterable[Arguments]) -> list[Path]:
        """Where pieces are kept. No two have one name; which equal parts are one object may count,
        so that at worst one is computed again.
        """
        about = self._made_by, function.__module__, function.__qualname__
        known: dict[int, str] = {}  # what many pieces work on is looked at once
        for value in chain.from_iterable(every):
            known[id(value)] = known.get(id(value)) or _sha256(encode(value))
        told = [" ".join([*about, *(known[id(value)] for value in one)]) for one in every]
        return [self._folder / f"{_sha256(one.encode())}{SUFFIX}" for one in told]

    def forget_the_rest(self) -> None:
        """Delete pieces that nobody asked for since the store was opened: other code or data."""
        if self._folder.is_symlink():
            _log.warning("%s is a link: old pieces there are not deleted", self._folder)
            return
        sweep(self._folder)
        for path in self._folder.iterdir() if self._folder.is_dir() else ():
            if _NAME.fullmatch(path.name) and path not in self._asked and _is_file(path):
                with suppress(OSError):
                    path.unlink()


def _kept(paths: Iterable[Path]) -> dict[Path, Any]:
    """What was kept under these names and is as it was written."""
    found: dict[Path, Any] = {}
    for path in filter(_is_file, dict.fromkeys(paths)):
        try:
            content = path.read_bytes()
            if content[:_HEAD] != _head(path, content[_HEAD:]):
                raise ValueError("it is not as it was written")
            found[path] = decode(content[_HEAD:])
        except (OSError, ValueError) as trouble:
            _log.warning("%s: %s; it is computed again and replaced", path, trouble)
    return found


def _compute(path: Path, function: Callable[..., Any], arguments: Arguments) -> bytes:
    """Compute a piece and keep it; its bytes.

    Raises
    ------
    OSError
        With the file's name, when the folder cannot be written or the disk is full.
    """
    data = encode(function(*arguments))
    try:
        with appearing(path) as temporary:
            temporary.write_bytes(_head(path, data) + data)
    except (FileNotFoundError, IsADirectoryError) as trouble:  # swept by another run just now
        _log.warning("%s is not kept: %s", path, trouble)
    return data


def _head(path: Path, data: bytes) -> bytes:
    """The mark, and a digest of name and bytes."""
    return MARK + _sha256(path.name.encode() + data).encode() + b"\n"


def _sha256(data: bytes) -> str:
    return hashlib.sha256(data).hexdigest()


def _is_file(path: Path) -> bool:
    """Whether there is a file under that very name, not behind a link."""
    return path.is_file() and not path.is_symlink()


os.environ.setdefault("NO_ET", "1")  # pydra reports its use over the network unless told not to

CALLS: dict[str, Callable[[], object]] = {}
"""What the workers are to do, by name; they are forked while it is filled, and inherit it."""


@python.define(outputs=["done"])  # type: ignore[untyped-decorator]
def Piece(name: str) -> str:
    """Computes and keeps a piece; one that raises is left to the process that asked for it."""
    import contextlib

    from spinepipe.studies.discrepancy.store import CALLS

    with contextlib.suppress(Exception):
        CALLS[name]()
    return name


def _in_workers(calls: Mapping[str, Callable[[], object]], threads: int) -> None:
    """Have pydra's workers make the calls, so many at a time.

    They are forked, so they compute with the very objects, and the compiled kernels, of this
    process. Pydra's own cache holds pickles: it lies in a folder that no other run ever reads.
    """
    multiprocessing.current_process().daemon = False  # a job's is one, and may have no children
    most, fork = min(threads, len(calls)), multiprocessing.get_context("fork")
    CALLS.update(calls)
    try:
        with TemporaryDirectory(prefix="spinepipe-", ignore_cleanup_errors=True) as scratch:
            os.environ["PYDRA_HASH_CACHE"] = str(Path(scratch, "hashes"))  # else in the home
            worker = ConcurrentFuturesWorker(n_procs=most)
            worker.pool = ProcessPoolExecutor(most, fork, initializer=_begin)
            with Submitter(cache_root=scratch, worker=worker) as submitter:
                submitter(Piece().split(name=list(calls)), raise_errors=True)
    except Exception as trouble:  # as when a worker is killed: no reason to give up the search
        _log.warning("a worker failed, what it left is computed without: %s", trouble)
    finally:
        CALLS.clear()


def _begin() -> None:
    """Begin the life of a worker."""
    gc.freeze()  # what it was forked with stays: no need to look through it at each collection
    end_with_parent()
