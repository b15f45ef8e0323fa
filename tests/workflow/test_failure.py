"""Runs that go wrong: dying workers, a run that is killed, bad input, folders of somebody else's.

What would be caught: a Python stack in the place of a sentence, a job that failed and takes others
along, a killed run that loses or mixes results, a run that starts though it cannot end.
"""

import os
import re
import shutil
from pathlib import Path

import psutil
import pytest
from small_project import Project, written
from toy import SPECIMENS

from spinepipe.files import HOST
from spinepipe.jobs.project import lock

pytestmark = pytest.mark.slow

ACCIDENTS = {
    "a": ("import os; os.kill(os.getpid(), 9)", "killed from outside (SIGKILL)"),
    "b": ("import os; os._exit(7)", "ended itself in mid-job with exit code 7"),
    "c": ("raise ValueError('no such spine')", "ValueError: no such spine"),
    "d": ("raise OSError(28, 'full', 'results/x')", "no space is left on the disk of results"),
}
"""What happens at a specimen, and what must be said of it."""

# Added to the Snakefile: the accidents stand beside it and are run in place of the job.
RUN_ACCIDENTS = """

whole_run_job = run_job


def run_job(job, rule, wildcards, *others):
    specimen = wildcards.get("specimen")
    if rule == "count_joints" and specimen in {specimens}:
        job = f"accidents:at_{{specimen}}"
    whole_run_job(job, rule, wildcards, *others)
"""


def job_file(specimen: str) -> str:
    return f"counted/joints/specimen-{specimen}.parquet"


def test_failing_jobs_are_named_the_others_kept_and_a_killed_run_goes_on(
    toy_copy: Project,
) -> None:
    """First four of six jobs fail, then a run with other settings is killed, then all is well."""
    content, snakefile = toy_copy.contents(), toy_copy.path("Snakefile")
    whole = snakefile.read_text()
    shutil.rmtree(toy_copy.path("results"))
    happens = [f"def at_{one}(**_):\n    {what}\n" for one, (what, _) in ACCIDENTS.items()]
    toy_copy.path("accidents.py").write_text("\n".join(happens))
    snakefile.write_text(whole + RUN_ACCIDENTS.format(specimens=set(ACCIDENTS)))
    done = toy_copy.snakemake("-j2", "--keep-going", "all")
    assert done.returncode != 0
    assert "Traceback" not in done.stdout
    listed = done.stdout.partition(f"\n{len(ACCIDENTS)} jobs failed:")[2]
    for specimen, (_, words) in ACCIDENTS.items():
        log = f"results/counted/logs/count_joints/specimen-{specimen}.log"
        assert f"job count_joints study=counted specimen={specimen}: " in done.stdout
        assert words in done.stdout
        assert f"count_joints study=counted specimen={specimen} (log: {log})" in listed
        assert words in toy_copy.path(log).read_text()
    kept = {job_file(one) for one in SPECIMENS if one not in ACCIDENTS}
    assert set(toy_copy.files()) == kept
    index = toy_copy.path("results/index.html").read_text()
    assert "1 study: 1 failed" in index
    assert "job count_joints study=counted specimen=a: " in index
    assert ACCIDENTS["a"][1] in index
    assert "(and 3 jobs more)" in index

    snakefile.write_text(whole)
    toy_copy.edit("config/studies/counted.yaml", "times: 2", "times: 3")
    workers = toy_copy.killed_after(4, "count_joints")
    assert workers
    assert all(ended(pid, start) for pid, start in workers)
    toy_copy.edit("config/studies/counted.yaml", "times: 3", "times: 2")
    before, left = toy_copy.files(), toy_copy.contents()
    of_other_settings = [name for name in left if left[name] != content[name]]
    assert len(of_other_settings) >= 4

    toy_copy.run()
    assert toy_copy.contents() == content
    assert "1 study, all up to date" in toy_copy.path("results/index.html").read_text()
    after = toy_copy.files()
    cut_off = {path.name for path in toy_copy.path(".snakemake/incomplete").rglob("*")}
    assert not cut_off
    sound = set(before) - set(of_other_settings)
    assert sum(after[name] != before[name] for name in sound) <= 2  # at work when it was killed


