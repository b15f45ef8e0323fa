"""Result files that one job makes for its neighbours, whose own jobs then only take them.

Where many small jobs cost little more together than one of them alone, whichever comes first does
the work of its neighbours too. Their files wait hidden beside their places, so that any worker
finds them. A file is taken only if it is whole, carries the mark that the job would write, and is
no older than what the job reads; else the job does the work itself.
"""

import os
from pathlib import Path

from spinepipe.marks import read_mark


def waiting(output: str | Path) -> Path:
    """Where a result file waits for its own job."""
    path = Path(output)
    return path.with_name(f".{path.name}")


def is_made(path: str | Path, mark: str, read: str | Path) -> bool:
    """Whether there is a file with this mark, no older than the file ``read`` that it hangs on."""
    try:
        fresh = os.stat(path).st_mtime_ns >= os.stat(read).st_mtime_ns
        return fresh and read_mark(path) == mark
    except FileNotFoundError:
        return False


def is_to_make(output: str | Path, mark: str, read: str | Path) -> bool:
    """Whether a file is neither in its place nor waits for its job."""
    return not any(is_made(path, mark, read) for path in (output, waiting(output)))


def take(output: str | Path, mark: str, read: str | Path) -> bool:
    """Put a waiting file in its place, whether there is one; parameters as of `is_made`."""
    there = is_made(waiting(output), mark, read)
    if there:
        os.replace(waiting(output), output)
    return there
