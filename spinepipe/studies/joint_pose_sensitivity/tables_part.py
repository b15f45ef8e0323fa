"""Which tables the page shows, and in what order."""

from collections.abc import Iterator

import pandas as pd

from spinepipe.report.page.results import Results
from spinepipe.report.page.significance import FOLDED, folded, in_full
from spinepipe.report.page.sortable import Sortable, sortable
from spinepipe.report.pose_against_stiffness import TREE, importance_by_factor
from spinepipe.studies import JointPoseSensitivity
from spinepipe.tables import AGAINST_GOULD_2024A, IMPORTANCE, STATISTICS, TABLES
from spinepipe.tables.schema import Column

SHOWN = {
    "counts": "Fits and filters",
    "summary": "Medians and spreads",
    "against_gould_2024a": "Beside Gould et al. 2024",
    "success_by_method": "Success by method",
    "variance_shares": "Variance shares of joint pose and stiffness",
    "importance": "Importance in the regression tree, by factor",
    "required_precision": "Landmark precision needed",
    "agreement": "Agreement of predicted and measured motion",
    "statistics": "Tests of significance",
}
"""Tables of the page in their order, with their titles."""

_BY_FACTOR = tuple(
    column
    for column in IMPORTANCE.columns
    if column.name in ("specimen", "joint", "coordinate", "factor", "leaves", "r2", "n")
)
_IMPORTANCE = (
    *_BY_FACTOR[:4],
    Column("importance", "number", "share of all predictors of this factor among all splits"),
    Column("predictors", "integer", "predictors of this factor"),
    *_BY_FACTOR[4:],
    Column("message", "text", "why there is no tree"),
)


_AGAINST_ORDER = (
    *("quantity", "unit", "paper", "paper_low", "paper_high", "ours", "ours_low", "ours_high"),
    *("verdict", "reason", "where"),
)
AGAINST_COLUMNS = tuple(
    column
    for name in _AGAINST_ORDER
    for column in AGAINST_GOULD_2024A.columns
    if column.name == name
)
"""What a reader compares stands first; the short name is left to the file."""


def shown_tables(study: JointPoseSensitivity, results: Results) -> list[Sortable]:
    """Tables that the study has, as the page shows them; those without rows are left out."""
    found = [
        table
        for name, title in SHOWN.items()
        if len(results.table(name))
        for table in _of(name, title, results.table(name), study)
    ]
    return [table for table in found if table.rows]


def _of(
    name: str, title: str, frame: pd.DataFrame, study: JointPoseSensitivity
) -> Iterator[Sortable]:
    about = TABLES[name].about
    if name == "statistics":
        yield sortable(name, title, about, in_full(frame), STATISTICS.columns)
        yield _folded(frame, study.significance)
    elif name == "importance":
        yield sortable(name, title, about, _trees(frame), _IMPORTANCE)
    elif name == AGAINST_GOULD_2024A.name:
        yield sortable(name, title, about, frame, AGAINST_COLUMNS)
    else:
        yield sortable(name, title, about, frame, TABLES[name].columns)


def _trees(importance: pd.DataFrame) -> pd.DataFrame:
    """Importance by factor, and one row with its message for each tree that could not be grown."""
    none = importance[importance["status"] != "done"].drop_duplicates(TREE)
    told = none[[*TREE, "n", "message"]]
    return pd.concat([importance_by_factor(importance), told], ignore_index=True)


def _folded(frame: pd.DataFrame, alpha: float) -> Sortable:
    about = (
        "Tests done again and again with a stiffness set or a pose held fixed: how many are "
        f"significant at {alpha:g}, and how large the effects of these are. One row per test, "
        "joint, response and factor; every single test is in statistics.parquet."
    )
    title = "Tests of significance, two factors"
    return sortable("statistics", title, about, folded(frame, alpha), FOLDED)
