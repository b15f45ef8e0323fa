"""A further kind of study costs one folder, one rules file, one study file and one page of docs.

Nothing else of the project is edited for it, and no result of another kind is computed again.
"""

import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from small_project import Project, Shared, copy_project

from spinepipe.tables import read_frame

pytestmark = pytest.mark.slow

TOY = Path(__file__).parents[1] / "cases" / "toy_kind"
DIGESTS = """
from spinepipe.jobs.code import code_digest
from spinepipe.studies.registry import kind_of, place_of
for kind in ("joint_pose_sensitivity", "cohort_stiffness"):
    for job in kind_of(kind).jobs:
        print(kind, job.name, code_digest(place_of(kind, job.name).partition(":")[0]))
"""


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


def build(folder: Path) -> Project:
    """A project with the kind added and its study built; and the digests of jobs before."""
    project = copy_project(folder)
    project.path("digests").write_text(python(project, "-c", DIGESTS))
    shutil.copytree(TOY / "joint_count", project.path("spinepipe/studies/joint_count"))
    shutil.copy(TOY / "joint_count.smk", project.path("workflow/rules"))
    shutil.copy(TOY / "counted.yaml", project.path("config/studies"))
    project.path("config/config.yaml").write_text("studies: [counted]\n")
    project.path("docs/studies").mkdir(parents=True)
    shutil.copy(TOY / "joint_count.md", project.path("docs/studies"))
    project.run()
    return project


@pytest.fixture
def built(shared: Shared) -> Project:
    """The same, built once and not to be changed."""
    return shared.project("toy", build)


@pytest.fixture
def extended(built: Project, tmp_path: Path) -> Project:
    """The same, for one test to change."""
    return built.copy(tmp_path / "project")


def test_its_tables_figure_and_report_are_built(built: Project) -> None:
    results = built.path("results/counted")
    joints = read_frame(results / "joints.parquet")
    assert dict(zip(joints["specimen"], joints["joints"], strict=True)) == {"s01": 6}
    assert read_frame(results / "totals.parquet")["joints"].tolist() == [6]
    assert "<svg" in (results / "figures" / "joint_bars.svg").read_text("utf-8")
    page = (results / "report.html").read_text("utf-8")
    assert "There are 6 joints." in page
    assert "Number of joints of each specimen." in page


def test_its_docs_are_generated(extended: Project) -> None:
    python(extended, "-m", "spinepipe.cli", "docs")
    page = extended.path("docs/studies/joint_count.md").read_text("utf-8")
    assert "what each count is multiplied by" in page
    assert "number of joints" in page


def test_a_wrong_setting_is_told_like_any_other(extended: Project) -> None:
    extended.path("config/studies/bad.yaml").write_text(
        "study: bad\nkind: joint_count\ncohort: palanca_l1l4\ntimes: 0\n"
    )
    done = extended.snakemake("-n", "results/bad/joints.parquet")
    assert done.returncode
    assert "times" in done.stdout
    assert "greater than or equal to 1" in done.stdout


def test_jobs_of_other_kinds_hang_on_nothing_of_it(built: Project) -> None:
    assert python(built, "-c", DIGESTS) == built.path("digests").read_text()


def test_only_what_looks_at_a_setting_is_made_again(extended: Project) -> None:
    study = extended.path("config/studies/counted.yaml")
    study.write_text(study.read_text("utf-8") + "shown: columns\n")
    planned = extended.planned()
    assert "counted/report.html" in planned
    assert not [name for name in planned if "joints" in name or "totals" in name]
