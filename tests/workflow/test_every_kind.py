"""One run of a small study of each kind makes all that the kind declares, and nothing else.

What would be caught: a rule or a job that makes other tables, columns, types or figures than are
declared, tables that do not say what they were made of, numbers that are none, a page that lacks
figures or fetches something, logs of jobs that went well, `full` that makes again what `all` has
made. That results say nothing of the machine
is asked when the project is built (`small_project.Shared`).
"""

import re
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest
from small_project import Project
from small_studies import SMALL

from spinepipe.studies.read import check
from spinepipe.studies.registry import files_of, kind_of
from spinepipe.studies.study_files import StudyFiles

pytestmark = pytest.mark.slow

MAKERS = {b"seed", b"code_digest", b"config_digest", b"data_digest", b"result_digest"}
FETCHES = re.compile(r"""<(script|link|img|iframe)[^>]+(src|href)=["'](https?:)?//""")


def layout(project: Project, kind: str) -> StudyFiles:
    return files_of(*check(project.folder, kind))


@pytest.mark.parametrize("kind", SMALL)
def test_tables_are_as_declared_and_name_their_makers(eight: Project, kind: str) -> None:
    look_at_tables(eight, kind, full=False)


def look_at_tables(project: Project, kind: str, full: bool) -> None:
    tables = layout(project, kind).tables_of(full)
    assert tables
    for name in tables:
        found = pq.read_table(project.path(f"{layout(project, kind).folder}/{name}.parquet"))
        assert found.schema.remove_metadata() == kind_of(kind).table(name).schema, name
        assert set(found.schema.metadata) >= MAKERS, name
        for column, values in zip(found.column_names, found.columns, strict=True):
            if str(values.type) == "double":
                assert np.isfinite(values.drop_null().to_numpy()).all(), (name, column)


@pytest.mark.parametrize("kind", SMALL)
def test_results_are_whole_and_the_page_opens_alone(eight: Project, kind: str) -> None:
    files = layout(eight, kind)
    assert {name.removeprefix("results/") for name in files.results()} <= set(eight.files())
    assert not list(eight.path(f"results/{kind}").rglob("*.log"))
    page = eight.path(f"{files.folder}/report.html").read_text()
    for name in files.figures(full=False):
        assert f'id="figure-{name}"' in page, name
    assert "default-src 'none'" in page
    assert not FETCHES.search(page)


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
    before = project.files()
    again = project.rerun("full")
    assert not again & set(before)
    assert project.planned("all") == set()
    for kind in SMALL:
        look_at_tables(project, kind, full=True)
