"""One run of a small study of each kind makes all that the kind declares, and nothing else.

What would be caught: a rule or a job that makes other tables, columns, types or figures than are
declared, tables that do not say what they were made of, numbers that are none, a page that lacks
figures or fetches something, logs of jobs that went well. That results say nothing of the machine
is asked when the project is built (`small_project.Shared`).
"""

import re

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
    tables = layout(eight, kind).tables
    assert tables
    for name in tables:
        found = pq.read_table(eight.path(f"{layout(eight, kind).folder}/{name}.parquet"))
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
    for name in files.figures:
        assert f'id="figure-{name}"' in page, name
    assert "default-src 'none'" in page
    assert not FETCHES.search(page)