def ended(pid: int, start: float) -> bool:
    """Whether that process is gone, or goes while one waits for it."""
    try:
        process = psutil.Process(pid)
        if process.create_time() == start:
            process.wait(timeout=600)
    except psutil.NoSuchProcess:
        return True
    return not process.is_running() or process.create_time() != start


def test_an_unsound_cohort_or_study_is_told_before_anything_runs(toy_copy: Project) -> None:
    shutil.rmtree(toy_copy.path("results"))
    toy_copy.edit("config/cohorts/stack/joints.csv", "b,L2L3,0,36,", "b,L2L3,0,high,")
    text = toy_copy.path("config/studies/counted.yaml").read_text()
    other = text.replace("study: counted", "study: other").replace("times: 2", "times: 0")
    toy_copy.path("config/studies/other.yaml").write_text(other)
    toy_copy.edit("config/config.yaml", "[counted]", "[counted, other]")
    done = toy_copy.snakemake("-j2", "all")
    assert done.returncode != 0
    for told in ("joints.csv", "high", "other.yaml", "times", "greater than or equal to 1"):
        assert told in done.stdout, told
    assert "Traceback" not in done.stdout
    assert not toy_copy.path("results").exists()


def test_results_that_cannot_be_written_are_told_at_once(toy_copy: Project) -> None:
    shutil.rmtree(toy_copy.path("results"))
    toy_copy.path("results").symlink_to("/proc/self")  # not even root may make a folder there
    done = toy_copy.snakemake("-j2", "all")
    assert done.returncode != 0
    assert "results cannot be written to" in done.stdout
    assert "Traceback" not in done.stdout


def test_a_record_that_cannot_be_kept_is_told_before_anything_runs(toy_copy: Project) -> None:
    """Its folder is one in which nobody may write, not even root."""
    toy_copy.path(".snakemake").rename(toy_copy.folder / "record")
    toy_copy.path(".snakemake").symlink_to("/proc/self")
    ended = toy_copy.snakemake("-j2", "all")
    assert ended.returncode != 0
    assert "where Snakemake keeps its record" in ended.stdout
    assert "Traceback" not in ended.stdout


def test_a_second_run_at_the_same_time_is_told(toy_copy: Project) -> None:
    """By the lock that the first one holds; a look is free."""
    toy_copy.path(f"results/{job_file('b')}").write_bytes(b"")
    before = toy_copy.files()
    with lock(toy_copy.path(".snakemake/spinepipe-running")):
        ended = toy_copy.snakemake("-j2", "all")
        assert toy_copy.planned()
    assert ended.returncode != 0
    assert f"at work in this folder: process {os.getpid()} on {HOST}, since 2" in ended.stdout
    assert "Traceback" not in ended.stdout
    assert toy_copy.files() == before


@pytest.mark.full
def test_a_study_outside_the_selection_is_checked_when_asked_for(toy_copy: Project) -> None:
    text = toy_copy.path("config/studies/counted.yaml").read_text()
    other = text.replace("study: counted", "study: other").replace("times: 2", "times: 0")
    toy_copy.path("config/studies/other.yaml").write_text(other)
    assert toy_copy.planned() == set()
    done = toy_copy.snakemake("-j2", "results/other/joints.parquet")
    assert done.returncode != 0
    assert "other.yaml" in done.stdout
    assert "Traceback" not in done.stdout


REMOVED = """

whole_run_job = run_job


def run_job(job, rule, *others):
    if rule == "joint_count_table":
        shutil.rmtree("results/counted", ignore_errors=True)
    whole_run_job(job, rule, *others)
"""
"""Added to the Snakefile: as files are about to be joined, somebody removes all results."""


