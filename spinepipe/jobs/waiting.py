"""Result files that one job makes for its neighbours, whose own jobs then only take them.

Where many small jobs cost little more together than one of them alone, whichever comes first does
the work of its neighbours too. Their files wait hidden beside their places, so that any worker
finds them. A file is taken only if it is whole and carries the mark that the job would write, in
which stands what it is made of; else the job does the work itself. Who works on neighbours holds a
lock meanwhile, so that two workers do not both do the same; the system lets go of it when they end.
"""

import fcntl
import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from spinepipe.marks import read_mark


def waiting(output: str | Path) -> Path:
    """Where a result file waits for its own job."""
    path = Path(output)
    return path.with_name(f".{path.name}")


def is_to_make(output: str | Path, mark: str) -> bool:
    """Whether a file with this mark is neither in its place nor waits for its job."""
    return not any(_is_made(path, mark) for path in (output, waiting(output)))


def take(output: str | Path, mark: str) -> bool:
    """Put a waiting file with this mark in its place; whether there is one."""
    there = _is_made(waiting(output), mark)
    if there:
        os.replace(waiting(output), output)
    return there


@contextmanager
def alone_at(lock: str | Path) -> Iterator[bool]:
    """Whether no other process is at work under a lock; nobody else is until the block is left.

    Where files cannot be locked (some network disks), everybody is told so: work is done twice.
    """
    path = Path(lock)
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("wb") as file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            yield False
            return
        except OSError:
            pass
        try:
            yield True
        finally:
            with suppress(OSError):
                path.unlink()


def _is_made(path: str | Path, mark: str) -> bool:
    try:
        return read_mark(path) == mark
    except FileNotFoundError:
        return False
