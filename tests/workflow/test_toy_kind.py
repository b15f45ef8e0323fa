"""A further kind of study costs one folder, one rules file, one study file and one page of docs.

What would be caught: a list of kinds somewhere that a new kind must be entered in, and results of
other kinds that hang on it.
"""

import pytest
from small_project import Project
from toy import DIGESTS, SPECIMENS, python

from spinepipe.tables import read_frame

pytestmark = pytest.mark.slow


def test_its_tables_figure_and_report_are_built(toy: Project) -> None:
    results = toy.path("results/counted")
    joints = read_frame(results / "joints.parquet")
    assert dict(zip(joints["specimen"], joints["joints"], strict=True)) == dict.fromkeys(
        SPECIMENS, 6
    )
    assert read_frame(results / "totals.parquet")["joints"].tolist() == [36]
    assert "<svg" in (results / "figures" / "joint_bars.svg").read_text("utf-8")
    page = (results / "report.html").read_text("utf-8")
    assert "There are 36 joints." in page
    assert "Number of joints of each specimen." in page


def test_its_docs_are_generated_and_a_wrong_setting_is_told(toy_copy: Project) -> None:
    python(toy_copy, "-m", "spinepipe.cli", "docs")
    page = toy_copy.path("docs/studies/joint_count.md").read_text("utf-8")
    assert "what each count is multiplied by" in page
    assert "number of joints" in page
    toy_copy.edit("config/studies/counted.yaml", "times: 2", "times: 0")
    said = python(toy_copy, "-m", "spinepipe.cli", "check", fails=True)
    assert "times" in said
    assert "greater than or equal to 1" in said


def test_jobs_of_other_kinds_hang_on_nothing_of_it(toy: Project) -> None:
    assert python(toy, "-c", DIGESTS) == toy.path("digests").read_text()


@pytest.mark.full
def test_only_what_looks_at_a_setting_is_made_again(toy_copy: Project) -> None:
    study = toy_copy.path("config/studies/counted.yaml")
    study.write_text(study.read_text("utf-8") + "shown: columns\n")
    planned = toy_copy.planned()
    assert "counted/report.html" in planned
    assert not [name for name in planned if "joints" in name or "totals" in name]


@pytest.mark.full
def test_figures_are_in_snakemake_s_own_report(toy_copy: Project) -> None:
    done = toy_copy.snakemake("--report", "report.html")
    assert done.returncode == 0, done.stdout
    assert "joint_bars.svg" in toy_copy.path("report.html").read_text()
