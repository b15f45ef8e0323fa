"""The main study as a user runs it: cold, again, and after losing a file; wall time and memory."""

import contextlib
import os
import shutil
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import psutil

from spinepipe.studies.joint_pose_sensitivity.settings import JointPoseSensitivity
from spinepipe.studies.read import check
from spinepipe.studies.registry import files_of

ROOT = Path(__file__).resolve().parents[1]
STUDY = "l1l4_joint_pose"
PARTS = ("Snakefile", "workflow", "profiles", "spinepipe", "papers", "config")
SECONDS_BETWEEN_LOOKS = 0.5


@dataclass(frozen=True)
class Run:
    """One run of the workflow.

    Attributes
    ----------
    peak_mib : largest memory of all its processes together (shared pages counted once).
    engine_s : CPU seconds of Snakemake itself, without its workers. cpu_s : of all its processes.
    """

    what: str
    wall_s: float
    peak_mib: float
    engine_s: float
    goal: str
    cpu_s: float


FOUNDATION = (
    *("simulations.parquet", "model.yaml", "best.json"),
    *(f"figures/{name}.svg" for name in ("agreement", "joint_pose")),
)
"""Results without what the study tells beyond its poses."""


def runs() -> Iterator[Run]:
    """Compute poses, fits and simulations of the study in a copy of the project, on two cores."""
    with copy_of_project() as folder:
        wanted = [f"results/{STUDY}/{name}" for name in FOUNDATION]
        results = Path(folder) / "results" / STUDY
        yield run_workflow("poses, fits and simulations, cold", folder, wanted, "90 s, 1 GB")
        yield run_workflow("nothing to do", folder, wanted, "8 s")
        (results / "jobs/specimen-s01/pose-0007/stiffness-best03.parquet").unlink()
        yield run_workflow(
            "one simulation lost", folder, [*wanted, _file("jobs", "best03")], "10 s"
        )
        (results / "calibrations/specimen-s01/pose-0007.parquet").unlink()
        yield run_workflow("one calibration lost", folder, [*wanted, _file("calibrations")], "12 s")


def whole_runs() -> Iterator[Run]:
    """Run the whole study, bootstraps, methods, tests and report included."""
    wanted = files_of(*check(ROOT, STUDY)).results()
    with copy_of_project() as folder:
        yield run_workflow("whole study, cold", folder, wanted, "300 s")
        yield run_workflow("nothing to do", folder, wanted, "")


@contextlib.contextmanager
def copy_of_project(root: Path = ROOT) -> Iterator[str]:
    """A copy of the project, or of another tree of it, without results."""
    with tempfile.TemporaryDirectory(prefix="spinepipe-bench-") as folder:
        for part in PARTS:
            copy = shutil.copytree if (root / part).is_dir() else shutil.copy
            copy(root / part, Path(folder) / part)
        yield folder


def _file(folder: str, stiffness: str = "") -> str:
    """A job file that was deleted: Snakemake does not miss it once the table is there."""
    name = f"results/{STUDY}/{folder}/specimen-s01/pose-0007"
    return f"{name}/stiffness-{stiffness}.parquet" if stiffness else f"{name}.parquet"


def targets() -> int:
    """Job files of the whole study."""
    study, cohort = check(ROOT, STUDY)
    assert isinstance(study, JointPoseSensitivity)
    return len(cohort.specimen_names) * study.poses * (2 + study.best_models)


def run_workflow(what: str, folder: str, wanted: Sequence[str], goal: str) -> Run:
    """Make these targets on two cores and watch it; raises RuntimeError when that fails."""
    start = time.perf_counter()
    process = subprocess.Popen(
        [sys.executable, "-m", "snakemake", "-j2", *wanted],
        cwd=folder,
        # the copy's own code, whatever is installed
        env=os.environ | {"PYTHONPATH": os.pathsep.join([folder, f"{folder}/workflow/plugins"])},
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
    )
    watch = Watch(process.pid)
    watch.start()
    _, errors = process.communicate()
    wall = time.perf_counter() - start
    if process.returncode:
        raise RuntimeError(f"{what}: {errors.decode()[-2000:]}")
    return Run(what, wall, watch.peak_mib, watch.engine_s, goal, sum(watch.cpu_s.values()))


class Watch(threading.Thread):
    """Looks at a process and its descendants until it ends."""

    def __init__(self, pid: int) -> None:
        super().__init__(daemon=True)
        self.pid, self.peak_mib, self.engine_s = pid, 0.0, 0.0
        self.cpu_s: dict[int, float] = {}  # by process, when it was last seen

    def run(self) -> None:
        while psutil.pid_exists(self.pid):
            with contextlib.suppress(psutil.NoSuchProcess, psutil.AccessDenied):
                self._look(psutil.Process(self.pid))
            time.sleep(SECONDS_BETWEEN_LOOKS)

    def _look(self, root: psutil.Process) -> None:
        times = root.cpu_times()
        self.engine_s = max(self.engine_s, times.user + times.system)
        processes = (root, *root.children(recursive=True))
        for one in processes:
            with contextlib.suppress(psutil.NoSuchProcess):
                spent = one.cpu_times()
                self.cpu_s[one.pid] = spent.user + spent.system
        total = sum(process.memory_full_info().pss for process in processes)
        self.peak_mib = max(self.peak_mib, total / 2**20)
