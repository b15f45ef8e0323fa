"""Fifty studies, one after the other, in one pool of workers: does anything grow?

Snakemake is called fifty times in one process, so that its workers stay. Studies are of two kinds
in turn: one with the stacked engine, tables of indices and figures, one with PyBullet. Every one
has a seed of its own, and a cohort that no one had before, so that no store of a worker serves two.
After each study, each worker tells what it holds.
"""

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import grid_cases
import pandas as pd
from lever import lever
from small_project import Project

STUDIES = 50
WARM = 10
"""Studies after which everything has been imported, compiled and stored once, of both kinds."""

SHOWN = (1, 2, 5, 10, 20, 30, 40, 50)
MOST_GROWTH_MIB = 3.0
"""Of a worker from then to the end. It was 4.8 when each worker kept cohorts that it had served."""

GRID = (
    "seed: {seed}\nposes: 1\nstiffness_sets: 2\n"
    "virtual_tests: {{moment_nm: 7.5, tests: [flexion, left_rotation], steps: 2}}\n"
)
PROBE = '''
"""What a worker holds."""

import ctypes
import gc
import json
import os
import time

import psutil


def look(number, folder):
    gc.collect()
    ctypes.CDLL(None).malloc_trim(0)  # what was freed goes back, so that only what is held counts
    me, clients = psutil.Process(), 0
    if "pybullet" in __import__("sys").modules:
        import pybullet

        clients = sum(pybullet.getConnectionInfo(k)["isConnected"] for k in range(64))
    held = me.memory_full_info()
    told = {
        "study": number,
        "worker": me.pid,
        "rss_mib": held.rss / 2**20,
        "private_mib": held.uss / 2**20,
        "open_files": me.num_fds(),
        "threads": me.num_threads(),
        "pybullet_clients": clients,
        "objects": len(gc.get_objects()),
    }
    with open(f"{folder}/{number}-{me.pid}.json", "w") as file:
        json.dump(told, file)
    time.sleep(2)  # so that the other worker takes the other look
'''
DRIVER = '''
"""Runs studies in turn in one process; after each, both workers are looked at."""

import os
import sys
import threading
from pathlib import Path

from snakemake.cli import main
from snakemake.dag import DAG
from snakemake.persistence import PersistenceBase

PLAIN = {one: dict(vars(one)) for one in (DAG, PersistenceBase)}


def as_imported():
    """Undo what the rules change of Snakemake: they do so once in a process."""
    for one, members in PLAIN.items():
        for name, member in members.items():
            if vars(one)[name] is not member:
                setattr(one, name, member)


for number, name in enumerate(sys.argv[1:], 1):
    Path("config/config.yaml").write_text(f"studies: [{name}]\\n")
    for header in Path("config/cohorts").glob("*/cohort.yaml"):
        lines = [line for line in header.read_text().splitlines() if line[:6] != "title:"]
        header.write_text("\\n".join([*lines, f"title: as study {number} has it"]) + "\\n")
    try:
        main(["-j2", "all"])
    except SystemExit as end:
        assert not end.code, name
    as_imported()
    from spinepipe.jobs.pool import submit_and_wait

    looks = [
        threading.Thread(
            target=submit_and_wait,
            args=("look", "probe:look", "look.log"),
            kwargs={"number": number, "folder": "looks"},
        )
        for _ in range(2)
    ]
    for look in looks:
        look.start()
    for look in looks:
        look.join()
    print("study", number, flush=True)
'''
HANGS_S = 6 * 3600

Row = dict[str, Any]


def many(folder: Path, studies: int) -> tuple[Project, list[str]]:
    """A project with so many studies of two kinds, and the program that runs them."""
    names = [f"s{number:02d}" for number in range(studies)]
    of_levers = [(name, 4, f"seed: {k}") for k, name in enumerate(names) if k % 2]
    project = lever(folder, *of_levers)
    for number, name in enumerate(names):
        if number % 2 == 0:
            _grid(project, name, number)
    project.path("probe.py").write_text(PROBE)
    project.path("driver.py").write_text(DRIVER)
    project.path("looks").mkdir()
    return project, names


def _grid(project: Project, name: str, seed: int) -> None:
    grid_cases.project(project.folder, GRID.format(seed=seed), specimens=("a",))
    made = project.path(f"config/studies/{grid_cases.STUDY}.yaml")
    text = made.read_text().replace(f"study: {grid_cases.STUDY}", f"study: {name}")
    project.path(f"config/studies/{name}.yaml").write_text(text)
    made.unlink()


def looks(folder: Path, studies: int = STUDIES) -> pd.DataFrame:
    """What each worker held after each study."""
    project, names = many(folder / "many", studies)
    scratch = project.path("scratch")
    scratch.mkdir()
    done = subprocess.run(
        [sys.executable, "driver.py", *names],
        cwd=project.folder,
        env={
            **project.environment(),
            "PYTHONPATH": f"{project.folder}:{project.path('workflow/plugins')}",
            "OMP_NUM_THREADS": "1",
            "TMPDIR": str(scratch),
        },
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        timeout=HANGS_S,
        check=False,
    )
    assert done.returncode == 0, done.stdout[-3000:]
    found = [json.loads(path.read_text()) for path in project.path("looks").glob("*.json")]
    assert not list(scratch.iterdir()), list(scratch.iterdir())
    return pd.DataFrame(found).sort_values(["study", "worker"], ignore_index=True)


def rows(folder: Path, studies: int = STUDIES, warm: int = WARM) -> list[Row]:
    """The most that a worker held after some of the studies; raises where it grows."""
    found = looks(folder, studies)
    per_study = found.drop(columns="worker").groupby("study").max()
    first, last = per_study.loc[warm], per_study.loc[studies]
    growth = last - first
    assert growth["private_mib"] < MOST_GROWTH_MIB, per_study.to_string()
    assert (growth[["open_files", "threads", "pybullet_clients"]] <= 0).all(), per_study.to_string()
    shown = [number for number in SHOWN if number <= studies]
    return per_study.loc[shown].round(1).reset_index().to_dict("records")
