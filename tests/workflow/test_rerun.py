"""What is computed again after something was deleted or changed, and what is kept.

What would be caught: a job that is not made again though what it reads has changed (its mark does
not reach the rule), or is though nothing has; a lost file that nobody misses; a look at what is to
be done that changes or reads what it must not.
"""

import os
import shutil
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
BATCH = "global_sensitivity/jobs/responses/specimen-b/batch-00002.parquet"
MOTION = "tracking/opensim/a/flexion_extension/optk_generic.mot"
"""Lost files."""

MOVES_OF_B = "range_of_motion/blocks/range_of_motion/specimen-b/"

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
    return {name for name in files if "-" in name and "/blocks/" not in name}


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
    planned = project.planned("all")
    assert not sprung.exists()
    assert project.files() == before

    assert {"other/report.html", "counted/report.html"} <= planned
    again = planned & {*before, BATCH, MOTION}  # no picture or page of most was there to begin with
    of = {kind: {name for name in again if name.startswith(f"{kind}/")} for kind in SMALL}
    assert {kind for kind in SMALL if not of[kind]} == set(UNTOUCHED)
    assert "discrepancy/discrepancy/verdict.json" in of["discrepancy"]
    assert not of_jobs(of[POSES])
    assert {name for name in of[POSES] if "/blocks/" in name} == {
        f"{POSES}/blocks/simulations/specimen-s01/block-00{number}.parquet" for number in (0, 1)
    }
    assert {name for name in of[POSES] if "-" not in name} == {
        f"{POSES}/simulations.parquet",
        *made_of(project, "simulations"),
    }
    assert "cohort_stiffness/findings.parquet" in of["cohort_stiffness"]
    assert not {name for name in of["cohort_stiffness"] if "-" in name}
    assert of_jobs(of["range_of_motion"]) == {"range_of_motion/frames/specimen-b.parquet"}
    blocks = {name for name in of["range_of_motion"] if "/blocks/" in name}
    assert blocks == {name for name in before if name.startswith(MOVES_OF_B)}
    batches = {name for name in of_jobs(of["global_sensitivity"]) if "/jobs/" in name}
    assert batches == {BATCH}
    assert of["tracking"] == {MOTION}


@pytest.mark.full
def test_simulations_with_the_best_sets_alone_hang_on_what_ranks_them(
    eight: Project, tmp_path: Path
) -> None:
    project = eight.copy(tmp_path / "project")
    success = "best_models: 2\nsuccess: {outlier_times_start: 50}"
    project.edit(f"config/studies/{POSES}.yaml", "best_models: 2", success)
    again = project.rerun(f"results/{POSES}/simulations.parquet")
    simulations = {name for name in project.files() if name.startswith(SIMULATIONS)}
    assert len(simulations) == 4 * 3
    assert of_jobs(again) == {name for name in simulations if "best" in name}


@pytest.mark.parametrize("recorded", [True, False])
def test_files_that_are_dated_anew_are_as_they_were(
    eight: Project, tmp_path: Path, recorded: bool
) -> None:
    """As after a copy that keeps no dates: what is newer than what is made of it is not news."""
    project = eight.copy(tmp_path / "project")
    if not recorded:
        shutil.rmtree(project.path(".snakemake"))
    for path in sorted(project.path(f"results/{POSES}").rglob("*.parquet"), reverse=True):
        os.utime(path)
    content = project.contents()
    assert project.rerun(f"results/{POSES}/simulations.parquet") == set()
    assert project.contents() == content


@pytest.mark.full
def test_a_job_file_is_made_when_asked_for_by_name(eight: Project, tmp_path: Path) -> None:
    """And nothing that is made of it."""
    project = eight.copy(tmp_path / "project")
    lost = f"{SIMULATIONS}specimen-s01/pose-0003/stiffness-best02.parquet"
    os.unlink(project.path(f"results/{lost}"))
    before = project.files()
    project.run(f"results/{lost}")
    assert written(before, project.files()) == {lost}
