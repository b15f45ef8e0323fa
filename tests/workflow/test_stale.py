"""No table is made of two settings: what hangs on others is seen by its mark and computed again."""

import os
import re
import shutil
import signal
from pathlib import Path

import pyarrow.parquet as pq
import pytest
from small_project import Project, copy_project

from spinepipe.marks import read_mark

pytestmark = pytest.mark.slow

STUDY = """\
study: small
kind: joint_pose_sensitivity
cohort: palanca_l1l4
seed: 1
loading: equilibrium
poses: 4
best_models: 2
block: 2
calibration:
  bound_factor: 100
  weights:
    {anterior: 10, superior: 100, right: 1, extension: 1, right_bending: 0, left_rotation: 0}
"""
TABLES = tuple(f"results/small/{name}.parquet" for name in ("simulations", "agreement"))
SIMULATION = "results/small/jobs/specimen=s01/pose=0001/stiffness=best02.parquet"
CALIBRATION = "results/small/calibrations/specimen=s01/pose=0002.parquet"

# Snakemake ends as by `kill -9` when so many jobs of a rule have written their files.
KILLED = """

import signal
jobs_left = {count}
whole_execute = execute


def execute(rule, job, wildcards, log, arguments):
    global jobs_left
    whole_execute(rule, job, wildcards, log, arguments)
    jobs_left -= rule == "{rule}"
    if not jobs_left:
        os.kill(os.getpid(), signal.SIGKILL)
"""

SEED = ("seed: 1", "seed: 2")
LOADING = ("loading: equilibrium", "loading: settle")
BOUND = ("bound_factor: 100", "bound_factor: 2")
RANKING = ("best_models: 2", "best_models: 1")
SAME = ("seed: 1", "seed: 1")


@pytest.fixture(scope="session")
def _done(tmp_path_factory: pytest.TempPathFactory) -> Project:
    project = copy_project(tmp_path_factory.mktemp("marks") / "project")
    project.path("config/studies/small.yaml").write_text(STUDY)
    run(project)
    return project


@pytest.fixture
def done(_done: Project, tmp_path: Path) -> Project:
    """A project with the tables of a small study; each test has its own."""
    shutil.copytree(_done.folder, tmp_path / "project")
    return Project(tmp_path / "project")


def run(project: Project) -> str:
    ended = project.snakemake("-j1", *TABLES)
    assert ended.returncode == 0, ended.stdout
    return ended.stdout


def planned(project: Project, *targets: str) -> set[str]:
    """Files that a run would write, told without running it."""
    ended = project.snakemake("-n", *(targets or TABLES), "--quiet", "host")
    assert ended.returncode == 0, ended.stdout
    lines = re.findall(r"^    output: (.*)$", ended.stdout, re.MULTILINE)
    return {name for line in lines for name in line.split(", ")}


def killed_with(project: Project, change: tuple[str, str], rule: str, count: int) -> None:
    """Run with other settings until so many jobs of a rule are done, then with the old again."""
    study, snakefile = "config/studies/small.yaml", project.path("Snakefile")
    whole = snakefile.read_text()
    snakefile.write_text(whole + KILLED.format(rule=rule, count=count))
    project.edit(study, *change)
    ended = project.snakemake("-j1", *TABLES)
    assert ended.returncode == -signal.SIGKILL, ended.stdout
    snakefile.write_text(whole)
    project.edit(study, *change[::-1])
    assert project.snakemake("--unlock").returncode == 0


@pytest.mark.parametrize(
    "kills",
    [
        [(SEED, "simulate", 2)],
        [(SEED, "sample_landmarks", 1), (BOUND, "calibrate", 3), (SAME, "calibrate", 1)],
        [(BOUND, "rank_models", 1), (RANKING, "aggregate_block", 2)],
        [(LOADING, "simulate", 5), (LOADING, "aggregate_table", 1), (SAME, "simulate", 1)],
    ],
    ids=lambda kills: "-".join(rule for _, rule, _ in kills),
)
def test_after_kill_and_change_back_tables_are_as_undisturbed(
    done: Project, kills: list[tuple[tuple[str, str], str, int]]
) -> None:
    content = done.contents()
    for kill in kills:
        killed_with(done, *kill)
    run(done)
    again = done.contents()
    assert {name: again[name] for name in content} == content
    assert planned(done) == set()


def without_record(project: Project) -> Project:
    shutil.rmtree(project.path(".snakemake"))
    return project


def test_copied_results_are_known_by_their_marks(done: Project) -> None:
    without_record(done)
    assert planned(done) == set()
    done.edit("config/studies/small.yaml", *SEED)
    landmarks = {f"results/small/landmarks{part}.parquet" for part in ("", "/specimen=s01")}
    assert landmarks <= planned(done, *TABLES, "results/small/landmarks.parquet")


def spoiled(path: Path, metadata: bool) -> None:
    """One other letter in the mark of a file; or no mark at all, as older versions wrote files."""
    if metadata:
        mark = read_mark(path).encode()
        other = (b"1" if mark.startswith(b"0") else b"0") + mark[1:]
        path.write_bytes(path.read_bytes().replace(mark, other))
    else:
        pq.write_table(pq.read_table(path).replace_schema_metadata(None), path)


@pytest.fixture(params=[True, False], ids=["another mark", "no mark"])
def one_spoiled(request: pytest.FixtureRequest, done: Project) -> tuple[Project, str]:
    """A project with a job file behind the ranking that is not what it should be, and as old."""
    path = done.path(SIMULATION)
    time = path.stat().st_mtime_ns
    spoiled(path, request.param)
    os.utime(path, ns=(time, time))
    return done, SIMULATION


@pytest.mark.parametrize("recorded", [True, False])
def test_a_file_with_another_mark_or_none_is_computed_again(
    one_spoiled: tuple[Project, str], recorded: bool
) -> None:
    project, name = one_spoiled
    if not recorded:
        without_record(project)
    block = "results/small/blocks/simulations/specimen=s01/block=000.parquet"
    assert planned(project) == {name, block, *TABLES}


def test_what_was_cut_off_behind_the_ranking_is_computed_again(done: Project) -> None:
    """Snakemake looks for such files before it knows the simulations."""
    markers = done.path(".snakemake/incomplete")
    record = next(
        path
        for path in done.path(".snakemake/metadata").rglob("*")
        if path.is_file() and '"rule":"simulate"' in path.read_text().replace(" ", "")
    )
    shutil.copy(record, markers / record.relative_to(done.path(".snakemake/metadata")))
    assert len([name for name in planned(done) if "/jobs/" in name]) == 1


def test_a_ranking_with_the_same_sets_simulates_nothing_again(done: Project) -> None:
    """Its own mark differs, but a simulation hangs on nothing but its own set."""
    done.edit(
        "config/studies/small.yaml",
        "best_models: 2",
        "best_models: 2\nsuccess: {outlier_times_start: 50}",
    )
    before = done.files()
    run(done)
    after = done.files()
    assert before["small/best.json"] != after["small/best.json"]
    assert not [name for name in after if "/jobs/" in name and before[name] != after[name]]
