"""The workflow passes Snakemake's own checks and its figures reach the report."""

import pytest
from small_project import Project

from spinepipe.studies.joint_pose_sensitivity.kind import FIGURES

pytestmark = pytest.mark.slow


def test_lint_finds_nothing(project: Project) -> None:
    done = project.snakemake("--lint")
    assert done.returncode == 0, done.stdout


def test_figures_are_in_the_report(project: Project) -> None:
    done = project.snakemake("--report", "report.html")
    assert done.returncode == 0, done.stdout
    report = project.path("report.html").read_text()
    assert all(f"{name}.svg" in report for name in FIGURES)
