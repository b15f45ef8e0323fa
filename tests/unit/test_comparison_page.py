"""The page that sets a paper's numbers beside ours: what it counts, in which words.

Catches a number counted as evidence that is none, a weak comparison told as a strong one, counts
that do not add up, a code of the files on the page, and a name that becomes markup.
"""

import re
from html import unescape
from types import SimpleNamespace
from typing import Any

import pandas as pd
import pytest
from hostile import HARMLESS, PAYLOAD, Structure
from page_rules import faults_of_page
from sweeps import sweep

from papers.engine import claims_of, judge, rows_of
from papers.run import Computed, StudyRun
from spinepipe.report.conclusions import MOST_WORDS
from spinepipe.report.page.comparison import (
    LIMITS,
    LINES,
    NO_EVIDENCE,
    STRONG,
    VERDICTS,
    answer,
    comparison,
    lines,
)
from spinepipe.studies.tracking.tables import AGAINST_WANG_2021 as SHAPE

COMPARED = [code for code in VERDICTS if code != "not_computed"]


def made(*rows: tuple[str, str, str | None], words: str = "") -> pd.DataFrame:
    """Rows of which limit, verdict and evidence are given."""
    texts = {name: f"some_{name}{words}" for name in ("id", "where", "quantity", "unit", "reason")}
    empty = dict.fromkeys(("paper_low", "paper_high", "ours", "ours_low", "ours_high"))
    columns = ("limit", "verdict", "evidence")
    return pd.DataFrame(
        [texts | empty | {"paper": 1.0} | dict(zip(columns, row, strict=True)) for row in rows]
    )


def independent(counts: dict[tuple[str, str], int]) -> pd.DataFrame:
    """So many rows of each limit and verdict."""
    rows = [(*pair, "independent") for pair, n in counts.items() for _ in range(n)]
    return made(*rows) if rows else made(("none", "circular", "circular")).iloc[:0]


def page(rows: pd.DataFrame, study: str = "s01") -> str:
    settings: Any = SimpleNamespace(study=study)
    cohort: Any = SimpleNamespace(made_up=True, rebuilt=False)
    return comparison(SHAPE, "Beside Wang et al. 2021", rows, settings, cohort)


def numbers(text: str) -> list[int]:
    return [int(one) for one in re.findall(r"\d+", text)]


def visible(html: str) -> str:
    body = html[html.index("<main") : html.index("</main>")]
    return unescape(re.sub(r"<[^>]+>", " ", body))


SPREAD = {
    (limit, verdict): 1 + 4 * row + column
    for row, limit in enumerate(LIMITS)
    if limit != "none"
    for column, verdict in enumerate(VERDICTS)
}
"""Each limit and verdict with a number of its own."""

CASES = {
    "of all": SPREAD,
    "all inside": {(limit, "inside"): 3 for limit in LIMITS if limit != "none"},
    "all outside": {(limit, "outside"): 3 for limit in LIMITS if limit != "none"},
    "strong alone": {(STRONG, "inside"): 2, (STRONG, "undecided"): 1},
    "weak alone": {("one_sided", "undecided"): 2, ("binary", "inside"): 5},
    "strong not comparable": {(STRONG, "not_computed"): 4, ("wide", "outside"): 1},
    "nothing comparable": {("none", "not_computed"): 4},
    "nothing": {},
}


@sweep("case", CASES)
def test_the_answer_counts_what_was_compared(case: str) -> None:
    """Agreement within a range of the paper first and apart from all else."""
    counts = CASES[case]
    strong, weaker = (
        [
            sum(n for (one, verdict), n in counts.items() if one in limits and verdict in wanted)
            for wanted in (["inside"], COMPARED)
        ]
        for limits in ({STRONG}, set(LIMITS) - {STRONG})
    )
    said = answer(independent(counts))
    assert [n for n, letter in enumerate(said, 1) if letter == "."] == [len(said)]
    assert len(said.split()) <= MOST_WORDS
    if strong[1] + weaker[1]:
        assert numbers(said) == (strong if strong[1] else []) + (weaker if weaker[1] else [])
    else:
        assert numbers(said) == [n for n in (sum(counts.values()),) if n]


@sweep("case", CASES)
def test_lines_are_few_and_count_every_row_once(case: str) -> None:
    counts = CASES[case]
    found = list(lines(independent(counts)))
    assert len(found) <= 4
    told: dict[str, int] = dict.fromkeys(VERDICTS.values(), 0)
    for _, line, _ in found:
        for part in line.rstrip(".").split(", "):
            n, words = part.split(" ", 1)
            assert int(n) > 0
            told[words] += int(n)
    for code, words in VERDICTS.items():
        assert told[words] == sum(n for (_, one), n in counts.items() if one == code)


