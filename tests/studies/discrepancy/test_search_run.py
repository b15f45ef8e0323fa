"""A search for missing effects as Snakemake runs it, on two chains.

A straight chain turns joint by joint, so its flexion under a law k q + r q^3 is the root of a
cubic, solved here by numpy: the hidden truth is stiffening, and nothing of spinepipe makes it.

What would be caught: a search that does not name what is hidden, or whose rows are not those of
its study; files of its store that are not found again.
"""

import json
from pathlib import Path

import pyarrow.parquet as pq
import pytest
from small_project import Project, written

pytestmark = pytest.mark.slow

STUDY = "discrepancy"
FOLDER = f"results/{STUDY}/discrepancy"
TABLES = (
    *("gap", "candidates", "where", "confusions", "held_out", "imperfections"),
    *("field_numbers", "tabulated", "next_tests"),
)


def test_the_search_finds_what_the_chains_hide(eight: Project) -> None:
    verdict = json.loads(eight.path(f"{FOLDER}/verdict.json").read_text())
    assert verdict["verdict"] == "NAMED"
    assert [one["name"] for one in verdict["effects"]] == ["nonlinear_stiffening"]
    assert verdict["gap"]["with_effects"] < 0.1 * verdict["gap"]["base"]
    assert verdict["gap"]["held_out_closed"] > 0.9


def test_every_result_holds_the_rows_of_its_study(eight: Project) -> None:
    rows = {
        name: pq.read_metadata(eight.path(f"{FOLDER}/{name}.parquet")).num_rows for name in TABLES
    }
    assert rows["gap"] == 2 * 2 * 6 * 3 * 3  # specimens, tests, steps, joints, rotations
    assert rows["held_out"] == 2 + 2  # tests, specimens
    assert rows.pop("next_tests") == rows.pop("tabulated") == 0  # all is named
    assert min(rows.values()) > 0
    assert eight.path(f"{FOLDER}/design.csv").read_text().startswith("effect_or_pair,test,")


@pytest.mark.full
def test_a_search_made_again_finds_its_pieces(eight: Project, tmp_path: Path) -> None:
    project = eight.copy(tmp_path / "project")
    before, contents = project.files(), project.contents()
    project.run("--force", f"{FOLDER}/verdict.json")
    made = written(before, project.files())
    assert f"{STUDY}/discrepancy/verdict.json" in made
    assert not [name for name in made if "/store/" in name]
    assert {name for name in made if project.contents()[name] != contents[name]} == set()
