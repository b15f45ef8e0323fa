"""A search for missing effects as Snakemake runs it: its files, and what is made again.

The search itself is replaced by one that hands over made-up results: these are tests of the rules.
What would be caught: a verdict that waits for pictures, another base model that goes unseen.
"""

import shutil
from pathlib import Path

import discrepancy_cases as cases
import pyarrow.parquet as pq
import pytest
from small_project import Project, Shared, copy_project

from spinepipe.marks import write_marked

pytestmark = [pytest.mark.slow, pytest.mark.full]

STUDY = "probe"
FOLDER = f"results/{STUDY}/discrepancy"
HANDING_OVER = '''"""Job: made-up results instead of a search."""

import json
from pathlib import Path

import pyarrow.parquet as pq

from spinepipe.jobs.digest import provenance
from spinepipe.jobs.inputs import study_of
from spinepipe.jobs.digest import base_marks
from spinepipe.marks import KEY, with_mark, write_marked
from spinepipe.tables import write


def run(root: str, study: str, threads: int, **files: str) -> None:
    """Each result from the folder ``made_up``, with the mark that it must have."""
    assert study == "probe"
    settings, cohort = study_of(root, study)
    known = provenance("search", settings, cohort, None, base_marks(root, settings.base.model))
    for path in map(Path, files.values()):
        made = Path(root, "made_up", path.name)
        if path.suffix == ".parquet":
            write(pq.read_table(made), path, known)
        elif path.suffix == ".json":
            path.write_text(json.dumps(with_mark(json.loads(made.read_text()), known[KEY])))
        else:
            write_marked(made.read_text(), path, known[KEY])
'''


def build(folder: Path) -> Project:
    """A project with a study whose results were all made by Snakemake."""
    project = copy_project(folder)
    shutil.rmtree(project.path("config"))
    cases.project(project.folder, "base: {model: base.yaml}\n")
    project.job("discrepancy", "search").write_text(HANDING_OVER)
    model = "model: m\ncohort: chains\neffects: [{effect: linear_bushing}]\n"
    made = cases.results(project.folder, "NAMED")
    for name in ("model_base.yaml", "model_with_effects.yaml"):
        (made / name).write_text(model)
    pq.read_table(made / "next_tests.parquet").to_pandas().to_csv(made / "design.csv", index=False)
    made.rename(project.path("made_up"))
    shutil.rmtree(project.path("results"))
    project.path("base.yaml").write_text(model)
    project.run()
    return project


@pytest.fixture
def searched(shared: Shared) -> Project:
    """The same, built once and not to be changed."""
    return shared.project("made_up_search", build)


def test_the_verdict_and_all_around_it_are_made(searched: Project) -> None:
    made = {name.removeprefix(f"{STUDY}/discrepancy/") for name in searched.files()}
    tables = {f"{name}.parquet" for name in ("gap", "candidates", "where", "confusions")}
    assert made >= tables | {"verdict.json", "held_out.parquet", "report.html"}
    assert made >= {"model_base.yaml", "model_with_effects.yaml", "figures/misfit.png"}
    report = searched.path(f"results/{STUDY}/report.html").read_text()
    assert "lacks neutral zone in flexion–extension" in report


def test_where_the_page_once_was_stays_a_target_that_leads_to_it(
    searched: Project, tmp_path: Path
) -> None:
    """Lost it is made when asked for; a page that an earlier version left there is replaced."""
    project = searched.copy(tmp_path / "project")
    former = project.path(f"{FOLDER}/report.html")
    leading = former.read_bytes()
    assert b'href="../report.html"' in leading
    former.unlink()
    assert project.planned() == set()
    assert f"{STUDY}/discrepancy/report.html" in project.planned(f"{FOLDER}/report.html")
    write_marked("an earlier page", former, "0" * 64)
    project.run()
    assert former.read_bytes() == leading


def test_the_verdict_alone_needs_no_picture(searched: Project, tmp_path: Path) -> None:
    project = searched.copy(tmp_path / "project")
    assert project.planned() == set()
    shutil.rmtree(project.path("results"))
    planned = project.planned(f"{FOLDER}/verdict.json")
    assert f"{STUDY}/discrepancy/verdict.json" in planned
    assert not [name for name in planned if "figures" in name or name.endswith(".html")]


def test_another_base_is_another_search(searched: Project, tmp_path: Path) -> None:
    project = searched.copy(tmp_path / "project")
    project.edit("base.yaml", "model: m", "model: other")
    assert f"{STUDY}/discrepancy/verdict.json" in project.rerun(f"{FOLDER}/verdict.json")
    assert project.planned(f"{FOLDER}/verdict.json") == set()
