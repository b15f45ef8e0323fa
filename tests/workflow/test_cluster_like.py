"""A study run as on a cluster: submitted jobs are processes of their own that share a folder.

The profile for Slurm is used as it is, with an executor that submits to a shell script instead.
"""

import re
import shutil
from pathlib import Path

import grid_cases
import pytest
import yaml
from lever import lever
from small_project import Project, copy_project

from spinepipe.studies.registry import kind_names

pytestmark = pytest.mark.slow

ROOT = Path(__file__).parents[2]
PROFILE = ROOT / "profiles/slurm/config.yaml"
MOVES = 16
STUDY = (
    "poses: 2\nstiffness_sets: 8\n"
    "virtual_tests: {moment_nm: 7.5, tests: [flexion, left_rotation], steps: 3}\n"
)
MOVES_PER_SUBMITTED_JOB = 8
SAMPLES = 24
"""Runs of each specimen of the sensitivity study: one submitted job."""
SUBMIT = """\
#!/bin/sh
# Stands in for a queue: the job script runs in a session of its own, as nobody's child.
setsid sh "$1" > "queue/$(basename "$1").log" 2>&1 < /dev/null &
echo $!
"""
# Which process reads the Snakefile: one for each time Snakemake is started.
NOTE = "\nPath('queue', f'{os.getpid()}.start').touch()\n"


def new_project(folder: Path) -> Project:
    project = copy_project(folder)
    grid_cases.project(folder, STUDY, specimens=("a",))
    return with_queue(project)


def with_queue(project: Project) -> Project:
    project.path("queue").mkdir()
    snakefile = project.path("Snakefile")
    snakefile.write_text(snakefile.read_text() + NOTE)
    submit = project.path("submit.sh")
    submit.write_text(SUBMIT)
    submit.chmod(0o755)
    return project


def run_on_cluster(project: Project, target: str) -> str:
    """What a project is asked for, its jobs submitted; returns what Snakemake said."""
    done = project.snakemake(
        *(target, "--profile", "profiles/slurm", "--executor", "cluster-generic"),
        *("--cluster-generic-submit-cmd", "./submit.sh", "--jobs", "2", "--cores", "2"),
        *("--group-components", f"moves={MOVES_PER_SUBMITTED_JOB}", f"responses={SAMPLES}"),
        *("--seconds-between-status-checks", "1", "--latency-wait", "10"),
    )
    logs = "\n".join(path.read_text() for path in project.path("queue").glob("*.log"))
    assert done.returncode == 0, done.stdout + logs
    return done.stdout


def test_samples_computed_as_on_a_cluster_give_the_same_files(tmp_path: Path) -> None:
    study = ("factors", SAMPLES // 6, "")
    local = lever(tmp_path / "local", study)
    # Nothing is submitted after this table that is not when moves are asked for below.
    asked = "results/factors/responses.parquet"
    local.run(asked)
    cluster = with_queue(lever(tmp_path / "cluster", study))
    said = run_on_cluster(cluster, asked)
    assert cluster.contents() == local.contents()
    groups = len(re.findall("Submitted group job", said))
    assert (
        len(list(cluster.path("results/factors/jobs/responses").rglob("*.parquet"))) == 2 * SAMPLES
    )
    assert groups == 2  # the samples of each specimen


def test_submitted_jobs_make_the_same_files_and_start_snakemake_once(tmp_path: Path) -> None:
    local, cluster = new_project(tmp_path / "local"), new_project(tmp_path / "cluster")
    local.run()
    said = run_on_cluster(cluster, "all")
    assert cluster.contents() == local.contents()

    groups = len(re.findall("Submitted group job", said))
    submitted = len(re.findall("Submitted (?:group )?job", said))
    assert (
        groups == MOVES // MOVES_PER_SUBMITTED_JOB + 1
    )  # and one of summaries, figures and report
    assert submitted < MOVES
    assert len(list(cluster.path("queue").glob("*.start"))) == submitted + 1

    assert cluster.planned() == set()


def test_the_profile_speaks_of_rules_that_exist(tmp_path: Path) -> None:
    settings = yaml.safe_load(PROFILE.read_text())
    project = new_project(tmp_path / "project")
    shutil.copytree(ROOT / "config/studies", project.path("config/studies"), dirs_exist_ok=True)
    rules = set(project.snakemake("--list-rules").stdout.split())
    assert {"move", "respond"} <= rules
    assert set(settings["groups"]) | set(settings["set-resources"]) <= rules
    assert set(settings["group-components"]) <= set(settings["groups"].values())
    pages = {rule for rule in rules if rule.endswith(("_figure", "_report"))}
    assert len(pages) == 2 * len(kind_names())
    assert {settings["groups"].get(rule) for rule in pages} == {"pages"}
