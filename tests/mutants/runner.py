"""Runs of pytest in forks of one process that has loaded other people's libraries already.

Started in a copy of the project; asked and answering by lines of JSON. Nothing of the project is
loaded before a fork, so each run sees the code as it stands then.
"""

import json
import os
import resource
import signal
import sys
from collections.abc import Sequence
from importlib import import_module

import pytest

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


class First:
    """Tells what fails, into an open file."""

    def __init__(self, told: int) -> None:
        self.told = told

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """Of one test."""
        if report.failed:
            os.write(self.told, f"{report.nodeid}\n".encode())

    def pytest_collectreport(self, report: pytest.CollectReport) -> None:
        """Of a file that cannot be read."""
        if report.failed:
            os.write(self.told, f"{report.nodeid}\n".encode())


def failed(tests: Sequence[str], marks: str, most_s: int) -> str:
    """The first test that fails, `TIME` for a run of more processor time; empty where all pass."""
    reading, writing = os.pipe()
    child = os.fork()
    if child == 0:
        os.close(reading)
        os._exit(_run(tests, marks, most_s, writing))
    os.close(writing)
    with os.fdopen(reading) as told:
        named = told.read().split("\n")[0]
    _, status = os.waitpid(child, 0)
    if os.WIFSIGNALED(status):
        return named or TIME
    ended = os.waitstatus_to_exitcode(status)
    return "" if ended in (0, NOTHING_THERE) else named or f"pytest ended with {ended}"


def _run(tests: Sequence[str], marks: str, most_s: int, told: int) -> int:
    """In the fork: silent, within its time."""
    resource.setrlimit(resource.RLIMIT_CPU, (most_s, most_s))
    signal.alarm(WAITING * most_s)
    silent = os.open(os.devnull, os.O_WRONLY)
    os.dup2(silent, 1)
    os.dup2(silent, 2)
    try:
        return int(pytest.main(["-x", "-q", "-m", marks, *tests], plugins=[First(told)]))
    except BaseException as broken:
        os.write(told, f"{type(broken).__name__}\n".encode())
        return 1


def main() -> None:
    """Answer until nobody asks any more."""
    for name in LOADED:
        import_module(name)
    for line in sys.stdin:
        asked = json.loads(line)
        answer = failed(asked["tests"], asked["marks"], asked["most_s"])
        print(json.dumps(answer), flush=True)


if __name__ == "__main__":
    main()
