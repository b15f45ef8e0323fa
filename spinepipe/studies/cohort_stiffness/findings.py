"""Job: what the study says to the findings of Gould et al. 2024b, each with its number.

Each claim is decided by its own test first: yes, no, or undecided. Of some thirty that are looked
at together, at a significance of 0.05, one or two would be decided by chance alone. So p is
corrected for their number (Holm 1979 with Shaffer 1986), of a no as of a yes, and a claim that the
corrected p does not decide is undecided. So is one with fewer than `FEWEST` specimens.

A claim has up to two p. ``p`` tests that there is no effect: if small, there is one. ``p_no`` tests
that the effect is large enough to matter: if small, it surely is not. A claim without ``p_no`` has
its no by ``p`` as well, where the effect has the other sign. Claims about load cases may have a no
by size alone, without a test; nothing is corrected there, and it stays.
"""

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence

import pandas as pd

from spinepipe.jobs.digest import provenance
from spinepipe.jobs.inputs import study_of_kind
from spinepipe.status import joined
from spinepipe.studies.cohort_stiffness.claims import (
    BY_CONSTRUCTION,
    BY_SIZE,
    CIRCULAR,
    DECIDED,
    FEWEST,
    UNDECIDED,
    Row,
)
from spinepipe.studies.cohort_stiffness.claims_of_errors import error_findings, error_spreads
from spinepipe.studies.cohort_stiffness.claims_of_stiffness import (
    load_case_findings,
    stiffness_spreads,
)
from spinepipe.studies.cohort_stiffness.settings import CohortStiffness
from spinepipe.studies.cohort_stiffness.tables import FINDINGS
from spinepipe.tables import from_rows, read_frames, write

PUT_IN = ("stiffness_differs_between_", "literature_overpredicts_", "wrong_level_ratio_")
"""How claims begin that are about the stiffness that was put into a made-up cohort."""

MADE_UP = "put in: nobody was measured, the cohort is made up"


def run(root: str, study: str, tables: list[str], output: str) -> None:
    """Write ``findings.parquet``."""
    settings, cohort = study_of_kind(CohortStiffness, root, study)
    rows = list(finding_rows(read_frames(tables), settings.significance))
    if cohort.made_up:
        rows = [mark_circular(row) for row in rows]
    origin = provenance("findings", settings, cohort)
    write(from_rows(FINDINGS, rows), output, origin)


def finding_rows(frames: Mapping[str, pd.DataFrame], significance: float) -> Iterator[Row]:
    """Rows of the table ``findings``.

    Parameters
    ----------
    frames : tables ``stiffness``, ``errors``, ``statistics``, and ``pooling`` where there is one.
    significance : p below which a test decides.
    """
    stiffness, errors, statistics = (frames[n] for n in ("stiffness", "errors", "statistics"))
    by_themselves = (
        *error_findings(errors, significance),
        *load_case_findings(stiffness, errors, statistics, significance),
        *stiffness_spreads(stiffness, frames.get("pooling"), significance),
        *error_spreads(statistics, significance),
    )
    yield from decide_together(by_themselves, stiffness["specimen"].nunique(), significance)


def mark_circular(row: Row) -> Row:
    """The row in a made-up cohort: that stiffness is as it was drawn is no finding.

    A yes of a claim that is about that (`PUT_IN`) is called circular; all other rows stay.
    """
    if row["holds"] != "yes" or not str(row["finding"]).startswith(PUT_IN):
        return row
    return row | {"holds": CIRCULAR, "message": joined(MADE_UP, row["message"])}


def decide_together(rows: Sequence[Row], specimens: int, significance: float) -> Iterator[Row]:
    """The rows with ``p_holm``, and undecided where few specimens or all claims together say so.

    Parameters
    ----------
    rows : claims, each decided by its own test.
    specimens : in the study, for rows that do not say how many theirs are.
    significance : p below which a test decides.
    """
    for row, p_holm in zip(rows, _corrected(rows), strict=True):
        row = row | {"p_holm": p_holm}
        why = _why_not(row, specimens, significance)
        # only a yes or a no is taken back; what is circular or was not asked stays
        doubted = {"holds": UNDECIDED, "message": joined(why, row["message"])}
        yield row | doubted if why and row["holds"] in DECIDED else row


def _corrected(rows: Sequence[Row]) -> list[float | None]:
    """The deciding p of each row, corrected for all claims; None where no test decided.

    A claim may have two tests, and so two null hypotheses: no effect, and one that matters. At most
    one of the two is true, so a claim counts once. From the smallest p on, each is multiplied by
    the number of claims that still have an untested hypothesis, its own among them, and is not
    below the one before (Holm 1979, with Shaffer 1986, doi 10.1080/01621459.1986.10478341). A claim
    of two tests stays in that number until both are done. With one test each it is Holm's method.
    Claims that are circular by construction are no tests and do not count.
    """
    tests = [
        (row[name], place, name)
        for place, row in enumerate(rows)
        for name in _TESTS
        if row[name] is not None and not row.get(BY_CONSTRUCTION)
    ]
    # Step down from the smallest p. A claim, known by its place, is open as long as one of its
    # tests is.
    open_tests = Counter(place for _, place, _ in tests)
    reached, found = 0.0, {}
    for p, place, name in sorted(tests):
        reached = max(reached, min(1.0, len(open_tests) * p))
        found[place, name] = reached
        open_tests[place] -= 1
        open_tests += Counter()  # drops what has none left
    return [
        None if row.get(BY_SIZE) else found.get((place, _deciding(row)))
        for place, row in enumerate(rows)
    ]


_TESTS = ("p", "p_no")
"""Columns of the two tests: of no effect, and of an effect that matters."""


def _deciding(row: Row) -> str:
    """Which test of a row decides: that of its verdict, else the one of smaller p.

    A yes is by ``p``. A no is by ``p_no`` where the claim has that test, else by ``p``.
    """
    p, p_no = (row[name] for name in _TESTS)
    if p_no is None or row["holds"] == "yes":
        return "p"
    return "p_no" if row["holds"] == "no" or p is None or p_no < p else "p"


def _why_not(row: Row, specimens: int, significance: float) -> str:
    """Why a claim cannot be decided, whatever its own test says; empty if nothing is against it."""
    n = specimens if row["specimens"] is None else row["specimens"]
    if n < FEWEST:
        return f"{n} specimen{'' if n == 1 else 's'}, and a verdict needs {FEWEST}"
    p, p_holm = row[_deciding(row)], row["p_holm"]
    if p is not None and p_holm is not None and p < significance <= p_holm:
        return "decided by itself, but not beside the other claims"
    return ""
