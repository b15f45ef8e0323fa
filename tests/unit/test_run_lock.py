"""One run at a time: a second one is told which, and a killed one leaves nothing behind.

Catches the lock of a living run that is given away, or one of a dead run that stays.
"""

import os
import re
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from spinepipe.files import HOST
from spinepipe.jobs.project import AtWork, lock

HOLD = """
import sys, time
from pathlib import Path
from spinepipe.jobs.project import lock

held = lock(Path(sys.argv[1]))
print("held", flush=True)
time.sleep(3600)
"""


def test_the_lock_of_a_run_is_free_when_it_was_killed(tmp_path: Path) -> None:
    path = tmp_path / "running"
    command = [sys.executable, "-c", HOLD, str(path)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == "held\n"
        with pytest.raises(AtWork) as told:
            lock(path)
        assert re.fullmatch(rf"process {process.pid} on {HOST}, since \d{{4}}-.*", str(told.value))
        process.send_signal(signal.SIGKILL)
        process.wait()
    with lock(path), pytest.raises(AtWork, match=f"process {os.getpid()} on"):
        lock(path)
    lock(path).close()
