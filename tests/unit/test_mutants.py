"""Mutation testing: what is drawn, how it is run, what is counted.

Catches mutants drawn twice, run wrongly or counted as seen.
"""

import ast
import csv
import json
import subprocess
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path

import pytest
from sweeps import sweep

from tests.mutants.lines import mentions, statement
from tests.mutants.reach import Reach
from tests.mutants.sample import AREAS, ROOT, Mutant, drawn
from tests.mutants.table import EQUAL, Ended, table

AREA = "statistics"


def test_a_draw_hangs_on_its_seed_and_takes_each_place_once() -> None:
    one, same, other = (drawn(AREA, 12, seed) for seed in (1, 1, 2))
    assert one == same
    assert one != other
    assert len(set(one)) == 12
    assert all(mutant.path.startswith(AREAS[AREA][0]) for mutant in one)


@pytest.mark.full
def test_lengths_that_must_be_alike_are_not_spoilt() -> None:
    false = [one for one in drawn("trunk", 10_000, 1) if one.operator.endswith("TrueWithFalse")]
    lines = [(ROOT / one.path).read_text().splitlines()[one.line - 1] for one in false]
    assert lines
    assert not [line for line in lines if "strict=True" in line and line.count("True") == 1]


@sweep("mutant", lambda: drawn(AREA, 6, 1), lambda one: f"{one.path}:{one.line}")
def test_a_mutant_is_code_that_differs_in_one_place(mutant: Mutant) -> None:
    whole, code = (ROOT / mutant.path).read_text(), mutant.code()
    assert ast.dump(ast.parse(whole)) != ast.dump(ast.parse(code))
    pairs = zip(whole.splitlines(), code.splitlines(), strict=True)
    differ = [(was.strip(), becomes.strip()) for was, becomes in pairs if was != becomes]
    assert differ == [mutant.change()]


def line_of(path: str, start: str) -> int:
    """Number of the first line that starts so."""
    lines = (ROOT / path).read_text().splitlines()
    return 1 + next(at for at, line in enumerate(lines) if line.startswith(start))


def test_a_statement_is_known_by_its_lines_and_by_what_it_defines() -> None:
    path = "tests/mutants/lines.py"
    constant = statement(path, line_of(path, "_COMPOUND"))
    assert (constant.names, constant.inside, len(constant.lines)) == ({"_COMPOUND"}, False, 4)
    assert statement(path, line_of(path, "_COMPOUND") + 2) == constant
    head = statement(path, line_of(path, "def statement"))
    assert (head.names, head.inside) == ({"statement"}, False)
    inner = statement(path, line_of(path, "        if line in one.lines"))
    assert (inner.names, inner.inside, len(inner.lines)) == ({"statement"}, True, 1)
    with pytest.raises(ValueError, match="nothing stands here"):
        statement(path, 10_000)


def test_a_name_is_mentioned_where_it_is_used() -> None:
    places = mentions("ferguson_by")
    assert places
    for path, line in places:
        text = (ROOT / path).read_text().splitlines()[line - 1]
        assert "ferguson_by" in text
        assert not text.strip().startswith(("def ", "from ", "import "))


@pytest.mark.full
def test_tests_are_near_the_lines_that_they_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of a test file that is followed, each line that a test runs leads back to that test."""
    tests, path = "tests/unit/test_screw.py", "spinepipe/experiment/screw.py"
    monkeypatch.setattr("tests.mutants.reach.files_of_tests", lambda: [tests])
    reach = Reach(tmp_path)
    assert reach.missing() == [tests]
    assert answers([{"tests": [tests], "most_s": 300, "kept": str(reach.kept(tests))}]) == [""]
    reach.vouch(tests)
    assert reach.missing() == []
    quick, files = Reach(tmp_path).near(path, line_of(path, "    return Screw("))
    assert files == [tests]
    assert quick
    assert all(name.startswith(f"{tests}::test_") for name in quick)
    changed = json.loads((tmp_path / "tests-unit-test_screw.code").read_text())
    assert {tests, path} <= set(changed)
    (tmp_path / "tests-unit-test_screw.code").write_text(json.dumps({**changed, path: "other"}))
    assert reach.missing() == [tests]


RUNS = """\
import pytest

def test_passes(): pass

def test_fails(): assert False

def test_hangs():
    while True: pass
"""


@pytest.mark.full
def test_a_run_tells_the_first_that_fails_and_ends_what_hangs(tmp_path: Path) -> None:
    """Of files of their own, by a process that loads nothing beforehand."""
    (tmp_path / "test_it.py").write_text(RUNS)
    (tmp_path / "test_broken.py").write_text("import nothing_of_that_name\n")
    (tmp_path / "pytest.ini").write_text("[pytest]\n")
    asked = [
        (("test_it.py::test_passes",), ""),
        (("test_it.py",), "test_it.py::test_fails"),
        (("test_it.py::test_hangs", "test_it.py::test_fails"), "time"),
        (("test_broken.py",), "test_broken.py"),
    ]
    told = answers([{"tests": tests, "most_s": 2} for tests, _ in asked], tmp_path)
    assert told == [first for _, first in asked]


def answers(asked: Sequence[Mapping[str, object]], folder: Path = ROOT) -> list[str]:
    """What a process that runs tests in a folder says, with nothing loaded beforehand."""
    code = f"import sys; sys.path.insert(0, {str(ROOT)!r})\n"
    code += "from tests.mutants import runner\nrunner.LOADED = ()\nrunner.main()\n"
    done = subprocess.run(
        [sys.executable, "-c", code],
        cwd=folder,
        input="".join(json.dumps(one) + "\n" for one in asked),
        capture_output=True,
        text=True,
        check=True,
    )
    return [json.loads(line) for line in done.stdout.splitlines()]


def test_equal_ones_are_counted_apart() -> None:
    seen, lives, equal = drawn(AREA, 3, 1)
    ended = [Ended(seen, "tests/unit/test_it.py::test_it"), Ended(lives, "")]
    text = table(ended, [equal], "asked so")
    assert f"| {AREA} | 2 | 1 | 1 | 50 % | 1 |" in text
    assert "| all | 2 | 1 | 1 | 50 % | 1 |" in text
    _, not_seen = text.split("Not seen:")
    was = lives.change()[0].replace("|", "\\|")
    assert f"| `{lives.path}` | `{was}` |" in not_seen
    assert len(not_seen.strip().splitlines()) == 3


def test_what_was_judged_equal_is_still_in_the_code() -> None:
    with EQUAL.open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    places = [(row["path"], row["was"], row["becomes"]) for row in rows]
    assert len(set(places)) == len(places)
    for row in rows:
        lines = [line.strip() for line in (ROOT / row["path"]).read_text().splitlines()]
        assert row["was"] in lines, f"{row['path']} has no such line any more: {row['was']}"
        assert row["becomes"] != row["was"]
        assert row["why"]
