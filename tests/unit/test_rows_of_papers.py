"""Rows of `papers/*.csv`: each can be read, judged and told.

Catches a row whose rule or selector does not exist or is called with other arguments than it has, a
number that no rule makes a range of, and evidence that is called independent and is not.
"""

import inspect
import re
import shutil
from collections import Counter
from pathlib import Path

import pytest
from sweeps import sweep

from papers.engine import COLUMNS, FOLDER, Evidence, arguments, claims_of, compare, rows_of
from papers.ranges import RULES
from papers.selectors import SELECTORS, selectors_of
from spinepipe.comparison import papers

PAPERS = papers.papers()


def test_papers_are_beside_the_package_and_in_this_test() -> None:
    assert papers.beside()
    assert Path(papers.FOLDER) == FOLDER
    assert PAPERS


@sweep("paper", PAPERS)
def test_a_row_has_all_columns_and_a_name_of_its_own(paper: str) -> None:
    rows = rows_of(paper)
    assert {tuple(row) for row in rows} == {COLUMNS}
    twice = [name for name, count in Counter(row["id"] for row in rows).items() if count > 1]
    assert not twice
    assert not [row["id"] for row in rows if not (row["where"] and row["quantity"])]


@sweep("paper", PAPERS)
def test_rules_and_selectors_take_the_arguments_that_rows_have(paper: str) -> None:
    selectors = selectors_of(paper)
    for row in rows_of(paper):
        assert row["rule"] in RULES, row["id"]
        if row["selector"]:
            signature = inspect.signature(selectors[row["selector"]])
            signature.bind(None, **arguments(row["selector_args"]))
        else:
            assert row["missing"], f"{row['id']}: neither a selector nor why there is none"
    assert set(RULES) >= {row["rule"] for row in rows_of(paper)}


@sweep("paper", PAPERS)
def test_every_selector_of_a_paper_has_a_row(paper: str) -> None:
    used = {row["selector"] for row in rows_of(paper)}
    assert not set(selectors_of(paper)) - set(SELECTORS) - used


def test_papers_and_package_meet_in_one_file() -> None:
    """Papers know tables of results alone, and one file of the package knows papers."""
    imported = re.compile(r"^\s*(?:from|import) (spinepipe|papers)\b|\"(papers)\.", re.MULTILINE)
    own, package = FOLDER.glob("*.py"), Path(papers.__file__).parents[1].rglob("*.py")
    found = {file: {*map("".join, imported.findall(file.read_text()))} for file in (*own, *package)}
    assert not [file for file in found if file.parent == FOLDER and "spinepipe" in found[file]]
    there = [file for file in found if file.parent != FOLDER and "papers" in found[file]]
    assert there == [Path(papers.__file__)]


@sweep("paper", PAPERS)
def test_a_range_is_about_what_is_printed(paper: str) -> None:
    """Where a number is printed, the range holds it: but for one of which other numbers decide."""
    wrong = [
        claim.id
        for claim in claims_of(paper)
        if claim.printed is not None
        and not claim.range.holds(claim.printed)
        and claim.evidence in (Evidence.INDEPENDENT, Evidence.CIRCULAR)
    ]
    assert not wrong


@sweep("paper", PAPERS)
def test_evidence_is_what_the_row_is(paper: str) -> None:
    for row in rows_of(paper):
        name = row["id"]
        assert (row["evidence"] == "contradicted") == bool(row["contradicted"]), name
        assert (row["evidence"] == "") == bool(row["missing"]), name
        if row["selector"] == "number" and row["evidence"] not in ("recomputed", "contradicted"):
            assert row["evidence"] == "circular", name
            assert "of the shipped study" in row["note"], name
        assert row["also"] == "" or row["contradicted"], name


@sweep("paper", PAPERS)
def test_what_follows_from_the_paper_alone_needs_no_run(paper: str) -> None:
    """A recomputed or excluded number is a row with our value filled in, not code of a study."""
    found = {row["id"]: row for row in compare(paper, {}, {})}
    for row in rows_of(paper):
        if row["selector"] == "number":
            assert found[row["id"]]["ours"] == arguments(row["selector_args"])["value"]
            assert found[row["id"]]["evidence"] != "independent", row["id"]
    assert all(row["reason"] for row in found.values())


@pytest.mark.parametrize(
    ("paper", "numbers"),
    [(paper, {"independent", "circular", "recomputed", "contradicted"}) for paper in PAPERS],
)
def test_every_paper_has_numbers_of_each_kind(paper: str, numbers: set[str]) -> None:
    assert {row["evidence"] for row in rows_of(paper)} - {""} == numbers


def test_a_comparison_hangs_on_its_own_paper_and_the_engine(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    shutil.copytree(FOLDER, tmp_path / "papers", ignore=shutil.ignore_patterns("__pycache__"))
    monkeypatch.setattr(papers, "FOLDER", tmp_path / "papers")
    paper, other = PAPERS[:2]
    (tmp_path / "papers" / f"{paper}_beside.py").touch()  # a second file of selectors
    for changed, same in (
        (f"{paper}.csv", {other}),
        (f"{paper}.py", {other}),
        (f"{paper}_beside.py", {other}),
        ("ranges.py", set()),
        ("engine.py", set()),
    ):
        before = {name: papers.digest(name) for name in PAPERS}
        with (tmp_path / "papers" / changed).open("a") as file:
            file.write("\n")
        after = {name: papers.digest(name) for name in PAPERS}
        assert {name for name in (paper, other) if before[name] == after[name]} == same, changed
