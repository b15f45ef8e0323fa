"""Runs that go wrong: bad input, dying workers, folders that cannot be written, a killed run."""

import shutil
import subprocess
import time
from collections.abc import Callable

import psutil
import pytest
from small_project import Project, written

pytestmark = pytest.mark.slow

# Appended to a job of the copied package: what happens at one pose.
ACCIDENT = """

_run = run


def run(**arguments):
    if arguments["pose"] == "0003":
        {accident}
    _run(**arguments)
"""


def arrange(project: Project, accident: str) -> None:
    path = project.path("spinepipe/jobs/calibrate.py")
    path.write_text(path.read_text() + ACCIDENT.format(accident=accident))


@pytest.mark.parametrize(
    ("accident", "words"),
    [
        ("import os; os.kill(os.getpid(), 9)", "killed from outside (SIGKILL)"),
        ("import os; os._exit(7)", "ended itself in mid-job with exit code 7"),
        ("raise ValueError('no such spine')", "ValueError: no such spine"),
        ("raise OSError(28, 'full', 'results/x')", "no space is left on the disk of results"),
    ],
)
def test_a_failing_job_is_named_and_the_others_are_kept(
    project: Project, accident: str, words: str
) -> None:
    original = project.path("spinepipe/jobs/calibrate.py").read_text()
    content = project.contents()
    arrange(project, accident)
    done = project.snakemake("-j2", "--keep-going", "all")
    log = "results/small/logs/calibrate/specimen=s01/pose=0003.log"
    assert done.returncode != 0
    assert "job calibrate study=small specimen=s01 pose=0003: " in done.stdout
    assert words in done.stdout
    assert log in done.stdout
    assert "Traceback" not in done.stdout
    assert words in project.path(log).read_text()
    project.path("spinepipe/jobs/calibrate.py").write_text(original)
    project.run_all()
    assert project.contents() == content


def test_an_unsound_cohort_is_told_before_anything_runs(
    new_project: Callable[[int], Project],
) -> None:
    project = new_project(6)
    loads = project.path("config/cohorts/palanca_l1l4/loads.csv")
    loads.write_text(loads.read_text() + "s01,flexion,2,L9,0,heavy,0,0,0,0,,,\n")
    done = project.snakemake("-j2", "all")
    assert done.returncode != 0
    assert "loads.csv" in done.stdout
    assert "Traceback" not in done.stdout
    assert not project.path("results").exists()


def test_a_study_outside_the_selection_is_checked_when_asked_for(project: Project) -> None:
    project.write_study("other", poses=0)
    assert "Nothing to be done" in project.run_all()
    done = project.snakemake("-j2", "results/other/poses.parquet")
    assert done.returncode != 0
    assert "other.yaml" in done.stdout
    assert "Traceback" not in done.stdout


def test_results_that_cannot_be_written_are_told_at_once(
    new_project: Callable[[int], Project],
) -> None:
    project = new_project(6)
    project.path("results").symlink_to("/proc/self")  # not even root may make a folder there
    done = project.snakemake("-j2", "all")
    assert done.returncode != 0
    assert "results cannot be written to" in done.stdout
    assert "Traceback" not in done.stdout


def test_the_warm_pool_is_insisted_on(new_project: Callable[[int], Project]) -> None:
    project = new_project(6)
    done = project.snakemake("-j2", "--workflow-profile", "none", "all")
    assert done.returncode != 0
    assert "force-use-threads" in done.stdout
    assert not project.path("results").exists()


def test_a_killed_run_goes_on_where_it_was(new_project: Callable[[int], Project]) -> None:
    project = new_project(30)
    kill_in_mid_study(project)
    cut_off = {path.name for path in project.path(".snakemake/incomplete").rglob("*")}
    before = project.files()
    assert project.snakemake("--unlock").returncode == 0
    project.run_all()
    again = written(before, project.files()) & set(before)
    assert len(again) <= len(cut_off)
    assert len([name for name in project.files() if "/jobs/" in name]) == 30 * 3
    resumed = project.contents()
    shutil.rmtree(project.path("results"))
    project.run_all()
    assert project.contents() == resumed


def kill_in_mid_study(project: Project) -> None:
    """Kill Snakemake outright during the simulations; its workers have to end by themselves."""
    run = subprocess.Popen(
        project.command("-j2", "all"),
        cwd=project.folder,
        env=project.environment(),
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    deadline = time.monotonic() + 120
    jobs = project.path("results/small/jobs")
    while len(list(jobs.rglob("*.parquet"))) < 20:
        assert run.poll() is None
        assert time.monotonic() < deadline
        time.sleep(0.02)
    workers = psutil.Process(run.pid).children(recursive=True)
    run.kill()
    run.wait()
    assert workers
    _, alive = psutil.wait_procs(workers, timeout=10)
    assert not alive
