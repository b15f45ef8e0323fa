"""`python -m benchmarks commands OLD`: the commands of a newcomer, at HEAD and at an older commit.

Both are cloned into `.benchmarks`. What is measured once is kept there, so that a call that was cut
off goes on; it is no part of a plain `make bench`, as it takes hours.
"""

import json
import os
import shutil
import signal
import subprocess
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

from benchmarks.study import ROOT, Watch

FOLDER = ROOT / ".benchmarks"
REPEATS = 3
LOST = "results/l1l4_joint_pose/jobs/specimen-s01/pose-0007/stiffness-best03.parquet"

Measured = dict[str, float]
"""`wall_s`, and of runs of a workflow `peak_mib` (shared pages counted once)."""


@dataclass(frozen=True)
class Clone:
    """One of the two commits, cloned."""

    folder: Path

    def run(self, command: str) -> Measured:
        """A command by bash, its output kept beside the clone; RuntimeError when it fails."""
        begun = time.perf_counter()
        with self._log().open("a") as log:
            process = subprocess.Popen(["bash", "-c", command], **self._how(log))
            watch = Watch(process.pid)
            watch.start()
            status = process.wait()
        if status:
            raise RuntimeError(f"{command!r} ended with {status}, see {self._log()}")
        return {"wall_s": time.perf_counter() - begun, "peak_mib": watch.peak_mib}

    def first_report(self) -> Measured:
        """From `make all` with everything installed to the first page; the rest is cut off."""
        shutil.rmtree(self.folder / "results", ignore_errors=True)
        shutil.rmtree(self.folder / ".snakemake", ignore_errors=True)
        begun = time.perf_counter()
        with self._log().open("a") as log:
            process = subprocess.Popen(["make", "all"], **self._how(log))
            while not list(self.folder.glob("results/**/report.html")):
                if process.poll() is not None:
                    raise RuntimeError(f"make all ended without a report, see {self._log()}")
                time.sleep(0.1)
            seconds = time.perf_counter() - begun
            os.killpg(process.pid, signal.SIGKILL)
            process.wait()
        return {"wall_s": seconds}

    def one_lost(self) -> Measured:
        """One simulation deleted, and made again."""
        (self.folder / LOST).unlink()
        return self.run(f".venv/bin/snakemake -j2 all {LOST}")

    def installed(self) -> Measured:
        """What `make all` installs, from nothing."""
        shutil.rmtree(self.folder / ".venv", ignore_errors=True)
        return self.run("make env")

    def _log(self) -> Path:
        return self.folder.with_suffix(".log")

    def _how(self, log: object) -> dict[str, object]:
        return {"cwd": self.folder, "stdout": log, "stderr": log, "start_new_session": True}


Step = Callable[[Clone], Measured]


def steps() -> Iterator[tuple[str, Step, int, bool]]:
    """What is measured in turn: name, how, how often, and whether of the new side alone."""
    yield "install", Clone.installed, REPEATS, False
    yield "first report", Clone.first_report, REPEATS, False
    yield "make all", lambda clone: clone.run("rm -rf results .snakemake; make all"), 1, False
    yield "make all, nothing to do", lambda clone: clone.run("make all"), REPEATS, False
    yield (
        "snakemake, nothing to do",
        lambda one: one.run(".venv/bin/snakemake -j2 all"),
        REPEATS,
        False,
    )
    yield "one file lost", Clone.one_lost, REPEATS, False
    yield "make test", lambda clone: clone.run("make test"), 1, False
    yield ".ci/run", lambda clone: clone.run("rm -rf results .snakemake; .ci/run"), 1, True


def measure(old: str) -> dict[str, dict[str, list[Measured]]]:
    """Each step on both sides in turn, those that are known left out; by step and commit."""
    asked = ["git", "rev-parse", "--short", old, "HEAD"]
    commits = subprocess.run(asked, cwd=ROOT, check=True, capture_output=True, text=True)
    sides = {name: Clone(FOLDER / name) for name in commits.stdout.split()}
    for name, clone in sides.items():
        if not clone.folder.exists():
            subprocess.run(["git", "clone", "--quiet", ROOT, clone.folder], check=True)
            subprocess.run(["git", "checkout", "--quiet", name], cwd=clone.folder, check=True)
    kept = FOLDER / f"{'_'.join(sides)}.json"
    found: dict[str, dict[str, list[Measured]]] = (
        json.loads(kept.read_text()) if kept.exists() else {}
    )
    for step, how, repeats, new_alone in steps():
        of_step = found.setdefault(step, {name: [] for name in list(sides)[new_alone:]})
        for number in range(repeats):
            for name in (name for name, done in of_step.items() if len(done) <= number):
                of_step[name].append(how(sides[name]))
                kept.write_text(json.dumps(found, indent=1))
                print(f"{step}, {name}: {of_step[name][-1]['wall_s']:.1f} s", flush=True)
    return found
