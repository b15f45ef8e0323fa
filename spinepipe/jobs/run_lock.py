"""Whose lock a project has: that of a run which was killed is taken off by the next one.

Snakemake's lock is a folder with lists of files. It stays when Snakemake is killed, and nothing in
it tells whether that run still lives. So each run that computes on this machine leaves a note in
the folder and holds it (`flock`). The system lets go of a note when its process ends, however it
ends, also when another process has got its number since.
"""

import fcntl
import os
import re
import shutil
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from spinepipe.files import HOST

_NOTE = re.compile(r"(\d+)@([A-Za-z0-9-]+)\.run")
"""Name of a note: the process that runs and its machine."""

_GUARD = "one_at_a_time"


@contextmanager
def one_at_a_time(record: Path) -> Iterator[None]:
    """Only one process at a time is inside; where a disk knows no such locks, all are.

    Parameters
    ----------
    record : folder where Snakemake keeps its record.
    """
    with (record / _GUARD).open("a") as guard:
        with suppress(OSError):
            fcntl.flock(guard, fcntl.LOCK_EX)
        yield


@contextmanager
def noted(locks: Path) -> Iterator[None]:
    """A note of this process among the locks, held until the end."""
    locks.mkdir(parents=True, exist_ok=True)
    note = locks / f"{os.getpid()}@{HOST}.run"
    with note.open("a") as held:
        try:
            fcntl.flock(held, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:  # a disk without such locks: nobody may judge by this note
            note.unlink()
        try:
            yield
        finally:
            note.unlink(missing_ok=True)


def take_off(locks: Path) -> list[int]:
    """Remove the lock of runs that are no more; their process numbers."""
    dead = abandoned(locks)
    if dead:
        shutil.rmtree(locks)
    return dead


def abandoned(locks: Path) -> list[int]:
    """Process numbers of the runs that left this lock; none if any of them may still live.

    That is one that holds its note, one on another machine, and one that left no note, as jobs
    that it submitted may run on.
    """
    notes = [found for path in _files(locks) if (found := _NOTE.fullmatch(path.name))]
    over = all(_is_over(locks, note) for note in notes)
    return [int(note[1]) for note in notes] if over else []


def at_work(locks: Path) -> list[str]:
    """Runs that hold this lock, or may: which process on which machine, and since when."""
    notes = [found for path in _files(locks) if (found := _NOTE.fullmatch(path.name))]
    return [
        f"process {note[1]} on {note[2]}, since {_since(locks / note[0])}"
        for note in notes
        if not _is_over(locks, note)
    ]


def _since(note: Path) -> str:
    with suppress(OSError):  # it has just ended
        return time.strftime("%Y-%m-%d %H:%M", time.localtime(note.stat().st_mtime))
    return "a while"


def _files(locks: Path) -> list[Path]:
    return sorted(locks.iterdir()) if locks.is_dir() else []


def _is_over(locks: Path, note: re.Match[str]) -> bool:
    if note[2] != HOST:
        return False
    try:
        with (locks / note[0]).open() as file:
            fcntl.flock(file, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except OSError:
        return False
    return True
