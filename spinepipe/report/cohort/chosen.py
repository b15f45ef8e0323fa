"""Which rows of the tables of a cohort study a figure shows."""

from collections.abc import Sequence

import pandas as pd

from spinepipe.report.cohort.named import ALL, ALL_BUT

NOTHING = "nothing"


def fitted_to_most(frame: pd.DataFrame) -> str:
    """The label of fits to all load cases; the only load case where a study has one."""
    labels = [name for name in dict.fromkeys(frame["fitted_to"]) if name != NOTHING]
    return ALL if ALL in labels or not labels else str(labels[0])


def single_cases(frame: pd.DataFrame) -> list[str]:
    """Load cases that stiffness was fitted to one at a time, in the order of the table."""
    return [
        str(name)
        for name in dict.fromkeys(frame["fitted_to"])
        if name not in (ALL, NOTHING) and not str(name).startswith(ALL_BUT)
    ]


def without_one_case(frame: pd.DataFrame) -> list[str]:
    """Labels of fits that left out one load case; of two load cases, those to the other."""
    labels = [str(name) for name in dict.fromkeys(frame["fitted_to"])]
    left_out = [name for name in labels if name.startswith(ALL_BUT)]
    return left_out or single_cases(frame)


def own(stiffness: pd.DataFrame, representations: Sequence[str]) -> pd.DataFrame:
    """Stiffness fitted to each specimen's own motion under all load cases."""
    fitted = stiffness["fitted_to"] == fitted_to_most(stiffness)
    return stiffness[
        fitted
        & (stiffness["source"] == "own")
        & stiffness["representation"].isin(list(representations))
    ]


def doubted(rows: pd.DataFrame) -> pd.Series:
    """Whether each stiffness is not held by the data: not identifiable, or at a bound."""
    known = rows["identifiable"].map(lambda flag: flag is None or bool(flag)).astype(bool)
    return ~known | (rows["at_bound"] != "no")
