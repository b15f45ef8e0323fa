"""Which tests run a line of the library, as followed once per file of tests and kept.

Compiled code cannot be followed, and constants are read when a file is loaded: there the tests
count that run a place where the name stands.
"""

import hashlib
import json
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cache, cached_property
from pathlib import Path

from coverage import CoverageData

from tests.mutants.lines import ROOT, mentions, statement
from tests.mutants.runner import SHARED

NEVER = ("workflow", "validation", "mutants", "generators", "cases")
"""Folders of tests that run whole studies, or that are no tests."""

DEPTH = 4
"""Names that lead to names: so many times at most."""


def files_of_tests() -> list[str]:
    """All that a fault may be shown to, by their names from the project's folder."""
    found = sorted((ROOT / "tests").rglob("test_*.py"))
    named = [path.relative_to(ROOT) for path in found]
    return [path.as_posix() for path in named if not {*path.parts} & {*NEVER}]


@dataclass(frozen=True)
class Reach:
    """What each file of tests was seen to run, kept in a folder."""

    folder: Path

    def kept(self, tests: str) -> Path:
        """Where that of one file of tests is kept."""
        return self.folder / (tests.replace("/", "-").removesuffix(".py") + ".reach")

    def missing(self) -> list[str]:
        """Files of tests that were not followed, or that changed, or what they run did."""
        return [name for name in files_of_tests() if not self._holds(name)]

    def vouch(self, tests: str) -> None:
        """Note what code a file of tests was seen to call; what it only loads does not count."""
        called = [
            path for path, at in self._run(tests).items() if any(_is_called(path, n) for n in at)
        ]
        code = {path: _digest(path) for path in (tests, *called)}
        self.kept(tests).with_suffix(".code").write_text(json.dumps(code))

    def _holds(self, tests: str) -> bool:
        noted = self.kept(tests).with_suffix(".code")
        if not noted.is_file():
            return False
        code = json.loads(noted.read_text())
        return all((ROOT / path).is_file() and _digest(path) == was for path, was in code.items())

    def near(self, path: str, line: int) -> tuple[list[str], list[str]]:
        """Tests that run a line, the quickest first, and the files they are in, nearest first.

        Near is a file of tests that runs little else but the file of the line.
        """
        tests = self._at(path, line, DEPTH, set())
        files = {name.partition("::")[0] for name in tests}
        alone = [name for name in tests if "::" in name]
        quick = sorted(alone, key=lambda name: self._cpu_s.get(name, 0.0))
        return quick, sorted(files, key=lambda name: (-self._share(name, path), name))

    def cpu_s(self, name: str) -> float:
        """Processor time of a test or of all of a file, followed: about twice that without."""
        whole = (s for test, s in self._cpu_s.items() if test.startswith(f"{name}::"))
        return self._cpu_s[name] if name in self._cpu_s else sum(whole)

    def _share(self, tests: str, path: str) -> float:
        lines = self._lines[tests]
        return len(lines.get(path, ())) / max(sum(map(len, lines.values())), 1)

    def _at(self, path: str, line: int, depth: int, done: set[str]) -> set[str]:
        """Tests that run a line, or else one that names what the line belongs to."""
        try:
            here = statement(path, line)
        except ValueError:
            return set()
        found = set(self._running(path, here.lines)) if here.inside else set()
        if found or not depth:
            return found
        for name in here.names - done:
            done.add(name)
            for place in mentions(name):
                found |= self._at(*place, depth - 1, done)
            found |= _naming(name)
        return found

    def _running(self, path: str, lines: Iterable[int]) -> Iterable[str]:
        for tests, at in self._lines.items():
            for line in lines:
                for context in at.get(path, {}).get(line, ()):
                    yield context if context != SHARED else tests

    @cached_property
    def _cpu_s(self) -> dict[str, float]:
        kept = [self.kept(name).with_suffix(".json") for name in files_of_tests()]
        parts = [json.loads(path.read_text()) for path in kept if path.is_file()]
        return {name: cpu_s for part in parts for name, cpu_s in part.items()}

    @cached_property
    def _lines(self) -> dict[str, dict[str, dict[int, list[str]]]]:
        """Contexts by file of tests, file of the library and line."""
        return {name: self._run(name) for name in files_of_tests()}

    def _run(self, tests: str) -> dict[str, dict[int, list[str]]]:
        """Contexts by file of the library and line; none where a run ended before it was kept."""
        if not self.kept(tests).is_file():
            return {}
        data = CoverageData(str(self.kept(tests)))
        data.read()
        lines = {path: data.contexts_by_lineno(path) for path in data.measured_files()}
        return {path: at for path, at in lines.items() if at}


def _is_called(path: str, line: int) -> bool:
    try:
        return statement(path, line).inside
    except ValueError:
        return False


@cache
def _digest(path: str) -> str:
    return hashlib.sha256((ROOT / path).read_bytes()).hexdigest()[:16]


@cache
def _naming(name: str) -> frozenset[str]:
    """Files of tests in which a name stands."""
    return frozenset(path for path in files_of_tests() if name in (ROOT / path).read_text())
