"""Which rows of the tables of a cohort study a figure shows."""

from collections.abc import Sequence

import pandas as pd

from spinepipe.report.stage_errors import joint_label_of


def own(stiffness: pd.DataFrame, representations: Sequence[str]) -> pd.DataFrame:
    """Stiffness fitted to each specimen's own motion under all load cases."""
    fitted = stiffness["fitted_to"] == joint_label_of(stiffness)
    return stiffness[
        fitted
        & (stiffness["source"] == "own")
        & stiffness["representation"].isin(list(representations))
    ]


def doubted(rows: pd.DataFrame) -> pd.Series:
    """Whether each stiffness is not held by the data: not identifiable, or at a bound."""
    known = rows["identifiable"].map(lambda flag: flag is None or bool(flag)).astype(bool)
    return ~known | (rows["at_bound"] != "no")
