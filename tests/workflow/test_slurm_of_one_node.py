"""`spinepipe run --slurm` on a real Slurm of one node, where its programs are installed.

Catches options that the plugin or the queue refuses, groups that are not submitted as one, a job
that exceeds its time and takes others along, a killed run that cannot be taken up.
"""

import os
import signal
import subprocess
import time
from pathlib import Path
from tempfile import TemporaryDirectory

import pytest
import single_node_slurm
from small_project import Project
from toy import STUDY

pytestmark = [
    pytest.mark.full,
    pytest.mark.skipif(
        bool(single_node_slurm.why_not()), reason=single_node_slurm.why_not() or "it is there"
    ),
]

OPTIONS = (
    *("run", STUDY, "--slurm", "--", "--slurm-status-command", "squeue", "--retries", "0"),
    *("--seconds-between-status-checks", "3", "--slurm-init-seconds-before-status-checks", "3"),
    *("--set-resources", "count_joints:runtime=1", "--latency-wait", "5"),
    *("--groups", "count_joints=counts", "--group-components", "counts=3"),
)

SLEEPS = """

whole_run_job = run_job


def run_job(job, rule, wildcards, *others):
    if rule == "count_joints" and wildcards.get("specimen") == "c":
        import time

        time.sleep(3600)
    whole_run_job(job, rule, wildcards, *others)
"""
"""Added to the Snakefile: one of six jobs takes longer than it asked for."""


def start(project: Project, cluster: dict[str, str]) -> "subprocess.Popen[str]":
    own = {name: cluster[name] for name in ("SLURM_CONF", "PATH")}
    return project.started(*OPTIONS, stderr=subprocess.STDOUT, **own)


def queue(cluster: dict[str, str], states: str) -> list[str]:
    """Numbers of jobs in these states."""
    asked = ["squeue", "--noheader", "--format=%i", f"--states={states}"]
    told = subprocess.run(asked, env=cluster, capture_output=True, text=True, check=True)
    return told.stdout.split()


def test_groups_a_job_beyond_its_time_a_killed_run_and_its_resume(toy_copy: Project) -> None:
    snakefile = toy_copy.path("Snakefile")
    whole, content = snakefile.read_text(), toy_copy.contents()
    for path in toy_copy.path("results").rglob("*.*"):
        path.unlink()
    with (
        TemporaryDirectory(dir="/tmp", prefix="sl") as folder,
        single_node_slurm.running(Path(folder), minutes=60) as cluster,
    ):
        snakefile.write_text(whole + SLEEPS)
        said = (run := start(toy_copy, cluster)).communicate(timeout=1200)[0]
        assert run.returncode == 3, said
        assert queue(cluster, "TIMEOUT"), said
        assert "are kept. After mending, the same command goes on." in said
        submitted = len(queue(cluster, "all"))
        assert submitted == 2, "six jobs in groups of three"
        kept = toy_copy.files()
        assert 3 <= sum("joint" in name for name in kept) < 6

        run = start(toy_copy, cluster)  # the run and Snakemake are killed, its job is not
        while len(queue(cluster, "all")) == submitted:
            assert run.poll() is None
            time.sleep(0.5)
        for child in children(run.pid):
            os.kill(child, signal.SIGKILL)
        run.kill()
        run.communicate()
        for number in queue(cluster, "PENDING,RUNNING"):
            subprocess.run(["scancel", number], env=cluster, check=True)

        snakefile.write_text(whole)
        said = (run := start(toy_copy, cluster)).communicate(timeout=1200)[0]
        assert run.returncode == 0, said
        assert toy_copy.contents() == content
        after = toy_copy.files()
        assert all(after[name] == state for name, state in kept.items())


def children(pid: int) -> list[int]:
    told = subprocess.run(["pgrep", "-P", f"{pid}"], capture_output=True, text=True, check=False)
    return [int(one) for one in told.stdout.split()]
