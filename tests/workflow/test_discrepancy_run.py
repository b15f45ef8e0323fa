"""A search for missing effects as Snakemake runs it: its files, and what is made again.

The search itself is replaced by one that hands over made-up results: these are tests of the rules.
"""

import importlib
import shutil
from pathlib import Path
from types import ModuleType

import pytest
from small_project import Project, copy_project, written

pytestmark = pytest.mark.slow

STUDY = "probe"
FOLDER = f"results/{STUDY}/discrepancy"
HANDING_OVER = '''"""Job: made-up results instead of a search."""

import json
from pathlib import Path

import pyarrow.parquet as pq

from spinepipe.jobs.inputs import study_of_kind
from spinepipe.jobs.model_mark import base_marks
from spinepipe.jobs.provenance import provenance
from spinepipe.marks import KEY, with_mark, write_marked
from spinepipe.studies import Discrepancy
from spinepipe.tables import write


def run(root: str, study: str, **files: str) -> None:
    """Copy each result from the folder ``made_up``, marked."""
    assert study == "probe"
    settings, cohort = study_of_kind(Discrepancy, root, study)
    marks = base_marks(root, settings.base.model)
    made_by = provenance("discrepancy.search", settings, cohort, None, marks)
    for path in files.values():
        source = Path(root, "made_up", Path(path).name)
        if source.suffix == ".parquet":
            write(pq.read_table(source), path, made_by)
        elif source.suffix == ".yaml":
            write_marked(source.read_text(), path, made_by[KEY])
        else:
            data = with_mark(json.loads(source.read_text()), made_by[KEY])
            Path(path).write_text(json.dumps(data))
'''


def made_up_cases() -> ModuleType:
    """The made-up results of the unit tests, whose folder pytest knows only when it runs them."""
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(Path(__file__).parents[1] / "unit")
        return importlib.import_module("discrepancy_cases")


@pytest.fixture(scope="module")
def searched(tmp_path_factory: pytest.TempPathFactory) -> Project:
    """A project with a study whose results were all made by Snakemake."""
    cases = made_up_cases()
    project = copy_project(tmp_path_factory.mktemp("searched") / "project")
    shutil.rmtree(project.path("config"))
    cases.project(project.folder, "base: {model: base.yaml}\n")
    search = project.path("spinepipe/jobs/discrepancy/search.py")
    search.write_text(HANDING_OVER)
    model = "model: m\ncohort: chains\neffects: [{effect: linear_bushing}]\n"
    made = cases.results(project.folder, "NAMED")
    for name in ("model_base.yaml", "model_with_effects.yaml"):
        (made / name).write_text(model)
    made.rename(project.path("made_up"))
    shutil.rmtree(project.path("results"))
    project.path("base.yaml").write_text(model)
    project.run_all()
    return project


def test_the_verdict_and_all_around_it_are_made(searched: Project) -> None:
    made = {name.removeprefix(f"{STUDY}/discrepancy/") for name in searched.files()}
    tables = {f"{name}.parquet" for name in ("gap", "candidates", "where", "confusions")}
    assert made >= tables | {"verdict.json", "held_out.parquet", "report.html"}
    assert made >= {"model_base.yaml", "model_with_effects.yaml", "figures/gap_map.png"}
    report = searched.path(f"{FOLDER}/report.html").read_text()
    assert "The model lacks a neutral zone" in report
    before = searched.files()
    searched.run_all()
    assert written(before, searched.files()) == set()


def test_the_verdict_alone_needs_no_picture(searched: Project, tmp_path: Path) -> None:
    project = Project(tmp_path / "project")
    shutil.copytree(searched.folder, project.folder)
    shutil.rmtree(project.path("results"))
    done = project.snakemake("-j2", f"{FOLDER}/verdict.json")
    assert done.returncode == 0, done.stdout
    assert not [name for name in project.files() if "figures" in name or name.endswith(".html")]


def test_another_base_is_another_search(searched: Project, tmp_path: Path) -> None:
    project = Project(tmp_path / "project")
    shutil.copytree(searched.folder, project.folder)
    before = project.files()
    project.edit("base.yaml", "model: m", "model: other")
    project.run_all()
    assert f"{STUDY}/discrepancy/verdict.json" in written(before, project.files())


def test_lint_finds_nothing_in_the_rules_of_a_search(searched: Project) -> None:
    done = searched.snakemake("--lint")
    assert done.returncode == 0, done.stdout
