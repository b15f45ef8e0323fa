"""One way to spoil a project, and what must be said of it."""

import os
import shutil
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from enum import Enum
from pathlib import Path

from tests.generators.spoilt.projects import Project, write


class Expected(Enum):
    """What `spinepipe check` must make of a case."""

    REFUSED = "must be refused"
    TOLD = "must be refused or warned of"
    FINE = "must pass without a word"
    OPEN = "may be right: cannot be decided from the files alone"


@dataclass(frozen=True)
class Link:
    """A symbolic link in the place of a file."""

    to: str


FOLDER = "folder"
"""In the place of a file: a folder of its name."""

GONE = None
"""In the place of a file: nothing."""

Content = bytes | Link | str | None

Changes = Mapping[str, Content]
"""What stands in the place of files, by path from the root."""


@dataclass(frozen=True)
class Case:
    """One spoilt project.

    Attributes
    ----------
    name : project, file, place and mutation.
    what : the mutation alone.
    family : what kind of mutation it is, for tables.
    file : path of what is spoilt. place : its column or dotted key, empty for all of it.
    changes : makes the files that differ from the project's.
    told_in : names of files in which it may be told, beside ``file``.
    """

    project: Project
    family: str
    what: str
    file: str
    place: str
    expected: Expected
    changes: Callable[[], Changes]
    told_in: tuple[str, ...] = ()

    @property
    def name(self) -> str:
        """A name of its own."""
        parts = (self.project.name, self.file.removeprefix("config/"), self.place, self.what)
        return " | ".join(parts)

    def lines(self) -> tuple[int, int]:
        """First and last line that differ from the sound file, as an editor counts them."""
        content = self.changes().get(self.file)
        if not isinstance(content, bytes):
            return 0, 0
        old = self.project.files.get(self.file, b"").splitlines()
        new = content.splitlines()
        first = _alike(old, new)
        last = len(new) - min(_alike(old[::-1], new[::-1]), len(new) - first)
        return first + 1, max(last, first + 1)

    def write(self, root: Path) -> Path:
        """Write the spoilt project below a folder."""
        changes = self.changes()
        write({n: c for n, c in self.project.files.items() if n not in changes}, root)
        for name, content in changes.items():
            _put(root / name, content)
        return root


def _alike(some: list[bytes], others: list[bytes]) -> int:
    """How many lines at the beginning are the same."""
    pairs = zip(some, others, strict=False)
    return next((n for n, (a, b) in enumerate(pairs) if a != b), min(len(some), len(others)))


def _put(path: Path, content: Content) -> None:
    if content is GONE:
        return
    path.parent.mkdir(parents=True, exist_ok=True)
    if isinstance(content, Link):
        path.symlink_to(content.to)
    elif isinstance(content, bytes):
        path.write_bytes(content)
    elif content == FOLDER:
        path.mkdir()
    else:
        os.mkfifo(path)


def removed(root: Path) -> None:
    """Delete what was written."""
    shutil.rmtree(root)
