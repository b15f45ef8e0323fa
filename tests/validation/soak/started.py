"""A run of Snakemake in a copy of the project: its processes, what it says, what it costs."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

import psutil
from small_project import Project

HANGS_S = 3 * 3600.0
"""A run that takes longer hangs: it does on no machine, however busy."""

LOOK_S = 0.1


@dataclass(frozen=True)
class Started:
    """A run in a process group of its own, its words in a file.

    Attributes
    ----------
    scratch : its folder for temporary files.
    """

    process: subprocess.Popen[bytes]
    said: Path
    scratch: Path

    def words(self) -> str:
        """What it has said so far."""
        return self.said.read_text(errors="replace")

    def family(self) -> list[psutil.Process]:
        """Snakemake, the server that workers are forked from, and workers."""
        with suppress(psutil.NoSuchProcess):
            root = psutil.Process(self.process.pid)
            return [root, *root.children(recursive=True)]
        return []

    def workers(self) -> list[psutil.Process]:
        """Those that run jobs, which the server has forked."""
        found = []
        for one in self.family():
            with suppress(psutil.Error):
                parent = one.parent()
                if parent is not None and "forkserver" in " ".join(parent.cmdline()):
                    found.append(one)
        return found

    def kill_all(self) -> list[psutil.Process]:
        """Kill the whole group at once, as a queue or a machine that goes down does; who it was."""
        family = self.family()
        with suppress(ProcessLookupError):
            os.killpg(self.process.pid, signal.SIGKILL)
        for one in family:
            with suppress(psutil.Error):
                one.kill()
        self.process.wait()
        return family

    def end(self) -> int:
        """Wait for the end; the return code."""
        return self.process.wait(HANGS_S)


@contextmanager
def start(project: Project, *arguments: str) -> Iterator[Started]:
    """`snakemake -j2` of a project in a process group of its own, as a shell starts it.

    Outside, nothing of it runs any more.
    """
    scratch = project.path("scratch")
    scratch.mkdir(exist_ok=True)
    said = project.path("said.txt")
    environment = {
        **project.environment(),
        "PYTHONPATH": f"{project.folder}:{project.path('workflow/plugins')}",
        "OMP_NUM_THREADS": "1",
        "TMPDIR": str(scratch),
    }
    with said.open("wb") as words:
        process = subprocess.Popen(
            [sys.executable, "-m", "snakemake", "-j2", *(arguments or ("all",))],
            cwd=project.folder,
            env=environment,
            stdout=words,
            stderr=subprocess.STDOUT,
            start_new_session=True,
        )
    run = Started(process, said, scratch)
    try:
        yield run
    finally:
        if process.poll() is None:
            run.kill_all()


def looks(started: Started) -> Iterator[None]:
    """Goes on every few milliseconds until the run has ended."""
    until = time.monotonic() + HANGS_S
    while started.process.poll() is None:
        assert time.monotonic() < until, f"the run hangs: {started.words()[-2000:]}"
        yield
        time.sleep(LOOK_S)


@dataclass(frozen=True)
class Cost:
    """What a run took, s: on the clock, and of processors by Snakemake alone."""

    code: int
    wall_s: float
    engine_s: float
    said: str


def timed(project: Project, *arguments: str) -> Cost:
    """Run to the end; its workers' time is not in the processor's time."""
    before = time.monotonic()
    with start(project, *arguments) as run:
        _, status, used = os.wait4(run.process.pid, 0)
        run.process.returncode = code = os.waitstatus_to_exitcode(status)
        wall = time.monotonic() - before
        return Cost(code, wall, used.ru_utime + used.ru_stime, run.words())


Seen = dict[str, tuple[int, int]]
"""Of each result file: its inode and when it was changed, ns."""


def seen(project: Project) -> Seen:
    """All result files but logs; a file that goes while one looks is left out."""
    results, found = project.path("results"), {}
    for path in results.rglob("*"):
        if "logs" in path.parts:
            continue
        with suppress(FileNotFoundError):
            status = path.stat()
            if path.is_file():
                place = path.relative_to(results).as_posix()
                found[place] = (status.st_ino, status.st_mtime_ns)
    return found


def ended(processes: list[psutil.Process]) -> bool:
    """Whether all of these are gone, or go while one waits."""
    _, alive = psutil.wait_procs(processes, timeout=600)
    return not alive
