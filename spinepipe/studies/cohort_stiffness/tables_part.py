"""Which tables the page of a cohort study shows, and which of their rows."""

import pandas as pd

from spinepipe.report.page.results import Results
from spinepipe.report.page.sortable import Sortable, sortable
from spinepipe.report.page.tables import AGAINST_COLUMNS
from spinepipe.report.stage_errors import joint_label_of
from spinepipe.studies.fitted_to import ALL_BUT, NOBODY
from spinepipe.tables import AGAINST_GOULD_2024B, FINDINGS, TABLES

SHOWN = {
    "findings": "Claims about the cohort, checked",
    "ranking": "Representations in order",
    "mae": "Mean absolute errors in the loaded direction",
    "pooling": "How stiffness is spread over the cohort",
    "against_gould_2024b": "Beside Gould et al. 2024b",
    "sign_checks": "Does each joint move with the load?",
    "fits": "Fits",
    "stiffness": "Stiffness fitted to all load cases",
    "statistics": "Tests of significance",
}
"""Tables of the page in their order, with their titles."""

_CLAIM_ORDER = ("statement", "holds", "value", "unit", "low", "high", "p", "quantity", "message")
_COLUMNS = {
    FINDINGS.name: tuple(c for name in _CLAIM_ORDER for c in FINDINGS.columns if c.name == name),
    AGAINST_GOULD_2024B.name: AGAINST_COLUMNS,
}
"""What a reader compares stands first; short names are left to the files."""


def shown_tables(results: Results) -> list[Sortable]:
    """Tables that the study has, as the page shows them; those without rows are left out."""
    found = []
    for name, title in SHOWN.items():
        frame = results.table(name)
        if not len(frame):
            continue
        rows, told = _rows(name, frame)
        shape = TABLES[name]
        columns = _COLUMNS.get(shape.name, shape.columns)
        found.append(sortable(name, title, f"{shape.about} {told}".strip(), rows, columns))
    return [table for table in found if table.rows]


def _rows(name: str, frame: pd.DataFrame) -> tuple[pd.DataFrame, str]:
    """Rows that the page shows, and what is said of those that it does not."""
    chosen, told = frame, ""
    if name == "stiffness":
        whole = frame["fitted_to"] == joint_label_of(frame)
        chosen, told = frame[whole & (frame["source"] == "own")], "own fits to all load cases"
    elif name == "pooling":
        chosen, told = frame[frame["without"] == NOBODY], "fits of all specimens"
    elif name in ("fits", "mae"):
        left_out = frame["fitted_to"].astype(str).str.startswith(ALL_BUT)
        chosen, told = frame[~left_out], "fits that leave no load case out"
    if len(chosen) == len(frame):
        return frame, ""
    return chosen, f"Here: {told}; the others are in {name}.parquet."
