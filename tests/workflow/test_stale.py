"""No table is made of two settings: what hangs on others is seen by its mark and computed again.

One kill between two settings is in `test_failure`, one look after changes in `test_rerun`; here
are kills at other jobs, and files whose marks are another's, gone or unrecorded.
"""

import os
import shutil
from pathlib import Path

import pyarrow.parquet as pq
import pytest
from small_project import Project

from spinepipe.marks import read_mark

pytestmark = [pytest.mark.slow, pytest.mark.full]

KIND = "joint_pose_sensitivity"
TABLES = tuple(f"results/{KIND}/{name}.parquet" for name in ("simulations", "agreement"))

SEED = ("seed: 1", "seed: 2")
LOADING = ("loading: equilibrium", "loading: settle")
BOUND = ("bound_factor: 100", "bound_factor: 2")
RANKING = ("best_models: 2", "best_models: 1")


@pytest.fixture
def done(eight: Project, tmp_path: Path) -> Project:
    """Each test has its own; files of the other kinds are left out."""
    project = eight.copy(tmp_path / "project")
    for folder in project.path("results").iterdir():
        if folder.is_dir() and folder.name != KIND:
            shutil.rmtree(folder)
    return project


def killed_with(project: Project, change: tuple[str, str], rule: str, count: int) -> None:
    """Run with other settings until so many jobs of a rule are done, then with the old again."""
    project.edit(f"config/studies/{KIND}.yaml", *change)
    project.killed_after(count, rule, *TABLES)
    project.edit(f"config/studies/{KIND}.yaml", *change[::-1])


@pytest.mark.parametrize(
    "kills",
    [
        [(SEED, "simulations_block", 1)],
        [(SEED, "sample_landmarks", 1), (BOUND, "calibrations_block", 2)],
        [(BOUND, "calibrations_block", 1), (RANKING, "simulations_block", 1)],
        [(LOADING, "simulations_block", 2), (LOADING, f"{KIND}_table", 1)],
    ],
    ids=lambda kills: "-".join(rule for _, rule, _ in kills),
)
def test_after_kill_and_change_back_tables_are_as_undisturbed(
    done: Project, kills: list[tuple[tuple[str, str], str, int]]
) -> None:
    content = done.contents()
    for kill in kills:
        killed_with(done, *kill)
    done.run(*TABLES)
    tables = [table.removeprefix("results/") for table in TABLES]
    again = done.contents()
    assert {name: again[name] for name in tables} == {name: content[name] for name in tables}
    # A file that was being replaced when the run was killed is gone; tables that were finished
    # without it need it no more, and it is made again when it is asked for.
    gone = [f"results/{name}" for name in content if name not in again]
    if gone:
        done.run(*gone)
        again = done.contents()
    assert {name: again[name] for name in content} == content
    assert done.planned(*TABLES) == set()


def without_record(project: Project) -> Project:
    shutil.rmtree(project.path(".snakemake"))
    return project


def test_copied_results_are_known_by_their_marks(done: Project) -> None:
    without_record(done)
    assert done.planned(*TABLES) == set()
    done.edit(f"config/studies/{KIND}.yaml", *SEED)
    landmarks = {f"{KIND}/landmarks{part}.parquet" for part in ("", "/specimen-s01")}
    assert landmarks <= done.planned(*TABLES, f"results/{KIND}/landmarks.parquet")


def spoil(path: Path, metadata: bool) -> None:
    """Another letter in the mark of a file, or no mark, as of older versions; its age stays."""
    time = path.stat().st_mtime_ns
    if metadata:
        mark = read_mark(path).encode()
        other = (b"1" if mark.startswith(b"0") else b"0") + mark[1:]
        path.write_bytes(path.read_bytes().replace(mark, other))
    else:
        pq.write_table(pq.read_table(path).replace_schema_metadata(None), path)
    os.utime(path, ns=(time, time))


@pytest.mark.parametrize("recorded", [True, False])
def test_what_has_another_mark_or_none_or_was_cut_off_is_computed_again(
    done: Project, recorded: bool
) -> None:
    """Whether Snakemake has records of them or not: the files tell."""
    blocks = f"{KIND}/blocks/simulations/specimen-s01"
    another, none = f"{blocks}/block-000.parquet", f"{blocks}/block-001.parquet"
    cut_off = f"{KIND}/success.parquet"
    spoil(done.path(f"results/{another}"), metadata=True)
    spoil(done.path(f"results/{none}"), metadata=False)
    file = done.path(f"results/{cut_off}")
    file.write_bytes(file.read_bytes()[:-100])
    if not recorded:
        without_record(done)
    tables = {name.removeprefix("results/") for name in TABLES}
    assert done.planned(*TABLES) == {another, none, cut_off} | tables
