"""A search for missing effects from end to end: rules, search, figures and report, on two chains.

A straight chain turns joint by joint, so its flexion under a law k q + r q^3 is the root of a
cubic, solved here by numpy: the hidden truth is stiffening, and nothing of spinepipe makes it.
"""

import json
import re
import shutil
from pathlib import Path

import pyarrow.parquet as pq
import pytest
from small_project import Project, Shared, copy_project, written
from stiffening_chains import STUDY, chains

from spinepipe.studies.registry import kind_of

pytestmark = pytest.mark.slow

FOLDER = f"results/{STUDY}/discrepancy"

TABLES = (
    *("gap", "candidates", "where", "confusions", "held_out", "imperfections"),
    *("field_numbers", "tabulated", "next_tests"),
)


def build(folder: Path) -> Project:
    """The project after one run of everything."""
    project = copy_project(folder)
    shutil.rmtree(project.path("config"))
    chains(project.folder)
    project.run()
    return project


@pytest.fixture
def searched(shared: Shared) -> Project:
    """The same, built once and not to be changed."""
    return shared.project("search", build)


def test_the_search_finds_what_the_chains_hide(searched: Project) -> None:
    verdict = json.loads(searched.path(f"{FOLDER}/verdict.json").read_text())
    assert verdict["verdict"] == "NAMED"
    assert [one["name"] for one in verdict["effects"]] == ["nonlinear_stiffening"]
    assert verdict["gap"]["with_effects"] < 0.1 * verdict["gap"]["base"]
    assert verdict["gap"]["held_out_closed"] > 0.9


def test_every_result_is_there_and_holds_its_schema(searched: Project) -> None:
    rows = {}
    for name in TABLES:
        table = pq.read_table(searched.path(f"{FOLDER}/{name}.parquet"))
        schema = kind_of("discrepancy").table(name)
        assert table.column_names == [column.name for column in schema.columns]
        rows[name] = table.num_rows
    assert rows["gap"] == 2 * 2 * 6 * 3 * 3  # specimens, tests, steps, joints, rotations
    assert rows["held_out"] == 2 + 2  # specimens and tests
    assert rows.pop("next_tests") == rows.pop("tabulated") == 0  # all is named
    assert min(rows.values()) > 0
    assert searched.path(f"{FOLDER}/design.csv").read_text().startswith("effect_or_pair,test,")
    figures = {path.stem for path in searched.path(f"{FOLDER}/figures").glob("*.svg")}
    assert figures == {path.stem for path in searched.path(f"{FOLDER}/figures").glob("*.png")}
    assert figures == {figure.name for figure in kind_of("discrepancy").figures}


def test_the_report_opens_alone(searched: Project) -> None:
    page = searched.path(f"{FOLDER}/report.html").read_text()
    assert "The model lacks nonlinear stiffening" in page
    assert not re.search(r"""<(script|link|img|iframe)[^>]+(src|href)=["'](https?:)?//""", page)


def test_a_search_made_again_finds_its_pieces(searched: Project, tmp_path: Path) -> None:
    project = searched.copy(tmp_path / "project")
    assert project.planned() == set()
    before, contents = project.files(), project.contents()
    project.run("--force", f"{FOLDER}/verdict.json")
    made = written(before, project.files())
    assert f"{STUDY}/discrepancy/verdict.json" in made
    assert not [name for name in made if "/store/" in name]
    assert {name for name in made if project.contents()[name] != contents[name]} == set()
