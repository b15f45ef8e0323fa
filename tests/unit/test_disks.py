"""Disks that take no more: what was there stays, nothing half is left, and a sentence says so.

Catches half a file, or a lost old one, where the disk takes no more.
"""

import errno
import resource
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest
from sweeps import sweep

from spinepipe.jobs.pool import _explain, _Failure
from spinepipe.marks import write_marked
from spinepipe.schema import Column, Table
from spinepipe.studies.discrepancy.store import _compute
from spinepipe.tables import to_arrow, write

TABLE = Table("small", "A table.", ("n",), (Column("n", "integer", "n"),))
MARK = "0123456789abcdef" * 4
ROOM = 3000
"""Bytes that a file may have."""


@contextmanager
def short_of_room() -> Iterator[None]:
    """The system itself refuses all bytes of a file beyond so many."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (ROOM, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)


def table(path: Path, size: int) -> None:
    write(to_arrow(TABLE, {"n": np.arange(size)}), path, {"seed": "1"})


def text(path: Path, size: int) -> None:
    write_marked("x" * size, path, MARK)


def piece(path: Path, size: int) -> None:
    _compute(path, str.ljust, ("x", size))


WRITERS: dict[str, Callable[[Path, int], None]] = {
    "rows.parquet": table,
    "report.html": text,
    "figure.svg": text,
    "model.yaml": text,
    f"{MARK}.piece": piece,
}


@sweep("name", WRITERS)
def test_a_file_that_does_not_fit_is_not_written_at_all(tmp_path: Path, name: str) -> None:
    path, writer = tmp_path / name, WRITERS[name]
    writer(path, 10)
    before = path.read_bytes()
    assert len(before) < ROOM
    with short_of_room(), pytest.raises(OSError, match=r"\S") as refused:
        writer(path, 2 * ROOM)
    assert refused.value.errno == errno.EFBIG
    assert path.read_bytes() == before
    assert list(tmp_path.iterdir()) == [path]


@sweep(
    "number, words",
    [
        (errno.ENOSPC, "no space is left on the disk of results/small; free some space"),
        (errno.EDQUOT, "your disk quota is used up in results/small; free some space"),
        (errno.EFBIG, "a file in results/small is larger than allowed here; raise the limit"),
        (errno.EACCES, "no permission to use results/small; change its permissions"),
        (errno.EROFS, "results/small is on a read-only disk; run from a folder that can"),
        (errno.ENOENT, "results/small is gone: it, or its folder, was removed while the run"),
    ],
)
def test_each_refusal_is_one_sentence_with_what_to_do(number: int, words: str) -> None:
    said = _explain(_Failure("OSError: [Errno] ...", "trace", number), "results/small")
    assert words in said
    assert "un the same command again" in said
    assert "Errno" not in said
    assert "\n" not in said
