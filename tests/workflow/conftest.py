"""Projects for the tests of the workflow: without results, or with a computed study."""

import shutil
from collections.abc import Callable
from pathlib import Path

import pytest
from small_project import SKIPPED, Project, copy_project


@pytest.fixture
def new_project(tmp_path: Path) -> Callable[[int], Project]:
    """Makes a project without results, its study `small` with so many poses."""

    def make(poses: int) -> Project:
        project = copy_project(tmp_path / "project")
        project.write_study("small", poses)
        return project

    return make


@pytest.fixture(scope="session")
def _finished(tmp_path_factory: pytest.TempPathFactory) -> Project:
    project = copy_project(tmp_path_factory.mktemp("finished") / "project")
    project.write_study("small", poses=6)
    project.run_all()
    return project


@pytest.fixture
def project(_finished: Project, tmp_path: Path) -> Project:
    """A project whose study `small` (6 poses) has been computed; each test has its own."""
    shutil.copytree(_finished.folder, tmp_path / "project", ignore=SKIPPED)
    return Project(tmp_path / "project")
