"""The workflow passes Snakemake's own checks and its figures reach the report."""

import shutil
from collections.abc import Callable
from pathlib import Path

import pytest
from small_project import Project

from spinepipe.studies.read import names_by_kind
from spinepipe.studies.registry import kind_names, kind_of

pytestmark = pytest.mark.slow

ROOT = Path(__file__).parents[2]


def test_lint_finds_nothing_in_the_rules_of_any_kind(
    new_project: Callable[[int], Project],
) -> None:
    project = new_project(6)
    shutil.copytree(ROOT / "config/studies", project.path("config/studies"), dirs_exist_ok=True)
    assert set(names_by_kind(project.folder)) == set(kind_names())
    done = project.snakemake("--lint")
    assert done.returncode == 0, done.stdout


def test_figures_are_in_the_report(project: Project) -> None:
    done = project.snakemake("--report", "report.html")
    assert done.returncode == 0, done.stdout
    report = project.path("report.html").read_text()
    figures = kind_of("joint_pose_sensitivity").figures
    assert all(f"{figure.name}.svg" in report for figure in figures)
