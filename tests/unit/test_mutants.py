"""Mutation testing: what is drawn, how it is run, what is counted."""

import ast
import csv
import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.mutants.nearest import nearest
from tests.mutants.sample import AREAS, ROOT, Mutant, drawn
from tests.mutants.table import EQUAL, Ended, table

AREA = "statistics"


def test_a_draw_hangs_on_its_seed_and_takes_each_place_once() -> None:
    one, same, other = (drawn(AREA, 12, seed) for seed in (1, 1, 2))
    assert one == same
    assert one != other
    assert len(set(one)) == 12
    assert all(mutant.path.startswith(AREAS[AREA][0]) for mutant in one)


@pytest.mark.parametrize("mutant", drawn(AREA, 6, 1), ids=lambda one: f"{one.path}:{one.line}")
def test_a_mutant_is_code_that_differs_in_one_place(mutant: Mutant) -> None:
    whole, code = (ROOT / mutant.path).read_text(), mutant.code()
    assert ast.dump(ast.parse(whole)) != ast.dump(ast.parse(code))
    pairs = zip(whole.splitlines(), code.splitlines(), strict=True)
    differ = [(was.strip(), becomes.strip()) for was, becomes in pairs if was != becomes]
    assert differ == [mutant.change()]


def test_the_file_named_like_a_module_is_nearest_and_rings_follow_one_another(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    some = tuple(ROOT / f"tests/unit/test_{name}.py" for name in ("frames", "screw", "loops"))
    monkeypatch.setattr("tests.mutants.nearest._tests", lambda: some)
    path = "spinepipe/experiment/screw.py"
    assert nearest(path, 1) == ["tests/unit/test_screw.py"]
    assert nearest("spinepipe/frames.py", 1) == ["tests/unit/test_frames.py"]
    assert nearest(path, 1) + nearest(path, 2, beyond=1) == nearest(path, 3)
    assert nearest("spinepipe/motion/slices.py", 3) == []


RUNS = """\
import pytest

def test_passes(): pass

@pytest.mark.slow
def test_fails(): assert False

@pytest.mark.hangs
def test_hangs():
    while True: pass
"""


def test_a_run_tells_the_first_that_fails_and_ends_what_hangs(tmp_path: Path) -> None:
    """Of files of their own, by a process that loads nothing beforehand."""
    (tmp_path / "test_it.py").write_text(RUNS)
    (tmp_path / "test_broken.py").write_text("import nothing_of_that_name\n")
    (tmp_path / "pytest.ini").write_text("[pytest]\nmarkers =\n  slow\n  hangs\n")
    asked = [
        ("test_it.py", "not slow and not hangs", ""),
        ("test_it.py", "slow", "test_it.py::test_fails"),
        ("test_it.py", "hangs", "time"),
        ("test_broken.py", "not slow", "test_broken.py"),
    ]
    lines = [json.dumps({"tests": [name], "marks": m, "most_s": 2}) for name, m, _ in asked]
    code = f"import sys; sys.path.insert(0, {str(ROOT)!r})\n"
    code += "from tests.mutants import runner\nrunner.LOADED = ()\nrunner.main()\n"
    done = subprocess.run(
        [sys.executable, "-c", code],
        cwd=tmp_path,
        env={**os.environ, "PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1"},
        input="\n".join(lines) + "\n",
        capture_output=True,
        text=True,
        check=True,
    )
    assert [json.loads(line) for line in done.stdout.splitlines()] == [told for *_, told in asked]


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
