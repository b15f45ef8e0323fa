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


def take(output: str | Path, mark: str, read: str | Path) -> bool:
    """Put a waiting file where its job writes that reads ``read``; whether there was one."""
    ready = waiting(output)
    try:
        fresh = os.stat(ready).st_mtime_ns >= os.stat(read).st_mtime_ns
        if not fresh or read_mark(ready) != mark:
            return False
        os.replace(ready, output)
    except FileNotFoundError:
        return False
    return True
