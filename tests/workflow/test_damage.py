"""What a disk did to results is named in a sentence and computed again; no table is made of it."""

import os
import time
from pathlib import Path

import planted
import pytest
from small_project import Project, Shared
from small_tables import TABLES, project_with_tables, simulation

pytestmark = pytest.mark.slow

FLIPPED, EMPTY, CUT = simulation(0, "best01"), simulation(1, "best01"), simulation(2, "best01")
LATE, PICKLED = simulation(3, "best01"), simulation(0, "best02")
RANKED, BLOCK = "small/best.json", "small/blocks/simulations/specimen=s01/block=001.parquet"

REMOVED = """

whole_execute = execute


def execute(rule, function, wildcards, log, arguments):
    if rule == "simulate":
        shutil.rmtree("results/small", ignore_errors=True)
    whole_execute(rule, function, wildcards, log, arguments)
"""
"""Added to the Snakefile: whenever a simulation begins, somebody removes all results."""


@pytest.fixture
def done(shared: Shared, tmp_path: Path) -> Project:
    """A project with the tables of a small study; each test has its own."""
    return project_with_tables(shared, tmp_path)


def spoil(project: Project, name: str, content: bytes) -> None:
    """Other bytes in a file of the same age."""
    path = project.path(f"results/{name}")
    age = path.stat().st_mtime_ns
    path.write_bytes(content)
    os.utime(path, ns=(age, age))


def test_damage_is_named_and_computed_again_by_the_same_run(done: Project) -> None:
    content = done.contents()
    flipped = bytearray(content[FLIPPED])
    flipped[len(flipped) // 3] ^= 0x10
    spoil(done, FLIPPED, bytes(flipped))
    spoil(done, CUT, content[CUT][:-100])
    spoil(done, BLOCK, content[BLOCK] + b"more")
    spoil(done, RANKED, content[RANKED].replace(b'"pose": ', b'"pose": 1'))
    to_come = time.time() + 86400
    os.utime(done.path(f"results/{LATE}"), (to_come, to_come))
    folder = done.path(f"results/{FLIPPED}").parent
    dead, living = (f".stiffness=best01.parquet.{pid}" for pid in (2**30, os.getpid()))
    for name in (dead, living):
        (folder / name).write_bytes(b"PAR1")
    sprung = done.folder.parent / "sprung"
    spoil(done, PICKLED, planted.a_pickle(sprung))
    strays = planted.plant(done.folder, sprung)

    planned = done.snakemake("-n", *TABLES)
    assert planned.returncode == 0, planned.stdout
    assert (folder / dead).exists()  # a look changes nothing
    said = done.run(*TABLES)
    for name in (FLIPPED, CUT, PICKLED, RANKED, BLOCK):
        assert said.count(f"results/{name} is damaged") == 1
    assert f"results/{LATE} is dated" in said
    assert "Traceback" not in said
    assert not (folder / dead).exists()
    assert not sprung.exists()  # nothing that was planted has run
    for path in (folder / living, *strays):
        path.unlink(missing_ok=True)
    assert done.contents() == content
    assert done.planned(*TABLES) == set()


def test_snakemake_is_not_let_unpickle_anything(done: Project) -> None:
    sprung = done.folder.parent / "sprung"
    planted.plant(done.folder, sprung)
    looked = done.snakemake("-n", "--trust-io-cache", *TABLES)
    assert looked.returncode == 0, looked.stdout
    assert "--trust-io-cache is ignored" in looked.stdout
    assert not sprung.exists()


def test_of_many_damaged_files_five_are_named(done: Project) -> None:
    content = done.contents()
    jobs = [name for name in content if "/jobs/" in name]
    for name in jobs:
        spoil(done, name, b"")
    said = done.run(*TABLES)
    assert said.count("is damaged, cut off, empty") == 5
    assert f"so do {len(jobs) - 5} more files" in said
    assert done.contents() == content


def test_a_second_run_at_the_same_time_is_told(done: Project) -> None:
    """By what the first one keeps while it runs: the files that it is about to make."""
    locks = done.path(".snakemake/locks")
    locks.mkdir(exist_ok=True)
    (locks / "0.output.lock").write_text(f"{TABLES[0]}\n")
    spoil(done, EMPTY, b"")
    before = done.files()
    ended = done.snakemake("-j2", *TABLES)
    assert ended.returncode != 0
    assert "cannot be locked" in ended.stdout
    assert "--unlock" in ended.stdout
    assert "Traceback" not in ended.stdout
    assert done.files() == before


def test_results_removed_in_mid_run_are_told_in_a_sentence(done: Project) -> None:
    content, snakefile = done.contents(), done.path("Snakefile")
    whole = snakefile.read_text()
    snakefile.write_text(f"import shutil\n{whole}{REMOVED}")
    spoil(done, EMPTY, b"")
    ended = done.snakemake("-j2", *TABLES)
    assert ended.returncode != 0
    assert "Traceback" not in ended.stdout
    assert "removed while the run went on. Run the same command again" in ended.stdout
    snakefile.write_text(whole)
    done.run(*TABLES)
    again = done.contents()
    assert {name: again[name] for name in content if name in again} == {
        name: one for name, one in content.items() if name in again
    }
    assert set(TABLES) <= {f"results/{name}" for name in again}


def test_a_record_that_cannot_be_kept_is_told_before_anything_runs(done: Project) -> None:
    """Its folder is one in which nobody may write, not even root."""
    done.path(".snakemake").rename(done.folder / "record")
    done.path(".snakemake").symlink_to("/proc/self")
    ended = done.snakemake("-j2", *TABLES)
    assert ended.returncode != 0
    assert "where Snakemake keeps its record" in ended.stdout
    assert "Traceback" not in ended.stdout
