"""How many mistakes in sound files `check` tells, with the right column and the right remedy.

Kept cohort by cohort: a run that was cut off goes on.
"""

import sys
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from tempfile import TemporaryDirectory

import pandas as pd

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "cases"))

from fresh_mistakes import FRESH, LAST
from mistaken_cases import MISTAKES, Mistake
from mistaken_cohorts import (
    FRESH_COHORTS,
    REAL_SPINES,
    SHIPPED,
    SMALL,
    scores,
    there,
)

from tests.validation.kept import Kept

COHORTS = {"known": (*SMALL, *SHIPPED, *REAL_SPINES), "fresh": FRESH_COHORTS}
KINDS = {"known": MISTAKES, "fresh": FRESH, "last": LAST}
HANGS_ON = (
    *("spinepipe/**/*.py", "config/cohorts/**/*.*", "tests/generators/**/*.py"),
    *("tests/cases/*mist*.py", "tests/cases/cohort_cases.py", "tests/validation/*.py"),
)
SHARES = ("told", "column", "remedy", "alone")


def every(
    cohorts: Sequence[str] = tuple(COHORTS), kinds: Sequence[str] = tuple(KINDS)
) -> pd.DataFrame:
    """One row for each mistake in each cohort."""
    kept, rows = Kept("plausibility", HANGS_ON), []
    for group in cohorts:
        for name in filter(there, COHORTS[group]):
            for kind in kinds:
                piece = f"{group} {name} {kind}"
                if piece not in kept.known:
                    kept.add(piece, _scores(name, KINDS[kind]))
                    print(f"plausibility: {piece}, {len(kept.known[piece])}", flush=True)
                rows += [{"cohorts": group, "kinds": kind, **one} for one in kept.known[piece]]
    return pd.DataFrame(rows)


def _scores(name: str, mistakes: Sequence[Mistake]) -> list[dict[str, object]]:
    with TemporaryDirectory() as folder:
        return [asdict(one) for one in scores(name, mistakes, Path(folder))]


def table(rows: pd.DataFrame) -> pd.DataFrame:
    """Number of mistakes, and of these how many are told and how well."""
    groups = rows.groupby(["cohorts", "kinds"], sort=False)
    found = groups[list(SHARES)].sum()
    found.insert(0, "mistakes", groups.size())
    return found.reset_index()


def by_kind(rows: pd.DataFrame) -> pd.DataFrame:
    """The same for each kind of mistake."""
    groups = rows.groupby(["kinds", "mistake"], sort=False)
    found = groups[list(SHARES)].sum()
    found.insert(0, "cohorts", groups.size())
    return found.reset_index()