def test_the_strongest_evidence_stands_first_and_borrowed_tolerances_apart() -> None:
    found = list(lines(independent(SPREAD)))
    assert [heading for heading, *_ in found] == [heading for heading, *_ in LINES]
    for (_, line, _), (_, limits, _) in zip(found, LINES, strict=True):
        of = [SPREAD[limit, "inside"] for limit in limits if limit != "none"]
        assert numbers(line)[0] == sum(of)
    assert [limits for _, limits, _ in LINES[:3]] == [(STRONG,), ("chosen",), ("borrowed",)]
    weak = found[-1][2]
    kinds = [limit for limit in LINES[-1][1] if limit != "none"]
    pairs = [
        (SPREAD[one, "inside"], sum(SPREAD[one, verdict] for verdict in COMPARED)) for one in kinds
    ]
    assert numbers(weak) == [n for pair in pairs for n in pair], "of each kind, those compared"


def test_every_limit_has_one_line_and_every_code_a_word() -> None:
    assert sorted(limit for _, limits, _ in LINES for limit in limits) == sorted(LIMITS)
    assert set(LIMITS) == set(SHAPE.column("limit").allowed)
    assert set(SHAPE.column("evidence").allowed) == {"independent", *NO_EVIDENCE} - {""}
    assert set(SHAPE.column("verdict").allowed) == {*VERDICTS, *NO_EVIDENCE} - {""}


def test_what_is_no_evidence_is_counted_nowhere_and_folded() -> None:
    """Ours outside of what was put in is told: it should have come out again."""
    none = [
        *[("binary", "circular", "circular")] * 3,
        *[("two_sided", "outside", "circular")] * 2,
        ("two_sided", "recomputed", "recomputed"),
        ("binary", "contradicted", "contradicted"),
        ("none", "not_computed", None),
    ]
    counted = ("two_sided", "inside", "independent")
    alone, both = page(made(*none)), page(made(counted, *none))
    assert ["1 of 1" in one for one in (alone, both)] == [False, True]
    assert [one.count("<details") for one in (alone, both)] == [1, 2]
    assert [one.count(" open>") for one in (alone, both)] == [0, 1]
    folded = both[both.rindex("<details") :]
    about = re.search(r'<p class="soft">(.*?)</p>', folded)
    assert about
    assert numbers(about[1]) == [5, 1, 1, 1, 2]
    assert folded.count("<tr><td") == len(none)


def test_without_a_number_of_no_evidence_nothing_is_folded() -> None:
    html = page(made(("wide", "inside", "independent")))
    assert html.count("<details") == 1
    assert " open>" in html


def test_codes_stay_in_the_files() -> None:
    rows = [(limit, verdict, "independent") for limit, verdict in SPREAD]
    rows += [("one_sided", code, code) for code in NO_EVIDENCE if code]
    html = page(made(*rows))
    text = visible(html).replace("some_unit", "").replace("some_reason", "")
    text = text.replace("some_where", "").replace("against_wang_2021.parquet", "")
    assert "_" not in text
    assert not re.search(r"\b(?:inside|outside)\b", text)
    assert all(words in text for words in VERDICTS.values())
    assert not list(faults_of_page(html))


def test_rows_stand_by_strength() -> None:
    html = page(independent(dict.fromkeys(reversed(SPREAD), 1)))
    shown = re.findall(r"<td>([^<]+)", html)
    found = [one for one in shown if one in LIMITS.values()]
    assert list(dict.fromkeys(found)) == [LIMITS[one] for one in LIMITS if one != "none"]


@pytest.mark.parametrize("kind", ["independent", "circular"])
def test_no_text_becomes_markup(kind: str) -> None:
    """Names of studies, quantities, units, places and reasons, whoever wrote them."""
    pages = [
        page(made(("wide", "outside", kind), words=words), f"s{words}")
        for words in (PAYLOAD, HARMLESS)
    ]
    assert pages[0].count("&lt;script&gt;alert(1)") > 4, "they do stand in the page"
    hostile, harmless = map(Structure, pages)
    assert hostile.elements == harmless.elements
    assert hostile.scripts == harmless.scripts
    assert hostile.addresses == harmless.addresses


def test_an_interval_over_the_limit_is_undecided_on_the_page_too() -> None:
    """The same value of ours, with and without an interval that reaches over the paper's bound."""
    name = next(row["id"] for row in rows_of("wang_2021") if row["rule"] == "at_most")
    (claim,) = (claim for claim in claims_of("wang_2021") if claim.id == name)
    bound = claim.range.high
    assert bound is not None
    said = []
    for high in (0.9 * bound, 1.1 * bound):
        ours = Computed(0.8 * bound, 0.7 * bound, high)
        row = judge(type(claim)(**{**vars(claim), "ours": lambda run, o=ours: o}), StudyRun({}))
        said.append(next(lines(pd.DataFrame([row])))[1])
    assert said == [f"1 {VERDICTS['inside']}.", f"1 {VERDICTS['undecided']}."]
