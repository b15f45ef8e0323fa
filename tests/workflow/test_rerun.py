"""What is computed again after something was deleted or changed, and what is kept.

What would be caught: a job that is not made again though what it reads has changed (its mark does
not reach the rule), or is though nothing has; a lost file that nobody misses; a look at what is to
be done that changes or reads what it must not.
"""

import os
from pathlib import Path

import planted
import pytest
from small_project import Project, written
from small_studies import SMALL
from toy import add_kind

from spinepipe.studies.read import check
from spinepipe.studies.registry import files_of, kind_of

pytestmark = pytest.mark.slow

POSES = "joint_pose_sensitivity"
SIMULATIONS = f"{POSES}/jobs/"
BATCH = "global_sensitivity/jobs/responses/specimen=b/batch=00002.parquet"
MOTION = "tracking/opensim/a/flexion_extension/optk_generic.mot"
"""Lost files."""

UNTOUCHED = ("scoliosis", "trunk_loads")


def made_of(project: Project, *tables: str) -> set[str]:
    """Tables of joint poses that hang on any of these tables, but they."""
    files, reached = files_of(*check(project.folder, POSES)), set(tables)
    tables_of_all = set(files.tables_of(full=False))
    jobs = [job for job in kind_of(POSES).analyses if set(job.writes) <= tables_of_all]
    for _ in jobs:
        reached |= {name for job in jobs if reached & set(job.reads) for name in job.writes}
    return {f"{POSES}/{name}.parquet" for name in reached - set(tables)}


def of_jobs(files: set[str]) -> set[str]:
    """Those that a job for one pose, batch or the like writes."""
    return {name for name in files if "=" in name and "/blocks/" not in name}


def test_one_look_plans_what_hangs_on_each_change_and_nothing_else(
    eight: Project, tmp_path: Path
) -> None:
    """A change in each of five studies, none in two; a study, a kind, an effect more; pickles.

    The search alone tries each effect that there is.
    """
    project = eight.copy(tmp_path / "project")
    frames, simulate = project.path("spinepipe/frames.py"), project.job(POSES, "simulate")
    frames.write_text(f'"""Other words."""\n{frames.read_text()}\n# a comment\n')
    simulate.write_text(simulate.read_text() + "\n_UNUSED = 1\n")
    project.edit("config/studies/cohort_stiffness.yaml", "significance: 0.05", "significance: 0.01")
    project.edit("config/cohorts/stack/joints.csv", "b,L2L3,0,36,", "b,L2L3,0,37,")
    effects = project.path("spinepipe/effects")
    another = (effects / "hysteresis.py").read_text().replace('"hysteresis"', '"lately_added"')
    (effects / "lately_added.py").write_text(another)
    for lost in (BATCH, MOTION):
        project.path(f"results/{lost}").unlink()
    project.write_study("other", poses=2)
    add_kind(project)
    project.edit("config/config.yaml", "studies: [", "studies: [other, counted, ")
    sprung = tmp_path / "sprung"
    planted.plant(project.folder, sprung)
    left = project.path(f"results/{POSES}/.best.json.{2**30}")  # of a process that is no more
    left.write_bytes(b"{")

    before = project.files()
    planned, said = project.look("--trust-io-cache", "all")
    assert "--trust-io-cache is ignored" in said
    assert not sprung.exists()
    assert project.files() == before

    assert {"other/report.html", "counted/report.html"} <= planned
    again = planned & {*before, BATCH, MOTION}  # no picture or page of most was there to begin with
    of = {kind: {name for name in again if name.startswith(f"{kind}/")} for kind in SMALL}
    assert {kind for kind in SMALL if not of[kind]} == set(UNTOUCHED)
    assert "discrepancy/discrepancy/verdict.json" in of["discrepancy"]
    all_simulations = {name for name in before if name.startswith(SIMULATIONS)}
    assert len(all_simulations) == 4 * 3
    assert of_jobs(of[POSES]) == all_simulations
    assert {name for name in of[POSES] if "=" not in name} == {
        f"{POSES}/simulations.parquet",
        *made_of(project, "simulations"),
    }
    assert "cohort_stiffness/findings.parquet" in of["cohort_stiffness"]
    assert not {name for name in of["cohort_stiffness"] if "=" in name}
    of_b = {name for name in before if name.startswith("range_of_motion/jobs/specimen=b/")}
    assert len(of_b) == 16
    assert of_jobs(of["range_of_motion"]) == of_b | {"range_of_motion/frames/specimen=b.parquet"}
    batches = {name for name in of_jobs(of["global_sensitivity"]) if "/jobs/" in name}
    assert batches == {BATCH}
    assert of["tracking"] == {MOTION}


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


@pytest.mark.full
def test_a_new_ranking_reruns_the_simulations_that_use_it(eight: Project, tmp_path: Path) -> None:
    project = eight.copy(tmp_path / "project")
    path = project.job(POSES, "rank")
    path.write_text(path.read_text() + OTHER_RANKING)
    again = {name for name in project.rerun() if name.startswith(SIMULATIONS)}
    everything = {name for name in project.files() if name.startswith(SIMULATIONS)}
    assert again == {name for name in everything if "best02" in name}
    assert project.planned() == set()


@pytest.mark.full
def test_a_ranking_with_the_same_sets_simulates_nothing_again(
    eight: Project, tmp_path: Path
) -> None:
    """Its own mark differs, but a simulation hangs on nothing but its own set."""
    project = eight.copy(tmp_path / "project")
    success = "best_models: 2\nsuccess: {outlier_times_start: 50}"
    project.edit(f"config/studies/{POSES}.yaml", "best_models: 2", success)
    again = project.rerun(f"results/{POSES}/simulations.parquet")
    assert f"{POSES}/best.json" in again
    assert not [name for name in again if "/jobs/" in name]


@pytest.mark.full
def test_a_job_file_is_made_when_asked_for_by_name(eight: Project, tmp_path: Path) -> None:
    """And nothing that is made of it."""
    project = eight.copy(tmp_path / "project")
    lost = f"{SIMULATIONS}specimen=s01/pose=0003/stiffness=best02.parquet"
    os.unlink(project.path(f"results/{lost}"))
    before = project.files()
    project.run(f"results/{lost}")
    assert written(before, project.files()) == {lost}
