"""`python -m tests.validation.discrepancy.paired NEW OLD`: two searches on the same cohorts.

Each folder holds rows as `run.run` writes them. Told are the differences in percentage points, with
95 % intervals over the cohorts that both have scored.
"""

import json
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from tests.validation.discrepancy.judged import judged

Rows = Mapping[str, dict[str, Any]]


def rows_of(folder: Path) -> Rows:
    """By the names of their files, which are those of the recipes."""
    return {path.name: json.loads(path.read_text()) for path in sorted(folder.glob("*.json"))}


def answer(row: dict[str, Any]) -> str:
    """What a row's answer is worth (`Judged.answer`); a search that failed has none."""
    return judged(row).answer if row["status"] in ("scored", "refused") else "fail"


def main(new: str, old: str) -> None:
    """Print the differences."""
    after, before = rows_of(Path(new)), rows_of(Path(old))
    both = [name for name in after if name in before and after[name]["status"] != "no data"]
    aliens = [name for name in both if after[name]["target"]["kind"] == "alien"]
    for words, names in (("all cohorts", both), ("in no list", aliens)):
        for what, worth in (("right or in the set", ("yes", "set")), ("wrong name", ("WRONG",))):
            pairs = np.array(
                [[answer(rows[n]) in worth for rows in (after, before)] for n in names], dtype=float
            )
            apart = pairs[:, 0] - pairs[:, 1]
            mean, error = apart.mean(), 1.96 * apart.std(ddof=1) / np.sqrt(len(apart))
            print(
                f"{words}, {what}: {pairs[:, 0].sum():.0f} and {pairs[:, 1].sum():.0f} of "
                f"{len(names)}; {100 * mean:+.1f} points ({100 * (mean - error):+.1f} to "
                f"{100 * (mean + error):+.1f})"
            )


if __name__ == "__main__":
    main(*sys.argv[1:])
