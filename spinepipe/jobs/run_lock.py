"""One run at a time in a project.

The lock belongs to a process (`flock`): the system takes it off when that one ends, however it
ends, so that a run that was killed leaves nothing to be unlocked.
"""

import fcntl
import os
import time
from pathlib import Path
from typing import TextIO

from spinepipe.files import HOST


class AtWork(Exception):
    """Another run holds the lock; the text says which."""


def lock(path: Path) -> TextIO:
    """The lock, held until the file that is returned is closed.

    Where a disk knows no such locks, every run gets it.

    Raises
    ------
    AtWork
        With process, machine and hour of the run that holds it.
    """
    file = path.open("a+", encoding="utf-8")
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        with file:
            file.seek(0)
            raise AtWork(file.read().strip()) from None
    except OSError:
        pass
    file.truncate(0)
    file.write(f"process {os.getpid()} on {HOST}, since {time.strftime('%Y-%m-%d %H:%M')}\n")
    file.flush()
    return file
