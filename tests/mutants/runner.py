"""Runs of pytest in forks of one process that has loaded other people's libraries already.

Started in a copy of the project; asked and answering by lines of JSON. Nothing of the project is
loaded before a fork, so each run sees the code as it stands then.
"""

import json
import os
import resource
import signal
import sys
import time
from collections import defaultdict
from collections.abc import Generator, Sequence
from importlib import import_module
from pathlib import Path

import pytest
from coverage import Coverage

LOADED = (
    *("numpy", "scipy.linalg", "scipy.optimize", "scipy.spatial", "scipy.stats", "numba"),
    *("pandas", "pyarrow.parquet", "pydantic", "yaml", "matplotlib.pyplot"),
)
"""What most test files load: 3 s of 4 in a run of small tests."""

NOTHING_THERE = int(pytest.ExitCode.NO_TESTS_COLLECTED)
WAITING = 20
"""Times the processor time that a run may last: then it waits for something."""

TIME = "time"
"""Said of a run that was stopped."""

OF_MAKE_TEST = ("-m", "not full")
"""A fault counts as seen where `make test` sees it."""

SHARED = ""
"""What no test does alone: fixtures of a whole file, and loading it."""


class First:
    """Tells what fails, into an open file; runs tests in the order in which they are named."""

    def __init__(self, told: int, tests: Sequence[str]) -> None:
        self.told = told
        self.place = {name: at for at, name in enumerate(tests)}

    def pytest_collection_modifyitems(self, items: list[pytest.Item]) -> None:
        """Whole files, which are named without a test, stay as they are."""
        items.sort(key=lambda item: self.place.get(item.nodeid, len(self.place)))

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """Of one test."""
        if report.failed:
            os.write(self.told, f"{report.nodeid}\n".encode())

    def pytest_collectreport(self, report: pytest.CollectReport) -> None:
        """Of a file that cannot be read."""
        if report.failed:
            os.write(self.told, f"{report.nodeid}\n".encode())


class Followed:
    """Keeps which lines of the library each test runs, and its processor time in seconds."""

    def __init__(self, kept: Path) -> None:
        self.kept = kept
        self.cpu_s: dict[str, float] = defaultdict(float)
        self.cover = Coverage(str(kept), config_file=False, source=["spinepipe"], messages=False)
        self.cover.set_option("run:relative_files", True)
        self.cover.start()
        self._now = SHARED

    def _follow(self, name: str) -> None:
        self._now = name
        self.cover.switch_context(name)

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_protocol(self, item: pytest.Item) -> Generator[None, object, object]:
        """From the first fixture of a test to the last."""
        began = time.process_time()
        self._follow(item.nodeid)
        try:
            return (yield)
        finally:
            self._follow(SHARED)
            self.cpu_s[item.nodeid] += time.process_time() - began

    @pytest.hookimpl(wrapper=True)
    def pytest_fixture_setup(
        self, fixturedef: pytest.FixtureDef[object]
    ) -> Generator[None, object, object]:
        """What several tests share is nobody's own."""
        before = self._now
        if fixturedef.scope != "function":
            self._follow(SHARED)
        try:
            return (yield)
        finally:
            self._follow(before)

    def save(self) -> None:
        """Write both beside one another."""
        self.cover.stop()
        self.cover.save()
        self.kept.with_suffix(".json").write_text(json.dumps(self.cpu_s))


def failed(tests: Sequence[str], most_s: int, kept: str = "") -> str:
    """The first test that fails, `TIME` for a run of more processor time; empty where all pass.

    Parameters
    ----------
    kept : where to keep what each test runs; all tests are run then, also behind one that fails.
    """
    reading, writing = os.pipe()
    child = os.fork()
    if child == 0:
        os.close(reading)
        os._exit(_run(tests, most_s, writing, kept))
    os.close(writing)
    with os.fdopen(reading) as told:
        named = told.read().split("\n")[0]
    _, status = os.waitpid(child, 0)
    if os.WIFSIGNALED(status):
        return named or TIME
    ended = os.waitstatus_to_exitcode(status)
    return "" if ended in (0, NOTHING_THERE) else named or f"pytest ended with {ended}"


def _run(tests: Sequence[str], most_s: int, told: int, kept: str) -> int:
    """In the fork: silent, within its time."""
    resource.setrlimit(resource.RLIMIT_CPU, (most_s, most_s))
    signal.alarm(WAITING * most_s)
    silent = os.open(os.devnull, os.O_WRONLY)
    os.dup2(silent, 1)
    os.dup2(silent, 2)
    try:
        first = First(told, tests)
        if not kept:
            return int(pytest.main(["-x", "-q", *OF_MAKE_TEST, *tests], plugins=[first]))
        followed = Followed(Path(kept))
        ended = int(pytest.main(["-q", *OF_MAKE_TEST, *tests], plugins=[first, followed]))
        followed.save()
        return ended
    except BaseException as broken:
        os.write(told, f"{type(broken).__name__}\n".encode())
        return 1


def main() -> None:
    """Answer until nobody asks any more."""
    for name in LOADED:
        import_module(name)
    for line in sys.stdin:
        print(json.dumps(failed(**json.loads(line))), flush=True)


if __name__ == "__main__":
    main()
