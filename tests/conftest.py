"""What holds for all tests: in which order they run, and projects that several look at."""

import os
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from hypothesis import settings
from small_project import Project, Shared, copy_project

settings.register_profile("same everywhere", derandomize=True, deadline=None, database=None)
settings.load_profile("same everywhere")
"""Drawn examples are the same on each machine, and a slow one fails none of them."""


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


@pytest.fixture
def new_project(tmp_path: Path) -> Callable[[int], Project]:
    """Makes a project without results, its study `small` with so many poses."""

    def make(poses: int) -> Project:
        project = copy_project(tmp_path / "project")
        project.write_study("small", poses)
        return project

    return make


@pytest.fixture(scope="session")
def finished(shared: Shared) -> Project:
    """A project whose study `small` (6 poses) has been computed; not to be changed."""

    def build(folder: Path) -> Project:
        project = copy_project(folder)
        project.write_study("small", poses=6)
        project.run()
        return project

    return shared.project("finished", build)


@pytest.fixture
def project(finished: Project, tmp_path: Path) -> Project:
    """The same, for one test to change."""
    return finished.copy(tmp_path / "project")
