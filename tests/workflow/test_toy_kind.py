"""A further kind of study costs one folder, one rules file, one study file and one page of docs.

Nothing else of the project is edited for it, and no result of another kind is computed again.
"""

import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from small_project import Project, copy_project

from spinepipe.tables import read_frame

pytestmark = pytest.mark.slow

TOY = Path(__file__).parents[1] / "cases" / "toy_kind"
DIGESTS = """
from spinepipe.jobs.digest import code_digest
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


@pytest.fixture(scope="module")
def extended(tmp_path_factory: pytest.TempPathFactory) -> tuple[Project, str]:
    """A project with the kind added and its study built; and the digests of jobs before."""
    project = copy_project(tmp_path_factory.mktemp("toy") / "project")
    before = python(project, "-c", DIGESTS)
    shutil.copytree(TOY / "joint_count", project.path("spinepipe/studies/joint_count"))
    shutil.copy(TOY / "joint_count.smk", project.path("workflow/rules"))
    shutil.copy(TOY / "counted.yaml", project.path("config/studies"))
    project.path("config/config.yaml").write_text("studies: [counted]\n")
    project.path("docs/studies").mkdir(parents=True)
    shutil.copy(TOY / "joint_count.md", project.path("docs/studies"))
    project.run_all()
    return project, before


def test_its_tables_figure_and_report_are_built(extended: tuple[Project, str]) -> None:
    project, _ = extended
    results = project.path("results/counted")
    joints = read_frame(results / "joints.parquet")
    assert dict(zip(joints["specimen"], joints["joints"], strict=True)) == {"sheep": 6} or len(
        joints
    )
    assert read_frame(results / "totals.parquet")["joints"].tolist() == [joints["joints"].sum()]
    assert "<svg" in (results / "figures" / "joint_bars.svg").read_text("utf-8")
    page = (results / "report.html").read_text("utf-8")
    assert f"There are {joints['joints'].sum()} joints." in page
    assert "Number of joints of each specimen." in page


def test_its_docs_are_generated(extended: tuple[Project, str]) -> None:
    project, _ = extended
    python(project, "-m", "spinepipe.cli", "docs")
    page = project.path("docs/studies/joint_count.md").read_text("utf-8")
    assert "what each count is multiplied by" in page
    assert "number of joints" in page


def test_a_wrong_setting_is_told_like_any_other(extended: tuple[Project, str]) -> None:
    project, _ = extended
    bad = project.path("config/studies/bad.yaml")
    bad.write_text("study: bad\nkind: joint_count\ncohort: palanca_l1l4\ntimes: 0\n")
    try:
        done = project.snakemake("-n", "results/bad/joints.parquet")
    finally:
        bad.unlink()
    assert done.returncode
    assert "times" in done.stdout
    assert "greater than or equal to 1" in done.stdout


def test_jobs_of_other_kinds_hang_on_nothing_of_it(extended: tuple[Project, str]) -> None:
    project, before = extended
    assert python(project, "-c", DIGESTS) == before


def test_only_what_looks_at_a_setting_is_made_again(extended: tuple[Project, str]) -> None:
    project, _ = extended
    project.path("config/studies/counted.yaml").write_text(
        (TOY / "counted.yaml").read_text("utf-8") + "shown: columns\n"
    )
    told = project.snakemake("-n", "all").stdout
    assert "joint_count_report" in told
    assert "count_joints" not in told
