"""Writing files so that they appear whole or not at all."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


@contextmanager
def appearing(path: str | Path) -> Iterator[Path]:
    """A temporary file beside ``path`` to be written; it takes that name when all went well.

    Raises
    ------
    OSError
        With the file's name, when the folder cannot be written or the disk is full.
    """
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    temporary = path.with_name(f".{path.name}.{os.getpid()}")
    try:
        yield temporary
        os.replace(temporary, path)
    finally:
        temporary.unlink(missing_ok=True)


Stamp = tuple[str, int, int]
"""Name, size and time of change of a file."""


def stamp(path: str | Path) -> Stamp:
    """Name, size and time of change of a file: a key that a change of the file changes."""
    status = Path(path).stat()
    return str(path), status.st_size, status.st_mtime_ns
