"""One run of a small study of each kind makes all that the kind declares, and nothing else.

What would be caught: a rule or a job that makes other tables, columns, types or figures than are
declared, tables that do not say what they were made of, numbers that are none, a page that lacks
figures or fetches something, logs of jobs that went well, `full` that makes again what `all` has
made. That results say nothing of the machine
is asked when the project is built (`small_project.Shared`).
"""

import json
import re
from importlib import import_module
from pathlib import Path

import numpy as np
import pandas as pd
import pyarrow.dataset as ds
import pyarrow.parquet as pq
import pytest
from made_pages import SVG
from page_rules import faults_of_page, faults_of_told
from small_project import Project
from small_studies import SMALL

from spinepipe.report.forms.chart import Drawing
from spinepipe.report.page.study_page import ResultTables
from spinepipe.studies.read import check
from spinepipe.studies.registry import PACKAGE, files_of, kind_of
from spinepipe.studies.study_files import StudyFiles
from spinepipe.tables import StudyTables, arrow_schema

pytestmark = pytest.mark.slow

MAKERS = {b"seed", b"code_digest", b"config_digest", b"data_digest", b"result_digest"}
FETCHES = re.compile(r"""<(script|link|img|iframe)[^>]+(src|href)=["'](https?:)?//""")


def layout(project: Project, kind: str) -> StudyFiles:
    return files_of(*check(project.folder, kind))


def test_the_page_of_all_studies_names_each_below_its_question(eight: Project) -> None:
    """Pages of most were not asked for."""
    page = eight.path("results/index.html").read_text()
    assert set(re.findall(r"<b><(?:a|span)[^>]*>(\w+)<", page)) == set(SMALL)
    assert "8 studies: 1 up to date, 7 not finished" in page
    assert {kind_of(kind).question for kind in SMALL} <= set(re.findall(">([^<]+)</h2>", page))


@pytest.mark.parametrize("kind", SMALL)
def test_tables_are_as_declared_and_name_their_makers(eight: Project, kind: str) -> None:
    look_at_tables(eight, kind, full=False)


def look_at_tables(project: Project, kind: str, full: bool) -> None:
    tables = layout(project, kind).tables_of(full)
    assert tables
    for name in tables:
        found = pq.read_table(project.path(f"{layout(project, kind).folder}/{name}.parquet"))
        assert found.schema.remove_metadata() == arrow_schema(kind_of(kind).table(name)), name
        assert set(found.schema.metadata) >= MAKERS, name
        for column, values in zip(found.column_names, found.columns, strict=True):
            if str(values.type) == "double":
                assert np.isfinite(values.drop_null().to_numpy()).all(), (name, column)


@pytest.mark.parametrize("kind", SMALL)
def test_a_page_is_written_from_the_tables_of_all(eight: Project, kind: str) -> None:
    """All that it reads is there without those of `full`; its figures are left empty."""
    files, (study, cohort) = layout(eight, kind), check(eight.folder, kind)
    module = import_module(f"{PACKAGE}.{kind}.page")
    tables = [str(eight.path(name)) for name in files.table_files(files.tables, full=False)]
    others = files.other_files(files.told_in_report)
    others = {name: str(eight.path(path)) for name, path in others.items()}
    read = [path for path in tables if Path(path).stem in module.READ]
    drawings = {
        one.name: Drawing(one.name, one.title, "Words.", (SVG,))
        for one in kind_of(kind).figures
        if one.name in files.figures(full=False)
    }
    results = ResultTables(StudyTables.read(read, others), {}, drawings)
    page = module.page(study, cohort, results)
    assert list(faults_of_told(page.told)) == []
    html = page.html(study, cohort, results)
    assert list(faults_of_page(html)) == []
    look_at_page(html, files, full=False)


def look_at_page(page: str, files: StudyFiles, full: bool) -> None:
    assert "<figcaption>" in page
    assert "default-src 'none'" in page
    assert not FETCHES.search(page)


def look_at_results(project: Project, kind: str, full: bool) -> None:
    files = layout(project, kind)
    assert {name.removeprefix("results/") for name in files.results(full)} <= set(project.files())
    assert not list(project.path(f"results/{kind}").rglob("*.log"))
    page = project.path(files.page()).read_text()
    look_at_page(page, files, full=False)
    if files.adds:
        assert "`make full` makes them" in page
    package = json.loads(project.path(f"{files.folder}/datapackage.json").read_text("utf-8"))
    assert {one["name"] for one in package["resources"]} == set(files.tables_of(full))
    for one in package["resources"]:
        names = pq.read_schema(project.path(f"{files.folder}/{one['path']}")).names
        assert [field["name"] for field in one["schema"]["fields"]] == names


def test_a_study_that_is_all_computed_is_whole(eight: Project) -> None:
    look_at_results(eight, "range_of_motion", full=False)


def test_full_remakes_nothing_of_all(eight: Project, tmp_path: Path) -> None:
    project = eight.copy(tmp_path / "project")
    before, planned = set(project.files()), project.planned("full")
    assert not planned & before
    for kind in SMALL:
        whole = {name.removeprefix("results/") for name in layout(project, kind).results(full=True)}
        assert whole - before <= planned


@pytest.mark.full
def test_full_makes_all_tables_and_all_after_it_has_nothing_to_do(
    eight: Project, tmp_path: Path
) -> None:
    project = eight.copy(tmp_path / "project")
    project.run("all")
    before = project.files()
    again = project.rerun("full") & set(before)
    assert {Path(name).name for name in again} <= {"datapackage.json"}  # which lists all tables
    assert project.planned("all") == set()
    for kind in SMALL:
        look_at_tables(project, kind, full=True)
        look_at_results(project, kind, full=True)


TOGETHER = ("stiffness", "predicted_stiffness")
"""Two tables of the same job files: what was fitted, and what that predicts of others."""


@pytest.mark.parametrize("kind", SMALL)
def test_folders_of_job_files_open_as_one_data_set(eight: Project, kind: str) -> None:
    """By readers that make a column of ``name=value`` in paths; with the rows of the table."""
    files = layout(eight, kind)
    for name in (*files.made_of_jobs, *files.by_specimen):
        path = eight.path(f"{files.folder}/{name}.parquet")
        if not path.exists():  # of `full`
            continue
        whole, parts = pq.read_table(path), [files.block_files(name)]
        if name in files.made_of_jobs:
            places = files.blocks(name)
            parts.append([file for place in places for file in files.job_files(name, *place)])
        for made in parts:
            folders = {eight.path(re.split(r"/[a-z_]+-", file)[0]) for file in made}
            rows = whole.num_rows
            if name in TOGETHER and made is not parts[0]:
                files_of = [path for one in folders for path in one.rglob("*.parquet")]
                rows = sum(pq.read_metadata(one).num_rows for one in files_of)
            found = [ds.dataset(one, partitioning="hive").to_table() for one in folders]
            for one in found:
                assert one.schema.remove_metadata() == whole.schema.remove_metadata(), name
            assert sum(one.num_rows for one in found) == rows, name
            frames = [pd.read_parquet(one) for one in folders]
            assert sum(map(len, frames)) == rows, name
            assert {column for one in frames for column in one} == set(whole.column_names)
