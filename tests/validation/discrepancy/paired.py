"""`python -m tests.validation.discrepancy.paired NEW OLD`: two searches on the same cohorts.

Each folder holds rows as `run.run` writes them. Told are the differences in percentage points, with
95 % intervals over the cohorts that both have scored.
"""

import json
import sys
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from tests.validation.discrepancy.judged import Judged, judged

Rows = Mapping[str, dict[str, Any]]


def rows_of(folder: Path) -> Rows:
    """By the names of their files, which are those of the recipes."""
    return {path.name: json.loads(path.read_text()) for path in sorted(folder.glob("*.json"))}


def right(row: dict[str, Any]) -> bool:
    """Right or in the set; of what has no name, and of mistakes, that none is said for sure."""
    one = _judged(row)
    if one is None or one.wrong_name:
        return False
    if one.kind in ("alien", "mistake"):
        return one.verdict in ("UNKNOWN", "PART", "REFUSED")
    return one.top1 or one.truth_in_set or (not one.truth and one.verdict == "NULL")


def wrong(row: dict[str, Any]) -> bool:
    """A name that is said for sure and is not true."""
    one = _judged(row)
    return one is not None and one.wrong_name


def _judged(row: dict[str, Any]) -> Judged | None:
    return judged(row) if row["status"] in ("scored", "refused") else None


def main(new: str, old: str) -> None:
    """Print the differences."""
    after, before = rows_of(Path(new)), rows_of(Path(old))
    both = [name for name in after if name in before and after[name]["status"] != "no data"]
    aliens = [name for name in both if after[name]["target"]["kind"] == "alien"]
    for words, names in (("all cohorts", both), ("in no list", aliens)):
        counts: tuple[tuple[str, Callable[[dict[str, Any]], bool]], ...]
        counts = (("right or in the set", right), ("wrong name", wrong))
        for what, count in counts:
            pairs = np.array([(count(after[n]), count(before[n])) for n in names], dtype=float)
            apart = pairs[:, 0] - pairs[:, 1]
            mean, error = apart.mean(), 1.96 * apart.std(ddof=1) / np.sqrt(len(apart))
            print(
                f"{words}, {what}: {pairs[:, 0].sum():.0f} and {pairs[:, 1].sum():.0f} of "
                f"{len(names)}; {100 * mean:+.1f} points ({100 * (mean - error):+.1f} to "
                f"{100 * (mean + error):+.1f})"
            )


if __name__ == "__main__":
    main(*sys.argv[1:])
