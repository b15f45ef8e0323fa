"""The lock of a run that was killed is taken off, that of one that lives is not.

Catches the lock of a living run that is taken off, or of a dead one that stays.
"""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from spinepipe.files import HOST
from spinepipe.jobs.run_lock import at_work, noted, one_at_a_time, take_off

HOLD = """
import sys, time
from pathlib import Path
from spinepipe.jobs.run_lock import noted

with noted(Path(sys.argv[1])):
    print("held", flush=True)
    time.sleep(3600)
"""


@pytest.fixture
def locks(tmp_path: Path) -> Path:
    """A folder of locks as Snakemake leaves it."""
    folder = tmp_path / "locks"
    folder.mkdir()
    (folder / "0.input.lock").write_text("a\n")
    (folder / "0.output.lock").write_text("b\n")
    return folder


@pytest.fixture
def run(locks: Path) -> Iterator["subprocess.Popen[str]"]:
    """Another process that holds its note among them."""
    command = [sys.executable, "-c", HOLD, str(locks)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == "held\n"
        yield process
        process.kill()


def test_the_lock_of_a_killed_run_is_taken_off(locks: Path, run: "subprocess.Popen[str]") -> None:
    assert take_off(locks) == []
    assert (locks / "0.output.lock").exists()
    run.send_signal(signal.SIGKILL)
    run.wait()
    assert take_off(locks) == [run.pid]
    assert not locks.exists()
    assert take_off(locks) == []


def test_who_is_at_work_is_told_with_the_hour(locks: Path, run: "subprocess.Popen[str]") -> None:
    assert at_work(locks.parent) == []
    (note,) = locks.glob("*.run")
    os.utime(note, (hour := time.mktime((2026, 3, 1, 14, 5, 0, 0, 0, -1)), hour))
    assert at_work(locks) == [f"process {run.pid} on {HOST}, since 2026-03-01 14:05"]
    run.send_signal(signal.SIGKILL)
    run.wait()
    assert at_work(locks) == []


def test_of_two_runs_one_that_lives_keeps_the_lock(
    locks: Path, run: "subprocess.Popen[str]"
) -> None:
    run.send_signal(signal.SIGKILL)
    run.wait()
    with noted(locks):
        assert take_off(locks) == []
    assert take_off(locks) == [run.pid]


def test_who_left_no_note_or_runs_elsewhere_keeps_the_lock(locks: Path) -> None:
    assert take_off(locks) == []
    (locks / "17@another-machine.run").touch()
    assert take_off(locks) == []
    assert (locks / "0.input.lock").exists()


def test_a_note_is_gone_with_its_run(locks: Path) -> None:
    with noted(locks):
        assert [path.name for path in locks.glob("*.run")] == [
            next(locks.glob(f"{os.getpid()}@*.run")).name
        ]
    assert not list(locks.glob("*.run"))


def test_one_at_a_time_is_inside(tmp_path: Path, locks: Path) -> None:
    """A second process waits at the door: it comes in when the first has left."""
    order = tmp_path / "order"
    enter = (
        "from pathlib import Path; import sys\n"
        "from spinepipe.jobs.run_lock import one_at_a_time\n"
        "print('here', flush=True)\n"
        "with one_at_a_time(Path(sys.argv[1])):\n"
        "    order = Path(sys.argv[2])\n"
        "    order.write_text(order.read_text() + 'second')\n"
    )
    command = [sys.executable, "-c", enter, str(tmp_path), str(order)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as other:
        with one_at_a_time(tmp_path):
            assert other.stdout is not None
            assert other.stdout.readline() == "here\n"
            order.write_text("first ")
        assert other.wait(3600) == 0
    assert order.read_text() == "first second"
