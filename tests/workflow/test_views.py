"""Snakemake's own commands on the project: what they show, and that they change no result.

What would be caught: a look that makes a file newer or another, a command of Snakemake that ends
with a Python stack, and a `--touch` that has outdated results believed.
"""

import shutil
import tarfile
from collections.abc import Iterator
from pathlib import Path
from zipfile import ZipFile

import pytest
from small_project import Project
from toy import STUDY

pytestmark = [pytest.mark.slow, pytest.mark.full]

REPORT = f"results/{STUDY}/report.html"
OUTDATED = {
    f"{STUDY}/report.html",
    *(f"{STUDY}/figures/joint_bars.{kind}" for kind in ("svg", "pdf", "png")),
}
"""What a change of `shown` makes anew."""

BESIDE = {f"{STUDY}/datapackage.json", f"{STUDY}/conclusions.parquet"}
"""What is written along with a page, and no rule names."""


@pytest.fixture
def looked_at(toy_copy: Project) -> Iterator[Project]:
    """A project of which no result may be changed."""
    before = toy_copy.files()
    yield toy_copy
    assert toy_copy.files() == before


def seen(project: Project, *arguments: str) -> str:
    """What Snakemake said, which has to end well."""
    done = project.snakemake(*arguments)
    assert done.returncode == 0, done.stdout
    assert "Traceback" not in done.stdout
    return done.stdout


def show_columns(project: Project) -> None:
    """Change a setting at which the figure and the page look, and no table."""
    study = project.path(f"config/studies/{STUDY}.yaml")
    study.write_text(study.read_text("utf-8") + "shown: columns\n")


@pytest.mark.parametrize("changed", [False, True])
def test_looking_shows_what_is_to_be_done_and_changes_no_result(
    looked_at: Project, changed: bool
) -> None:
    if changed:
        show_columns(looked_at)
    for asked in ("--summary", "--detailed-summary"):
        lines = [line.split("\t") for line in seen(looked_at, asked).splitlines()]
        plans = {line[0].removeprefix("results/"): line[-1] for line in lines if len(line) > 1}
        pending = {name for name, plan in plans.items() if plan == "update pending"}
        assert set(plans) - {"output_file"} == set(looked_at.files()) - BESIDE
        assert pending == (OUTDATED if changed else set())
    graph = seen(looked_at, "--dag")
    assert 'label = "count_joints\\nspecimen: f\\nstudy: counted"' in graph
    drawn = [line for line in graph.splitlines() if "label = " in line]
    bold = {line.split('"')[1].split("\\n")[0] for line in drawn if "dashed" not in line}
    assert bold == ({"joint_count_figure", "joint_count_report", "all"} if changed else set())
    assert 'label = "joint_count_totals"' in seen(looked_at, "--rulegraph")
    assert looked_at.planned() == (OUTDATED if changed else set())
    assert "Unlocked" in seen(looked_at, "--unlock")


def test_rules_are_listed_and_clean_and_a_wrong_target_is_told(looked_at: Project) -> None:
    assert {"all", "full", "count_joints", "joint_count_report"} <= set(
        seen(looked_at, "--list-rules").splitlines()
    )
    assert "good condition" in seen(looked_at, "--lint")
    for target in ("al", f"results/{STUDY}/nothing.parquet"):
        done = looked_at.snakemake("-j1", target)
        assert done.returncode == 1
        assert f"No rule to produce {target}" in done.stdout
        assert "Traceback" not in done.stdout


def test_report_and_archive_of_snakemake(looked_at: Project) -> None:
    seen(looked_at, "--report", "snakemake.html")
    assert "joint_bars.svg" in looked_at.path("snakemake.html").read_text("utf-8")
    seen(looked_at, "--archive", "archive.tar.gz")
    with tarfile.open(looked_at.path("archive.tar.gz")) as archive:
        assert {"Snakefile", "workflow/rules/common.smk"} <= set(archive.getnames())


def test_touched_files_are_as_they_were_and_believed_only_if_they_are_right(
    toy_copy: Project,
) -> None:
    content = toy_copy.contents()
    seen(toy_copy, "-j1", "--touch", "--forceall")
    assert toy_copy.contents() == content
    assert toy_copy.planned() == set()
    show_columns(toy_copy)
    seen(toy_copy, "-j1", "--touch")
    assert toy_copy.contents() == content
    assert toy_copy.planned() == OUTDATED
    assert toy_copy.rerun() == {*OUTDATED, *BESIDE}


def test_all_output_can_be_deleted_and_comes_out_the_same(toy_copy: Project) -> None:
    content = toy_copy.contents()
    seen(toy_copy, "-j1", "--delete-all-output", "-n")
    assert toy_copy.contents() == content
    seen(toy_copy, "-j1", "--delete-all-output")
    assert set(toy_copy.files()) == BESIDE
    toy_copy.run()
    assert set(toy_copy.files()) == set(content)


def test_an_archived_study_is_made_again_as_it_was(toy_copy: Project, tmp_path: Path) -> None:
    """From the archive and the code alone: the job files that are not in it are missed."""
    assert "counted.zip: " in toy_copy.spinepipe("archive", STUDY)
    content = toy_copy.contents()
    for part in ("config", "results", ".snakemake"):
        shutil.rmtree(toy_copy.path(part))
    with ZipFile(toy_copy.path("counted.zip")) as archive:
        archive.extractall(tmp_path)
    for part in ("config", "results"):
        shutil.move(tmp_path / STUDY / part, toy_copy.path(part))
    assert not [name for name in toy_copy.files() if "specimen-" in name]
    toy_copy.run()
    again = toy_copy.contents()
    assert set(again) == set(content)
    assert {name for name in content if again[name] != content[name]} == set()
