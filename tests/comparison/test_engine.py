"""The engine that sets numbers beside a run: verdicts at the ends of a range, and what is told."""

from typing import Any

import pandas as pd
import pytest
from sweeps import sweep

from papers.engine import Claim, Evidence, arguments, judge
from papers.ranges import Range
from papers.run import Computed, NotComputed, StudyRun
from spinepipe.studies.tracking.tables import AGAINST_WANG_2021 as TABLE


def missing(run: StudyRun) -> Computed:
    raise NotComputed("this run made no table x")


def judged(
    value: float | None,
    low: float | None,
    high: float | None,
    wrong: str = "",
    ends: tuple[float | None, float | None] = (None, None),
    evidence: Evidence = Evidence.INDEPENDENT,
) -> Any:
    claim = Claim(
        *("a", "Table 1", "something", "mm", 2.0),
        range=Range(low, high, "the paper's IQR"),
        ours=missing if value is None else lambda run: Computed(value, *ends),
        evidence=Evidence.CONTRADICTED if wrong else evidence,
        contradicted=wrong,
        outside="for a reason",
        note="a note",
    )
    return judge(claim, StudyRun({}))


@sweep(
    "value, low, high, verdict",
    [
        (1.0, 1.0, 3.0, "inside"),
        (3.0, 1.0, 3.0, "inside"),
        (3.001, 1.0, 3.0, "outside"),
        (0.999, 1.0, 3.0, "outside"),
        (1e9, 1.0, None, "inside"),
        (-1e9, None, 3.0, "inside"),
        (3.001, None, 3.0, "outside"),
        (None, 1.0, 3.0, "not_computed"),
    ],
)
def test_verdict(value: float | None, low: float | None, high: float | None, verdict: str) -> None:
    assert judged(value, low, high)["verdict"] == verdict


@sweep(
    "low, high, ends, verdict",
    [
        (1.0, None, (1.5, 2.5), "inside"),
        (1.0, None, (1.0, 2.5), "inside"),  # touches
        (1.0, None, (0.9, 2.5), "undecided"),
        (1.0, None, (0.9, 2.0), "undecided"),  # largest of several, one of them below
        (1.0, None, (None, 2.5), "undecided"),  # open below
        (1.0, None, (1.5, None), "inside"),
        (None, 3.0, (1.5, 3.0), "inside"),
        (None, 3.0, (1.5, 3.1), "undecided"),
        (None, 3.0, (1.5, None), "undecided"),
        (None, 1.0, (1.5, 2.5), "outside"),
        (None, 1.0, (0.5, 2.5), "undecided"),
        (None, 1.0, (0.5, 2.0), "outside"),  # the largest is above, wherever the least is
        (1.0, 3.0, (0.5, 9.0), "inside"),  # two ends: as it was
        (2.0, 2.0, (0.5, 9.0), "inside"),
    ],
)
def test_a_single_limit_within_our_own_range_is_undecided(
    low: float | None, high: float | None, ends: tuple[float | None, float | None], verdict: str
) -> None:
    row = judged(2.0, low, high, ends=ends)
    assert row["verdict"] == verdict
    assert ("within our own range" in row["reason"]) == (verdict == "undecided")
    assert row["verdict"] in TABLE.column("verdict").allowed


def test_what_was_put_in_stays_circular_whatever_its_interval() -> None:
    found = [
        judged(2.0, 1.0, None, ends=(0.5, high), evidence=Evidence.CIRCULAR) for high in (3, 9)
    ]
    assert [row["verdict"] for row in found] == ["circular", "circular"]


@sweep(
    "value, reason",
    [
        (2.0, "range: the paper's IQR; a note"),
        (
            4.0,
            "range: the paper's IQR; ours is 2 times the paper's; for a reason; a note",
        ),
        (None, "range: the paper's IQR; this run made no table x; a note"),
    ],
)
def test_reason(value: float | None, reason: str) -> None:
    assert judged(value, 1.0, 3.0)["reason"] == reason


@sweep("value", [2.0, 4.0, None])
def test_what_the_paper_contradicts_is_not_compared(value: float | None) -> None:
    row = judged(value, 1.0, 3.0, "A1: 2 is not 3")
    assert (row["verdict"], row["ours"]) == ("contradicted", value)
    assert row["reason"].startswith("not compared: A1: 2 is not 3")


def test_arguments_of_a_row() -> None:
    found = arguments("table=fits; by=min; ends=true; low=-; joint=L1L2|L2L3; n=3")
    named = {"table": "fits", "by": "min", "ends": True, "low": None, "n": 3.0}
    assert found == named | {"joint": ("L1L2", "L2L3")}
    assert arguments("") == {}


def test_rows_of_a_run() -> None:
    frame = pd.DataFrame({"a": ["x", "y", "x"], "b": [1.0, None, 3.0], "message": ["", "why", ""]})
    run = StudyRun({"one": frame, "none": frame.iloc[:0]})
    assert list(run.rows("one", a=("x", "y"), b=3.0)["b"]) == [3.0]
    assert (run.number("one", "b", a="x"), len(run.rows("one", a="x"))) == (1.0, 2)
    for told, lacking in (
        ("no table two", lambda: run.rows("two")),
        ("table one has no row of a z", lambda: run.rows("one", a="z")),
        ("table none has no row of any kind", lambda: run.rows("none")),
        ("b is empty in one: why", lambda: run.number("one", "b", a="y")),
    ):
        with pytest.raises(NotComputed, match=told):
            lacking()
