"""Which seeds were scored by which code: those once looked at are never scored again.

``scored_seeds.csv`` is kept with the tests. Seeds below 20000 were looked at while the search was
made, those from 20000 to 29999 are for tuning (`tune.py`), scored ones start at 30000.
"""

import csv
from dataclasses import astuple, dataclass, fields
from datetime import date
from pathlib import Path

TUNING = (20000, 30000)
"""Seeds for looking at while the search is changed: from, and below."""

LIST = Path(__file__).with_name("scored_seeds.csv")


@dataclass(frozen=True)
class Range:
    """Seeds first to last that were scored by a code, by its digest."""

    first: int
    last: int
    code: str
    day: str


def ranges(path: Path = LIST) -> list[Range]:
    """All that were ever scored."""
    with path.open(encoding="utf-8", newline="") as file:
        return [
            Range(int(row["first"]), int(row["last"]), row["code"], row["day"])
            for row in csv.DictReader(file)
        ]


def first_seed(code: str, path: Path = LIST) -> int:
    """Where the seeds of this code start; the next fresh one if it has none yet."""
    for one in ranges(path):
        if one.code == code:
            return one.first
    return max([TUNING[1] - 1, *(one.last for one in ranges(path))]) + 1


def claim(code: str, first: int, last: int, path: Path = LIST) -> None:
    """Note down that these seeds are scored by this code."""
    if any(one.code == code for one in ranges(path)):
        return
    with path.open("a", encoding="utf-8", newline="") as file:
        row = astuple(Range(first, last, code, date.today().isoformat()))
        csv.writer(file, lineterminator="\n").writerow(row)


COLUMNS = tuple(one.name for one in fields(Range))
