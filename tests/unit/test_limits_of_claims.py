"""What it takes to be inside a range of a paper, worked out anew from the rows themselves.

Catches a claim called true or false on the wrong side of its limit.
"""

import csv
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pandas as pd
import pytest
from sweeps import sweep

from papers.engine import Claim, Evidence, claims_of, judge
from papers.ranges import Limit, Range, factor_of_two
from papers.run import Computed, NotComputed, StudyRun
from spinepipe.comparison import papers
from spinepipe.studies.tracking.tables import AGAINST_WANG_2021
from tests.validation import comparisons
from tests.validation.comparisons import LIMITS, OTHERS

ROOT = Path(__file__).parents[2]
PAPERS = papers.papers()
NOTHING = StudyRun({}, {"failed_when": "all"})

NO_OTHER_NUMBER = (
    *(f"joint_orientation.reduced.{joint}.extension.iqr" for joint in ("L1L2", "L2L3", "L3L4")),
    *(f"reduced_against_complete.extension_iqr_drop.{joint}" for joint in ("L1L2", "L3L4")),
)
"""A19: a column that is probably a copy, in whose place nothing else is printed."""


def by_hand(row: Mapping[str, Any]) -> str:
    """The kind of limit from the two ends and the words of the row."""
    low, high = row["paper_low"], row["paper_high"]
    ends = [end for end in (low, high) if end is not None]
    if len(ends) < 2:
        return "one_sided" if ends else "none"
    if low == high:
        return "binary"
    across_zero = low < 0.0 < high
    if not across_zero and max(abs(low), abs(high)) / 4.0 >= min(abs(low), abs(high)):
        return "wide"
    what = row["reason"].split(";")[0]
    if what.startswith("range: borrowed"):
        return "borrowed"
    return "chosen" if "chosen here" in what else "two_sided"


@sweep("paper", PAPERS)
def test_limit_follows_from_the_row(paper: str) -> None:
    rows = [judge(claim, NOTHING) for claim in claims_of(paper)]
    compared = [row for row in rows if row["verdict"] != "contradicted"]  # tells no range
    assert {row["id"]: row["limit"] for row in compared} == {
        row["id"]: by_hand(row) for row in compared
    }


def test_a_tolerance_of_another_number_is_borrowed() -> None:
    """The paper's error over all tasks, and how far apart two of its persons are."""
    rows = [judge(claim, NOTHING) for claim in claims_of("ghezelbash_2016")]
    borrowed = ("paper's RMSE over its tasks", "two persons of Fig 9 differ")
    found = [row for row in rows if any(words in row["reason"] for words in borrowed)]
    assert len(found) == 35
    assert {row["limit"] for row in found} == {"borrowed"}


@sweep("paper", PAPERS)
def test_a_sign_alone_is_never_called_contradicted(paper: str) -> None:
    """Where the paper's sign is known, ours agrees with it or does not."""
    signs = [claim for claim in claims_of(paper) if 0.0 in (claim.range.low, claim.range.high)]
    hidden = [one.id for one in signs if one.range.limit is Limit.ONE_SIDED and one.contradicted]
    assert hidden == []


@sweep("paper", PAPERS)
def test_a_contradicted_number_of_a_run_is_compared_with_all_that_is_printed(paper: str) -> None:
    for claim in claims_of(paper):
        if not claim.contradicted or claim.also or claim.id in NO_OTHER_NUMBER:
            continue
        try:
            claim.ours(NOTHING)  # the paper's own other number, of no run
        except NotComputed:
            pytest.fail(f"{claim.id}: our value is not held against the paper's other numbers")


@sweep("value, verdict", [(1.0, "contradicted"), (20.0, "contradicted"), (5.0, "outside")])
def test_ours_outside_all_that_the_paper_prints_disagrees(value: float, verdict: str) -> None:
    """Printed are 1 (0.5 to 2) and 20 (10 to 40)."""
    claim = Claim(
        *("a", "Table 1", "something", "mm", 1.0, factor_of_two(1.0)),
        ours=lambda run: Computed(value),
        evidence=Evidence.CONTRADICTED,
        outside="for a reason",
        contradicted="A1: 1 is not 20",
        also=(factor_of_two(20.0),),
    )
    row = judge(claim, NOTHING)
    assert row["verdict"] == verdict
    assert "A1: 1 is not 20" in row["reason"]


