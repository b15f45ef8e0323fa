"""`spinepipe check --results`: result files that are not as they were written are told and removed.

A run asks the files that it needs; this asks all, also job files whose rows are in a table already.
What is removed is computed again by the next run.
"""

import os
from collections.abc import Iterator
from pathlib import Path

from spinepipe.files import is_temporary
from spinepipe.marks import read_mark
from spinepipe.report.words import count

_MARKED = (".parquet", ".json", ".yaml", ".svg", ".png", ".html", ".osim", ".mot", ".csv")
_UNMARKED = ("datapackage.json",)


def run(root: Path, names: list[str]) -> int:
    """Remove damaged result files of these studies, of all where none is named; 1 if there are."""
    results = root / "results"
    folders = [results / name for name in names] or sorted(
        path for path in results.glob("*") if path.is_dir()
    )
    damaged, sound = [], 0
    for path in (path for folder in folders for path in _files(folder)):
        if read_mark(path):
            sound += 1
        else:
            damaged.append(path)
    for path in damaged:
        path.unlink()
        shown = path.relative_to(root).as_posix()
        print(f"FAIL  {shown}: damaged, cut off, empty or of an older version; removed")
    print(f"{count(sound, 'result file')} as written, {len(damaged)} removed.")
    if damaged:
        print("`snakemake all` computes them again.")
    return 1 if damaged else 0


def _files(folder: Path) -> Iterator[Path]:
    """Files that carry a mark when they are whole; links are not followed."""
    for place, _, files in os.walk(folder):
        for name in sorted(files):
            path = Path(place, name)
            known = path.suffix in _MARKED and name not in _UNMARKED
            if known and not is_temporary(name) and not path.is_symlink():
                yield path
