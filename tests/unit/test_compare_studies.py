"""Two studies side by side: what is the same, what differs, and by how much.

Catches a change that is not told, one that is told of equal studies, intervals taken for apart that
overlap, and a name that becomes markup.
"""

import re
import shutil
from collections.abc import Callable
from html import unescape
from math import inf
from pathlib import Path

import numpy as np
import pytest
import stored_studies as cases
from hostile import HARMLESS, PAYLOAD, Structure
from stored_studies import FIRST, SECOND
from sweeps import sweep

from spinepipe.api.results import open_results
from spinepipe.cli import main
from spinepipe.cli.compare import side_by_side
from spinepipe.problems import InputError
from spinepipe.report.conclusions import Told, Value
from spinepipe.report.overview.side_by_side import (
    APART,
    ONE,
    VALUE,
    VERDICT,
    are_apart,
    paired,
    settings_that_differ,
)
from spinepipe.studies.registry import kind_of
from spinepipe.tables import to_arrow, write

Compare = Callable[..., tuple[int, str, str]]


@pytest.fixture
def root(tmp_path: Path) -> Path:
    """A project of two studies with equal results, but for their names and seeds."""
    root = cases.project(tmp_path / "project")
    for name in (FIRST, SECOND):
        cases.store(root, name, cases.conclusions())
    return root


@pytest.fixture
def compare(root: Path, capsys: pytest.CaptureFixture[str]) -> Compare:
    """Exit code, standard output and standard error of the command."""

    def compare(*arguments: object) -> tuple[int, str, str]:
        code = main(["--root", str(root), "compare", *map(str, arguments)])
        told = capsys.readouterr()
        return code, told.out, told.err

    return compare


def test_of_a_study_and_itself_nothing_changed(compare: Compare, tmp_path: Path) -> None:
    page = tmp_path / "page.html"
    code, told, _ = compare(FIRST, FIRST, "-o", page)
    assert code == 0
    assert told.splitlines()[:4] == [
        "a: first (range_of_motion)",
        "b: first (range_of_motion)",
        "",
        "Nothing changed.",
    ]
    assert "differ" not in told
    shown = page.read_text()
    assert '<h1 id="answer">Nothing changed.</h1>' in shown
    assert re.findall(r"<td>range_of_motion</td>.*?<td>([^<]+)</td></tr>", shown) == ["equal"]


@sweep("side", [FIRST, SECOND])
def test_a_result_that_the_clock_ended_is_compared_with_nothing(side: str, tmp_path: Path) -> None:
    """Another computer would have come to another one."""
    root = cases.project(tmp_path / "project")
    by_clock = cases.conclusion("light", "ended", "check_minutes", "The clock ended it.")
    for name in (FIRST, SECOND):
        ended = [by_clock] if name == side else []
        cases.store(root, name, [*cases.conclusions(), *ended])
    with pytest.raises(InputError, match=f"{side}.*the clock ended"):
        side_by_side(root / "results" / FIRST, root / "results" / SECOND)


def test_equal_results_of_two_studies_differ_by_their_settings_alone(compare: Compare) -> None:
    _, told, _ = compare(FIRST, SECOND)
    assert "Different: 1 setting." in told
    assert "  seed: 1 | 2" in told
    assert "tables that differ" not in told


def test_a_changed_value_verdict_cell_and_row_are_told(
    root: Path, compare: Compare, tmp_path: Path
) -> None:
    folder = cases.store(root, SECOND, cases.conclusions(value=12.0, light="stop"))
    cases.change_table(folder, code_digest="another", seed="2", version_numpy="9.9")
    code, told, _ = compare(FIRST, SECOND, "-o", tmp_path / "page.html")
    assert code == 0
    assert "Different: 1 setting, 1 verdict, 1 conclusion without overlap, 1 table." in told
    assert "motion: 9.0 (8.0 to 10.0)° | 12.0 (11.0 to 13.0)°  (intervals do not overlap)" in told
    assert "conclusions that differ: 2 of 3" in told
    assert "light [verdict differs]" in told
    assert "range_of_motion: 1 cells differ (predicted_extension_deg 1); 1 rows only in a" in told
    assert "  code of range_of_motion: c0de | another" in told
    assert "  numpy: – | 9.9" in told
    assert "data of" not in told
    page = (tmp_path / "page.html").read_text()
    assert page.count('<span class="light stop">intervals do not overlap</span>') == 1
    assert "12.0 (11.0 to 13.0)°" in page
    assert "Draws: few." not in page  # which is the same


