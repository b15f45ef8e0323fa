"""A further kind of study costs one folder, one rules file, one study file and one page of docs.

What would be caught: a list of kinds somewhere that a new kind must be entered in, and what `full`
makes that `all` sees or makes again. That results of other kinds do not hang on it: `test_rerun`.
"""

import pytest
from small_project import Project
from toy import SPECIMENS, python

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
    assert "Joints counted." in page
    assert "shares (`make full` makes them" in page
    assert {name for name in toy.files() if "shares" in name or "full" in name} == set()


def test_full_adds_to_all_and_all_after_it_has_nothing_to_do(toy_copy: Project) -> None:
    assert toy_copy.rerun("full") == {
        "counted/shares.parquet",
        "counted/full.html",
        "counted/datapackage.json",
    }
    assert toy_copy.planned("all") == set()


def test_its_docs_are_generated(toy_copy: Project) -> None:
    python(toy_copy, "-m", "spinepipe.cli", "docs")
    page = toy_copy.path("docs/studies/joint_count.md").read_text("utf-8")
    assert "what each count is multiplied by" in page
    assert "number of joints" in toy_copy.path("docs/table/joint_count/joints.md").read_text(
        "utf-8"
    )


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