@sweep(
    "low, high, chosen, limit",
    [
        (1.0, 2.0, False, "two_sided"),
        (1.0, 2.0, True, "chosen"),
        (1.0, 4.0, True, "wide"),
        (1.0, 3.99, False, "two_sided"),
        (0.0, 3.0, False, "wide"),
        (-4.0, -1.0, False, "wide"),
        (-1.0, 3.0, False, "two_sided"),
        (2.0, None, False, "one_sided"),
        (None, 2.0, True, "one_sided"),
        (2.0, 2.0, False, "binary"),
        (None, None, False, "none"),
    ],
)
def test_kinds_of_limits(low: float | None, high: float | None, chosen: bool, limit: str) -> None:
    assert Range(low, high, "a range", chosen).limit == limit
    weaker = "borrowed" if limit in ("chosen", "two_sided") else limit
    assert Range(low, high, "a range", chosen, borrowed=True).limit == weaker


def test_the_schema_knows_every_limit() -> None:
    assert tuple(limit.value for limit in Limit) == AGAINST_WANG_2021.column("limit").allowed


# --- counts that documents tell -------------------------------------------------------------------

COUNTS = ROOT / "tests" / "validation" / "results" / "comparisons.csv"


def counted() -> dict[str, dict[str, int]]:
    with COUNTS.open() as file:
        return {
            row["study"]: {key: int(row[key]) for key in row if key not in ("study", "paper")}
            | {"claims": len(claims_of(row["paper"]))}
            for row in csv.DictReader(file)
        }


def test_counts_are_of_all_claims_and_add_up() -> None:
    for study, row in counted().items():
        assert row["rows"] == row["claims"], study
        assert row["inside"] == sum(row[key] for key in row if key.startswith("inside_")), study
        assert row["rows"] == row["inside"] + sum(row.get(name, 0) for name in OTHERS), study


def test_documents_tell_the_counts() -> None:
    found = counted()["t12s1_as_published"]
    words = " ".join((ROOT / "docs" / "studies" / "cohort_stiffness.md").read_text().split())
    assert (
        f"of {found['rows']} rows the study as published is inside for {found['inside']}, of which "
        f"{found['inside_two_sided']} lie in a range with two ends whose width the paper gives, "
        f"and outside for {found['outside']} "
    ) in words


@sweep("study", ["l1l4_joint_pose", "t12s1_as_published"])
def test_counts_by_hand_where_the_study_was_run(study: str) -> None:
    paths = sorted((ROOT / "results" / study).glob("against_*.parquet"))
    if not paths:
        pytest.skip(f"study {study} was not run here")
    rows = pd.read_parquet(paths[0]).to_dict("records")
    numbers = ("paper_low", "paper_high")
    plain = [row | {n: None if pd.isna(row[n]) else row[n] for n in numbers} for row in rows]
    inside = [by_hand(row) for row in plain if row["verdict"] == "inside"]
    assert {one: inside.count(one) for one in LIMITS} == {
        one: counted()[study].get(f"inside_{one}", 0) for one in LIMITS
    }


def test_a_table_is_counted_by_verdict_and_limit(tmp_path: Path) -> None:
    (tmp_path / "a").mkdir()
    rows = [("inside", "wide"), ("inside", "binary"), ("outside", "wide"), ("circular", "binary")]
    rows += [("inside", "borrowed"), *[("undecided", "one_sided")] * 2]
    frame = pd.DataFrame(rows, columns=["verdict", "limit"])
    frame.to_parquet(tmp_path / "a" / "against_b.parquet")
    (row,) = comparisons.table(tmp_path).to_dict("records")
    assert (row["study"], row["paper"], row["rows"], row["inside"]) == ("a", "b", 7, 3)
    assert (row["inside_wide"], row["inside_binary"], row["inside_two_sided"]) == (1, 1, 0)
    assert (row["outside"], row["circular"], row["not_computed"]) == (1, 1, 0)
    assert (row["inside_borrowed"], row["inside_one_sided"], row["undecided"]) == (1, 0, 2)