def test_a_change_within_intervals_is_told_as_one(root: Path) -> None:
    cases.store(root, SECOND, cases.conclusions(value=9.5))
    both = side_by_side(*(root / "results" / name for name in (FIRST, SECOND)))
    assert [one.remarks for one in both.changed] == [(VALUE,)]
    assert both.changed[0].place == "answer"
    assert len(both.alike) == 2


def test_folders_of_two_projects_are_compared_and_told_apart(
    root: Path, compare: Compare, tmp_path: Path
) -> None:
    shutil.copytree(root, tmp_path / "later")
    folders = [one / "results" / FIRST for one in (root, tmp_path / "later")]
    shutil.rmtree(tmp_path / "later/config")
    _, told, _ = compare(*folders)
    assert "a: project/first (" in told
    assert "b: later/first (" in told
    assert "settings: Not compared: first has no sound study file" in told
    assert "Nothing changed." in told


def test_of_two_kinds_what_both_have_is_compared(root: Path, compare: Compare) -> None:
    """Conclusions of the same rule, tables of the same layout; others are named."""
    other = root / "results" / "held"
    shutil.copytree(root / "results" / FIRST, other)
    table = kind_of("scoliosis").table("by_range")
    (other / "range_of_motion.parquet").unlink()
    made_by = {"kind": "scoliosis", "study": "held"}
    write(to_arrow(table, {name: [] for name in table.names}), other / "by_range.parquet", made_by)
    told = cases.conclusions(value=20.0)
    cases.store_conclusions(other, [*told, cases.conclusion("finding", "films", "x", "Films.")])
    code, said, _ = compare(FIRST, "held")
    assert code == 0
    assert "two types of study: compared is what both have" in said
    assert "conclusions that differ: 1 of 3" in said
    assert "Films." not in said
    assert "tables not compared: range_of_motion, by_range" in said


def test_tables_below_a_folder_are_found_though_conclusions_lie_above(root: Path) -> None:
    folder = root / "results" / FIRST
    (folder / "discrepancy").mkdir()
    (folder / "range_of_motion.parquet").rename(folder / "discrepancy/range_of_motion.parquet")
    found = open_results(folder)
    assert list(found) == ["range_of_motion"]
    assert "other" not in found
    with pytest.raises(KeyError):
        found["other"]


