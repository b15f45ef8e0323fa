"""Runs that go wrong: bad input, dying workers, folders that cannot be written."""

import shutil
from collections.abc import Callable

import pytest
from small_project import Project

pytestmark = pytest.mark.slow

CALIBRATIONS = "small/calibrations/specimen=s01"
ACCIDENTS = {
    "0001": ("import os; os.kill(os.getpid(), 9)", "killed from outside (SIGKILL)"),
    "0002": ("import os; os._exit(7)", "ended itself in mid-job with exit code 7"),
    "0003": ("raise ValueError('no such spine')", "ValueError: no such spine"),
    "0004": (
        "raise OSError(28, 'full', 'results/x')",
        "no space is left on the disk of results",
    ),
}
"""What happens at a pose, and what must be said of it."""

# Added to the Snakefile: the accidents stand beside it and are run in place of the job.
RUN_ACCIDENTS = """

whole_execute = execute


def execute(rule, function, wildcards, log, arguments):
    pose = wildcards.get("pose")
    if rule == "calibrate" and pose in {poses}:
        function = f"accidents:at_{{pose}}"
    whole_execute(rule, function, wildcards, log, arguments)
"""


def test_failing_jobs_are_named_and_the_others_are_kept(project: Project) -> None:
    content, snakefile = project.contents(), project.path("Snakefile")
    whole = snakefile.read_text()
    shutil.rmtree(project.path(f"results/{CALIBRATIONS}"))
    happens = [f"def at_{pose}(**_):\n    {what}\n" for pose, (what, _) in ACCIDENTS.items()]
    project.path("accidents.py").write_text("\n".join(happens))
    snakefile.write_text(whole + RUN_ACCIDENTS.format(poses=set(ACCIDENTS)))
    done = project.snakemake("-j2", "--keep-going", "all")
    assert done.returncode != 0
    assert "Traceback" not in done.stdout
    assert f"{len(ACCIDENTS)} jobs failed:" in done.stdout.partition("Exiting because")[2]
    for pose, (_, words) in ACCIDENTS.items():
        log = f"results/small/logs/calibrate/specimen=s01/pose={pose}.log"
        assert f"job calibrate study=small specimen=s01 pose={pose}: " in done.stdout
        assert words in done.stdout
        assert log in done.stdout
        assert words in project.path(log).read_text()

    snakefile.write_text(whole)
    again = project.rerun()
    lost = {f"{CALIBRATIONS}/pose={pose}.parquet" for pose in ACCIDENTS}
    assert {name for name in again if name.startswith(CALIBRATIONS)} == lost
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
    assert project.planned() == set()
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
