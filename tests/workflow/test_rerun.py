"""What is computed again after something was deleted or changed, and what is kept."""

from pathlib import Path

import pytest
from small_project import Project, written

from spinepipe.studies.joint_pose_sensitivity import kind as layout

pytestmark = pytest.mark.slow

SIMULATION = "small/jobs/specimen=s01/pose=0005/stiffness=best02.parquet"
BOOTSTRAP = "small/bootstrap/specimen=s01/bootstrap=start/loading=dynamic/set=001.parquet"
CALIBRATION = "small/calibrations/specimen=s01/pose=0002.parquet"
FIGURES = {f"small/figures/{name}.{kind}" for name in layout.FIGURES for kind in ("svg", "png")}
OPTIONAL = (
    *("bootstrap", "method_fits", "success_by_method"),
    *("precision_errors", "landmark_precision", "required_precision", "against_gould_2024a"),
)
TABLES = {f"small/{name}.parquet" for name in (*layout.ALWAYS, *OPTIONAL)}
OF_SIMULATIONS = {
    f"small/{name}.parquet"
    for name in (
        *("summary", "statistics", "agreement", "variance_shares", "importance"),
        "against_gould_2024a",
    )
}
"""Tables that are made of the table of simulations."""

# Appended to the ranking of the copied package: another number in one of its sets.
OTHER_RANKING = """

_run = run


def run(**arguments):
    _run(**arguments)
    with open(arguments["output"]) as file:
        data = json.load(file)
    data["s01"][1]["stiffness"][0][0] *= 1.01
    with open(arguments["output"], "w") as file:
        json.dump(data, file)
"""


def rerun(project: Project) -> set[str]:
    before = project.files()
    project.run_all()
    return written(before, project.files())


def delete(project: Project, name: str) -> None:
    project.path(f"results/{name}").unlink()


def simulations(files: set[str]) -> set[str]:
    return {name for name in files if name.startswith("small/jobs/")}


def test_a_run_makes_every_table_and_figure(project: Project) -> None:
    files = set(project.files())
    others = {"small/best.json", "small/model.yaml", "small/report.html"}
    assert TABLES | FIGURES | others <= files
    assert len(simulations(files)) == 6 * 3
    assert len([name for name in files if name.startswith("small/bootstrap/")]) == 3 * 3 + 2
    assert not list(project.path("results").rglob("*.log"))


def test_a_second_run_computes_nothing(project: Project) -> None:
    assert rerun(project) == set()


def test_a_deleted_simulation_is_computed_alone(project: Project) -> None:
    content = project.contents()
    delete(project, SIMULATION)
    block = "small/blocks/simulations/specimen=s01/block=001.parquet"
    again = rerun(project)
    made_of_it = FIGURES | OF_SIMULATIONS | {"small/report.html"}
    assert again - made_of_it == {SIMULATION, block, "small/simulations.parquet"}
    assert OF_SIMULATIONS | {"small/report.html"} <= again
    assert project.contents() == content


def test_a_deleted_calibration_reruns_no_simulation_when_the_ranking_stays(
    project: Project,
) -> None:
    content = project.contents()
    delete(project, CALIBRATION)
    again = rerun(project)
    assert {CALIBRATION, "small/calibrations.parquet", "small/best.json"} <= again
    assert simulations(again) == set()
    assert project.contents() == content


def test_a_deleted_bootstrap_fit_is_computed_alone(project: Project) -> None:
    content = project.contents()
    delete(project, BOOTSTRAP)
    jobs = ("small/bootstrap/", "small/jobs/", "small/calibrations/", "small/methods/")
    assert {name for name in rerun(project) if name.startswith(jobs)} == {BOOTSTRAP}
    assert project.contents() == content


def test_a_new_limit_computes_no_fit_again(project: Project) -> None:
    """Filters and limits are applied to fits that are there."""
    project.edit("config/studies/small.yaml", "poses: 4", "poses: 4, rotation_limit_deg: 2.0")
    again = rerun(project)
    assert "small/required_precision.parquet" in again
    folders = ("small/precision/", "small/bootstrap/", "small/jobs/", "small/calibrations/")
    assert not [name for name in again if name.startswith(folders)]


def test_a_new_ranked_set_reruns_the_simulations_that_use_it(project: Project) -> None:
    path = project.path("spinepipe/jobs/rank.py")
    path.write_text(path.read_text() + OTHER_RANKING)
    again = simulations(rerun(project))
    assert again == {name for name in simulations(set(project.files())) if "best02" in name}
    assert rerun(project) == set()


def test_a_changed_study_reruns_only_its_own_jobs(project: Project) -> None:
    project.write_study("other", poses=2)
    project.edit("config/config.yaml", "[small]", "[small, other]")
    assert all(name.startswith("other/") for name in rerun(project))
    project.edit("config/studies/other.yaml", "seed: 1", "seed: 2")
    again = rerun(project)
    assert "other/landmarks.parquet" in again
    assert all(name.startswith("other/") for name in again)


def test_comments_and_docstrings_rerun_nothing(project: Project) -> None:
    for name in ("spinepipe/frames.py", "spinepipe/jobs/simulate.py"):
        path = project.path(name)
        path.write_text(f'"""Other words."""\n{path.read_text()}\n# a comment\n')
    assert rerun(project) == set()


def test_changed_code_reruns_the_jobs_that_use_it(project: Project) -> None:
    path = project.path("spinepipe/jobs/simulate.py")
    path.write_text(path.read_text() + "\n_UNUSED = 1\n")
    again = rerun(project)
    assert len(simulations(again)) == 6 * 3
    assert not any(Path(name).parts[1] == "calibrations" for name in again)


def test_every_target_can_be_asked_for_by_name(project: Project) -> None:
    delete(project, SIMULATION)
    before = project.files()
    done = project.snakemake("-j1", f"results/{SIMULATION}")
    assert done.returncode == 0, done.stdout
    assert written(before, project.files()) == {SIMULATION}
