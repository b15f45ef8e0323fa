"""The file system as a project uses it: whole files, temporary ones, hidden ones."""

import os
import platform
import re
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from tempfile import TemporaryFile

CONFIG = Path("config") / "config.yaml"
"""Which studies a plain run builds; where it lies a project begins."""

HOST = re.sub(r"[^A-Za-z0-9]+", "-", platform.node()) or "here"
"""Name of this machine, as files that are gone with a process are called by it."""

_TEMPORARY = re.compile(r"\..+\.[a-z]+\.(\d+)(?:@([A-Za-z0-9-]+))?")
"""Name of a temporary file: what it will be called, the process that writes it and its machine."""

_DAY_S = 86400.0


@contextmanager
def appearing(path: str | Path) -> Iterator[Path]:
    """A temporary file beside ``path`` to be written; it takes that name when all went well.

    Its name begins with a dot: readers of a folder as one data set leave it out.

    Raises
    ------
    OSError
        With the file's name, when the folder cannot be written or the disk is full.
    """
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    temporary = path.with_name(f".{path.name}.{os.getpid()}@{HOST}")
    try:
        yield temporary
        os.replace(temporary, path)
    finally:
        temporary.unlink(missing_ok=True)


def refusal(folder: Path) -> str:
    """Why nothing can be written into a folder, which is made if need be; empty where it can."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with TemporaryFile(dir=folder) as probe:
            probe.write(b"1")
    except OSError as error:
        return error.strerror or str(error)
    return ""


def cache_home() -> Path:
    """Where programs keep what they can make again, as Snakemake and Matplotlib look for it."""
    return Path(os.environ.get("XDG_CACHE_HOME") or os.path.expanduser("~/.cache"))


def project_root(start: Path) -> Path:
    """The nearest folder upwards with config/config.yaml; the start where there is none."""
    return next((one for one in (start, *start.parents) if (one / CONFIG).is_file()), start)


def cache_of_project(root: Path) -> Path:
    """Where they keep it instead if the home folder cannot be written; as in the Makefile."""
    return root / ".snakemake" / "cache"


def is_temporary(name: str) -> bool:
    """Whether `appearing` gives such names to files that are being written."""
    return _TEMPORARY.fullmatch(name) is not None


def sweep(folder: str | Path) -> int:
    """Delete temporary files that processes which are no more left below a folder; how many.

    Of another machine it is not known whether a process lives: its files stay for a day. Links are
    not followed.
    """
    swept = 0
    for place, _, names in os.walk(folder):
        for name in filter(is_temporary, names):
            path = os.path.join(place, name)
            with suppress(OSError):
                if _is_abandoned(path, name):
                    os.unlink(path)
                    swept += 1
    return swept


def _is_abandoned(path: str, name: str) -> bool:
    found = _TEMPORARY.fullmatch(name)
    assert found is not None
    if found[2] not in (None, HOST):
        return time.time() - os.lstat(path).st_mtime > _DAY_S
    try:
        os.kill(int(found[1]), 0)
    except (ProcessLookupError, OverflowError):
        return True
    except PermissionError:  # it lives, and is somebody else's
        return False
    return False


Stamp = tuple[str, int, int]
"""Name, size and time of change of a file."""


def stamp(path: str | Path) -> Stamp:
    """Name, size and time of change of a file: a key that a change of the file changes."""
    status = Path(path).stat()
    return str(path), status.st_size, status.st_mtime_ns


def is_hidden(name: str) -> bool:
    """Whether a name is that of a hidden file (``.#x``, ``._x``, ``.x.swp``) or a copy (``x~``)."""
    return name.startswith((".", "#", "~")) or name.endswith(("~", ".bak", ".tmp"))


def files_in(folder: Path, ending: str) -> list[Path]:
    """Files of a folder with that ending, in order; no hidden ones, no folders, no dead links."""
    return [path for path in _visible(folder) if path.suffix == ending and path.is_file()]


def folders_in(folder: Path) -> list[Path]:
    """Folders of a folder, in order; no hidden ones."""
    return [path for path in _visible(folder) if path.is_dir()]


def strays_in(folder: Path, ending: str) -> list[Path]:
    """What has that ending, or one like it, and is no file to be read: folders, dead links."""
    like = {ending, ".yml"}
    return [
        path
        for path in _visible(folder)
        if path.suffix.casefold() in like and (path.suffix != ending or not path.is_file())
    ]


def _visible(folder: Path) -> list[Path]:
    """What is in a folder but hidden things; nothing where there is no such folder."""
    if not folder.is_dir():
        return []
    return sorted(path for path in folder.iterdir() if not is_hidden(path.name))
