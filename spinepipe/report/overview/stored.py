"""What the folder of a study's results says of it: its conclusions, its age, its size, failed jobs.

Nothing is computed and no mark is worked out: a look at a dozen studies takes less than a second.
"""

import os
from collections.abc import Iterator
from dataclasses import dataclass
from datetime import UTC, date, datetime
from math import floor, isfinite, log10
from pathlib import Path
from typing import Any

import pandas as pd

from spinepipe.report.words import number, rounded_to
from spinepipe.tables import read_frame

CONCLUSIONS = "conclusions"
"""The table of what a study concludes, in ``results/<study>``, whatever its kind."""

PAGES = ("report.html", "full.html")


@dataclass(frozen=True)
class StoredValue:
    """A number of a conclusion; ends of its interval are None where open or not known."""

    value: float
    unit: str
    low: float | None
    high: float | None

    def __str__(self) -> str:
        """Number, interval, unit: two digits of the half-width, else two; counts have all."""
        unit = "" if not self.unit else self.unit if self.unit == "°" else f"\u00a0{self.unit}"
        if self.low is not None and self.high is not None and self.high > self.low:
            last = floor(log10(0.5 * (self.high - self.low))) - 1
            value, low, high = (rounded_to(one, last) for one in (self.value, self.low, self.high))
            return f"{value} ({low} to {high}){unit}"
        whole = self.value.is_integer() and abs(self.value) < 1e6
        value = rounded_to(self.value, 0) if whole else number(self.value, 2)
        ends = (("above", self.low), ("below", self.high))
        known = [f" ({side} {number(end, 2)})" for side, end in ends if end is not None]
        return f"{value}{known[0] if len(known) == 1 else ''}{unit}"


@dataclass(frozen=True)
class StoredConclusion:
    """A sentence of a page with its numbers by name.

    Attributes
    ----------
    place : answer, key, depends, finding, light or methods. rule : what came to it.
    verdict : what the rule came to; of a light it begins with ok, check or stop.
    """

    place: str
    rule: str
    verdict: str
    text: str
    values: dict[str, StoredValue]

    @property
    def level(self) -> str:
        """Of a light: ok, check or stop."""
        return self.verdict.partition("_")[0]


def stored_conclusions(folder: Path) -> tuple[StoredConclusion, ...]:
    """The conclusions of a study in the order of its page; none where none were stored.

    Raises
    ------
    DamagedFile
        Where the table is not as it was written.
    """
    path = folder / f"{CONCLUSIONS}.parquet"
    if not path.is_file():
        return ()
    rows = read_frame(path).sort_values("order", kind="stable")
    return tuple(_conclusion(of) for _, of in rows.groupby("order", sort=True))


def _conclusion(rows: pd.DataFrame) -> StoredConclusion:
    """One sentence: a row for each of its numbers, or one that has none."""
    first = rows.iloc[0]
    values = {
        str(row["name"]): StoredValue(
            float(row["value"]), row["unit"] or "", _end(row["low"]), _end(row["high"])
        )
        for _, row in rows.iterrows()
        if pd.notna(row["value"])
    }
    place, rule, verdict, text = (str(first[key]) for key in ("place", "rule", "verdict", "text"))
    return StoredConclusion(place, rule, verdict, text, values)


def _end(cell: Any) -> float | None:
    return float(cell) if pd.notna(cell) and isfinite(cell) else None


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
        if path.suffix == ".parquet" and path.stem != CONCLUSIONS:
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
