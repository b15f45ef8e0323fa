"""A folder of results that are verified before they are used.

A file is ``<token>.piece``: the format's mark, a digest, then the bytes that were kept. The digest
is over token and bytes, so a file that was damaged, cut off or renamed counts as not there. Files
appear whole under their name, so nothing needs a lock: of two runs at once both may compute the
same, and the last one's file stays. Nothing is unpickled here and no link is followed.
"""

import hashlib
import logging
import re
import shutil
import stat
from collections.abc import Collection
from contextlib import suppress
from pathlib import Path

from spinepipe.files import appearing

SUFFIX = ".piece"

_OURS = b"spinepipe piece "
MARK = _OURS + b"1\n"
"""First bytes of a file; the number is that of the format."""

_NAME = re.compile(rf"([0-9a-f]{{64}}){SUFFIX}")
_TEMPORARY = re.compile(rf"\.[0-9a-f]{{64}}{SUFFIX}\.\d+(@[A-Za-z0-9-]+)?")
"""What `appearing` leaves when the process is killed, see `spinepipe.files`."""

_OLD_PLACE, _OLD_ENTRY = re.compile(r"[0-9a-f]{64}"), re.compile(r"hashes|python-\w+(\.lock)?")
"""Folders in which pydra once pickled the results, and what lies in them."""

_log = logging.getLogger(__name__)


class Kept:
    """Bytes by token (64 hex digits) in one folder, which may be deleted at any time.

    A folder that is a link is used, but nothing is ever deleted behind it.
    """

    def __init__(self, folder: Path) -> None:
        """The folder need not exist.

        Raises
        ------
        NotADirectoryError
            For a file, or a link to nothing.
        """
        if (folder.exists() or folder.is_symlink()) and not folder.is_dir():
            raise NotADirectoryError(f"{folder} is no folder; remove it, nothing is lost by that")
        self._folder = folder

    def read(self, token: str) -> bytes | None:
        """What was kept under the token; None where nothing is, or not what was written."""
        path = self._path(token)
        if not _is_file(path):
            return None
        try:
            return _verified(token, path.read_bytes())
        except FileNotFoundError:
            return None
        except (_Damaged, OSError) as trouble:
            _log.warning("%s: %s; it is computed again and replaced", path, trouble)
            return None

    def write(self, token: str, data: bytes) -> None:
        """Keep the bytes, in place of what is there.

        Raises
        ------
        OSError
            With the file's name, when the folder cannot be written or the disk is full.
        """
        try:
            with appearing(self._path(token)) as temporary:
                temporary.write_bytes(MARK + _digest(token, data) + b"\n" + data)
        except (FileNotFoundError, IsADirectoryError) as trouble:  # swept by another run just now
            _log.warning("%s is not kept: %s", self._path(token), trouble)

    def sweep(self, wanted: Collection[str]) -> None:
        """Delete what a store has written here and nobody wants; nothing behind a link."""
        if self._folder.is_symlink():
            _log.warning("%s is a link: old pieces there are not deleted", self._folder)
            return
        for path in self._folder.iterdir() if self._folder.is_dir() else ():
            name = _NAME.fullmatch(path.name)
            if (name and name[1] not in wanted) or _TEMPORARY.fullmatch(path.name):
                if _is_file(path) and _was_written_here(path):
                    with suppress(OSError):
                        path.unlink()
            elif _OLD_PLACE.fullmatch(path.name) and _is_old_place(path):
                shutil.rmtree(path, ignore_errors=True)

    def _path(self, token: str) -> Path:
        return self._folder / f"{token}{SUFFIX}"


class _Damaged(Exception):
    """Why a file's bytes are not those that were kept."""


def _verified(token: str, content: bytes) -> bytes:
    if not content.startswith(MARK):
        raise _Damaged("it does not begin as a piece of this version does")
    start = len(MARK) + 64
    digest, data = content[len(MARK) : start], content[start + 1 :]
    if content[start : start + 1] != b"\n" or digest != _digest(token, data):
        raise _Damaged("its bytes are not those that were written")
    return data


def _digest(token: str, data: bytes) -> bytes:
    found = hashlib.sha256(token.encode())
    found.update(data)
    return found.hexdigest().encode()


def _is_file(path: Path) -> bool:
    """Whether there is a file under that very name, not behind a link."""
    try:
        return stat.S_ISREG(path.lstat().st_mode)
    except FileNotFoundError:
        return False


def _was_written_here(path: Path) -> bool:
    """Whether a file begins as pieces of any version do, as far as it goes."""
    try:
        with path.open("rb") as file:
            return _OURS.startswith(file.read(len(_OURS)))
    except OSError:
        return False


def _is_old_place(path: Path) -> bool:
    """Whether a folder holds nothing but what pydra once kept in it for the store."""
    try:
        return stat.S_ISDIR(path.lstat().st_mode) and all(
            _OLD_ENTRY.fullmatch(entry.name) and not entry.is_symlink() for entry in path.iterdir()
        )
    except OSError:  # another run has removed it
        return False
