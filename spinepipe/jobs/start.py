"""Start Snakemake for a person or a program, and hear from it what happens.

The logger plugin writes an event a line as JSON (workflow/plugins); what else is on a line is text
for people: a warning, or what a long job says of itself.
"""

import json
import os
import signal
import subprocess
import sys
import threading
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from spinepipe.files import cache_home, cache_of_project, refusal

GRACE_S = 3.0
"""After which Snakemake is killed when it was stopped: it would wait for the jobs that are at work,
and half files are never kept.
"""

STOPPING = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)

Event = Mapping[str, Any]
"""``event`` is plan (jobs, left s), job (rule, study), progress (done, total, left, last), failed
(job, why), error (text) or text (text)."""


class Snakemake:
    """A run of Snakemake, which is stopped with the process that started it.

    Attributes
    ----------
    code : of its end, once `events` is through.
    """

    def __init__(
        self, root: Path, arguments: Sequence[str], study: str = "", submits: bool = False
    ) -> None:
        """Start it.

        Parameters
        ----------
        study : the one that is run, if it is one: its jobs of earlier runs tell the time.
        submits : whether its jobs are on a cluster: then it has those to cancel when it is stopped,
            and is not killed.
        """
        self.code, self._submits = 0, submits
        environment = {**os.environ, "PYTHONUTF8": "1", "SPINEPIPE_EVENTS": study}
        if refusal(cache_home() / "snakemake"):
            environment["XDG_CACHE_HOME"] = str(cache_of_project(root))
        command = [sys.executable, "-m", "snakemake", *arguments]
        # a session of its own: Ctrl-C reaches this process alone, which hands it on
        self._process = subprocess.Popen(
            command,
            cwd=root,
            env=environment,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            encoding="utf-8",
            errors="replace",
            start_new_session=True,
        )

    def events(self) -> Iterator[Event]:
        """What happens, until it ends; Ctrl-C ends it too, and its last events are told."""
        assert self._process.stdout is not None

        def stop(*_: object) -> None:
            if self.code:  # asked for the second time
                self._process.kill()
            elif self._process.poll() is None:
                self._process.send_signal(signal.SIGINT)
                if not self._submits:
                    kill = threading.Timer(GRACE_S, self._process.kill)
                    kill.daemon = True
                    kill.start()
            self.code = -signal.SIGINT

        before = {one: signal.signal(one, stop) for one in STOPPING}
        try:
            for line in self._process.stdout:
                yield _event(line.rstrip())
            ended = self._process.wait()
            self.code = self.code or ended
        finally:
            for one, handler in before.items():
                signal.signal(one, handler)
            if self._process.poll() is None:  # who listened has gone
                self._process.kill()
                self._process.wait()
            self._process.stdout.close()


def _event(line: str) -> Event:
    if line.startswith('{"event"'):
        told: Event = json.loads(line)
        return told
    return {"event": "text", "text": line}


def cores_here() -> int:
    """Cores that this process may use."""
    try:
        return len(os.sched_getaffinity(0))
    except AttributeError:  # only Linux tells which cores a process may use
        return os.cpu_count() or 1
