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
DIGESTS = """
from spinepipe.jobs.code import code_digest
from spinepipe.studies.registry import kind_of, place_of
for kind in ("joint_pose_sensitivity", "cohort_stiffness"):
    for job in kind_of(kind).jobs:
        print(kind, job.name, code_digest(place_of(kind, job.name).partition(":")[0]))
"""
"""Prints the digests of what jobs of other kinds hang on."""


def python(project: Project, *arguments: str, fails: bool = False) -> str:
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
    assert bool(done.returncode) == fails, done.stdout
    return done.stdout


def toy_project(folder: Path) -> Project:
    """A project with the kind added and a study of it; and the digests of jobs before."""
    project = copy_project(folder)
    project.path("digests").write_text(python(project, "-c", DIGESTS))
    grid_cases.project(folder, specimens=SPECIMENS)
    project.path(f"config/studies/{grid_cases.STUDY}.yaml").unlink()
    shutil.copytree(KIND / "joint_count", project.path("spinepipe/studies/joint_count"))
    shutil.copy(KIND / "joint_count.smk", project.path("workflow/rules"))
    shutil.copy(KIND / f"{STUDY}.yaml", project.path("config/studies"))
    project.path("config/config.yaml").write_text(f"studies: [{STUDY}]\n")
    project.path("docs/studies").mkdir(parents=True)
    shutil.copy(KIND / "joint_count.md", project.path("docs/studies"))
    return project
