"""A project with a kind of study made for tests: how many joints each specimen has.

Its jobs take milliseconds, so that what Snakemake does with jobs is all that takes time.
"""

import shutil
import subprocess
import sys
from pathlib import Path

import grid_cases
from small_project import Project, copy_project

KIND = Path(__file__).with_name("toy_kind")
STUDY = "counted"
SPECIMENS = tuple("abcdef")


def python(project: Project, *arguments: str) -> str:
    """What a program says that finds the package of the project."""
    done = subprocess.run(
        [sys.executable, *arguments],
        cwd=project.folder,
        env={**project.environment(), "PYTHONPATH": str(project.folder)},
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout
    return done.stdout


def add_kind(project: Project) -> None:
    """All that a further kind of study costs, and a study of it."""
    shutil.copytree(KIND / "joint_count", project.path("spinepipe/studies/joint_count"))
    shutil.copy(KIND / "joint_count.smk", project.path("workflow/rules"))
    shutil.copy(KIND / f"{STUDY}.yaml", project.path("config/studies"))
    project.path("docs/studies").mkdir(parents=True)
    shutil.copy(KIND / "joint_count.md", project.path("docs/studies"))


def toy_project(folder: Path) -> Project:
    """A project with the kind added and a study of it."""
    project = copy_project(folder, solves=False)
    grid_cases.project(folder, specimens=SPECIMENS)
    project.path(f"config/studies/{grid_cases.STUDY}.yaml").unlink()
    add_kind(project)
    project.path("config/config.yaml").write_text(f"studies: [{STUDY}]\n")
    return project
