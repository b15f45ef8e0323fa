"""What it takes to be inside a range of a paper, worked out anew from the rows themselves.

Catches a claim called true or false on the wrong side of its limit.
"""

import csv
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pandas as pd
import pytest
from spinepipe.report.page.document import judged as told
from sweeps import sweep

from papers.engine import Claim, Evidence, claims_of, judge
from papers.ranges import Limit, Range, factor_of_two
from papers.run import Computed, NotComputed, StudyRun
from spinepipe.comparison import papers
from spinepipe.studies.tracking.tables import AGAINST_WANG_2021
from tests.validation import comparisons

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
    return "chosen" if "chosen here" in row["reason"].split(";")[0] else "two_sided"


@sweep("paper", PAPERS)
def test_limit_follows_from_the_row(paper: str) -> None:
    rows = [judge(claim, NOTHING) for claim in claims_of(paper)]
    compared = [row for row in rows if row["verdict"] != "contradicted"]  # tells no range
    assert {row["id"]: row["limit"] for row in compared} == {
        row["id"]: by_hand(row) for row in compared
    }


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


def test_the_schema_knows_every_limit() -> None:
    assert tuple(limit.value for limit in Limit) == AGAINST_WANG_2021.column("limit").allowed


def test_the_page_says_what_inside_took() -> None:
    """Ten inside: 1 two-sided, 2 half to twice, 3 signs, 4 yes or no; one wide outside."""
    inside = ["two_sided", *["wide"] * 2, *["one_sided"] * 3, *["binary"] * 4]
    rows = pd.DataFrame(
        [{"limit": limit, "verdict": "inside", "evidence": "independent"} for limit in inside]
        + [
            {"limit": "wide", "verdict": "outside", "evidence": "independent"},
            {"limit": "binary", "verdict": "outside", "evidence": "circular"},
            {"limit": "binary", "verdict": "not_computed", "evidence": None},
        ]
    )
    assert told(rows) == (
        "Of 11 published quantities that are evidence ours are inside the paper's range for 10 and "
        "outside for 1. Of the 10 inside, 1 lie in a range with two ends whose width the paper "
        "gives, 2 in one so wide (half to twice, or more) that inside is no agreement, 3 are on "
        "the right side of a single limit or of zero, 4 are the same yes, no or count. Not "
        "counted: 1 that cohort or study were made to have, 1 that nothing of a run can be held "
        "against."
    )


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
        verdicts = ("inside", "outside", "circular", "recomputed", "contradicted", "not_computed")
        assert row["rows"] == sum(row[name] for name in verdicts), study


def test_documents_tell_the_counts() -> None:
    found = counted()["t12s1_as_published"]
    words = " ".join((ROOT / "docs" / "studies" / "cohort_stiffness.md").read_text().split())
    assert (
        f"of {found['rows']} rows the study as published is inside for {found['inside']}, of which "
        f"{found['inside_two_sided']} lie in a range with two ends whose width the paper gives, "
        f"and outside for {found['outside']} "
    ) in words
    readme = " ".join((ROOT / "README.md").read_text().split())
    assert f"sets {len(claims_of('gould_2024a'))} published numbers beside ours" in readme


@sweep("study", ["l1l4_joint_pose", "t12s1_as_published"])
def test_counts_by_hand_where_the_study_was_run(study: str) -> None:
    paths = sorted((ROOT / "results" / study).glob("against_*.parquet"))
    if not paths:
        pytest.skip(f"study {study} was not run here")
    rows = pd.read_parquet(paths[0]).to_dict("records")
    numbers = ("paper_low", "paper_high")
    plain = [row | {n: None if pd.isna(row[n]) else row[n] for n in numbers} for row in rows]
    inside = [by_hand(row) for row in plain if row["verdict"] == "inside"]
    asked = {"two_sided", "binary", "wide", "one_sided", "chosen"}
    assert {one: inside.count(one) for one in asked} == {
        one: counted()[study][f"inside_{one}"] for one in asked
    }


def test_a_table_is_counted_by_verdict_and_limit(tmp_path: Path) -> None:
    (tmp_path / "a").mkdir()
    rows = [("inside", "wide"), ("inside", "binary"), ("outside", "wide"), ("circular", "binary")]
    frame = pd.DataFrame(rows, columns=["verdict", "limit"])
    frame.to_parquet(tmp_path / "a" / "against_b.parquet")
    (row,) = comparisons.table(tmp_path).to_dict("records")
    assert (row["study"], row["paper"], row["rows"], row["inside"]) == ("a", "b", 4, 2)
    assert (row["inside_wide"], row["inside_binary"], row["inside_two_sided"]) == (1, 1, 0)
    assert (row["outside"], row["circular"], row["not_computed"]) == (1, 1, 0)
