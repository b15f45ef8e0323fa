"""The main study as a user runs it: cold, again, and after losing a file; wall time and memory."""

import shutil
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import psutil

ROOT = Path(__file__).resolve().parents[1]
STUDY = "l1l4_joint_pose"
PARTS = ("Snakefile", "workflow", "profiles", "spinepipe", "config")
SECONDS_BETWEEN_LOOKS = 0.5


@dataclass(frozen=True)
class Run:
    """One run of the workflow.

    Attributes
    ----------
    peak_mib : largest memory of all its processes together (shared pages counted once).
    """

    what: str
    wall_s: float
    peak_mib: float
    goal: str


def runs() -> Iterator[Run]:
    """Run the study in a copy of the project, on two cores."""
    with tempfile.TemporaryDirectory(prefix="spinepipe-bench-") as folder:
        for part in PARTS:
            copy = shutil.copytree if (ROOT / part).is_dir() else shutil.copy
            copy(ROOT / part, Path(folder) / part)
        results = Path(folder) / "results" / STUDY
        yield _run("whole study, cold", folder, "90 s, 1 GB")
        yield _run("nothing to do", folder, "8 s")
        (results / "jobs/specimen=s01/pose=0007/stiffness=best03.parquet").unlink()
        yield _run("one simulation lost", folder, "10 s")
        (results / "calibrations/specimen=s01/pose=0007.parquet").unlink()
        yield _run("one calibration lost", folder, "12 s")


def _run(what: str, folder: str, goal: str) -> Run:
    start = time.perf_counter()
    process = subprocess.Popen(
        [sys.executable, "-m", "snakemake", "-j2", "all"],
        cwd=folder,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
    )
    peak = [0.0]
    watcher = threading.Thread(target=_watch, args=(process.pid, peak), daemon=True)
    watcher.start()
    _, errors = process.communicate()
    if process.returncode:
        raise RuntimeError(f"{what}: {errors.decode()[-2000:]}")
    return Run(what, time.perf_counter() - start, peak[0], goal)


def _watch(pid: int, peak: list[float]) -> None:
    """Look at the memory of a process and its descendants until it ends."""
    while psutil.pid_exists(pid):
        total = 0
        try:
            root = psutil.Process(pid)
            for process in (root, *root.children(recursive=True)):
                total += process.memory_full_info().pss
        except (psutil.NoSuchProcess, psutil.AccessDenied):
            pass
        peak[0] = max(peak[0], total / 2**20)
        time.sleep(SECONDS_BETWEEN_LOOKS)
