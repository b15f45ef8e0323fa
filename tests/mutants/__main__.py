"""`python -m tests.mutants [--each N] [--seed S] [AREA ...]`: put in faults, count who sees them.

Each fault is put into a copy of the project, and the test files nearest to it are run, then the
next nearest. What no test sees is listed, to be looked at by a person: a test is missing, or the
fault is none (the code means the same).
"""

import argparse
import os
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from datetime import date
from functools import partial
from pathlib import Path
from queue import Queue

from tests.mutants.nearest import nearest
from tests.mutants.sample import AREAS, ROOT, Mutant, drawn

TABLE = ROOT / "docs" / "mutants.md"
RINGS = (5, 10)
"""Test files that are run first, and those run where they see nothing."""

LEAST_S, TIMES = 120.0, 4.0
"""A run that takes longer than both, by itself and over the run without a fault, hangs: seen."""


@dataclass(frozen=True)
class Ended:
    """A mutant, and what saw it: a ring of tests, time that ran out, or nobody (empty)."""

    mutant: Mutant
    seen_by: str


class Copy:
    """A copy of the project in which one fault at a time is put."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self._took: dict[tuple[str, ...], float | None] = {}
        listed = subprocess.run(["git", "ls-files"], cwd=ROOT, capture_output=True, text=True)
        for name in listed.stdout.splitlines():
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(ROOT / name, folder / name)

    def tried(self, mutant: Mutant) -> Ended:
        """Run the tests near a fault until one fails."""
        file = self.folder / mutant.path
        before = 0
        for count in RINGS:
            tests = tuple(nearest(mutant.path, count, before))
            before += count
            usual = self._usual(tests)
            if usual is None:
                continue
            whole, times = file.read_bytes(), file.stat()
            try:
                file.write_text(mutant.code())
                failed = self._run(tests, max(LEAST_S, TIMES * usual))
            finally:
                file.write_bytes(whole)
                os.utime(file, ns=(times.st_atime_ns, times.st_mtime_ns))
            if failed:
                return Ended(mutant, failed)
        return Ended(mutant, "")

    def _usual(self, tests: tuple[str, ...]) -> float | None:
        """Seconds of a run without a fault; None where there are no tests or they fail anyway."""
        if tests not in self._took:
            start = time.perf_counter()
            failed = self._run(tests, 1800.0) if tests else "no test"
            self._took[tests] = None if failed else time.perf_counter() - start
        return self._took[tests]

    def _run(self, tests: Sequence[str], most_s: float) -> str:
        """What failed; empty where nothing did."""
        path = f"{self.folder}:{self.folder / 'tests' / 'cases'}"
        one = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"), "1")
        told = {**os.environ, **one, "PYTHONPATH": path, "PYTHONDONTWRITEBYTECODE": "1"}
        command = [sys.executable, "-m", "pytest", "-x", "-q", "--no-header", *tests]
        try:
            done = subprocess.run(
                command, cwd=self.folder, env=told, capture_output=True, timeout=most_s, text=True
            )
        except subprocess.TimeoutExpired:
            return "time"
        if done.returncode == 0:
            return ""
        named = [line for line in done.stdout.splitlines() if line.startswith(("FAILED", "ERROR"))]
        return named[0].split()[1] if named else "an error"


def tried(mutants: Sequence[Mutant], workers: int) -> list[Ended]:
    """All mutants, in copies of their own; progress is printed."""
    with tempfile.TemporaryDirectory() as folder, ThreadPoolExecutor(workers) as pool:
        free: Queue[Copy] = Queue()
        for number in range(workers):
            free.put(Copy(Path(folder) / str(number)))
        ended = []
        for one in pool.map(partial(_in_a_copy, free), mutants):
            ended.append(one)
            where = f"{one.mutant.path}:{one.mutant.line} {one.mutant.operator}"
            print(f"{len(ended)}/{len(mutants)} {one.seen_by or 'LIVES'}: {where}", flush=True)
        return ended


def _in_a_copy(free: "Queue[Copy]", mutant: Mutant) -> Ended:
    copy = free.get()
    try:
        return copy.tried(mutant)
    finally:
        free.put(copy)


def table(ended: Sequence[Ended], asked: str) -> str:
    """Shares by area, and who lives, as Markdown."""
    lines = [
        "# Mutants",
        "",
        "Small faults put into the code, place by place at random, and whether the tests nearest",
        "to them see them. What lives is looked at: either a test is missing, or the fault changes",
        "nothing that can be seen.",
        "",
        f"`{asked}`, {date.today().isoformat()}",
        "",
        "| area | tried | seen | share |",
        "|---|---|---|---|",
    ]
    areas = list(dict.fromkeys(one.mutant.area for one in ended))
    for area in [*areas, "all"]:
        rows = [one for one in ended if area in (one.mutant.area, "all")]
        seen = sum(bool(one.seen_by) for one in rows)
        lines.append(f"| {area} | {len(rows)} | {seen} | {100 * seen / len(rows):.0f} % |")
    lines += ["", "Not seen:", "", "| file | line | fault |", "|---|---|---|"]
    for one in ended:
        if not one.seen_by:
            fault = one.mutant.operator.removeprefix("core/")
            lines.append(f"| `{one.mutant.path}` | {one.mutant.line} | {fault} |")
    return "\n".join([*lines, ""])


def main() -> None:
    """Draw, try, print and write the table."""
    parser = argparse.ArgumentParser(prog="python -m tests.mutants")
    parser.add_argument("areas", nargs="*", choices=[[], *AREAS], help="all by default")
    parser.add_argument("--each", type=int, default=12, help="mutants of each area")
    parser.add_argument("--seed", type=int, default=1, help="of the draw")
    parser.add_argument("--workers", type=int, default=2, help="copies at once")
    asked = parser.parse_args()
    areas = asked.areas or list(AREAS)
    mutants = [one for area in areas for one in drawn(area, asked.each, asked.seed)]
    ended = tried(mutants, asked.workers)
    words = " ".join(["python -m tests.mutants", f"--each {asked.each}", f"--seed {asked.seed}"])
    text = table(ended, " ".join([words, *asked.areas]))
    print(text)
    TABLE.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