@sweep("arguments, words", [(("frist", SECOND), "did you mean first?"), ((FIRST, "show"), "show")])
def test_what_is_no_study_with_results_is_told(
    arguments: tuple[str, str], words: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    root = cases.project(tmp_path)
    cases.store(root, FIRST, cases.conclusions())
    cases.store(root, SECOND, cases.conclusions())
    (root / "results/show").mkdir()
    assert main(["--root", str(root), "compare", *arguments]) in (1, 2)
    assert words in capsys.readouterr().err


def test_a_page_of_another_ending_is_refused(compare: Compare, tmp_path: Path) -> None:
    code, _, told = compare(FIRST, SECOND, "-o", tmp_path / "page.txt")
    assert code == 1
    assert "FILE.html" in told


def value(low: float | None, high: float | None, unit: str = "mm") -> Value:
    return Value(1.0, unit, low, high)


@sweep(
    "a, b, apart",
    [
        (value(0.0, 1.0), value(2.0, 3.0), True),
        (value(2.0, 3.0), value(0.0, 1.0), True),
        (value(0.0, 2.0), value(1.0, 3.0), False),
        (value(0.0, 9.0), value(1.0, 3.0), False),
        (value(0.0, 1.0), value(1.0, 3.0), False),  # they touch
        (value(0.0, 1.0), value(2.0, None), True),
        (value(None, 1.0), value(2.0, 3.0), True),
        (value(None, 1.0), value(0.5, None), False),
        (value(None, None), value(2.0, 3.0), False),
        (value(0.0, 1.0), value(2.0, 3.0, "cm"), False),
    ],
)
def test_intervals_are_apart_where_they_have_no_number_in_common(
    a: Value, b: Value, apart: bool
) -> None:
    assert are_apart(a, b) is are_apart(b, a) is apart


@sweep(
    "given, told",
    [
        (Value(2.03, "°", 1.5, 2.4), "2.03 (1.50 to 2.40)°"),
        (Value(2149.0, "N", 1950.0, 2250.0), "2\u2009150 (1\u2009950 to 2\u2009250)\u00a0N"),
        (Value(-0.004, "mm", -1.5, 1.5), "0.0 (\u22121.5 to 1.5)\u00a0mm"),
        (Value(3.0, "", None, None), "3"),
        (Value(1800.0, "", None, None), "1\u2009800"),
        (Value(0.5961, "°", None, None), "0.60°"),
        (Value(5000.0, "N/m", 4400.0, None), "5\u2009000 (above 4\u2009400)\u00a0N/m"),
    ],
)
def test_numbers_are_rounded_by_their_interval(given: Value, told: str) -> None:
    assert f"{given}" == told


def sentence(place: str, rule: str, verdict: str = "v") -> Told:
    return Told(place, rule, verdict, "", f"{place} by {rule}", "", "", {})


def test_answers_meet_whatever_made_them_and_several_of_a_rule_in_turn() -> None:
    a = [sentence("answer", "named"), sentence("light", "fits"), sentence("light", "fits")]
    b = [sentence("answer", "nothing"), sentence("light", "fits"), sentence("key", "size")]
    told = paired(a, b, one_kind=True)
    assert [(one.place, one.remarks) for one in told] == [
        ("answer", (VERDICT,)),
        ("light", ()),
        ("light", (ONE,)),
        ("key", (ONE,)),
    ]
    assert [one.place for one in paired(a, b, one_kind=False)] == ["answer", "light"]


def test_settings_are_told_by_their_dotted_names() -> None:
    a = {"study": "a", "fit": {"free": ["x"], "times": 2.0}, "seed": None, "own": 1}
    b = {"study": "b", "fit": {"free": ["x", "y"], "times": 2.0}, "seed": 3}
    found = settings_that_differ(a, b, one_kind=True)
    told = [(one.name, one.a, one.b) for one in found]
    assert told == [("fit.free", "[x]", "[x, y]"), ("seed", "null", "3"), ("own", "1", "–")]
    assert [one.name for one in settings_that_differ(a, b, one_kind=False)] == ["fit.free", "seed"]


def test_an_open_end_that_is_stored_as_infinite_is_open(root: Path) -> None:
    number = ("motion", 9.0, "°", -inf, np.nan)
    cases.store(root, FIRST, [cases.conclusion("answer", "r", "v", "Open.", number)])
    both = side_by_side(*(root / "results" / name for name in (FIRST, SECOND)))
    (answer,) = [one for one in both.conclusions if one.place == "answer"]
    assert APART not in answer.remarks
    assert answer.values[0].a == "9°"


def test_texts_of_people_never_become_markup(root: Path, compare: Compare, tmp_path: Path) -> None:
    pages = []
    for number, payload in enumerate((PAYLOAD, HARMLESS)):
        value = (f"n{payload}", 1.0, payload, 0.0, 2.0)
        told = [
            cases.conclusion("answer", "r", payload, f"A {payload}", value),
            cases.conclusion("finding", payload, "v", payload),
        ]
        folder = cases.store(root, SECOND, told)
        cases.change_table(folder, seed=payload, version_x=payload)
        compare(FIRST, SECOND, "-o", tmp_path / f"{number}.html")
        pages.append((tmp_path / f"{number}.html").read_text())
    hostile, harmless = map(Structure, pages)
    assert unescape(pages[0]).count(PAYLOAD) >= 4
    assert hostile.elements == harmless.elements
    assert hostile.scripts == harmless.scripts
    assert "default-src 'none'" in pages[0]
