"""What holds for all tests: in which order they run, shared projects, what the last line says."""

import os
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import pytest
from hypothesis import settings
from small_project import Project, Shared
from snakemake_starts import SnakemakeStarts

settings.register_profile("same everywhere", derandomize=True, deadline=None, database=None)
settings.load_profile("same everywhere")
"""Drawn examples are the same on each machine, and a slow one fails none of them."""


SPREAD = frozenset({"test_stack", "test_supports", "test_plausibility"})
"""Long files whose tests share nothing: each test may go to another worker."""


def pytest_configure(config: pytest.Config) -> None:
    """Starts of Snakemake are counted."""
    config.pluginmanager.register(SnakemakeStarts())


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Slow tests and long files first, so that none of them runs alone at the end.

    Those of long files go to any worker, all others file by file; who looks at one shared project
    goes to one worker, so that no other waits until it is built.
    """

    def short(item: pytest.Item) -> bool:
        return item.get_closest_marker("slow") is None and item.path.stem not in SPREAD

    items.sort(key=short)
    for item in items:
        looks_at = {"eight", "toy"}.intersection(getattr(item, "fixturenames", ()))
        if item.path.stem not in SPREAD:
            item.add_marker(pytest.mark.xdist_group(min(looks_at, default=item.path.stem)))


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """One line that says what could not be tested here, and why."""
    skipped = terminalreporter.stats.get("skipped", [])
    reasons = Counter(one.longrepr[2].removeprefix("Skipped: ") for one in skipped)
    told = "; ".join(f"{count} ({reason})" for reason, count in sorted(reasons.items()))
    terminalreporter.write_line(f"not tested here: {told or 'nothing was skipped'}")


@pytest.fixture(scope="session")
def shared(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Shared]:
    """Projects that all workers share."""
    base = tmp_path_factory.getbasetemp()
    folder = base.parent if "PYTEST_XDIST_WORKER" in os.environ else base
    (folder / "shared").mkdir(exist_ok=True)
    projects = Shared(folder / "shared")
    yield projects
    projects.check()


@pytest.fixture(scope="session")
def eight(shared: Shared) -> Project:
    """A project whose studies, one of each kind, were computed at once; not to be changed."""

    def build(folder: Path) -> Project:
        from small_studies import asked, eight_kinds

        project = eight_kinds(folder)
        project.run(*asked(project))
        return project

    return shared.project("eight", build)


@pytest.fixture(scope="session")
def toy(shared: Shared) -> Project:
    """A project with a kind more than there are, its study computed; not to be changed."""

    def build(folder: Path) -> Project:
        from toy import toy_project

        project = toy_project(folder)
        project.run()
        return project

    return shared.project("toy", build)


@pytest.fixture
def toy_copy(toy: Project, tmp_path: Path) -> Project:
    """The same, for one test to change."""
    return toy.copy(tmp_path / "project")
