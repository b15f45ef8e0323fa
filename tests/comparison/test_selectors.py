"""What selectors read from a run, row by row of `<paper>.csv`, worked by hand from `made_up`.

Columns: a change to the made-up run (see `altered`), our value and its ends, the verdict, and words
that the reason must have, parted by bars. An empty value is none.

Would catch a row of another stage, model or load case taken, an order turned round, a test read
without a result, and a number told of tables that a run does not have.
"""

import csv
from functools import cache
from pathlib import Path
from typing import Any

import pytest

from papers.engine import claims_of, judge, judged, rows_of
from papers.run import StudyRun
from spinepipe.comparison.papers import papers
from spinepipe.studies.registry import every_kind
from spinepipe.tables import from_rows
from tests.comparison.altered import altered
from tests.comparison.made_up import ASKED, run_of

PAPERS = papers()
TABLES = {table.name: table for kind in every_kind().values() for table in kind.tables}


def by_hand(paper: str) -> list[dict[str, str]]:
    with Path(__file__).with_name(f"{paper}.csv").open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


@cache
def whole(paper: str) -> tuple[dict[str, Any], ...]:
    """All rows of the made-up run."""
    return tuple(judged(claims_of(paper), StudyRun(run_of(paper), ASKED[paper])))


CASES = [
    pytest.param(paper, row, id=f"{row['id']} {row['changed'][:60]}".strip())
    for paper in PAPERS
    for row in by_hand(paper)
]


@pytest.mark.parametrize(("paper", "row"), CASES)
def test_our_value_and_what_is_told_of_it(paper: str, row: dict[str, str]) -> None:
    (claim,) = [claim for claim in claims_of(paper) if claim.id == row["id"]]
    found = judge(claim, StudyRun(*altered(run_of(paper), ASKED[paper], row["changed"])))
    ours = float(row["ours"]) if row["ours"] else None
    assert found["ours"] == (ours if ours is None else pytest.approx(ours))
    assert found["verdict"] == row["verdict"]
    if row["ends"]:
        ends = [float(end) for end in row["ends"].split(" to ")]
        assert [found["ours_low"], found["ours_high"]] == pytest.approx(ends)
    assert [words for words in row["told"].split(" | ") if words not in found["reason"]] == []


@pytest.mark.parametrize("paper", PAPERS)
def test_every_selector_is_worked_by_hand(paper: str) -> None:
    selector = {row["id"]: row["selector"] for row in rows_of(paper)}
    worked = {selector[row["id"]] for row in by_hand(paper)}
    assert {name for name in selector.values() if name} - worked <= {"number"}


@pytest.mark.parametrize(
    ("paper", "table"), [(paper, table) for paper in PAPERS for table in run_of(paper)]
)
def test_a_missing_table_is_told(paper: str, table: str) -> None:
    """Nothing but what hangs on the table changes, and its rows say what is missing."""
    rest = {name: frame for name, frame in run_of(paper).items() if name != table}
    after = judged(claims_of(paper), StudyRun(rest, ASKED[paper]))
    changed = [new for old, new in zip(whole(paper), after, strict=True) if old != new]
    less = [row for row in changed if row["ours"] is None]
    assert less or table in ("landmarks", "spread_over_landmark_sd")  # whose numbers are in notes
    assert {row["verdict"] for row in less} <= {"not_computed", "contradicted"}
    assert all(f"table {table}" in row["reason"] for row in less)


@pytest.mark.parametrize("paper", PAPERS)
def test_empty_tables_are_as_missing(paper: str) -> None:
    empty = {name: frame.iloc[:0] for name, frame in run_of(paper).items()}
    after, missing = (judged(claims_of(paper), StudyRun(run)) for run in (empty, {}))
    assert [row["ours"] for row in after] == [row["ours"] for row in missing]
    from_rows(TABLES[f"against_{paper}"], after)


@pytest.mark.parametrize("paper", PAPERS)
def test_without_a_run_nothing_is_computed_and_why_is_told(paper: str) -> None:
    rows = judged(claims_of(paper), StudyRun({}))
    given = {row["id"] for row in rows_of(paper) if row["selector"] == "number"}
    assert {row["id"] for row in rows if row["ours"] is not None} == given
    assert all(row["reason"] for row in rows)


@pytest.mark.parametrize("paper", PAPERS)
def test_where_ours_is_outside_why_is_known(paper: str) -> None:
    """Whatever a run has, a row that can be outside says what is known of the reason."""
    bare = [
        row["id"]
        for row in rows_of(paper)
        if row["selector"] not in ("", "number")
        and not (row["missing"] or row["outside"] or row["contradicted"])
    ]
    assert bare == []
