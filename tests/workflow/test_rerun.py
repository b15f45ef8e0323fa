"""What is computed again after something was deleted or changed, and what is kept."""

from pathlib import Path

import pytest
from small_project import Project, written

from spinepipe.studies.read import check
from spinepipe.studies.registry import kind_of
from spinepipe.studies.study_files import StudyFiles

pytestmark = pytest.mark.slow

KIND = "joint_pose_sensitivity"
SIMULATION = "small/jobs/specimen=s01/pose=0005/stiffness=best02.parquet"
BOOTSTRAP = "small/bootstrap/specimen=s01/bootstrap=start/loading=dynamic/set=001.parquet"
CALIBRATION = "small/calibrations/specimen=s01/pose=0002.parquet"
JOB_FOLDERS = ("jobs", "bootstrap", "calibrations", "methods", "precision")

# Appended to the ranking of the copied package: another second set, all others the same.
OTHER_RANKING = """

import json
from pathlib import Path

from spinepipe.marks import KEY, with_mark, without_mark

_run = run


def run(**arguments):
    _run(**arguments)
    path = Path(arguments["output"])
    ranked = json.loads(path.read_text())
    mark, ranked = ranked[KEY], without_mark(ranked)
    ranked["s01"][1]["stiffness"] = ranked["s01"][0]["stiffness"]
    path.write_text(json.dumps(with_mark(ranked, mark), indent=1))
"""


def layout(project: Project) -> StudyFiles:
    """Names of the files of the study."""
    return kind_of(KIND).files.of(*check(project.folder, "small"))


def made_of(project: Project, *tables: str) -> set[str]:
    """Tables, figures and report that hang on any of these tables, their own files left out."""
    files, reached = layout(project), set(tables)
    jobs = [job for job in kind_of(KIND).analyses if set(job.writes) <= set(files.tables)]
    for _ in jobs:
        reached |= {name for job in jobs if reached & set(job.reads) for name in job.writes}
    figures = [name for name in files.figures if reached & set(files.figure(name).tables)]
    return {
        *(f"small/{name}.parquet" for name in reached - set(tables)),
        *(f"small/figures/{name}.{kind}" for name in figures for kind in ("svg", "png")),
        "small/report.html",
    }


def delete(project: Project, *names: str) -> None:
    for name in names:
        project.path(f"results/{name}").unlink()


def of_jobs(files: set[str]) -> set[str]:
    """Those that a job for one pose, set or the like writes."""
    return {name for name in files if "=" in name and name.split("/")[1] in JOB_FOLDERS}


def simulations(files: set[str]) -> set[str]:
    return {name for name in files if name.startswith("small/jobs/")}


def test_a_run_makes_every_table_and_figure(finished: Project) -> None:
    files = set(finished.files())
    assert {name.removeprefix("results/") for name in layout(finished).results()} <= files
    assert {"small/best.json", "small/model.yaml", "small/report.html"} <= files
    assert len(simulations(files)) == 6 * 3
    assert len([name for name in files if name.startswith("small/bootstrap/")]) == 3 * 2 + 2
    assert not list(finished.path("results").rglob("*.log"))


def test_nothing_is_computed_twice_also_after_other_comments(project: Project) -> None:
    for path in (project.path("spinepipe/frames.py"), project.job(KIND, "simulate")):
        path.write_text(f'"""Other words."""\n{path.read_text()}\n# a comment\n')
    assert project.rerun() == set()


def test_what_is_deleted_is_computed_alone_with_what_is_made_of_it(project: Project) -> None:
    content = project.contents()
    delete(project, SIMULATION)
    block = "small/blocks/simulations/specimen=s01/block=001.parquet"
    own = {SIMULATION, block, "small/simulations.parquet"}
    assert project.planned() == own | made_of(project, "simulations")

    before = project.files()
    project.run(f"results/{SIMULATION}")  # every target can be asked for by name
    assert written(before, project.files()) == {SIMULATION}

    delete(project, SIMULATION, CALIBRATION, BOOTSTRAP)
    again = project.rerun()
    assert {"small/calibrations.parquet", "small/best.json", "small/bootstrap.parquet"} <= again
    assert of_jobs(again) == {SIMULATION, CALIBRATION, BOOTSTRAP}  # the ranking stays as it was
    assert project.contents() == content


def test_a_new_ranking_reruns_the_simulations_that_use_it(project: Project) -> None:
    path = project.job(KIND, "rank")
    path.write_text(path.read_text() + OTHER_RANKING)
    again = of_jobs(project.rerun())
    assert again == {name for name in simulations(set(project.files())) if "best02" in name}
    assert project.planned() == set()


def test_another_study_leaves_the_files_of_the_first(project: Project) -> None:
    project.write_study("other", poses=2)
    project.edit("config/config.yaml", "[small]", "[small, other]")
    planned = project.planned()
    assert "other/report.html" in planned
    assert {Path(name).parts[0] for name in planned} == {"other"}


def test_changed_code_reruns_the_jobs_that_use_it(project: Project) -> None:
    path = project.job(KIND, "simulate")
    path.write_text(path.read_text() + "\n_UNUSED = 1\n")
    again = project.planned()
    assert len(simulations(again)) == 6 * 3
    assert of_jobs(again) == simulations(again)
    assert "small/calibrations.parquet" not in again