@pytest.mark.full
def test_results_removed_in_mid_run_are_told_in_a_sentence(toy_copy: Project) -> None:
    content, snakefile = toy_copy.contents(), toy_copy.path("Snakefile")
    whole = snakefile.read_text()
    snakefile.write_text(f"import shutil\n{whole}{REMOVED}")
    os.truncate(toy_copy.path(f"results/{job_file('b')}"), 0)
    ended = toy_copy.snakemake("-j2", "all")
    assert ended.returncode != 0
    assert "Traceback" not in ended.stdout
    assert "removed while the run went on. Run the same command again" in ended.stdout
    snakefile.write_text(whole)
    toy_copy.run()
    assert toy_copy.contents() == content


@pytest.mark.full
def test_of_many_damaged_files_five_are_named(toy_copy: Project) -> None:
    content = toy_copy.contents()
    for one in SPECIMENS:
        toy_copy.path(f"results/{job_file(one)}").write_bytes(b"")
    said = toy_copy.run()
    assert said.count("is damaged, cut off, empty") == 5
    assert f"so do {len(SPECIMENS) - 5} more files" in said
    assert toy_copy.contents() == content


DYING = """

import os as _os

_run = run


def run(*given, parts, **named):
    here = any(one["pose"] == "0001" and one["stiffness"] == "01" for one in parts.values())
    if here and _os.path.exists("dying"):
        _os.kill(_os.getpid(), 9)
    _run(*given, parts=parts, **named)
"""
"""Added to a job whose files are made block by block: at one of them its process dies."""


@pytest.mark.full
def test_a_file_that_kills_its_process_is_named_and_takes_no_other_along(
    eight: Project, tmp_path: Path
) -> None:
    project = eight.copy(tmp_path / "project")
    path = project.job("range_of_motion", "simulate")
    path.write_text(path.read_text() + DYING)
    before = project.files()
    project.path("dying").touch()
    target = "results/range_of_motion/range_of_motion.parquet"
    ended = project.snakemake("-j2", "--keep-going", target)
    assert ended.returncode != 0
    for specimen in "ab":
        dead = f"results/range_of_motion/jobs/specimen-{specimen}/pose-0001/stiffness-01.parquet"
        assert re.search(rf"job moves_block .*{dead}: .*SIGKILL", ended.stdout), ended.stdout
    jobs = {name for name in before if name.startswith("range_of_motion/jobs/")}
    made = written(before, project.files()) & jobs
    assert jobs - made == {name for name in jobs if name.endswith("pose-0001/stiffness-01.parquet")}
    project.path("dying").unlink()
    assert jobs & project.rerun(target) == jobs - made


CHANGED = """

whole_run_job = run_job


def run_job(job, rule, *others):
    whole_run_job(job, rule, *others)
    if rule == "joint_count_table":
        study = Path("config/studies/counted.yaml")
        study.write_text(study.read_text().replace("times: 2", "times: 3"))
"""
"""Added to the Snakefile: once a table is joined, somebody changes a setting of the study."""


@pytest.mark.full
def test_settings_changed_in_mid_run_are_told_and_mix_nothing(toy_copy: Project) -> None:
    content, snakefile = toy_copy.contents(), toy_copy.path("Snakefile")
    whole = snakefile.read_text()
    shutil.rmtree(toy_copy.path("results"))
    snakefile.write_text(whole + CHANGED)
    ended = toy_copy.snakemake("-j1", "all")
    assert ended.returncode != 0
    assert "settings, data or code have changed since this run was planned" in ended.stdout
    assert "Traceback" not in ended.stdout
    snakefile.write_text(whole)
    toy_copy.edit("config/studies/counted.yaml", "times: 3", "times: 2")
    toy_copy.run()
    assert toy_copy.contents() == content
