"""What the folder of a study's results says of it: its conclusions, its age, its size, failed jobs.

Nothing is computed and no mark is worked out: a look at a dozen studies takes less than a second.
"""

import os
from collections.abc import Iterator
from dataclasses import dataclass
from datetime import UTC, date, datetime
from pathlib import Path

from spinepipe.report.conclusions import Told, read_back
from spinepipe.studies.tables import CONCLUSIONS
from spinepipe.tables import read_frame

PAGES = ("report.html", "full.html")


def stored_conclusions(folder: Path) -> tuple[Told, ...]:
    """The conclusions of a study in the order of its page; none where none were stored.

    Raises
    ------
    DamagedFile
        Where the table is not as it was written.
    """
    path = folder / f"{CONCLUSIONS.name}.parquet"
    if not path.is_file():
        return ()
    return tuple(read_back(read_frame(path)))


@dataclass(frozen=True)
class Failure:
    """Jobs that failed since the page was made.

    Attributes
    ----------
    log : of the first one, by name, from the folder of results. why : its first line.
    count : how many jobs.
    """

    log: Path
    why: str
    count: int


@dataclass(frozen=True)
class StoredFiles:
    """Files of a study.

    Attributes
    ----------
    bytes : of all together. newest : day (UTC) of the youngest table; None without tables.
    page : whether there is a report. failure : of jobs, none where a page is younger.
    """

    bytes: int
    newest: date | None
    page: bool
    failure: Failure | None


def stored_files(folder: Path) -> StoredFiles:
    """Look through the folder of a study's results, ``results/<study>``."""
    size, newest, failed = 0, 0.0, []
    for path, state in _files(folder):
        size += state.st_size
        if path.suffix == ".parquet" and path.stem != CONCLUSIONS.name:
            newest = max(newest, state.st_mtime)
        if path.suffix == ".log" and state.st_size:  # of jobs that went well they are empty
            failed.append((path, state.st_mtime))
    pages = [path.stat().st_mtime for name in PAGES if (path := folder / name).is_file()]
    logs = sorted(path for path, at in failed if at > max(pages, default=0.0))
    return StoredFiles(
        bytes=size,
        newest=datetime.fromtimestamp(newest, UTC).date() if newest else None,
        page=(folder / PAGES[0]).is_file(),
        failure=Failure(logs[0].relative_to(folder.parent), _first_line(logs[0]), len(logs))
        if logs
        else None,
    )


def _files(folder: Path) -> Iterator[tuple[Path, os.stat_result]]:
    """All that is there, while a run may be at work; links are not followed."""
    for place, _, names in os.walk(folder):
        for path in (Path(place, name) for name in names):
            try:
                yield path, path.lstat()
            except FileNotFoundError:
                continue


def _first_line(log: Path) -> str:
    with log.open(encoding="utf-8", errors="replace") as file:
        return file.readline().strip()
