"""How often all tests of a run have started Snakemake, told at the end by pytest."""

from typing import Any

import pytest
from small_project import STARTS

MOST = 20
"""Of what `make test` runs: each start takes seconds in which nothing is tested."""


class SnakemakeStarts:
    """A plugin of pytest: sums up over its workers, and fails a run of `make test` above `MOST`."""

    def __init__(self) -> None:
        self.of_workers = 0

    @property
    def all(self) -> int:
        """Of this process and of workers that have ended."""
        return self.of_workers + len(STARTS)

    @pytest.hookimpl(optionalhook=True)
    def pytest_testnodedown(self, node: Any) -> None:
        """Take over what a worker has counted."""
        self.of_workers += getattr(node, "workeroutput", {}).get("snakemake_starts", 0)

    def pytest_sessionfinish(self, session: pytest.Session) -> None:
        """Hand over what this worker has counted, or judge the sum."""
        if hasattr(session.config, "workeroutput"):
            session.config.workeroutput["snakemake_starts"] = len(STARTS)
        elif self.all > MOST and session.config.option.markexpr == "not full":
            session.exitstatus = pytest.ExitCode.TESTS_FAILED

    def pytest_terminal_summary(self, terminalreporter: Any) -> None:
        """One line."""
        if self.all:
            terminalreporter.write_line(
                f"Snakemake was started {self.all} times (make test: at most {MOST})"
            )
