"""Claims of one study beside each other: few specimens decide nothing, and many claims need more.

Each claim is decided by its own test first. Of some thirty that are looked at together one or two
would be decided by chance alone, so p is corrected for their number (Holm 1979).
"""

from collections.abc import Iterator, Sequence

from spinepipe.statistics import corrected
from spinepipe.studies.cohort_stiffness.claims import BY_CONSTRUCTION, DECIDED, UNDECIDED, Row
from spinepipe.tables.shared import joined

FEWEST = 3
"""Specimens that a verdict needs; the scatter of two is that of one difference."""


def together(rows: Sequence[Row], specimens: int, significance: float) -> Iterator[Row]:
    """The rows with ``p_holm``, and undecided where few specimens or all claims together say so.

    Parameters
    ----------
    specimens : in the study. significance : p below which a test decides.
    """
    tests = [None if row.get(BY_CONSTRUCTION) else row["p"] for row in rows]
    for row, p_holm in zip(rows, corrected(tests, "holm"), strict=True):
        row = row | {"p_holm": p_holm}
        why = _why_not(row, specimens, significance)
        doubted = {"holds": UNDECIDED, "message": joined(why, row["message"])}
        yield row | doubted if why and row["holds"] in DECIDED else row


def _why_not(row: Row, specimens: int, significance: float) -> str:
    """Why a claim cannot be decided, whatever its own test says."""
    n = specimens if row["specimens"] is None else row["specimens"]
    if n < FEWEST:
        return f"{n} specimen{'' if n == 1 else 's'}, and a verdict needs {FEWEST}"
    p, p_holm = row["p"], row["p_holm"]
    if p_holm is not None and p < significance <= p_holm:
        return "decided by itself, but not beside the other claims"
    return ""
