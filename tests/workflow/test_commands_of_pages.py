"""What README, the first page and the tutorial tell to type does what they say.

Catches a command or an option that the program does not have, and a step of the tutorial that ends
otherwise than well.
"""

import os
import re
import shlex
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
import yaml

from spinepipe.cli import main
from spinepipe.cli.program import COMMANDS

ROOT = Path(__file__).resolve().parents[2]
PAGES = ("README.md", "docs/index.md", "docs/tutorial.md")
TUTORIAL = "docs/tutorial.md"
KNOWN = [name for group in COMMANDS.values() for name in group]
BEFORE_A_RUN = ("import", "check", "show")


def code(page: str) -> Iterator[str]:
    """Blocks of code, fenced or set in by four blanks."""
    text = (ROOT / page).read_text(encoding="utf-8")
    yield from re.findall(r"^```\w*\n(.*?)^```", text, re.DOTALL | re.MULTILINE)
    yield from re.findall(r"(?:^    .*\n)+", text, re.MULTILINE)


def typed(page: str) -> list[list[str]]:
    """Words of each command, in the order of the page."""
    text = (ROOT / page).read_text(encoding="utf-8")
    lines = [line.strip() for block in code(page) for line in block.splitlines()]
    found = [line for line in lines if line.startswith("spinepipe ")]
    return [shlex.split(line, comments=True)[1:] for line in sorted(found, key=text.index)]


@pytest.mark.parametrize("page", PAGES)
def test_each_command_and_option_is_of_the_program(
    page: str, capsys: pytest.CaptureFixture[str]
) -> None:
    for words in typed(page):
        if words == ["--version"]:
            continue
        assert words[0] in KNOWN, words
        assert main([words[0], "--help"]) == 0
        told = capsys.readouterr().out
        for option in (word for word in words if word.startswith("-")):
            assert re.search(rf"(?<![\w-]){option}(?![\w-])", told), (words, option)


def test_targets_of_make_are_there() -> None:
    targets = set(re.findall(r"^([\w-]+):", (ROOT / "Makefile").read_text(), re.MULTILINE))
    for page in PAGES:
        told = re.findall(
            r"`make ([\w-]+)`|^ +make ([\w-]+)", (ROOT / page).read_text(), re.MULTILINE
        )
        assert {one or other for one, other in told} <= targets, page


def steps(project: Path) -> Iterator[list[str]]:
    """The tutorial's commands on its example; study files are written before the first of them."""
    for block in code(TUTORIAL):
        if block.startswith("study: "):
            study = yaml.safe_load(block)["study"]
            (project / "config" / "studies" / f"{study}.yaml").write_text(block)
    for words in typed(TUTORIAL):
        if any("example_rig" in word or "testing_machine" in word for word in words):
            yield words


@pytest.fixture
def project(tmp_path: Path) -> Path:
    shutil.copytree(ROOT / "docs" / "examples", tmp_path / "docs" / "examples")
    (tmp_path / "config" / "studies").mkdir(parents=True)
    return tmp_path


def test_the_tutorial_up_to_a_run(
    project: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(project)
    done = [words for words in steps(project) if words[0] in BEFORE_A_RUN]
    for words in done:
        assert main(words) == 0, (words, capsys.readouterr())
    assert [words[0] for words in done] == [*BEFORE_A_RUN, "check"]


@pytest.mark.full
def test_the_whole_tutorial(project: Path) -> None:
    path = os.pathsep.join(map(str, (ROOT, ROOT / "workflow" / "plugins")))
    told = os.environ | {"PYTHONPATH": path, "BROWSER": "true"}
    program = [sys.executable, "-m", "spinepipe.cli"]
    steps_of_all = [["init", "."], *steps(project)]
    for words in steps_of_all:
        if words[:2] == ["new", "study"]:  # written by the page already
            (project / "config" / "studies" / f"{words[2]}.yaml").unlink()
        done = subprocess.run(
            [*program, *words], cwd=project, env=told, capture_output=True, text=True, check=False
        )
        assert done.returncode == 0, (words, done.stdout, done.stderr)
    assert "neutral zone" in (project / "results/example_rig_missing/report.html").read_text()
