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

import yaml

from spinepipe.files import appearing, cache_home, cache_of_project, refusal

SLURM = Path("profiles") / "slurm" / "config.yaml"

ADDED_TO = Path(".snakemake") / "spinepipe-slurm" / "config.yaml"
"""The profile for Slurm with what a run adds to its lists."""

LISTS = (
    *("--set-resources", "--default-resources", "--groups", "--group-components"),
    "--set-threads",
)
"""Options of Snakemake that replace the whole list of a profile; ``rule:resource=value``."""

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
        self, root: Path, arguments: Sequence[str], study: str = "", grace_s: float | None = 3.0
    ) -> None:
        """Start it.

        Parameters
        ----------
        study : the one that is run, if it is one: its jobs of earlier runs tell the time.
        grace_s : after which it is killed when it was stopped; None where it has submitted jobs to
            cancel. It would wait for the jobs that are at work, and half files are never kept.
        """
        self.code, self._grace_s = 0, grace_s
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
                if self._grace_s is not None:
                    kill = threading.Timer(self._grace_s, self._process.kill)
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


def slurm_profile(root: Path, arguments: Sequence[str], also: Sequence[str]) -> list[str]:
    """Write the profile for Slurm with what is added to its lists; arguments of Snakemake with it.

    Snakemake itself would put what is typed in the place of a whole list.

    Parameters
    ----------
    arguments : for Snakemake. also : default resources, ``slurm_account=name``.

    Raises
    ------
    FileNotFoundError
        Where the project has no profile for Slurm.
    """
    profile = yaml.safe_load((root / SLURM).read_text("utf-8"))
    rest: list[str] = []
    added: list[tuple[str, str]] = [("--default-resources", one) for one in also]
    option = ""
    for one in arguments:
        name, _, value = one.partition("=")
        if one.startswith("-"):
            option = name if name in LISTS else ""
            added += [(option, value)] if option and value else []
            rest += [] if option else [one]
        elif option:
            added.append((option, one))
        else:
            rest.append(one)
    for option, one in added:
        key, _, value = one.partition("=")
        place = profile.setdefault(option.removeprefix("--"), {})
        if isinstance(place, list):  # the other form in which a profile may have it
            place.append(one)
        elif ":" in key:
            rule, _, resource = key.partition(":")
            place.setdefault(rule, {})[resource] = yaml.safe_load(value)
        else:
            place[key] = yaml.safe_load(value)
    (root / ADDED_TO).parent.mkdir(parents=True, exist_ok=True)
    with appearing(root / ADDED_TO) as temporary:
        temporary.write_text(yaml.safe_dump(profile, sort_keys=False), "utf-8")
    return [*rest, "--profile", str(ADDED_TO.parent)]
