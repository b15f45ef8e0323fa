"""How many mistakes in sound files `check` tells, with the right column and the right remedy."""

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

COHORTS = {"known": (*SMALL, *SHIPPED, *REAL_SPINES), "fresh": FRESH_COHORTS}
KINDS = {"known": MISTAKES, "fresh": FRESH, "last": LAST}
SHARES = ("told", "column", "remedy", "alone")


def every(
    cohorts: Sequence[str] = tuple(COHORTS), kinds: Sequence[str] = tuple(KINDS)
) -> pd.DataFrame:
    """One row for each mistake in each cohort."""
    rows = []
    for group in cohorts:
        for kind in kinds:
            for name in filter(there, COHORTS[group]):
                for one in _scores(name, KINDS[kind]):
                    rows.append({"cohorts": group, "kinds": kind, **one})
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
