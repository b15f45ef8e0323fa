"""What holds for all tests: in which order they run, and projects that several look at."""

import os
from collections.abc import Iterator
from pathlib import Path

import pytest
from hypothesis import settings
from small_project import Project, Shared
from snakemake_starts import SnakemakeStarts

settings.register_profile("same everywhere", derandomize=True, deadline=None, database=None)
settings.load_profile("same everywhere")
"""Drawn examples are the same on each machine, and a slow one fails none of them."""


def pytest_configure(config: pytest.Config) -> None:
    """Starts of Snakemake are counted."""
    config.pluginmanager.register(SnakemakeStarts())


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Slow tests first. Those that share projects go to any worker, all others file by file."""
    items.sort(key=lambda item: item.get_closest_marker("slow") is None)
    for item in items:
        if "shared" not in getattr(item, "fixturenames", ()):
            item.add_marker(pytest.mark.xdist_group(item.path.stem))


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
    """A project whose studies, one of each kind, have been computed at once; not to be changed."""

    def build(folder: Path) -> Project:
        from small_studies import eight_kinds

        project = eight_kinds(folder)
        project.run()
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
