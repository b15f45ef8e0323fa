"""Workers: who dies in mid-job is told, who dies while it waits harms nobody.

Catches a dead worker that is not told, or that takes its pool along.
"""

import time
from pathlib import Path

import psutil
import pytest

from spinepipe.jobs.pool import JobFailed, submit_and_wait

HANGS_S = 600
"""Nothing here takes as long, on any machine."""


def test_a_worker_that_died_while_it_waited_harms_no_job(tmp_path: Path) -> None:
    """Its first job goes well and starts a program that kills it when it waits for the next."""
    log, ready, dead = (str(tmp_path / name) for name in ("log", "ready", "dead"))
    script = f"echo $PPID > {dead}; until [ -e {ready} ]; do sleep 0.01; done; kill -9 $PPID"
    submit_and_wait("first", "subprocess:Popen", log, args=script, shell=True)
    while not (told := Path(dead).read_text() if Path(dead).exists() else ""):
        time.sleep(0.01)
    worker = psutil.Process(int(told))
    Path(ready).touch()
    worker.wait(HANGS_S)
    submit_and_wait("second", "os:mkdir", log, path=str(tmp_path / "made"))
    assert (tmp_path / "made").is_dir()
    assert not Path(log).exists()


def test_a_worker_that_dies_in_mid_job_is_told_and_the_next_job_has_another(tmp_path: Path) -> None:
    log = tmp_path / "log"
    with pytest.raises(JobFailed, match=r"job third: .*SIGKILL"):
        submit_and_wait("third", "subprocess:call", str(log), args="kill -9 $PPID", shell=True)
    assert "SIGKILL" in log.read_text()
    submit_and_wait("fourth", "os:mkdir", str(log), path=str(tmp_path / "made"))
    assert (tmp_path / "made").is_dir()


def test_a_worker_that_a_job_made_large_serves_no_further_one(tmp_path: Path) -> None:
    log, place = str(tmp_path / "log"), tmp_path / "worker"

    def worker() -> int:
        submit_and_wait("who", "subprocess:call", log, args=f"echo $PPID > {place}", shell=True)
        return int(place.read_text())

    before = worker()
    submit_and_wait("small", "numpy:ones", log, shape=10)
    assert worker() == before
    submit_and_wait("large", "numpy:ones", log, shape=60_000_000)
    assert worker() != before
